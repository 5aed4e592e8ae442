"""What a controller is."""

from __future__ import annotations

from typing import Any

from scissordyn.control.signal import SIGNALS
from scissordyn.plugin.element import SLOTS, Part, Slot, arguments_of
from scissordyn.units import State

DEFAULTS = {"delay": 0.0, "recorded": "", "recursion_gain": 0.0}


class Controller(Part):
    """From the signals of an actuator to its torque [N m], and the rates of its states.

    Its kernel names the signals that it uses; `recorded` is the present value of the recorded signal, `delayed` the one of
    S(t) = y(t) + R S(t - T) a delay ago.
    """

    slot = Slot(
        "controller",
        SIGNALS,
        {"torque": (len(SIGNALS), "force")},
        ("time", "recorded"),
        DEFAULTS,
        stateful=True,
        title="controller",
    )
    delay: float
    """Delay of the recorded signal [s]; 0 for none."""
    recorded: str
    """The signal whose delayed value it uses; empty for none."""
    recursion_gain: float
    """R [1]."""

    @property
    def states(self) -> tuple[State, ...]:
        """Its internal states; empty for none."""
        states: tuple[State, ...] = self.declaration.states
        return states

    def _uses(self, signal: str) -> bool:
        """Whether the kernel names a signal."""
        kernels: Any = self.declaration.kernels.values()
        return any(name.startswith(signal) for kernel in kernels for name in arguments_of(kernel))

    @property
    def uses_feed_forward(self) -> bool:
        return self._uses("feed_forward")

    @property
    def uses_sensor(self) -> bool:
        """Whether it uses the actuator's sensor."""
        return self.recorded.startswith("sensor") or self._uses("sensor")


SLOTS[Controller.slot.name] = Controller
