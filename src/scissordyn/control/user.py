"""A user's own controller: a plain Python function, compiled and called by its address."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.control.signal import SIGNALS, check_signal
from scissordyn.errors import InputError
from scissordyn.plugin.pointer import USER
from scissordyn.plugin.user_compile import Function, probe, row
from scissordyn.plugin.user_file import pinned
from scissordyn.units import Quantity, check_quantities

__all__ = ["UserController"]

LEADING = ("t", *SIGNALS)


@dataclass(frozen=True)
class UserController:
    """A controller of the user's own, without hidden states.

    Parameters
    ----------
    function : callable or str
        ``f(t, reference_angle, reference_speed, reference_acceleration, error, speed, sensor_x, sensor_y, sensor_rate_x,
        sensor_rate_y, delayed, feed_forward, *constants)``, in SI units, to N m; or ``"file.py:f"``.
    constants : tuple of float
        Further arguments of the function.
    digest : str
        Of the file that holds the function, so that a saved run cannot silently run an edited one; that of the file as it is
        now if not given.
    delay : float
        How far back it looks [s]; 0 for not at all.
    recorded : str
        The signal that it looks back at: "error", "speed", "sensor_x" ...; its value one delay ago is `delayed`.

    Raises
    ------
    InputError
        If the function cannot be compiled, raises, or gives no finite number for ordinary signals.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""
    delay: Annotated[float, Quantity("s", minimum=0.0, help="how far back it looks")] = 0.0
    recorded: str = ""

    name: ClassVar[str] = "user"
    tag: ClassVar[int] = USER
    source: ClassVar[str] = "the user"
    feeds: ClassVar[bool] = True
    states: ClassVar[tuple[str, ...]] = ()
    memory: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self)
        object.__setattr__(self, "digest", pinned(self.function, self.digest))
        if (self.delay > 0.0) != bool(self.recorded):
            raise InputError(
                f"UserController with delay = {self.delay:g} s and recorded = {self.recorded!r}", "both or neither of them"
            )
        if self.recorded:
            check_signal("UserController", self.recorded)
        # rest and motion either way; a sensor and a past that are zero, as where there are none, or not
        grid = (
            (t, angle, speed, 0.1, error, speed, sensor, -sensor, speed, sensor, past, past)
            for t, angle, speed, error, sensor, past in itertools.product(
                (0.0, 1.0), (0.0, 0.7), (-10.0, 0.0, 10.0), (-3.0, 0.0, 0.01), (0.0, 1e-3), (0.0, 1.0)
            )
        )
        probe("controller", self.function, self.digest, self.constants, LEADING, grid)

    @property
    def senses(self) -> bool:
        """Whether the recorded signal is the sensor's; what the function itself reads is not known."""
        return self.recorded.startswith("sensor")

    def parameters(self) -> tuple[float, ...]:
        """Address of the compiled function in this process, then the constants."""
        return row("controller", self.function, self.digest, self.constants, LEADING)
