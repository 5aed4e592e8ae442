"""Coulomb friction."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.laws.contact import Friction
from scissordyn.laws.friction.coefficients import Coefficient, RampSpeed, kinetic_limit
from scissordyn.plugin.element import element


@kernel
def direction(v, ramp_speed):
    """Return the sign of v, smoothed over the ramp speed if that is not zero."""
    if ramp_speed > 0.0:
        return math.tanh(v / ramp_speed)
    return math.copysign(1.0, v) if v != 0.0 else 0.0


def force(slip_speed, normal_force, kinetic, ramp_speed):
    """Return the tangential force [N] at a slip speed [m/s]."""
    return kinetic * normal_force * direction(slip_speed, ramp_speed)


@element(name="coulomb", force=force, limit=kinetic_limit, source="Coulomb 1785")
class Coulomb(Friction):
    r"""Friction opposite to sliding, independent of its speed.

    .. math:: F_t = \mu F_n \tanh\frac{v}{v_0}

    The sign of v is smoothed over v_0; with v_0 = 0 it is the sign itself, and a sticking joint makes the
    integrator chatter or fail.
    """

    kinetic: Coefficient = 0.05
    ramp_speed: RampSpeed = 1e-4
