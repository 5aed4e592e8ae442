"""Mechanisms of the benchmarks: the paper's array with clearance at joint A, and longer arrays."""

from __future__ import annotations

import scissordyn as sd

__all__ = ["FRICTION", "UNTIL", "array", "clearance_everywhere", "friction_everywhere", "name_of"]

CLEARANCE = 0.5e-3
UNTIL = 0.05
FRICTION: tuple[float | None, ...] = (None, 0.01, 0.1)
"""Kinetic friction coefficients: frictionless, and the paper's smallest and largest."""


def name_of(kinetic: float | None) -> str:
    """Return the name of a case in the tables."""
    return "frictionless" if kinetic is None else f"LuGre {kinetic:g}"


def clearance(kinetic: float | None) -> sd.Clearance:
    """Return the paper's clearance joint."""
    return sd.Clearance(CLEARANCE) if kinetic is None else sd.Clearance(CLEARANCE, friction=sd.LuGre(kinetic=kinetic))


def array(kinetic: float | None = None, units: int = 2) -> sd.Mechanism:
    """Return an array from 30 degrees with clearance at joint A, whose tip moves as fast as that of two units at 150 rpm."""
    return sd.scissor(units=units).driven(speed=sd.rpm(150) * 2 / units).with_clearance("A", clearance(kinetic))


def clearance_everywhere(units: int) -> sd.Mechanism:
    """Return an array with clearance and no friction in every revolute joint."""
    found = sd.scissor(units=units).driven(speed=sd.rpm(150))
    for joint in found.joints:
        found = found.with_clearance(joint.name, clearance(None))
    return found


def friction_everywhere(units: int) -> sd.Mechanism:
    """Return a light array that folds slowly from 60 to 58 degrees, with clearance of 0.1 mm and LuGre friction everywhere."""
    arm = sd.scissor(units=units, bar_length=0.5, bar_mass=0.2, slider_mass=0.5, angle=sd.degrees(60))
    arm = arm.driven(sd.Cycloidal(sd.degrees(60), sd.degrees(-2), 2.0))
    return arm.with_clearance("all", sd.Clearance(1e-4, friction=sd.LuGre(kinetic=0.1)))
