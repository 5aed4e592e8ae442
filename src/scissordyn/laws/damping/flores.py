"""Flores, Machado, Silva and Martins's damping factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["Flores"]


@dataclass(frozen=True)
class Flores:
    r"""Damping for the whole range of restitution coefficients.

    .. math:: \xi = \frac{8(1-c_e)}{5c_e}
    """

    restitution: Annotated[float, Quantity("1", above=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "flores"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Flores et al. 2011, doi:10.1007/s11044-010-9237-4"
    restitution_range: ClassVar[tuple[float, float] | None] = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 8.0 * (1.0 - self.restitution) / (5.0 * self.restitution)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
