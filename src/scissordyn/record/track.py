"""Motion of tracked points, and the instants from which they stay within their tolerances."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.mechanics.sample import Record
from scissordyn.plan.plan import Plan
from scissordyn.record.results import Variables, described, labels
from scissordyn.record.trajectory import Trajectory

PARTS = ("servo", "bending", "clearance")
"""Causes of deviation of tracked points from the commanded path, in the order in which they are added to the mechanism."""

# Meaning, in a run, of the settling time of a tracked point
SETTLING = "instant from which the deviation of a tracked point stays within its tolerance"


def tracked(plan: Plan, motion: np.ndarray) -> np.ndarray:
    """Return positions, velocities or accelerations of tracked points from a record's X, V or A, shape (nt, tracks, 2)."""
    points = [plan.coordinates.tracked(track).at(motion) for track in plan.mechanism.tracks]
    return np.stack(points, axis=1) if points else np.zeros((len(motion), 0, 2))


def track_variables(path: Trajectory, record: Record) -> Variables:
    """Return position, velocity and acceleration of tracked points along `track`; no variables without tracked points."""
    tracks = path.plan.mechanism.tracks
    if not tracks:
        return {}
    variables = {"track": labels("track", [track.name for track in tracks], "tracked point")}
    for name, rows, units in (("position", record.X, "m"), ("velocity", record.V, "m/s"), ("acceleration", record.A, "m/s^2")):
        text = f"{name} of the tracked point"
        variables[f"track_{name}"] = described(("time", "track", "axis"), tracked(path.plan, rows), units, text)
    return variables


def settling_times(plan: Plan, bands: np.ndarray, end: float) -> np.ndarray:
    """Return the instants from which tracked points stay within their tolerances [s], shape (tracks,)."""
    settled = np.where(np.isnan(bands["last_above"]), 0.0, bands["last_above"])
    settled[settled >= end * (1.0 - 1e-12)] = math.inf
    return np.where([track.tolerance is None for track in plan.mechanism.tracks], math.nan, settled)
