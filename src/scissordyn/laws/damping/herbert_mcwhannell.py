"""Herbert and McWhannell's damping factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["HerbertMcWhannell"]


@dataclass(frozen=True)
class HerbertMcWhannell:
    r"""Damping whose energy loss is found along the approach curve of the damped contact.

    .. math:: \xi = \frac{6(1-c_e)}{(2c_e-1)^2 + 3}
    """

    restitution: Annotated[float, Quantity("1", minimum=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "herbert-mcwhannell"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Herbert, McWhannell 1977, doi:10.1115/1.3439270"
    restitution_range: ClassVar[tuple[float, float] | None] = None

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 6.0 * (1.0 - self.restitution) / ((2.0 * self.restitution - 1.0) ** 2 + 3.0)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
