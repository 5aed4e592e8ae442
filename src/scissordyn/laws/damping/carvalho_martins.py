"""Carvalho and Martins's damping factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["CarvalhoMartins"]


@dataclass(frozen=True)
class CarvalhoMartins:
    r"""A rational fit of the exact factor.

    .. math:: \xi = \tfrac{3}{2} (1 - c_e) \frac{11 - c_e}{1 + 9c_e}
    """

    restitution: Annotated[float, Quantity("1", minimum=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "carvalho-martins"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Carvalho, Martins 2019, doi:10.1016/j.mechmachtheory.2019.03.028"
    restitution_range: ClassVar[tuple[float, float] | None] = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 1.5 * (1.0 - self.restitution) * (11.0 - self.restitution) / (1.0 + 9.0 * self.restitution)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
