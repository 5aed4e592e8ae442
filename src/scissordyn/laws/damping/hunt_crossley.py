"""Hunt and Crossley's damping factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["HuntCrossley"]


@dataclass(frozen=True)
class HuntCrossley:
    r"""Damping that vanishes with the indentation, so that the force starts and ends at zero.

    .. math:: \xi = \tfrac{3}{2} (1 - c_e)
    """

    restitution: Annotated[float, Quantity("1", minimum=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "hunt-crossley"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Hunt, Crossley 1975, doi:10.1115/1.3423596"
    restitution_range: ClassVar[tuple[float, float] | None] = None

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 1.5 * (1.0 - self.restitution)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
