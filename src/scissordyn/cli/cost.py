"""How long a run will take, from a fraction of a second of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scissordyn.run.advance.driver import Driver

TRIED = 0.3
"""Time that is spent on the beginning of a run [s]."""

LONG = 20.0
"""Time from which a run is long enough to say so [s]."""


class TimeIsOverError(Exception):
    """Ends a run after the time that it may take."""


def limited(seconds: float) -> Callable[[float], None]:
    """A function of the progress that ends a run after so many seconds, by `TimeIsOverError`."""
    ends = time.perf_counter() + seconds

    def progress(_: float) -> None:
        if time.perf_counter() > ends:
            raise TimeIsOverError

    return progress


def cost_line(driver: Driver, until: float) -> str:
    """What the run of a new driver will take; empty if that is short or the beginning fails."""
    from scissordyn.run.start.demand import duration

    began = time.perf_counter()
    try:
        driver.advance(until, progress=limited(TRIED))
    except TimeIsOverError:
        pass
    else:
        return ""
    taken, reached, steps = time.perf_counter() - began, driver.time, driver.tried
    if reached <= 0.0 or taken * until / reached < LONG:
        return ""
    total = taken * until / reached
    return (
        f"Cost: about {duration(total)} and {steps * until / reached:.2g} steps on this machine, as the first {steps} steps "
        f"take {taken:.2g} s and reach {reached:.3g} s of {until:g} s; a shorter run: --set run.until=VALUE"
    )
