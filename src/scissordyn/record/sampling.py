"""Time means and subsets of samples, which may be unequally spaced."""

from __future__ import annotations

import numpy as np

from scissordyn.errors import InputError
from scissordyn.model.options import Options
from scissordyn.record.results import Run
from scissordyn.tolerance import DATA_TOL


def is_whole(run: Run, options: Options | None) -> bool:
    """Return True if the samples of a run last from its start to its end, so that its largest values and integrals hold.

    A run that ended early may last longer than its last sample, by less than the distance of two samples.
    """
    time, end = np.atleast_1d(run["time"].values), float(run.attrs["end"])
    early = options is not None and run.attrs["status"] != "complete"
    gap_max = options.until / (options.count - 1) if options is not None and early else DATA_TOL * end
    return bool(time[0] == 0.0 and time[-1] >= end - gap_max) if time.size else end <= gap_max


def check_whole(run: Run, options: Options | None, what: str) -> None:
    """Raise `InputError` for part of a run: its largest values, contacts and integrals would be those of the whole run."""
    if not is_whole(run, options):
        time = np.atleast_1d(run["time"].values)
        samples_text = f"with samples from {time[0]:.6g} s to {time[-1]:.6g} s" if time.size else "without samples"
        raise InputError(
            f"{what} of part of a run, {samples_text}, which lasts from 0 to {float(run.attrs['end']):.6g} s",
            "the whole run; for contacts in part of it sd.contact_statistics",
            "sd.contact_statistics(run, after=0.1, until=0.2)",
        )


def equally_spaced(time: np.ndarray) -> bool:
    step = np.diff(time)
    return bool(step.size == 0 or np.ptp(step) <= DATA_TOL * float(np.mean(step)))


def time_mean(values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the time mean over the first axis by the trapezoidal rule; a single sample is its own mean."""
    if time.size == 1:
        return np.asarray(values[0], float)
    return np.asarray(np.trapezoid(values.astype(float), time, axis=0) / (time[-1] - time[0]))


def spread_samples(time: np.ndarray, count: int) -> np.ndarray:
    """Return the indices of `count` samples spread evenly over time, including the first and the last sample."""
    if equally_spaced(time):
        return np.unique(np.linspace(0, time.size - 1, count).round().astype(int))
    times = np.linspace(time[0], time[-1], count)
    after = np.clip(np.searchsorted(time, times), 1, time.size - 1)
    return np.unique(after - (times - time[after - 1] < time[after] - times))
