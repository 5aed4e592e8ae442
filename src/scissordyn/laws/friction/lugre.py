"""LuGre friction: bristles that bend and slide."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.bristle import (
    BristleDamping,
    BristleStiffness,
    DampingSpeed,
    fading_speed,
    micro_damping,
    start,
    steady,
)
from scissordyn.laws.friction.coefficients import Kinetic, Static, StribeckExponent, StribeckSpeed, Viscous, static_coefficient
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.units import State, check_quantities

__all__ = ["LuGre", "force", "start", "static_limit", "steady"]


@dataclass(frozen=True)
class LuGre:
    r"""Bristle friction with pre-sliding, Stribeck effect and stick-slip.

    .. math::
        z' = v - \sigma_0 \frac{|v|}{g(v)} z,\quad g = \mu_k + (\mu_s - \mu_k) e^{-|v/v_s|^\gamma},\quad
        F_t = F_n (\sigma_0 z + \sigma_1 e^{-(v/v_d)^2} z' + \sigma_2 v)

    bristle_deflection z is in m. The static coefficient is 1.5 times the kinetic one unless it is given. With a constant
    sigma_1 friction would exceed the static limit many times over when slip reverses under load; it stays within mu_s F_n, plus
    the viscous part, as long as sigma_1 v_d <= sqrt(2 e) mu_k; equality is the default (decision 0006).
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    stribeck_speed: StribeckSpeed = 1e-3
    stribeck_exponent: StribeckExponent = 2.0
    bristle_stiffness: BristleStiffness = 1e5
    bristle_damping: BristleDamping = 316.0
    viscous: Viscous = 0.0
    damping_speed: DampingSpeed = None

    name: ClassVar[str] = "lugre"
    kernel_kind: ClassVar[int] = 1
    source: ClassVar[str] = (
        "Canudas de Wit et al. 1995, doi:10.1109/9.376053; fading sigma_1: Canudas de Wit, Lischinsky 1997, "
        "Int. J. Adaptive Control and Signal Processing 11, 65-80"
    )
    states: ClassVar[tuple[State, ...]] = (State("bristle_deflection", "m"),)
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("LuGre", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2 and v_d."""
        return (
            self.kinetic,
            static_coefficient("LuGre", self.kinetic, self.static),
            self.stribeck_speed,
            self.stribeck_exponent,
            self.bristle_stiffness,
            self.bristle_damping,
            self.viscous,
            self.damping_speed or fading_speed(self.kinetic, self.bristle_damping),
        )


@kernel()
def force(v, normal, z, dz, p):
    """Tangential force [N]; writes z' [m/s] into dz[0]. z[0] is the bristle deflection [m]."""
    rate = v - p[4] * abs(v) * z[0] / sliding_coefficient(v, p)
    dz[0] = rate
    return normal * (p[4] * z[0] + micro_damping(v, p[5], p[7]) * rate + p[6] * v)


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that static friction and the viscous part allow at slip speed v [m/s]."""
    return normal * (p[1] + p[6] * abs(v))
