"""What a controller is."""

from __future__ import annotations

from typing import ClassVar, Protocol, runtime_checkable

from scissordyn.plugin.pointer import PARAMETERS

__all__ = ["PARAMETERS", "Controller"]


@runtime_checkable
class Controller(Protocol):
    """From the signals of an actuator to its torque."""

    name: ClassVar[str]
    tag: ClassVar[int]
    source: ClassVar[str]
    feeds: ClassVar[bool]
    """Whether it makes use of a feed-forward torque."""

    @property
    def states(self) -> tuple[str, ...]:
        """Names of its hidden states, empty for a controller without memory."""

    @property
    def delay(self) -> float:
        """How far back it looks [s]; 0 for not at all."""

    @property
    def recorded(self) -> str:
        """The signal that it looks back at; empty for none."""

    @property
    def memory(self) -> float:
        """R of the recorded S(t) = y(t) + R S(t - T) [1]."""

    @property
    def senses(self) -> bool:
        """Whether it reads the actuator's sensor."""

    def parameters(self) -> tuple[float, ...]:
        """The numbers that the kernel reads, at most `PARAMETERS` of them."""
