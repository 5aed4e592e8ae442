"""Interpolation between samples: cubic Hermite polynomials from values and their rates."""

from __future__ import annotations

import numpy as np
import xarray as xr

from scissordyn.analysis.variable import Variable

RATES = {
    "slider_position": "slider_velocity",
    "slider_velocity": "slider_acceleration",
    "position": "velocity",
    "velocity": "acceleration",
    "angle": "angular_velocity",
    "angular_velocity": "angular_acceleration",
}
"""Recorded variables whose rate of change is recorded too."""

Ends = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Value and rate at the start of an interval, value and rate at its end."""


def cubic(s: np.ndarray, step: np.ndarray, ends: Ends) -> np.ndarray:
    """The cubic with given values and rates at both ends of an interval.

    Its error is y''''(t) h^4/384 at most (Davis 1975, Interpolation and Approximation).
    """
    y0, r0, y1, r1 = ends
    value: np.ndarray = (
        (1.0 + 2.0 * s) * (1.0 - s) ** 2 * y0
        + s * (1.0 - s) ** 2 * step * r0
        + s**2 * (3.0 - 2.0 * s) * y1
        + s**2 * (s - 1.0) * step * r1
    )
    return value


def slope(s: np.ndarray, step: np.ndarray, ends: Ends) -> np.ndarray:
    """The rate of change of `cubic`; parameters as there."""
    y0, r0, y1, r1 = ends
    rate: np.ndarray = 6.0 * s * (1.0 - s) * (y1 - y0) / step + (1.0 - s) * (1.0 - 3.0 * s) * r0 + s * (3.0 * s - 2.0) * r1
    return rate


def interpolate(run: xr.Dataset, when: np.ndarray, dim: str) -> dict[str, Variable]:
    """Interpolated variables of a run between its samples.

    Shapes: `when` (n,) [s].
    """
    time = run["time"].values
    left = np.clip(np.searchsorted(time, when, side="right") - 1, 0, time.size - 2)
    step = time[left + 1] - time[left]
    part = (when - time[left]) / step
    variables: dict[str, Variable] = {}
    for name, rate in RATES.items():
        if name not in run or rate not in run:
            continue
        ordered = run[name].transpose("time", ...)
        values, rates = ordered.values, run[rate].transpose(*ordered.dims).values
        ends = values[left], rates[left], values[left + 1], rates[left + 1]
        across = (slice(None), *[None] * (values.ndim - 1))
        dims = (dim, *(str(other) for other in ordered.dims[1:]))
        variables[name] = dims, cubic(part[across], step[across], ends), dict(run[name].attrs)
        if rate not in RATES:
            variables[rate] = dims, slope(part[across], step[across], ends), dict(run[rate].attrs)
    return variables
