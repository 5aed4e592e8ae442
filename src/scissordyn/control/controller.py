"""Base class of controllers."""

from __future__ import annotations

from typing import Any

from scissordyn.control.signal import SIGNALS
from scissordyn.plugin.element import SLOTS, Part, Slot, arguments_of
from scissordyn.units import State

DEFAULTS = {"delay": 0.0, "recorded": "", "recursion_gain": 0.0}  # Values of attributes of a controller without a delay


class Controller(Part):
    """Base of controllers, which compute the torque [N m] of an actuator and the rates of internal states from signals.

    The kernel's argument names select its signals. `recorded` is the present value of the recorded signal y. `delayed` is the
    value of S(t) = y(t) + R S(t - T) one delay ago.
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
    """Signal whose delayed value is used; empty for none."""
    recursion_gain: float
    """Weight R of S(t - T) [1]."""

    @property
    def states(self) -> tuple[State, ...]:
        """Internal states; empty if there are none."""
        states: tuple[State, ...] = self.declaration.states
        return states

    def _uses(self, signal: str) -> bool:
        """Return whether a kernel has an argument whose name begins with `signal`."""
        kernels: Any = self.declaration.kernels.values()
        return any(name.startswith(signal) for kernel in kernels for name in arguments_of(kernel))

    @property
    def uses_feed_forward(self) -> bool:
        return self._uses("feed_forward")

    @property
    def uses_sensor(self) -> bool:
        """True if the controller uses the actuator's sensor."""
        return self.recorded.startswith("sensor") or self._uses("sensor")


SLOTS[Controller.slot.name] = Controller
