"""Time means and subsets of samples, which may be unequally spaced."""

from __future__ import annotations

import numpy as np

from scissordyn.tolerance import DATA_TOL


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
    wanted = np.linspace(time[0], time[-1], count)
    after = np.clip(np.searchsorted(time, wanted), 1, time.size - 1)
    return np.unique(after - (wanted - time[after - 1] < time[after] - wanted))
