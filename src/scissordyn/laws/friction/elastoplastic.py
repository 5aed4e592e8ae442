"""Elasto-plastic LuGre friction."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.bristle import DEFLECTION, BristleFriction, fading_speed, micro_damping
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.plugin.element import element, numbers
from scissordyn.units import Quantity


def force(
    slip_speed,
    normal_force,
    bristle_deflection,
    kinetic,
    static,
    stribeck_speed,
    stribeck_exponent,
    bristle_stiffness,
    bristle_damping,
    viscous,
    damping_speed,
    breakaway,
):
    """Return the tangential force [N] and z' [m/s], the rate of the bristle deflection."""
    farthest = sliding_coefficient(slip_speed, kinetic, static, stribeck_speed, stribeck_exponent) / bristle_stiffness  # z_max
    bend = abs(bristle_deflection)
    slipping = 0.0  # alpha
    if bristle_deflection * slip_speed > 0.0 and bend > breakaway:
        slipping = 1.0
        if bend < farthest:
            slipping = 0.5 + 0.5 * math.sin(math.pi * (bend - 0.5 * (farthest + breakaway)) / (farthest - breakaway))
    rate = slip_speed * (1.0 - slipping * bend / farthest)
    force = normal_force * (
        bristle_stiffness * bristle_deflection
        + micro_damping(slip_speed, bristle_damping, damping_speed) * rate
        + viscous * slip_speed
    )
    return force, rate


@element(
    name="elasto-plastic",
    force=force,
    states=(DEFLECTION,),
    source="Dupont, Hayward, Armstrong, Altpeter 2002, doi:10.1109/TAC.2002.1000274",
)
class ElastoPlastic(BristleFriction):
    r"""LuGre friction whose bristles first deflect without slip, so that a joint at rest does not creep.

    .. math::
        z' = v \left(1 - \alpha \frac{\sigma_0 z}{g(v)} \operatorname{sgn} v\right),\quad
        F_t = F_n (\sigma_0 z + \sigma_1 e^{-(v/v_d)^2} z' + \sigma_2 v)

    alpha is 0 while z and v have different signs or |z| <= z_ba, 1 from z_max = g(v)/sigma_0 on, and half a sine wave between.
    z_ba is the breakaway fraction of mu_k/sigma_0, the smallest z_max. bristle_deflection z is in m. The static coefficient is
    1.5 times the kinetic one unless it is given. v_d is the largest that keeps friction within mu_s F_n, plus the viscous part,
    whatever the Stribeck speed, unless it is given (decision 0006).
    """

    breakaway: Annotated[
        float, Quantity("1", above=0.0, below=1.0, help="fraction of mu_k/sigma_0 up to which bristles only deflect")
    ] = 0.7

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the kernel's parameters, with z_ba in m; by default mu_s and v_d are computed from the other fields."""
        static = self._static_coefficient()
        fading = self.damping_speed or fading_speed(self._largest(static), self.bristle_damping)
        breakaway = self.breakaway * self.kinetic / self.bristle_stiffness
        return numbers(self, static=static, damping_speed=fading, breakaway=breakaway)

    def _largest(self, static: float) -> float:
        """Return the largest sigma_1 |v| e^(-(v/v_d)^2) with which friction cannot exceed the static coefficient.

        With u = sigma_0 |z|/mu_s friction is mu_s u + sigma_1 z', z' = v (1 - alpha u) at the worst slip speed, where g
        = mu_s.
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
