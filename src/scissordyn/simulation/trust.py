"""The trust horizon: how long two runs at different tolerances tell the same story.

Impacts are chaotic; beyond this horizon a trajectory is a sample of what may happen, not a prediction.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

__all__ = ["PARTING", "TIGHTER", "horizon"]

TIGHTER = 0.1
"""Tolerance of the second run as a fraction of the first."""

PARTING = 0.1
"""Orbits have parted when they differ by this fraction of the clearance."""


def horizon(run: xr.Dataset, tighter: xr.Dataset) -> tuple[float, int]:
    """Until when two runs of the same case agree.

    Parameters
    ----------
    run, tighter : Dataset
        The run and its repetition at a tighter tolerance, sampled at the same instants.

    Returns
    -------
    until : float
        First sampled time at which a journal's orbits differ by more than `PARTING` of its clearance, or the end [s].
    contacts : int
        Number of contacts that started before.
    """
    instants = min(run.sizes["time"], tighter.sizes["time"])
    time = run["time"].values[:instants]
    until = float(time[-1]) if instants else 0.0
    if "eccentricity" in run and instants:
        difference = run["eccentricity"].values[:instants] - tighter["eccentricity"].values[:instants]
        apart = np.hypot(difference[..., 0], difference[..., 1]) / run["clearance"].values
        parted = np.flatnonzero(np.nanmax(apart, axis=1) > PARTING)
        if parted.size:
            until = float(time[parted[0]])
    starts = run["contact_start"].values
    return (until if math.isfinite(until) else 0.0), int(np.sum(starts < until))
