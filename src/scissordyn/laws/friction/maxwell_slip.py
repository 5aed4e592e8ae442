"""Maxwell-slip friction with two elements in parallel: a stiff one that slides early, and a soft one."""

from __future__ import annotations

from typing import Annotated

from scissordyn.laws.contact import Friction
from scissordyn.laws.friction.bristle import PRESLIDING_SPEED, BristleStiffness, onset
from scissordyn.laws.friction.coefficients import Coefficient, kinetic_limit
from scissordyn.plugin.element import element
from scissordyn.units import Quantity, State


def force(slip_speed, normal_force, first_deflection, second_deflection, kinetic, share, first_stiffness, second_stiffness):
    """Return the tangential force [N] and the rates of the deflections of both elements [m/s]."""
    first = slip_speed - abs(slip_speed) * first_stiffness * first_deflection / (share * kinetic)
    second = slip_speed - abs(slip_speed) * second_stiffness * second_deflection / ((1.0 - share) * kinetic)
    return normal_force * (first_stiffness * first_deflection + second_stiffness * second_deflection), first, second


def steady(slip_speed, kinetic, share, first_stiffness, second_stiffness):
    """Return the deflections of steady sliding at a slip speed [m/s], zero at rest."""
    sense = 1.0 if slip_speed > 0.0 else -1.0 if slip_speed < 0.0 else 0.0
    return sense * share * kinetic / first_stiffness, sense * (1.0 - share) * kinetic / second_stiffness


def start(slip_speed, kinetic, share, first_stiffness, second_stiffness):
    """Return the deflections at a contact's start at a slip speed [m/s]."""
    part = onset(slip_speed, PRESLIDING_SPEED)
    return part * share * kinetic / first_stiffness, part * (1.0 - share) * kinetic / second_stiffness


@element(
    name="maxwell-slip",
    force=force,
    start=start,
    steady=steady,
    limit=kinetic_limit,
    states=(State("first_deflection", "m"), State("second_deflection", "m")),
    source="Iwan 1966, doi:10.1115/1.3625199 (elements side by side); Dahl 1976, doi:10.2514/3.61511 (each element)",
)
class MaxwellSlip(Friction):
    r"""Friction of two elements side by side that yield one after the other, without a static peak.

    .. math:: z_i' = v - \frac{\sigma_i |v|}{w_i \mu} z_i,\quad F_t = F_n (\sigma_1 z_1 + \sigma_2 z_2),\quad w_1 + w_2 = 1

    The deflections z_i are in m. Each element is one of Dahl's with exponent 1, so that it yields gradually.
    """

    kinetic: Coefficient = 0.05
    share: Annotated[float, Quantity("1", minimum=0.01, maximum=0.99, help="w_1, part of mu of the first element")] = 0.5
    first_stiffness: BristleStiffness = 1e5
    second_stiffness: BristleStiffness = 1e4
