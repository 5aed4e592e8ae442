"""Elasto-plastic LuGre friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import static_coefficient
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.units import Quantity, check_quantities

__all__ = ["ElastoPlastic", "force", "start"]


@dataclass(frozen=True)
class ElastoPlastic:
    r"""LuGre friction whose bristles first deflect without slip, so that a joint at rest does not creep.

    .. math::
        z' = v \left(1 - \alpha \frac{\sigma_0 z}{g(v)} \operatorname{sgn} v\right),\quad
        F_t = F_n (\sigma_0 z + \sigma_1 z' + \sigma_2 v)

    alpha is 0 while z and v have different signs or |z| <= z_ba, 1 from z_max = g(v)/sigma_0 on, and half a sine wave between.
    z_ba is the breakaway fraction of mu_k/sigma_0, the smallest z_max. bristle_deflection z is in m. The static coefficient is
    1.5 times the kinetic one unless it is given.
    """

    kinetic: Annotated[float, Quantity("1", above=0.0, help="kinetic friction coefficient mu_k")] = 0.05
    static: Annotated[float | None, Quantity("1", above=0.0, help="static friction coefficient mu_s")] = None
    stribeck_speed: Annotated[float, Quantity("m/s", above=0.0, help="Stribeck speed v_s")] = 1e-3
    stribeck_exponent: Annotated[float, Quantity("1", above=0.0, help="exponent gamma of the Stribeck curve")] = 2.0
    bristle_stiffness: Annotated[float, Quantity("1/m", above=0.0, help="sigma_0 per unit normal force")] = 1e5
    bristle_damping: Annotated[float, Quantity("s/m", minimum=0.0, help="sigma_1 per unit normal force")] = 316.0
    viscous: Annotated[float, Quantity("s/m", minimum=0.0, help="sigma_2 per unit normal force")] = 0.0
    breakaway: Annotated[
        float, Quantity("1", above=0.0, below=1.0, help="fraction of mu_k/sigma_0 up to which bristles only deflect")
    ] = 0.7

    name: ClassVar[str] = "elasto-plastic"
    kernel_kind: ClassVar[int] = 9
    source: ClassVar[str] = "Dupont, Hayward, Armstrong, Altpeter 2002, doi:10.1109/TAC.2002.1000274"
    states: ClassVar[tuple[str, ...]] = ("bristle_deflection",)
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("ElastoPlastic", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2 and z_ba [m]."""
        return (
            self.kinetic,
            static_coefficient("ElastoPlastic", self.kinetic, self.static),
            self.stribeck_speed,
            self.stribeck_exponent,
            self.bristle_stiffness,
            self.bristle_damping,
            self.viscous,
            self.breakaway * self.kinetic / self.bristle_stiffness,
        )


@kernel()
def force(v, normal, z, dz, p):
    """Tangential force [N]; writes z' [m/s] into dz[0]. z[0] is the bristle deflection [m]."""
    farthest = sliding_coefficient(v, p) / p[4]  # z_max
    bend = abs(z[0])
    slipping = 0.0  # alpha
    if z[0] * v > 0.0 and bend > p[7]:
        slipping = 1.0
        if bend < farthest:
            slipping = 0.5 + 0.5 * math.sin(math.pi * (bend - 0.5 * (farthest + p[7])) / (farthest - p[7]))
    rate = v * (1.0 - slipping * bend / farthest)
    dz[0] = rate
    return normal * (p[4] * z[0] + p[5] * rate + p[6] * v)


@kernel()
def start(v, z, p):
    """Deflection at the start of a contact: that of steady sliding at the slip speed v [m/s]."""
    z[0] = math.copysign(sliding_coefficient(v, p), v) / p[4] if v != 0.0 else 0.0
