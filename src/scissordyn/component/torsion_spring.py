"""A hinge spring and damper between two bodies."""

from __future__ import annotations

from typing import Annotated

from scissordyn.component.declaration import component
from scissordyn.component.place import GROUND
from scissordyn.component.port import HINGE
from scissordyn.units import Quantity


def force(angle, speed, stiffness, free_angle, damping):
    """Torque [N m], stored energy [J], dissipated power [W]."""
    twist = angle - free_angle
    return -stiffness * twist - damping * speed, 0.5 * stiffness * twist * twist, damping * speed * speed


@component(
    port=HINGE,
    force=force,
    section="torsion_spring",
    symbol="spiral",
    example={"body": "rod", "stiffness": "2 N m/rad", "free_angle": "90 deg", "damping": "0.1 N m s/rad"},
)
class TorsionSpring:
    """A hinge spring and damper between two bodies: torque -k (phi - phi_0) - d phi' on the first.

    phi is the angle of the body against its base, turns counted.

    Parameters
    ----------
    name : str
    body, base : str
        The base may be "ground".
    stiffness : float
        k [N m/rad].
    free_angle : float
        phi_0 [rad].
    damping : float
        d [N m s/rad].

    References
    ----------
    García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0
    """

    name: str
    body: str
    base: str = GROUND
    stiffness: Annotated[float, Quantity("N m/rad", minimum=0.0, maximum=1e12, help="stiffness")] = 0.0
    free_angle: Annotated[float, Quantity("rad", minimum=-1e4, maximum=1e4, help="angle without torque")] = 0.0
    damping: Annotated[float, Quantity("N m s/rad", minimum=0.0, maximum=1e12, help="damping")] = 0.0
