"""Deviation of tracked points from the commanded path, split into the parts due to servos, bending and clearance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scissordyn.mechanics.monitored import TRACK_DEVIATION
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.plan.plan import plan as make_plan
from scissordyn.record.ideal_path import IdealPath
from scissordyn.record.results import Run, Variables, along, described, labels
from scissordyn.record.track import PARTS, SETTLING, settling_times, tracked
from scissordyn.record.trajectory import Trajectory
from scissordyn.run.instants import nearest_samples
from scissordyn.run.trajectory import compute


def deviation_variables(run: Run, path: Trajectory, ideal: IdealPath, options: Options) -> Variables:
    """Return the distance of the tracked points from the commanded path, and the parts of this deviation."""
    place = ideal.at(run["time"].values)
    positions = along(run["track_position"], "time", "track", "axis")
    difference = positions - place
    peaks = path.peaks(TRACK_DEVIATION)
    parts, at_peaks = _parts(path, ideal, options, run["time"].values, positions, peaks["largest_time"])
    about = "distance of the tracked point from its position on the commanded path of the rigid ideal mechanism"
    columns = (
        ("peak_track_deviation", peaks["largest"], "m", f"largest {about}"),
        ("peak_track_deviation_time", peaks["largest_time"], "s", f"when the {about} is largest"),
        ("rms_track_deviation", path.root_mean_squares(TRACK_DEVIATION), "m", f"r.m.s. {about}"),
        ("settling_time", settling_times(path.plan, path.bands(TRACK_DEVIATION), path.end), "s", SETTLING),
    )
    unknown = ideal.end < path.end * (1.0 - 1e-9)
    of_parts = "what servos, bending and clearance add to the deviation of the tracked point"
    return {
        "part": labels("part", PARTS, "cause of a deviation"),
        "deviation_part": described(("time", "track", "part", "axis"), np.moveaxis(parts, 0, 2), "m", of_parts),
        "peak_deviation_part": described(("track", "part", "axis"), at_peaks, "m", f"{of_parts} when it is largest"),
        "track_deviation": described(("time", "track"), np.hypot(*np.moveaxis(difference, -1, 0)), "m", about),
        **{
            name: described("track", np.full_like(values, np.nan) if unknown else values, units, text)
            for name, values, units, text in columns
        },
    }


def _parts(
    path: Trajectory, ideal: IdealPath, options: Options, time: np.ndarray, positions: np.ndarray, peak_times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of deviations at the samples, and at the instant of each track's largest deviation.

    Shapes: `time` (nt,) [s], `positions` (nt, tracks, 2) [m], `peak_times` (tracks,) [s]; returns (parts, nt, tracks, 2) and
    (tracks, parts, 2) [m], NaN where the instant is not known.
    """
    at_peaks = np.full((peak_times.size, len(PARTS), 2), np.nan)
    has_peak_time = np.isfinite(peak_times)
    if not time.size or not has_peak_time.any():
        return deviation_parts(ideal, path.plan.mechanism, options, time, positions), at_peaks
    kept = nearest_samples(path, peak_times[has_peak_time])
    places = tracked(path.plan, replace(path, samples=kept).record().X)
    all_times, first = np.unique(np.concatenate([time, kept.time]), return_index=True)
    parts = deviation_parts(ideal, path.plan.mechanism, options, all_times, np.concatenate([positions, places])[first])
    rows, tracks = np.searchsorted(all_times, kept.time), np.flatnonzero(has_peak_time)
    at_peaks[tracks] = np.moveaxis(parts[:, rows, tracks], 0, 1)
    return parts[:, np.searchsorted(all_times, time)], at_peaks


def deviation_parts(path: IdealPath, mechanism: Mechanism, options: Options, times: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the parts of the deviation due to servos, bars that bend and clearance, shape (parts, time, tracks, 2) [m].

    Each part is the change of position when its cause is added to the mechanism. The parts add up to the deviation.
    """
    before, previous = path.stages[0], path.at(times)
    parts = np.zeros((len(PARTS), *previous.shape))
    start: StartKind = "static" if options.start == "static" else "concentric"
    until = max(float(times[-1]), 1e-12) if times.size else options.until
    calm = replace(options, start=start, method="auto", trust=False, step=None, samples=2, until=until)
    for number, stage in enumerate((*path.stages[1:], mechanism)):
        if stage is before:
            continue
        positions = at
        if stage is not mechanism:
            run = compute(make_plan(stage), calm, times=times, monitor=False)
            if run.status == "interrupted":
                raise KeyboardInterrupt
            reached = tracked(run.plan, run.record().X)
            positions = np.full(previous.shape, np.nan)
            positions[: len(reached)] = reached
        parts[number] = positions - previous
        before, previous = stage, positions
    return parts
