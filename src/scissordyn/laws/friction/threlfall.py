"""Threlfall's friction."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.laws.contact import Friction
from scissordyn.laws.friction.coefficients import Coefficient, kinetic_limit
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def force(slip_speed, normal_force, kinetic, ramp_speed):
    """Return the tangential force [N] at a slip speed [m/s]."""
    return math.copysign(kinetic * normal_force * -math.expm1(-3.0 * abs(slip_speed) / ramp_speed), slip_speed)


@element(name="threlfall", force=force, limit=kinetic_limit, source="Threlfall 1978")
class Threlfall(Friction):
    r"""Coulomb friction approached exponentially.

    .. math:: F_t = \mu F_n (1 - e^{-3|v|/v_0}) \operatorname{sgn} v

    At v_0 it is 95 % of Coulomb's; the exponential is used beyond, where some printings have a constant.

    The citation could not be verified.
    """

    kinetic: Coefficient = 0.05
    ramp_speed: Annotated[
        float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_0, at which friction is 95 % of Coulomb's")
    ] = 1e-3
