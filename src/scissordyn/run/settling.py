"""From when on tracked points stay within their tolerances."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.plan.plan import Plan

__all__ = ["SETTLING", "settling_times"]

SETTLING = "from when on the deviation of a tracked point stays within its tolerance"


def settling_times(plan: Plan, bands: np.ndarray, end: float) -> np.ndarray:
    """From when on the tracked points stay within their tolerances [s].

    Parameters
    ----------
    plan : Plan
    bands : ndarray of BAND, shape (tracks,)
    end : float
        End of the run [s].

    Returns
    -------
    ndarray, shape (tracks,)
        0 for one that never leaves its tolerance, infinite for one that is not within it at the end; NaN without a tolerance.
    """
    found = np.where(np.isnan(bands["last_above"]), 0.0, bands["last_above"])
    found[found >= end * (1.0 - 1e-12)] = math.inf
    return np.where([track.tolerance is None for track in plan.tracks], math.nan, found)
