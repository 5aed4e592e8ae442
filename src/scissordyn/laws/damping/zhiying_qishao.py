"""Zhiying and Qishao's damping factor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.units import Quantity, check_quantities

__all__ = ["ZhiyingQishao"]


@dataclass(frozen=True)
class ZhiyingQishao:
    r"""Lankarani and Nikravesh's factor, raised for soft contacts.

    .. math:: \xi = \tfrac{3}{4} (1 - c_e^2) e^{2(1-c_e)}
    """

    restitution: Annotated[float, Quantity("1", minimum=0.0, maximum=1.0, help="restitution coefficient c_e")] = 0.9

    name: ClassVar[str] = "zhiying-qishao"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Qin (Zhiying), Lu (Qishao) 2006, Journal of Dynamics and Control 4, 294-298"
    restitution_range: ClassVar[tuple[float, float] | None] = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 0.75 * (1.0 - self.restitution**2) * math.exp(2.0 * (1.0 - self.restitution))

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
