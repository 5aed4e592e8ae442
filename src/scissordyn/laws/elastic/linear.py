"""A linear spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.units import Quantity, check_quantities

__all__ = ["Linear", "energy", "force"]


@dataclass(frozen=True)
class Linear:
    r"""A spring of constant stiffness.

    .. math:: F = k \delta
    """

    stiffness: Annotated[float, Quantity("N/m", minimum=1e-3, maximum=1e15, help="k")] = 1e9

    name: ClassVar[str] = "linear"
    kernel_kind: ClassVar[int] = 4
    source: ClassVar[str] = "definition"
    small_contact: ClassVar[bool] = False
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    caveat: ClassVar[str] = ""

    def __post_init__(self) -> None:
        check_quantities(self)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The stiffness [N/m]."""
        return (self.stiffness,)


@kernel()
def force(delta, p):
    """Force [N] at indentation delta > 0 [m]."""
    return p[0] * delta


@kernel()
def energy(delta, p):
    """Work [J] to press in by delta [m]."""
    return 0.5 * p[0] * delta * delta
