"""Brown and McPhee's friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.coefficients import Kinetic, Static, static_coefficient
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["BrownMcPhee", "force", "static_limit"]


@dataclass(frozen=True)
class BrownMcPhee:
    r"""Stribeck friction as one smooth function, its peak at the transition speed.

    .. math::
        F_t = F_n \left[\mu_k \tanh\frac{4v}{v_t} + \frac{(\mu_s - \mu_k)\, v/v_t}{\left((v/2v_t)^2 + 3/4\right)^2}\right]

    The viscous part of the source is left out. The static coefficient is 1.5 times the kinetic one unless it is given.
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    transition_speed: Annotated[float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_t, at which friction peaks")] = 1e-3

    name: ClassVar[str] = "brown-mcphee"
    kernel_kind: ClassVar[int] = 6
    source: ClassVar[str] = "Brown, McPhee 2016, doi:10.1115/1.4033658"
    states: ClassVar[tuple[State, ...]] = ()
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("BrownMcPhee", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s and v_t."""
        return self.kinetic, static_coefficient("BrownMcPhee", self.kinetic, self.static), self.transition_speed


@kernel()
def force(v, normal, p):
    """Tangential force [N] at slip speed v [m/s]."""
    s = v / p[2]
    rest = 0.25 * s * s + 0.75
    return normal * (p[0] * math.tanh(4.0 * s) + (p[1] - p[0]) * s / (rest * rest))


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return p[1] * normal
