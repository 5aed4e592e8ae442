"""A mechanism whose drives stand still, for static equilibrium."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import numpy as np

from scissordyn.component.time_function import ConstantSpeed, Polynomial, TimeFunction
from scissordyn.errors import InputError
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.time_function import function_at, function_rows
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism

Joint = TypeVar("Joint", Revolute, Guide)


def at_rest(mechanism: Mechanism, time: float = 0.0) -> Mechanism:
    """The same mechanism without friction, with compliant contacts, its drives and distances constant as at a time [s]."""
    if time != 0.0 and mechanism.coupling_parts:
        # turns since the start would have to be counted
        what = "positions at rest along the motion of a mechanism with couplings or driven coordinates"
        raise InputError(what, "positions at the start, or a run")
    return dataclasses.replace(
        mechanism,
        drives=tuple(
            dataclasses.replace(drive, motion=_constant(drive.motion, mechanism.body(drive.body).placed_angle, time))
            for drive in mechanism.drives
        ),
        joints=tuple(_frictionless(joint) for joint in mechanism.joints),
        guides=tuple(_frictionless(guide) for guide in mechanism.guides),
        rods=tuple(dataclasses.replace(rod, motion=rod.motion and _constant(rod.motion, 0.0, time)) for rod in mechanism.rods),
        # one of which only the speed is given begins where the bodies are placed
        coordinate_drives=tuple(
            dataclasses.replace(
                drive,
                motion=ConstantSpeed(0.0) if isinstance(drive.motion, ConstantSpeed) else _constant(drive.motion, 0.0, time),
            )
            for drive in mechanism.coordinate_drives
        ),
    )


def loads_at(mechanism: Mechanism, time: float) -> Mechanism:
    """The same mechanism with the time functions of its loads constant as at a time [s]."""

    def constant(part: Any) -> Any:
        motion = getattr(part, "time_function", None)
        return part if motion is None else dataclasses.replace(part, time_function=_constant(motion, 0.0, time))

    return dataclasses.replace(mechanism, components=tuple(constant(part) for part in mechanism.components))


def _constant(motion: TimeFunction, start: float, time: float) -> TimeFunction:
    value = np.zeros(4)
    function_at(time, function_rows(motion, start), value)
    return Polynomial((float(value[0]),))


def _frictionless(joint: Joint) -> Joint:
    if joint.clearance is None:
        return joint
    return dataclasses.replace(
        joint, clearance=dataclasses.replace(joint.clearance, friction=NoFriction(), contact="compliant")
    )
