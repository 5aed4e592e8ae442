"""Safaeifar and Farshidianfar's damping factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["SafaeifarFarshidianfar"]


@dataclass(frozen=True)
class SafaeifarFarshidianfar:
    r"""Damping from an energy balance with different approach and rebound curves.

    .. math:: \xi = \frac{5(1-c_e)}{4c_e}
    """

    restitution: Annotated[float, Quantity("1", above=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "safaeifar-farshidianfar"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Safaeifar, Farshidianfar 2020, doi:10.1007/s11044-020-09732-2"
    restitution_range: ClassVar[tuple[float, float] | None] = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 5.0 * (1.0 - self.restitution) / (4.0 * self.restitution)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
