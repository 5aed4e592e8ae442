"""No damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional

__all__ = ["NoDamping"]


@dataclass(frozen=True)
class NoDamping:
    """A contact without dissipation: xi = 0."""

    name: ClassVar[str] = "none"
    kernel_kind: ClassVar[int] = proportional.KERNEL_KIND
    source: ClassVar[str] = "Hertz 1881"
    restitution_range: ClassVar[tuple[float, float] | None] = None

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 0.0

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
