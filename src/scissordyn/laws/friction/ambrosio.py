"""Ambrosio's modified Coulomb friction."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.errors import InputError
from scissordyn.laws.contact import Friction
from scissordyn.laws.friction.coefficients import Coefficient, kinetic_limit
from scissordyn.plugin.element import element
from scissordyn.units import Quantity, check_quantities


def force(slip_speed, normal_force, kinetic, dead_speed, full_speed):
    """Return the tangential force [N] at a slip speed [m/s]."""
    ramp = min(1.0, max(0.0, (abs(slip_speed) - dead_speed) / (full_speed - dead_speed)))
    return math.copysign(kinetic * ramp * normal_force, slip_speed)


@element(name="ambrosio", force=force, limit=kinetic_limit, source="Ambrosio 2003")
class Ambrosio(Friction):
    r"""Coulomb friction whose sign change is a ramp between two slip speeds.

    .. math:: F_t = \mu c_d F_n \operatorname{sgn} v,\quad c_d = \min(1, \max(0, (|v|-v_0)/(v_1-v_0)))

    The citation could not be verified.
    """

    kinetic: Coefficient = 0.05
    dead_speed: Annotated[float, Quantity("m/s", minimum=0.0, maximum=10.0, help="v_0, below which friction is zero")] = 1e-4
    full_speed: Annotated[float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_1, above which friction is Coulomb's")] = (
        1e-3
    )

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.full_speed <= self.dead_speed:
            raise InputError(
                f"Ambrosio: full_speed = {self.full_speed:g} m/s not above dead_speed = {self.dead_speed:g} m/s",
                "full_speed > dead_speed",
            )
