"""From when on tracked points stay within their tolerances."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.plan.plan import Plan

SETTLING = "from when on the deviation of a tracked point stays within its tolerance"


def settling_times(plan: Plan, bands: np.ndarray, end: float) -> np.ndarray:
    """From when on the tracked points stay within their tolerances [s].

    Shapes: `bands` (tracks,); returns (tracks,).
    """
    found = np.where(np.isnan(bands["last_above"]), 0.0, bands["last_above"])
    found[found >= end * (1.0 - 1e-12)] = math.inf
    return np.where([track.tolerance is None for track in plan.tracks], math.nan, found)
