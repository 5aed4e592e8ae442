"""No control."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

__all__ = ["NoControl"]


@dataclass(frozen=True)
class NoControl:
    """An actuator that gives no torque: u = 0."""

    name: ClassVar[str] = "none"
    tag: ClassVar[int] = 0
    source: ClassVar[str] = "definition"
    feeds: ClassVar[bool] = False
    states: ClassVar[tuple[str, ...]] = ()
    delay: ClassVar[float] = 0.0
    recorded: ClassVar[str] = ""
    memory: ClassVar[float] = 0.0
    senses: ClassVar[bool] = False

    def parameters(self) -> tuple[float, ...]:
        """Nothing."""
        return ()
