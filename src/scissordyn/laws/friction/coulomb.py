"""Coulomb friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import Coefficient, RampSpeed
from scissordyn.units import State, check_quantities

__all__ = ["Coulomb", "direction", "force", "static_limit"]


@dataclass(frozen=True)
class Coulomb:
    r"""Friction opposite to sliding, independent of its speed.

    .. math:: F_t = \mu F_n \tanh\frac{v}{v_0}

    The sign of v is smoothed over v_0; with v_0 = 0 it is the sign itself, and a sticking joint makes the
    integrator chatter or fail.
    """

    kinetic: Coefficient = 0.05
    ramp_speed: RampSpeed = 1e-4

    name: ClassVar[str] = "coulomb"
    kernel_kind: ClassVar[int] = 3
    source: ClassVar[str] = "Coulomb 1785"
    states: ClassVar[tuple[State, ...]] = ()
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


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return p[0] * normal
