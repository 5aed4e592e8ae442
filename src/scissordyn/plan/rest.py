"""A mechanism whose drives stand still, for static equilibrium."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import numpy as np

from scissordyn.component.time_function import Polynomial, TimeFunction
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.time_function import function_at, function_rows
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism

Joint = TypeVar("Joint", Revolute, Guide)


def at_rest(mechanism: Mechanism, time: float = 0.0) -> Mechanism:
    """The same mechanism without friction, with compliant contacts, its drives and distances constant as at a time [s]."""

    def constant(motion: TimeFunction, start: float) -> TimeFunction:
        value = np.zeros(4)
        function_at(time, function_rows(motion, start), value)
        return Polynomial((float(value[0]),))

    return dataclasses.replace(
        mechanism,
        drives=tuple(
            dataclasses.replace(drive, motion=constant(drive.motion, mechanism.body(drive.body).placed_angle))
            for drive in mechanism.drives
        ),
        joints=tuple(_frictionless(joint) for joint in mechanism.joints),
        guides=tuple(_frictionless(guide) for guide in mechanism.guides),
        rods=tuple(dataclasses.replace(rod, motion=rod.motion and constant(rod.motion, 0.0)) for rod in mechanism.rods),
    )


def _frictionless(joint: Joint) -> Joint:
    if joint.clearance is None:
        return joint
    return dataclasses.replace(
        joint, clearance=dataclasses.replace(joint.clearance, friction=NoFriction(), contact="compliant")
    )
