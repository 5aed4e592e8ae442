"""No control."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scissordyn.units import State

__all__ = ["NoControl"]


@dataclass(frozen=True)
class NoControl:
    """An actuator without torque: u = 0."""

    name: ClassVar[str] = "none"
    kernel_kind: ClassVar[int] = 0
    source: ClassVar[str] = "definition"
    uses_feed_forward: ClassVar[bool] = False
    states: ClassVar[tuple[State, ...]] = ()
    delay: ClassVar[float] = 0.0
    recorded: ClassVar[str] = ""
    recursion_gain: ClassVar[float] = 0.0
    uses_sensor: ClassVar[bool] = False

    def parameters(self) -> tuple[float, ...]:
        """Nothing."""
        return ()
