"""What a controller is."""

from __future__ import annotations

from typing import ClassVar, Protocol, runtime_checkable

from scissordyn.units import State

__all__ = ["Controller"]


@runtime_checkable
class Controller(Protocol):
    """From the signals of an actuator to its torque."""

    name: ClassVar[str]
    source: ClassVar[str]

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
    def uses_feed_forward(self) -> bool:
        """Whether it uses a feed-forward torque."""

    @property
    def uses_sensor(self) -> bool:
        """Whether it uses the actuator's sensor."""

    def parameters(self) -> tuple[float, ...]:
        """The numbers that the kernel reads."""
