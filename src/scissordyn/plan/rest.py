"""A mechanism whose drives stand still, for static equilibrium."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

from scissordyn.component.time_function import ConstantSpeed, Polynomial, TimeFunction
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.time_function import function_start
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism

__all__ = ["at_rest"]

Joint = TypeVar("Joint", Revolute, Guide)


def at_rest(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with its drives and prescribed distances constant at their values of t = 0, and without friction."""

    def constant(motion: TimeFunction, start: float) -> TimeFunction:
        return Polynomial((start if isinstance(motion, ConstantSpeed) else function_start(motion),))

    return dataclasses.replace(
        mechanism,
        drives=tuple(
            dataclasses.replace(drive, motion=constant(drive.motion, mechanism.body(drive.body).angle))
            for drive in mechanism.drives
        ),
        joints=tuple(_frictionless(joint) for joint in mechanism.joints),
        guides=tuple(_frictionless(guide) for guide in mechanism.guides),
        rods=tuple(dataclasses.replace(rod, motion=rod.motion and constant(rod.motion, 0.0)) for rod in mechanism.rods),
    )


def _frictionless(joint: Joint) -> Joint:
    if joint.clearance is None:
        return joint
    return dataclasses.replace(joint, clearance=dataclasses.replace(joint.clearance, friction=NoFriction()))
