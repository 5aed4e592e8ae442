"""End stop of a rotation."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import GROUND
from scissordyn.components.port import HINGE
from scissordyn.components.stop import Exponent, Restitution, push, stop_damping
from scissordyn.kernel import kernel
from scissordyn.units import Quantity


@kernel
def gap(angle, speed, stop, side):
    """Return the angle beyond the stop [rad] and its rate [rad/s]."""
    return side * (angle - stop), side * speed


@kernel
def force(angle, speed, mode, approach_speed, effective_mass, stiffness, exponent, damping, stop, side):
    """Return torque [N m], elastic energy [J] and dissipated power [W]."""
    depth, rate = gap(angle, speed, stop, side)
    torque, energy, dissipation = push(mode, approach_speed, effective_mass, depth, rate, stiffness, exponent, damping)
    return -side * torque, energy, dissipation


@component(
    port=HINGE,
    force=force,
    gap=gap,
    label="end stop",
    context=("mode", "approach_speed", "effective_mass"),
    symbol="stop",
    example={"body": "rod", "angle": "80 deg"},
    source="Flores, Machado, Silva and Martins 2011, doi:10.1007/s11044-010-9237-4",
)
class AngleStop:
    r"""End stop of a rotation: beyond its angle a torque pushes the body back.

    .. math:: T = K\delta^n\left(1 + \xi\,\dot\delta/v\right)

    delta is the angle beyond the stop. v is its rate at the touch, or more where the stop is loaded later. xi is the damping
    factor of Flores et al. 2011 for the restitution coefficient, an approximation: a free body rebounds with 0.470 of its
    speed for a coefficient of 0.5, and with 0.069 for 0.1. The bodies reach the stop from the side on which they start; turns
    are counted.
    """

    name: str
    body: str
    angle: Annotated[float, Quantity("rad", minimum=-1e4, maximum=1e4, help="angle of the body against its base at the touch")]
    base: str = GROUND
    stiffness: Annotated[float, Quantity("1", above=0.0, maximum=1e15, help="K, in N m/rad^n with the n given here")] = 1e6
    exponent: Exponent = 1.5
    restitution: Restitution = 0.5

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return K, n, xi, the angle [rad], and the sense of rotation in which it is reached (1 or -1)."""
        side = math.copysign(1.0, self.angle - start[0])
        return self.stiffness, self.exponent, stop_damping(self.restitution), self.angle, side
