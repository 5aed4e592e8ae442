"""Ambrosio's modified Coulomb friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.errors import InputError
from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import Coefficient
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["Ambrosio", "force", "static_limit"]


@dataclass(frozen=True)
class Ambrosio:
    r"""Coulomb friction whose sign change is a ramp between two slip speeds.

    .. math:: F_t = \mu c_d F_n \operatorname{sgn} v,\quad c_d = \min(1, \max(0, (|v|-v_0)/(v_1-v_0)))

    The citation could not be verified.
    """

    kinetic: Coefficient = 0.05
    dead_speed: Annotated[float, Quantity("m/s", minimum=0.0, maximum=10.0, help="v_0, below which there is no friction")] = (
        1e-4
    )
    full_speed: Annotated[float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_1, above which friction is Coulomb's")] = (
        1e-3
    )

    name: ClassVar[str] = "ambrosio"
    kernel_kind: ClassVar[int] = 2
    source: ClassVar[str] = "Ambrosio 2003"
    states: ClassVar[tuple[State, ...]] = ()
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.full_speed <= self.dead_speed:
            raise InputError(
                f"Ambrosio: full_speed = {self.full_speed:g} m/s not above dead_speed = {self.dead_speed:g} m/s",
                "full_speed > dead_speed",
            )

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu, v_0, v_1."""
        return self.kinetic, self.dead_speed, self.full_speed


@kernel()
def force(v, normal, p):
    """Tangential force [N] at slip speed v [m/s]."""
    ramp = min(1.0, max(0.0, (abs(v) - p[1]) / (p[2] - p[1])))
    return math.copysign(p[0] * ramp * normal, v)


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return p[0] * normal
