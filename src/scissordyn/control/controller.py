"""What a controller is."""

from __future__ import annotations

from typing import ClassVar, Protocol, runtime_checkable

from scissordyn.plugin.pointer import PARAMETERS
from scissordyn.units import State

__all__ = ["PARAMETERS", "Controller"]


@runtime_checkable
class Controller(Protocol):
    """From the signals of an actuator to its torque."""

    name: ClassVar[str]
    kernel_kind: ClassVar[int]
    source: ClassVar[str]
    uses_feed_forward: ClassVar[bool]
    """Whether it uses a feed-forward torque."""

    @property
    def states(self) -> tuple[State, ...]:
        """Its internal states; empty for none."""

    @property
    def delay(self) -> float:
        """Delay of the recorded signal [s]; 0 for none."""

    @property
    def recorded(self) -> str:
        """The signal whose delayed value it uses; empty for none."""

    @property
    def recursion_gain(self) -> float:
        """R in the recorded S(t) = y(t) + R S(t - T) [1]."""

    @property
    def uses_sensor(self) -> bool:
        """Whether it uses the actuator's sensor."""

    def parameters(self) -> tuple[float, ...]:
        """The numbers that the kernel reads, at most `PARAMETERS` of them."""
