"""Motion of tracked points, and their deviation from the ideal mechanism on the same drive."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from scissordyn.mechanics.outputs import Record
from scissordyn.mechanics.point_map import PointMap
from scissordyn.mechanics.reduced_model import ReducedModel
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.track import Track
from scissordyn.simulation.trajectory import Trajectory

__all__ = ["ideal_deviation", "track_variables"]

Variables = dict[str, xr.Variable]


def _map(reduced: ReducedModel, track: Track) -> PointMap:
    if isinstance(track.point, str):
        return reduced.place((track.body, track.point))
    return reduced.at(track.body, track.point)


def track_variables(path: Trajectory, found: Record) -> Variables:
    """Position, velocity and acceleration of the tracked points, along `track`; nothing if there are none.

    Parameters
    ----------
    path : Trajectory
    found : Record

    Returns
    -------
    dict of str to Variable
    """
    tracks = path.reduced.mechanism.tracks
    if not tracks:
        return {}
    maps = [_map(path.reduced, track) for track in tracks]
    dims = ("time", "track", "axis")
    variables: Variables = {
        "track": xr.Variable(("track",), np.array([track.name for track in tracks]), {"long_name": "tracked point"})
    }
    for name, rows, units in (("position", found.X, "m"), ("velocity", found.V, "m/s"), ("acceleration", found.A, "m/s^2")):
        values = np.stack([each.at(rows) for each in maps], axis=1)
        text = f"{name} of the tracked point"
        variables[f"track_{name}"] = xr.Variable(dims, values, {"units": units, "long_name": text})
    return variables


def ideal_deviation(mechanism: Mechanism, run: xr.Dataset, ideal: xr.Dataset) -> Variables:
    """Distance of the tracked points from where they are in the ideal mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    run, ideal : Dataset
        Of the mechanism, and of the same with ideal joints at the same instants, or at the first of them.

    Returns
    -------
    dict of str to Variable
        `track_deviation` along time and track [m], NaN where the ideal mechanism does not reach; its largest sample
        `peak_track_deviation` along track.
    """
    apart = np.full((run.sizes["time"], len(mechanism.tracks)), np.nan)
    reached = min(run.sizes["time"], ideal.sizes["time"])
    difference: Any = run["track_position"].values[:reached] - ideal["track_position"].values[:reached]
    apart[:reached] = np.hypot(difference[..., 0], difference[..., 1])
    about = "distance of the tracked point from where it is in the ideal mechanism"
    largest = np.array([np.max(column[np.isfinite(column)], initial=0.0) for column in apart.T])
    return {
        "track_deviation": xr.Variable(("time", "track"), apart, {"units": "m", "long_name": about}),
        "peak_track_deviation": xr.Variable(("track",), largest, {"units": "m", "long_name": f"largest sampled {about}"}),
    }
