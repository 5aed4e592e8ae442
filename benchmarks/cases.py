"""The mechanisms that are measured: the paper's array with joint A loose, and longer ones."""

from __future__ import annotations

import scissordyn as sd

__all__ = ["CLEARANCE", "FRICTION", "UNTIL", "all_loose", "array", "name_of"]

CLEARANCE = 0.5e-3
UNTIL = 0.05
FRICTION: tuple[float | None, ...] = (None, 0.01, 0.1)
"""Frictionless, and the least and the most of the paper's kinetic friction coefficients."""


def name_of(kinetic: float | None) -> str:
    """A case as the tables name it."""
    return "frictionless" if kinetic is None else f"LuGre {kinetic:g}"


def clearance(kinetic: float | None) -> sd.Clearance:
    """The paper's loose joint."""
    return sd.Clearance(CLEARANCE) if kinetic is None else sd.Clearance(CLEARANCE, friction=sd.LuGre(kinetic=kinetic))


def array(kinetic: float | None = None, units: int = 2) -> sd.Mechanism:
    """An array at 150 rpm from 30 degrees with joint A loose."""
    return sd.scissor(units=units).driven(speed=sd.rpm(150)).loosen("A", clearance(kinetic))


def all_loose(units: int) -> sd.Mechanism:
    """An array in which every revolute joint is loose and frictionless."""
    found = sd.scissor(units=units).driven(speed=sd.rpm(150))
    for joint in found.joints:
        found = found.loosen(joint.name, clearance(None))
    return found
