"""The damping factor that returns exactly the restitution that was asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["Exact", "exact_factor"]


def exact_factor(restitution: float) -> float:
    """The root xi in [0, 1/c_e) of ln[(1+xi)/(1-xi c_e)] = xi (1+c_e), to round-off; zero for c_e = 1.

    Parameters
    ----------
    restitution : float
        c_e in (0, 1].

    Returns
    -------
    float
    """
    # in s = xi c_e the bracket is [0, 1) for every c_e. The residual is negative below the root and positive above it;
    # s = 1 - 2^-u resolves the end near 1, where the root lies for soft contacts
    low, high = 0.0, 1060.0
    for _ in range(80):
        u = 0.5 * (low + high)
        rest = 2.0**-u
        xi = -math.expm1(-u * math.log(2.0)) / restitution
        if math.log1p(xi) - math.log(rest) - xi * (1.0 + restitution) < 0.0:
            low = u
        else:
            high = u
    return -math.expm1(-0.5 * (low + high) * math.log(2.0)) / restitution


@dataclass(frozen=True)
class Exact:
    r"""The factor with which a free body, whatever the elastic part, rebounds with c_e times its approach speed.

    .. math:: \ln\frac{1+\xi}{1-\xi c_e} = \xi (1 + c_e)
    """

    restitution: Annotated[float, Quantity("1", above=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "exact"
    tag: ClassVar[int] = proportional.TAG
    source: ClassVar[str] = "Carvalho, Martins 2019, doi:10.1016/j.mechmachtheory.2019.03.028; the root by bisection"
    restitution_range: ClassVar[tuple[float, float] | None] = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """xi [1]."""
        return exact_factor(self.restitution)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """xi [1]."""
        return (self.factor,)
