"""Coulomb friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.units import Quantity, check_quantities

__all__ = ["Coulomb", "direction", "force"]


@dataclass(frozen=True)
class Coulomb:
    r"""Friction opposite to sliding, independent of its speed.

    .. math:: F_t = \mu F_n \tanh\frac{v}{v_0}

    The sign of v is smoothed over v_0; with v_0 = 0 it is the sign itself, and a sticking joint makes the
    integrator chatter or fail.
    """

    kinetic: Annotated[float, Quantity("1", above=0.0, help="friction coefficient mu")] = 0.05
    ramp_speed: Annotated[float, Quantity("m/s", minimum=0.0, help="v_0 over which the sign of v is smoothed")] = 1e-4

    name: ClassVar[str] = "coulomb"
    kernel_kind: ClassVar[int] = 3
    source: ClassVar[str] = "Coulomb 1785"
    states: ClassVar[tuple[str, ...]] = ()
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Coefficient mu and v_0."""
        return self.kinetic, self.ramp_speed


@kernel()
def direction(v, ramp_speed):
    """The sign of v, smoothed over a ramp speed where that is not zero."""
    if ramp_speed > 0.0:
        return math.tanh(v / ramp_speed)
    return math.copysign(1.0, v) if v != 0.0 else 0.0


@kernel()
def force(v, normal, p):
    """Tangential force [N] at slip speed v [m/s]."""
    return p[0] * normal * direction(v, p[1])
