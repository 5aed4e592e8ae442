"""No friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scissordyn.laws.contact import JointContact
from scissordyn.units import State

__all__ = ["NoFriction"]


@dataclass(frozen=True)
class NoFriction:
    """Two surfaces that slide freely: F_t = 0."""

    name: ClassVar[str] = "none"
    kernel_kind: ClassVar[int] = 0
    source: ClassVar[str] = "definition"
    states: ClassVar[tuple[State, ...]] = ()
    stiff: ClassVar[bool] = False

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Nothing."""
        return ()
