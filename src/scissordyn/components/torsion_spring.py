"""Hinge spring and damper between two bodies."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import TEXTBOOK, component
from scissordyn.components.place import GROUND
from scissordyn.components.port import HINGE
from scissordyn.units import Quantity


def force(angle, speed, stiffness, free_angle, damping):
    """Return torque [N m], stored energy [J] and dissipated power [W]."""
    twist = angle - free_angle
    return -stiffness * twist - damping * speed, 0.5 * stiffness * twist * twist, damping * speed * speed


@component(
    port=HINGE,
    force=force,
    symbol="spiral",
    example={"body": "rod", "stiffness": "2 N m/rad", "free_angle": "90 deg", "damping": "0.1 N m s/rad"},
    source=TEXTBOOK,
)
class TorsionSpring:
    """Hinge spring and damper between two bodies: torque -k (phi - phi_0) - d phi' on the first.

    phi is the angle of the body relative to its base, including full turns.
    """

    name: str
    body: str
    base: str = GROUND
    stiffness: Annotated[float, Quantity("N m/rad", minimum=0.0, maximum=1e12, help="stiffness k")] = 0.0
    free_angle: Annotated[float, Quantity("rad", minimum=-1e4, maximum=1e4, help="angle phi_0 without torque")] = 0.0
    damping: Annotated[float, Quantity("N m s/rad", minimum=0.0, maximum=1e12, help="damping d")] = 0.0
