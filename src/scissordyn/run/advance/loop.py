"""Time loop: calls of the compiled loop, slice by slice, with change points, growing arrays and Ctrl-C between calls."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Sequence

import numpy as np

from scissordyn.integrate import advance as loop
from scissordyn.run.advance.change_point import step_across
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.interrupt import check_interrupt
from scissordyn.run.advance.system import advance_systems

SLICE_STEPS_MAX = 20_000  # Largest number of time steps between two checks of Ctrl-C; results do not depend on it

CALL_SECONDS = 0.1
"""Target duration of one call of the compiled time loop [s]; Python handles Ctrl-C only between two calls."""

# statuses of the time loop that mean: an array is too short
FULL_STATUSES = (loop.LOG_FULL, loop.HISTORY_FULL, loop.RECORD_FULL)

# statuses of the time loop from which a driver can advance further
UNFINISHED = (loop.ADVANCING, loop.CHANGE_POINT, *FULL_STATUSES)


def advance_together(drivers: Sequence[Driver], until: float, most_steps: int) -> list[int]:
    """Advance each driver towards a time by at most `most_steps` steps, in one call of the loop; return their statuses."""
    for driver in drivers:
        driver.state.clock["end"] = until
    statuses = np.zeros(len(drivers), np.int64)
    addresses = (np.array(column, np.int64) for column in zip(*(driver.addresses for driver in drivers), strict=True))
    advance_systems(*addresses, most_steps, statuses)
    return list(map(int, statuses))


def next_slice(steps: int, seconds: float, most: int) -> int:
    """Return the number of steps of the next call, from the duration of the last one; the results do not depend on it."""
    return max(1, min(int(steps * CALL_SECONDS / max(seconds, 1e-9)), 2 * steps, most))


def advance(
    driver: Driver, until: float, *, most_steps: int = 50_000_000, progress: Callable[[float], None] | None = None
) -> int:
    """Advance a driver to a time, across change points and with growing arrays; return the status of the loop."""
    status, left = loop.ADVANCING, most_steps
    while status == loop.ADVANCING and left > 0:
        before, called = driver.steps_tried, clocks.perf_counter()
        if driver.state.clock["longest"][0] < 0.0 and not step_across(driver, until):
            return loop.STEP_TOO_SMALL
        status = advance_together([driver], until, min(driver.slice_steps, left))[0]
        taken = driver.steps_tried - before
        left -= max(1, taken)
        if status == loop.ADVANCING:
            driver.slice_steps = next_slice(taken, clocks.perf_counter() - called, SLICE_STEPS_MAX)
        if status == loop.CHANGE_POINT:
            status = loop.ADVANCING
        if status in FULL_STATUSES:
            driver.grow(status)
            status = loop.ADVANCING
        check_interrupt()
        if progress is not None:
            progress(driver.time)
    return status
