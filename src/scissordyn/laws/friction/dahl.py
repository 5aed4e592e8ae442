"""Dahl friction."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.kernel import equals
from scissordyn.laws.contact import Friction
from scissordyn.laws.friction.bristle import DEFLECTION, PRESLIDING_SPEED, BristleStiffness, onset
from scissordyn.laws.friction.coefficients import Coefficient, kinetic_limit
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def force(slip_speed, normal_force, bristle_deflection, kinetic, bristle_stiffness, shape):
    """Return the tangential force [N] and z' [m/s], the rate of the bristle deflection."""
    rest = 1.0 - bristle_stiffness * bristle_deflection / kinetic * math.copysign(1.0, slip_speed)
    rate = slip_speed * rest if equals(shape, 1.0) else slip_speed * math.copysign(abs(rest) ** shape, rest)
    return normal_force * bristle_stiffness * bristle_deflection, rate


def steady(slip_speed, kinetic, bristle_stiffness):
    """Return the deflection of steady sliding at a slip speed [m/s], zero at rest."""
    return math.copysign(kinetic, slip_speed) / bristle_stiffness if slip_speed != 0.0 else 0.0


def start(slip_speed, kinetic, bristle_stiffness):
    """Return the deflection at a contact's start at a slip speed [m/s]."""
    return onset(slip_speed, PRESLIDING_SPEED) * kinetic / bristle_stiffness


@element(
    name="dahl",
    force=force,
    start=start,
    steady=steady,
    limit=kinetic_limit,
    states=(DEFLECTION,),
    source="Dahl 1976, doi:10.2514/3.61511",
)
class Dahl(Friction):
    r"""Friction as the force of elastic surfaces that yield gradually, without a static peak.

    .. math:: z' = v \left|1 - \frac{\sigma_0 z}{\mu}\operatorname{sgn} v\right|^n
        \operatorname{sgn}\left(1 - \frac{\sigma_0 z}{\mu}\operatorname{sgn} v\right),\quad F_t = F_n \sigma_0 z

    bristle_deflection z is in m.
    """

    kinetic: Coefficient = 0.05
    bristle_stiffness: BristleStiffness = 1e5
    shape: Annotated[float, Quantity("1", minimum=0.5, maximum=4.0, help="exponent n, 1 for most materials")] = 1.0
