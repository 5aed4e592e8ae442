"""Kelvin and Voigt's dashpot beside the spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import dashpot
from scissordyn.units import Quantity, check_quantities

__all__ = ["KelvinVoigt"]


@dataclass(frozen=True)
class KelvinVoigt:
    r"""A linear dashpot with a given constant.

    .. math:: F_n = F_{el} + C \delta'

    The force is discontinuous at the start of the contact, and zero where it would be negative.
    """

    coefficient: Annotated[float, Quantity("N*s/m", minimum=0.0, maximum=1e12, help="damping coefficient C")] = 1e3

    name: ClassVar[str] = "kelvin-voigt"
    kernel_kind: ClassVar[int] = dashpot.KERNEL_KIND
    source: ClassVar[str] = "Goldsmith 1960, Impact"
    restitution_range: ClassVar[tuple[float, float] | None] = None

    def __post_init__(self) -> None:
        check_quantities(self)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """C [N s/m]."""
        return (self.coefficient,)
