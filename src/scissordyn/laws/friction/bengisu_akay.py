"""Bengisu and Akay's friction."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.laws.friction.coefficients import Kinetic, Static, StaticFriction, static_limit
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def force(slip_speed, normal_force, kinetic, static, peak_speed, decay):
    """Return the tangential force [N] at a slip speed [m/s]."""
    speed = abs(slip_speed)
    if speed < peak_speed:
        short = speed / peak_speed - 1.0
        coefficient = static - static * short * short
    else:
        coefficient = kinetic + (static - kinetic) * math.exp(-decay * (speed - peak_speed))
    return math.copysign(coefficient * normal_force, slip_speed)


@element(name="bengisu-akay", force=force, limit=static_limit, source="Bengisu, Akay 1994")
class BengisuAkay(StaticFriction):
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
