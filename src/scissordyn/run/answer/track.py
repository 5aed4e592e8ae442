"""Motion of tracked points, and their deviation from the commanded path."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.mechanics.monitored import TRACK_DEVIATION
from scissordyn.mechanics.outputs import Record
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.trajectory import Trajectory
from scissordyn.run.options import Options
from scissordyn.run.results import Run, Variables, along, described, labels
from scissordyn.run.start.ideal_path import PARTS, IdealPath, deviation_parts

SETTLING = "from when on the deviation of a tracked point stays within its tolerance"


def track_variables(path: Trajectory, record: Record) -> Variables:
    """Position, velocity and acceleration of the tracked points, along `track`; nothing if there are none."""
    tracks = path.plan.mechanism.tracks
    if not tracks:
        return {}
    maps = [path.plan.coordinates.tracked(track) for track in tracks]
    variables = {"track": labels("track", [track.name for track in tracks], "tracked point")}
    for name, rows, units in (("position", record.X, "m"), ("velocity", record.V, "m/s"), ("acceleration", record.A, "m/s^2")):
        values = np.stack([tracked.at(rows) for tracked in maps], axis=1)
        variables[f"track_{name}"] = described(("time", "track", "axis"), values, units, f"{name} of the tracked point")
    return variables


def deviation_variables(run: Run, path: Trajectory, ideal: IdealPath, options: Options) -> Variables:
    """Distance of the tracked points from where they are on the commanded path, and what adds to it."""
    place = ideal.at(run["time"].values)
    positions = along(run["track_position"], "time", "track", "axis")
    difference = positions - place
    parts = deviation_parts(ideal, path.plan.mechanism, options, run["time"].values, positions)
    about = "distance of the tracked point from where it is on the commanded path of the rigid ideal mechanism"
    peaks = path.peaks(TRACK_DEVIATION)
    # an integral of squares that are round-off may end below zero
    mean = np.sqrt(np.maximum(peaks["square"], 0.0) / path.end) if path.end > 0.0 else peaks["largest"]
    columns = (
        ("peak_track_deviation", peaks["largest"], "m", f"largest {about}"),
        ("peak_track_deviation_time", peaks["largest_time"], "s", f"when the {about} is largest"),
        ("rms_track_deviation", mean, "m", f"r.m.s. {about}"),
        ("settling_time", settling_times(path.plan, path.bands(TRACK_DEVIATION), path.end), "s", SETTLING),
    )
    unknown = ideal.end < path.end * (1.0 - 1e-9)
    of_parts = "what servos, bending and clearance add to the deviation of the tracked point"
    return {
        "part": labels("part", PARTS, "cause of a deviation"),
        "deviation_part": described(("time", "track", "part", "axis"), np.moveaxis(parts, 0, 2), "m", of_parts),
        "track_deviation": described(("time", "track"), np.hypot(*np.moveaxis(difference, -1, 0)), "m", about),
        **{
            name: described("track", np.full_like(values, np.nan) if unknown else values, units, text)
            for name, values, units, text in columns
        },
    }


def settling_times(plan: Plan, bands: np.ndarray, end: float) -> np.ndarray:
    """From when on the tracked points stay within their tolerances [s], shape (tracks,)."""
    settled = np.where(np.isnan(bands["last_above"]), 0.0, bands["last_above"])
    settled[settled >= end * (1.0 - 1e-12)] = math.inf
    return np.where([track.tolerance is None for track in plan.mechanism.tracks], math.nan, settled)
