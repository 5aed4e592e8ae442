"""Dahl friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.bristle import PRESLIDING_SPEED, BristleStiffness, onset
from scissordyn.laws.friction.coefficients import Coefficient
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["Dahl", "force", "start", "static_limit", "steady"]


@dataclass(frozen=True)
class Dahl:
    r"""Friction as the force of elastic surfaces that yield gradually, without a static peak.

    .. math:: z' = v \left|1 - \frac{\sigma_0 z}{\mu}\operatorname{sgn} v\right|^n
        \operatorname{sgn}\left(1 - \frac{\sigma_0 z}{\mu}\operatorname{sgn} v\right),\quad F_t = F_n \sigma_0 z

    bristle_deflection z is in m.
    """

    kinetic: Coefficient = 0.05
    bristle_stiffness: BristleStiffness = 1e5
    shape: Annotated[float, Quantity("1", minimum=0.5, maximum=4.0, help="exponent n, 1 for most materials")] = 1.0

    name: ClassVar[str] = "dahl"
    kernel_kind: ClassVar[int] = 8
    source: ClassVar[str] = "Dahl 1976, doi:10.2514/3.61511"
    states: ClassVar[tuple[State, ...]] = (State("bristle_deflection", "m"),)
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu, sigma_0 and n."""
        return self.kinetic, self.bristle_stiffness, self.shape


@kernel()
def force(v, normal, z, dz, p):
    """Tangential force [N]; writes z' [m/s] into dz[0]. z[0] is the bristle deflection [m]."""
    rest = 1.0 - p[1] * z[0] / p[0] * math.copysign(1.0, v)
    dz[0] = v * rest if p[2] == 1.0 else v * math.copysign(abs(rest) ** p[2], rest)
    return normal * p[1] * z[0]


@kernel()
def steady(v, z, p):
    """Deflection of steady sliding at slip speed v [m/s], none at rest."""
    z[0] = math.copysign(p[0], v) / p[1] if v != 0.0 else 0.0


@kernel()
def start(v, z, p):
    """Deflection at a contact's start at slip speed v [m/s]."""
    z[0] = onset(v, PRESLIDING_SPEED) * p[0] / p[1]


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return p[0] * normal
