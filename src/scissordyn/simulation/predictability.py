"""The predictability horizon: the time until which two runs at different tolerances agree.

Motion with impacts can be chaotic; beyond the horizon a trajectory is one sample of a distribution, not a prediction.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

__all__ = ["DIVERGENCE", "TIGHTER", "predictability_horizon"]

TIGHTER = 0.1
"""Tolerance of the second run as a fraction of the first."""

DIVERGENCE = 0.1
"""Difference of two orbits, as a fraction of the clearance, from which on they count as diverged."""


def predictability_horizon(run: xr.Dataset, tighter: xr.Dataset) -> tuple[float, int]:
    """Time until which two runs of the same case agree.

    Parameters
    ----------
    run, tighter : Dataset
        The run and its repetition at a tighter tolerance, sampled at the same instants.

    Returns
    -------
    until : float
        First sampled time at which a journal's orbits differ by more than `DIVERGENCE` of its clearance, or the end [s].
    contacts : int
        Number of contacts that started before it.
    """
    instants = min(run.sizes["time"], tighter.sizes["time"])
    time = run["time"].values[:instants]
    until = float(time[-1]) if instants else 0.0
    if "eccentricity" in run and instants:
        difference = run["eccentricity"].values[:instants] - tighter["eccentricity"].values[:instants]
        apart = np.hypot(difference[..., 0], difference[..., 1]) / run["clearance"].values
        diverged = np.flatnonzero(np.nanmax(apart, axis=1) > DIVERGENCE)
        if diverged.size:
            until = float(time[diverged[0]])
    starts = run["contact_start"].values
    return (until if math.isfinite(until) else 0.0), int(np.sum(starts < until))
