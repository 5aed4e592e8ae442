"""Tracked points: their motion, and when they settle within their tolerance."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.mechanics.outputs import Record
from scissordyn.plan.plan import Plan
from scissordyn.record.results import Variables, described, labels
from scissordyn.record.trajectory import Trajectory

PARTS = ("servo", "bending", "clearance")
"""What lets tracked points leave the commanded path, in the order in which it is added."""

SETTLING = "from when on the deviation of a tracked point stays within its tolerance"


def tracked(plan: Plan, motion: np.ndarray) -> np.ndarray:
    """Return the tracked points in a record's X, V or A, shape (nt, tracks, 2)."""
    points = [plan.coordinates.tracked(track).at(motion) for track in plan.mechanism.tracks]
    return np.stack(points, axis=1) if points else np.zeros((len(motion), 0, 2))


def track_variables(path: Trajectory, record: Record) -> Variables:
    """Return position, velocity and acceleration of the tracked points, along `track`; nothing without tracked points."""
    tracks = path.plan.mechanism.tracks
    if not tracks:
        return {}
    variables = {"track": labels("track", [track.name for track in tracks], "tracked point")}
    for name, rows, units in (("position", record.X, "m"), ("velocity", record.V, "m/s"), ("acceleration", record.A, "m/s^2")):
        text = f"{name} of the tracked point"
        variables[f"track_{name}"] = described(("time", "track", "axis"), tracked(path.plan, rows), units, text)
    return variables


def settling_times(plan: Plan, bands: np.ndarray, end: float) -> np.ndarray:
    """Return the instants from which the tracked points stay within their tolerances [s], shape (tracks,)."""
    settled = np.where(np.isnan(bands["last_above"]), 0.0, bands["last_above"])
    settled[settled >= end * (1.0 - 1e-12)] = math.inf
    return np.where([track.tolerance is None for track in plan.mechanism.tracks], math.nan, settled)
