"""Lee and Wang's damping factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["LeeWang"]


@dataclass(frozen=True)
class LeeWang:
    r"""Half of Hunt and Crossley's damping, for intermittent motion mechanisms.

    .. math:: \xi = \tfrac{3}{4} (1 - c_e)
    """

    restitution: Annotated[float, Quantity("1", minimum=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "lee-wang"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Lee, Wang 1983, J. Mech. Transm. Autom. Des. 105, 534-540"
    restitution_range: ClassVar[tuple[float, float] | None] = None

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 0.75 * (1.0 - self.restitution)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
