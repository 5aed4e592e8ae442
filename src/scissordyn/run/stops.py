"""Period of a drive, and stops of a run at given times, with what the run has done since the last stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from scissordyn.components.time_function import ConstantSpeed, Harmonic
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.advance.driver import Driver
from scissordyn.run.trajectory import advance_to


def drive_period(mechanism: Mechanism) -> float:
    """Return the period of a mechanism's only periodic drive [s]."""
    # a rotation at constant speed is periodic, a growing distance is not
    driving: tuple[Any, ...] = (*mechanism.drives, *mechanism.coordinate_drives)
    turning = (drive.motion for drive in driving if isinstance(drive.motion, ConstantSpeed))
    periods = {2.0 * math.pi / abs(motion.speed) for motion in turning if motion.speed != 0.0}
    motions = [part.motion for part in (*driving, *mechanism.rods)]
    periods |= {2.0 * math.pi / motion.angular_frequency for motion in motions if isinstance(motion, Harmonic)}
    if len(periods) != 1:
        raise InputError(
            f"the drives have {len(periods)} periods" if periods else "no drive is periodic",
            "one drive with a harmonic motion or a constant speed, or the argument `period` in Python",
            'harmonic = { mean = "45 deg", amplitude = "15 deg", angular_frequency = "3 Hz" } in [drive]',
        )
    return periods.pop()


class Stop(NamedTuple):
    """State of a run at one stop; the driver holds log, totals and peaks since the last stop."""

    number: int  # index of the stop, from 0
    begin: float  # time of the last stop [s]
    mode: np.ndarray  # modes of the guards at the last stop
    steps: int  # accepted steps since the last stop
    cause: str  # reason why the stop was not reached, or ""


def stops(
    driver: Driver,
    times: Iterable[float],
    most_steps: int,
    *,
    resets: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Iterator[Stop]:
    """Advance a driver to each time in turn and yield there; the last stop is the first that was not reached.

    With `resets` the event log, totals, peaks and the count of steps start from zero after each stop. The caller may change or
    restore the driver between two stops. A time that the driver has already passed is a stop without a step.
    """
    for number, until in enumerate(times):
        begin, mode, steps = driver.time, driver.state.mode.copy(), int(driver.state.counts["steps"][0])
        if resets:
            driver.clear_record()
        since = driver.steps_tried if resets else 0
        cause = advance_to(driver, until, most_steps, progress, since=since) if until > begin else ""
        yield Stop(number, begin, mode, int(driver.state.counts["steps"][0]) - steps, cause)
        if cause:
            return
