"""Threlfall's friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import Coefficient
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["Threlfall", "force", "static_limit"]


@dataclass(frozen=True)
class Threlfall:
    r"""Coulomb friction approached exponentially.

    .. math:: F_t = \mu F_n (1 - e^{-3|v|/v_0}) \operatorname{sgn} v

    At v_0 it is 95 % of Coulomb's; the exponential is used beyond, where some printings have a constant.

    The citation could not be verified.
    """

    kinetic: Coefficient = 0.05
    ramp_speed: Annotated[
        float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_0, at which friction is 95 % of Coulomb's")
    ] = 1e-3

    name: ClassVar[str] = "threlfall"
    kernel_kind: ClassVar[int] = 4
    source: ClassVar[str] = "Threlfall 1978"
    states: ClassVar[tuple[State, ...]] = ()
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Coefficient mu and v_0."""
        return self.kinetic, self.ramp_speed


@kernel()
def force(v, normal, p):
    """Tangential force [N] at slip speed v [m/s]."""
    return math.copysign(p[0] * normal * -math.expm1(-3.0 * abs(v) / p[1]), v)


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return p[0] * normal
