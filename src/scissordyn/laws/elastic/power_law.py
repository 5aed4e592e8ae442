"""A power law with given constants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic import power
from scissordyn.units import Quantity, check_quantities

__all__ = ["PowerLaw"]


@dataclass(frozen=True)
class PowerLaw:
    r"""A spring that hardens with a constant exponent.

    .. math:: F = K \delta^n

    K is in N/m^n; the default is Hertz's stiffness of a steel joint with R_B = 10 mm and c = 0.5 mm.
    """

    coefficient: Annotated[float, Quantity("1", minimum=1e-3, maximum=1e40, help="K, in N/m^n with the n given here")] = 6.61e10
    exponent: Annotated[float, Quantity("1", minimum=0.5, maximum=5.0, help="n")] = 1.5

    name: ClassVar[str] = "power"
    kernel_kind: ClassVar[int] = power.KERNEL_KIND
    source: ClassVar[str] = "definition; K as in Flores and co-workers 2006"
    small_contact: ClassVar[bool] = False
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    caveat: ClassVar[str] = ""

    def __post_init__(self) -> None:
        check_quantities(self)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """K [N/m^n] and n."""
        return self.coefficient, self.exponent
