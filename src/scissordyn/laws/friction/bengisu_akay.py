"""Bengisu and Akay's friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import Kinetic, Static, static_coefficient
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["BengisuAkay", "force", "static_limit"]


@dataclass(frozen=True)
class BengisuAkay:
    r"""A parabola up to static friction and an exponential down to kinetic friction.

    .. math::
        F_t = F_n \operatorname{sgn} v \begin{cases}
            \mu_s - \mu_s (|v|/v_0 - 1)^2 & |v| < v_0 \\
            \mu_k + (\mu_s - \mu_k) e^{-\xi (|v| - v_0)} & |v| \ge v_0 \end{cases}

    The static coefficient is 1.5 times the kinetic one unless it is given.

    The citation could not be verified.
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    peak_speed: Annotated[
        float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_0, at which friction is static friction")
    ] = 1e-3
    decay: Annotated[
        float, Quantity("s/m", minimum=1e-3, maximum=1e8, help="xi, slope of the fall from static to kinetic friction")
    ] = 1e3

    name: ClassVar[str] = "bengisu-akay"
    kernel_kind: ClassVar[int] = 5
    source: ClassVar[str] = "Bengisu, Akay 1994"
    states: ClassVar[tuple[State, ...]] = ()
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("BengisuAkay", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s, v_0 and xi."""
        return self.kinetic, static_coefficient("BengisuAkay", self.kinetic, self.static), self.peak_speed, self.decay


@kernel()
def force(v, normal, p):
    """Tangential force [N] at slip speed v [m/s]."""
    speed = abs(v)
    if speed < p[2]:
        short = speed / p[2] - 1.0
        coefficient = p[1] - p[1] * short * short
    else:
        coefficient = p[0] + (p[1] - p[0]) * math.exp(-p[3] * (speed - p[2]))
    return math.copysign(coefficient * normal, v)


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return p[1] * normal
