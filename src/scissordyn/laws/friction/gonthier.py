"""Gonthier's bristle friction with dwell time."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.kernel import kernel
from scissordyn.laws.friction.bristle import DEFLECTION, BristleStiffness, onset
from scissordyn.laws.friction.coefficients import Kinetic, Static, StaticFriction, Viscous, viscous_limit
from scissordyn.plugin.element import element
from scissordyn.units import Quantity, State


@kernel
def direction(v, smoothing_speed):
    """Return the sign of v, replaced below the smoothing speed by a cubic with zero slope at its ends."""
    r = v / smoothing_speed
    return math.copysign(1.0, v) if abs(r) >= 1.0 else r * (1.5 - 0.5 * r * r)


def force(
    slip_speed,
    normal_force,
    bristle_deflection,
    dwell,
    kinetic,
    static,
    stribeck_speed,
    smoothing_speed,
    dwell_time,
    bristle_stiffness,
    bristle_damping,
    viscous,
):
    """Return the tangential force [N], and the rates of the bristle deflection z [m/s] and of the dwell w [1/s]."""
    x = slip_speed / stribeck_speed
    stick = math.exp(-x * x)
    slide = -math.expm1(-x * x)
    rate = (
        stick * slip_speed
        + slide * (kinetic * direction(slip_speed, smoothing_speed) - bristle_stiffness * bristle_deflection) / bristle_damping
    )
    lag = stick - dwell
    dwell_rate = lag / dwell_time if lag >= 0.0 else lag * bristle_stiffness / bristle_damping
    largest = kinetic + (static - kinetic) * dwell
    bristle = min(largest, max(-largest, bristle_stiffness * bristle_deflection + bristle_damping * rate))
    return normal_force * (bristle + viscous * slip_speed), rate, dwell_rate


@kernel
def bend(v, kinetic, stribeck_speed, smoothing_speed, bristle_damping):
    """Return the bristles' coefficient in steady sliding at slip speed v != 0 [m/s], unbounded, with the sign of v."""
    x = v / stribeck_speed
    return kinetic * direction(v, smoothing_speed) - bristle_damping * math.exp(-x * x) * v / math.expm1(-x * x)


def steady(slip_speed, kinetic, static, stribeck_speed, smoothing_speed, bristle_stiffness, bristle_damping):
    """Return the states of steady sliding at slip speed v [m/s]: bristles within their largest force, undeflected at rest."""
    x = slip_speed / stribeck_speed
    dwell = math.exp(-x * x)
    largest = kinetic + (static - kinetic) * dwell
    bristle_deflection = (
        min(largest, max(-largest, bend(slip_speed, kinetic, stribeck_speed, smoothing_speed, bristle_damping)))
        / bristle_stiffness
        if slip_speed != 0.0
        else 0.0
    )
    return bristle_deflection, dwell


def start(slip_speed, kinetic, stribeck_speed, smoothing_speed, bristle_stiffness, bristle_damping):
    """Return the states at a contact's start at slip speed v [m/s]; kinetic friction bounds them, as there was no dwell."""
    bristle_deflection = (
        onset(slip_speed, stribeck_speed)
        * min(kinetic, abs(bend(slip_speed, kinetic, stribeck_speed, smoothing_speed, bristle_damping)))
        / bristle_stiffness
        if slip_speed != 0.0
        else 0.0
    )
    return bristle_deflection, 0.0


@element(
    name="gonthier-bristle",
    force=force,
    start=start,
    steady=steady,
    limit=viscous_limit,
    states=(DEFLECTION, State("dwell", "1", scale=1.0)),
    source="Gonthier, McPhee, Lange, Piedboeuf 2004, doi:10.1023/B:MUBO.0000029392.21648.bc",
)
class GonthierBristle(StaticFriction):
    r"""Bristles that stick at rest and slide when moving, and a static friction that grows with the time at rest.

    .. math::
        s = e^{-(v/v_s)^2},\quad z' = s v + (1 - s) \frac{\mu_k d(v) - \sigma_0 z}{\sigma_1},\quad
        \dot w = \frac{s - w}{\tau},\quad \tau = \begin{cases} \tau_d & s \ge w \\ \sigma_1/\sigma_0 & s < w \end{cases}

        F_t = F_n [\operatorname{sat}(\sigma_0 z + \sigma_1 z',\ \mu_k + (\mu_s - \mu_k) w) + \sigma_2 v]

    d(v) is the sign of v, smoothed by a cubic below the smoothing speed; sat(x, m) cuts x off at -m and m. bristle_deflection
    z is in m; dwell w is a pure number, 1 after a long rest. The source has forces where these are coefficients, times F_n.
    The static coefficient is 1.5 times the kinetic one unless it is given.
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    stribeck_speed: Annotated[
        float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_s, below which the bristles stick")
    ] = 1e-3
    smoothing_speed: Annotated[
        float, Quantity("m/s", minimum=1e-9, maximum=10.0, help="speed below which the sign of v is smoothed")
    ] = 1e-4
    dwell_time: Annotated[
        float, Quantity("s", minimum=1e-9, maximum=1e4, help="tau_d, in which static friction grows at rest")
    ] = 1e-3
    bristle_stiffness: BristleStiffness = 1e5
    bristle_damping: Annotated[float, Quantity("s/m", minimum=1e-6, maximum=1e6, help="sigma_1 per unit normal force")] = 10.0
    viscous: Viscous = 0.0
