"""Hu and Guo's damping factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["HuGuo"]


@dataclass(frozen=True)
class HuGuo:
    r"""Damping for the whole range of restitution, its energy balance taken over approach and rebound.

    .. math:: \xi = \frac{3(1-c_e)}{2c_e}
    """

    restitution: Annotated[float, Quantity("1", above=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "hu-guo"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Hu, Guo 2015, doi:10.1007/s11044-015-9453-z"
    restitution_range: ClassVar[tuple[float, float] | None] = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 1.5 * (1.0 - self.restitution) / self.restitution

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
