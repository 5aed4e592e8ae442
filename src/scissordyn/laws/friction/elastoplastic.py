"""Elasto-plastic LuGre friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

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
from scissordyn.laws.friction.lugre import static_limit
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["ElastoPlastic", "force", "start", "static_limit", "steady"]


@dataclass(frozen=True)
class ElastoPlastic:
    r"""LuGre friction whose bristles first deflect without slip, so that a joint at rest does not creep.

    .. math::
        z' = v \left(1 - \alpha \frac{\sigma_0 z}{g(v)} \operatorname{sgn} v\right),\quad
        F_t = F_n (\sigma_0 z + \sigma_1 e^{-(v/v_d)^2} z' + \sigma_2 v)

    alpha is 0 while z and v have different signs or |z| <= z_ba, 1 from z_max = g(v)/sigma_0 on, and half a sine wave between.
    z_ba is the breakaway fraction of mu_k/sigma_0, the smallest z_max. bristle_deflection z is in m. The static coefficient is
    1.5 times the kinetic one unless it is given. v_d is the largest that keeps friction within mu_s F_n, plus the viscous part,
    whatever the Stribeck speed, unless it is given (decision 0006).
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    stribeck_speed: StribeckSpeed = 1e-3
    stribeck_exponent: StribeckExponent = 2.0
    bristle_stiffness: BristleStiffness = 1e5
    bristle_damping: BristleDamping = 316.0
    viscous: Viscous = 0.0
    damping_speed: DampingSpeed = None
    breakaway: Annotated[
        float, Quantity("1", above=0.0, below=1.0, help="fraction of mu_k/sigma_0 up to which bristles only deflect")
    ] = 0.7

    name: ClassVar[str] = "elasto-plastic"
    kernel_kind: ClassVar[int] = 9
    source: ClassVar[str] = "Dupont, Hayward, Armstrong, Altpeter 2002, doi:10.1109/TAC.2002.1000274"
    states: ClassVar[tuple[State, ...]] = (State("bristle_deflection", "m"),)
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("ElastoPlastic", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2, v_d and z_ba [m]."""
        static = static_coefficient("ElastoPlastic", self.kinetic, self.static)
        return (
            self.kinetic,
            static,
            self.stribeck_speed,
            self.stribeck_exponent,
            self.bristle_stiffness,
            self.bristle_damping,
            self.viscous,
            self.damping_speed or fading_speed(self._largest(static), self.bristle_damping),
            self.breakaway * self.kinetic / self.bristle_stiffness,
        )

    def _largest(self, static: float) -> float:
        """The largest sigma_1 |v| e^(-(v/v_d)^2) with which friction cannot exceed the static coefficient.

        With u = sigma_0 |z|/mu_s friction is mu_s u + sigma_1 z', z' = v (1 - alpha u) at the worst slip speed, where g = mu_s.
        """
        first = self.breakaway * self.kinetic / static
        low, high = first, 1.0
        # the share falls from `first` on and is 1 at 1, its minimum lies between: four grids find it to rounding
        for _ in range(4):
            u = np.linspace(low, high, 1001)[:-1]
            slipping = 0.5 + 0.5 * np.sin(math.pi * (u - 0.5 * (1.0 + first)) / (1.0 - first))
            share = (1.0 - u) / (1.0 - slipping * u)
            at, step = u[np.argmin(share)], u[1] - u[0]
            low, high = at - step, at + step
        return static * float(np.min(share))


@kernel()
def force(v, normal, z, dz, p):
    """Tangential force [N]; writes z' [m/s] into dz[0]. z[0] is the bristle deflection [m]."""
    farthest = sliding_coefficient(v, p) / p[4]  # z_max
    bend = abs(z[0])
    slipping = 0.0  # alpha
    if z[0] * v > 0.0 and bend > p[8]:
        slipping = 1.0
        if bend < farthest:
            slipping = 0.5 + 0.5 * math.sin(math.pi * (bend - 0.5 * (farthest + p[8])) / (farthest - p[8]))
    rate = v * (1.0 - slipping * bend / farthest)
    dz[0] = rate
    return normal * (p[4] * z[0] + micro_damping(v, p[5], p[7]) * rate + p[6] * v)
