"""LuGre friction: elastic bristles with stick and slip."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import static_coefficient
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.units import Quantity, check_quantities

__all__ = ["LuGre", "force", "start"]


@dataclass(frozen=True)
class LuGre:
    r"""Bristle friction with pre-sliding, Stribeck effect and stick-slip.

    .. math::
        z' = v - \sigma_0 \frac{|v|}{g(v)} z,\quad g = \mu_k + (\mu_s - \mu_k) e^{-|v/v_s|^\gamma},\quad
        F_t = F_n (\sigma_0 z + \sigma_1 z' + \sigma_2 v)

    bristle_deflection z is in m. The static coefficient is 1.5 times the kinetic one unless it is given.
    """

    kinetic: Annotated[float, Quantity("1", above=0.0, help="kinetic friction coefficient mu_k")] = 0.05
    static: Annotated[float | None, Quantity("1", above=0.0, help="static friction coefficient mu_s")] = None
    stribeck_speed: Annotated[float, Quantity("m/s", above=0.0, help="Stribeck speed v_s")] = 1e-3
    stribeck_exponent: Annotated[float, Quantity("1", above=0.0, help="exponent gamma of the Stribeck curve")] = 2.0
    bristle_stiffness: Annotated[float, Quantity("1/m", above=0.0, help="sigma_0 per unit normal force")] = 1e5
    bristle_damping: Annotated[float, Quantity("s/m", minimum=0.0, help="sigma_1 per unit normal force")] = 316.0
    viscous: Annotated[float, Quantity("s/m", minimum=0.0, help="sigma_2 per unit normal force")] = 0.0

    name: ClassVar[str] = "lugre"
    kernel_kind: ClassVar[int] = 1
    source: ClassVar[str] = "Canudas de Wit et al. 1995, doi:10.1109/9.376053"
    states: ClassVar[tuple[str, ...]] = ("bristle_deflection",)
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("LuGre", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2."""
        return (
            self.kinetic,
            static_coefficient("LuGre", self.kinetic, self.static),
            self.stribeck_speed,
            self.stribeck_exponent,
            self.bristle_stiffness,
            self.bristle_damping,
            self.viscous,
        )


@kernel()
def force(v, normal, z, dz, p):
    """Tangential force [N]; writes z' [m/s] into dz[0]. z[0] is the bristle deflection [m]."""
    rate = v - p[4] * abs(v) * z[0] / sliding_coefficient(v, p)
    dz[0] = rate
    return normal * (p[4] * z[0] + p[5] * rate + p[6] * v)


@kernel()
def start(v, z, p):
    """Deflection at the start of a contact: that of steady sliding at the slip speed v [m/s]."""
    z[0] = math.copysign(sliding_coefficient(v, p), v) / p[4] if v != 0.0 else 0.0
