"""The largest value of a smooth sampled curve, between its samples."""

from __future__ import annotations

import math

import numpy as np


def smooth_peak(time: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """The vertex of the parabola through the largest sample and its two neighbours.

    Of a curve without impacts, such as a reaction of the ideal mechanism; what impacts make peaks of is located by the
    integrator. With 500 samples a period the error is below 1e-7 of the value.

    Shapes: `time` (nt,) [s], `values` (nt,).
    """
    if not np.isfinite(values).any():
        return math.nan, math.nan
    k = int(np.nanargmax(values))
    if not 0 < k < values.size - 1 or not np.isfinite(values[k - 1 : k + 2]).all():
        return float(values[k]), float(time[k])
    before, here, after = values[k - 1 : k + 2].tolist()
    bend = before - 2.0 * here + after
    if not bend < 0.0:
        return here, float(time[k])
    shift = 0.5 * (before - after) / bend
    return here - 0.25 * (before - after) * shift, float(time[k] + shift * (time[k + 1] - time[k]))
