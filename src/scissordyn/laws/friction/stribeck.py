"""Stribeck friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import (
    Kinetic,
    RampSpeed,
    Static,
    StribeckExponent,
    StribeckSpeed,
    Viscous,
    static_coefficient,
)
from scissordyn.laws.friction.coulomb import direction
from scissordyn.units import State, check_quantities

__all__ = ["Stribeck", "force", "sliding_coefficient", "static_limit"]


@dataclass(frozen=True)
class Stribeck:
    r"""Static friction that falls to kinetic friction as sliding starts, and a viscous part.

    .. math:: F_t = F_n \left[g(v) \tanh\frac{v}{v_0} + \sigma_2 v\right],\quad g = \mu_k + (\mu_s - \mu_k) e^{-|v/v_s|^\gamma}

    The sign of v is smoothed over v_0; with v_0 = 0 it is the sign itself, and a sticking joint makes the
    integrator chatter or fail. The static coefficient is 1.5 times the kinetic one unless it is given.
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    stribeck_speed: StribeckSpeed = 1e-3
    stribeck_exponent: StribeckExponent = 2.0
    viscous: Viscous = 0.0
    ramp_speed: RampSpeed = 1e-4

    name: ClassVar[str] = "stribeck"
    kernel_kind: ClassVar[int] = 7
    source: ClassVar[str] = "Stribeck 1902; Armstrong-Helouvry, Dupont, Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7"
    states: ClassVar[tuple[State, ...]] = ()
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("Stribeck", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s, v_s, gamma, sigma_2 and v_0."""
        static = static_coefficient("Stribeck", self.kinetic, self.static)
        return self.kinetic, static, self.stribeck_speed, self.stribeck_exponent, self.viscous, self.ramp_speed


@kernel()
def sliding_coefficient(v, p):
    """g(v), the friction coefficient of steady sliding without the viscous part; p starts with mu_k, mu_s, v_s, gamma."""
    s = abs(v) / p[2]
    # an integer exponent by multiplication: pow costs more than the rest of the law
    power = s * s if p[3] == 2.0 else s ** p[3]
    return p[0] + (p[1] - p[0]) * math.exp(-power)


@kernel()
def force(v, normal, p):
    """Tangential force [N] at slip speed v [m/s]."""
    return normal * (sliding_coefficient(v, p) * direction(v, p[5]) + p[4] * v)


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return normal * (p[1] + p[4] * abs(v))
