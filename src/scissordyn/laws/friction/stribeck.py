"""Stribeck friction."""

from __future__ import annotations

import math

from scissordyn.kernel import equals, kernel
from scissordyn.laws.friction.coefficients import (
    Kinetic,
    RampSpeed,
    Static,
    StaticFriction,
    StribeckExponent,
    StribeckSpeed,
    Viscous,
    viscous_limit,
)
from scissordyn.laws.friction.coulomb import direction
from scissordyn.plugin.element import element


@kernel
def sliding_coefficient(v, kinetic, static, stribeck_speed, stribeck_exponent):
    """Return g(v), the friction coefficient of steady sliding without the viscous part."""
    s = abs(v) / stribeck_speed
    # multiplication for the exponent 2: pow costs more than the rest of the law
    power = s * s if equals(stribeck_exponent, 2.0) else s**stribeck_exponent
    return kinetic + (static - kinetic) * math.exp(-power)


def force(slip_speed, normal_force, kinetic, static, stribeck_speed, stribeck_exponent, viscous, ramp_speed):
    """Return the tangential force [N] at a slip speed [m/s]."""
    return normal_force * (
        sliding_coefficient(slip_speed, kinetic, static, stribeck_speed, stribeck_exponent) * direction(slip_speed, ramp_speed)
        + viscous * slip_speed
    )


@element(
    name="stribeck",
    force=force,
    limit=viscous_limit,
    source="Stribeck 1902; Armstrong-Helouvry, Dupont, Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7",
)
class Stribeck(StaticFriction):
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
