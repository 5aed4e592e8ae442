"""A user-defined controller: a Python function, compiled and called by its address."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.control.controller import Controller
from scissordyn.control.signal import SIGNALS, check_signal
from scissordyn.errors import InputError
from scissordyn.plugin.short_form import Function, ShortForm
from scissordyn.units import Quantity, check_quantities


@dataclass(frozen=True)
class UserController(ShortForm, Controller):
    """A user-defined controller, without internal states.

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
        Delay of the recorded signal [s]; 0 for none.
    recorded : str
        The signal whose value one delay ago is `delayed`: "error", "speed", "sensor_x" ...

    Raises
    ------
    InputError
        If the function cannot be compiled, raises, or gives no finite number for ordinary signals.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""
    delay: Annotated[float, Quantity("s", minimum=0.0, help="delay of the recorded signal")] = 0.0
    recorded: str = ""

    leading: ClassVar[tuple[str, ...]] = ("t", *SIGNALS)
    recursion_gain = 0.0

    def __post_init__(self) -> None:
        check_quantities(self)
        super().__post_init__()
        if (self.delay > 0.0) != bool(self.recorded):
            raise InputError(
                f"UserController with delay = {self.delay:g} s and recorded = {self.recorded!r}", "both or neither of them"
            )
        if self.recorded:
            check_signal("UserController", self.recorded)
        # rest and motion in both senses; sensor and delayed signal zero, as where there are none, or not
        grid = (
            (t, angle, speed, 0.1, error, speed, sensor, -sensor, speed, sensor, delayed, delayed)
            for t, angle, speed, error, sensor, delayed in itertools.product(
                (0.0, 1.0), (0.0, 0.7), (-10.0, 0.0, 10.0), (-3.0, 0.0, 0.01), (0.0, 1e-3), (0.0, 1.0)
            )
        )
        self.probe(grid)
