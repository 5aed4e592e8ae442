"""The instants of ``samples = "auto"``: equally spaced ones, and those of the contacts themselves."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.run.advance.trajectory import Trajectory
from scissordyn.run.answer.contacts import columns
from scissordyn.run.options import EQUALLY_SPACED

if TYPE_CHECKING:
    import xarray as xr

MOST_INSTANTS = 20_001
"""Most samples of ``samples = "auto"``: ten times the equally spaced ones."""

WITHIN = 8
"""Instants inside each contact and each flight of a joint, at most."""


def of_trajectory(path: Trajectory) -> np.ndarray:
    """The instants of a trajectory; see `own_instants`."""
    table = columns(path.contacts())
    further = np.concatenate([path.peak["largest_time"], table["start"] + table["peak_normal_time"]])
    return own_instants(table["joint"], table["start"], table["peak_time"], table["duration"], further, path.end)


def of_run(run: xr.Dataset) -> np.ndarray:
    """The instants of a run, from its table of contacts and its located largest values; see `own_instants`."""
    names = [name for name in run.variables if re.search("peak_.*_time$", str(name)) and run[name].dims != ("contact",)]
    located = [run[name].values.ravel() for name in names]
    joint = np.unique(run["contact_joint"].values, return_inverse=True)[1]
    start, peak, duration = (run[name].values for name in ("contact_start", "peak_time", "contact_duration"))
    further = np.concatenate([start + run["peak_normal_time"].values, *located])
    return own_instants(joint, start, peak, duration, further, float(run.attrs["end"]))


def own_instants(
    joint: np.ndarray, start: np.ndarray, peak: np.ndarray, duration: np.ndarray, further: np.ndarray, last: float
) -> np.ndarray:
    """Instants at which a run is recorded so that no curve misses its own peaks.

    Equally spaced ones; start, largest force and end of every contact; the located largest values of everything else that is
    monitored; and inside each contact and each flight of a joint as many more as `MOST_INSTANTS` leaves room for.

    Shapes: `joint` (contacts,), `start, peak, duration` (contacts,) [s].
    """
    end = np.where(np.isfinite(duration), start + duration, last)
    located = np.concatenate([start, start + peak, end, further])
    parts = [np.linspace(0.0, last, EQUALLY_SPACED), located]
    pieces = _pieces(joint, start, end, last)
    room = MOST_INSTANTS - EQUALLY_SPACED - located.size
    inside = min(WITHIN, room // max(1, len(pieces)))
    if inside > 0 and len(pieces):
        part = (np.arange(inside) + 1.0) / (inside + 1.0)
        parts.append((pieces[:, :1] + (pieces[:, 1:] - pieces[:, :1]) * part).ravel())
    found = np.unique(np.concatenate(parts))
    found = found[np.isfinite(found) & (found >= 0.0) & (found <= last)]
    if found.size > MOST_INSTANTS:  # more contacts than samples: the equally spaced ones stay, and a part of the others
        further = np.setdiff1d(found, parts[0])
        kept = further[:: -(-further.size // (MOST_INSTANTS - EQUALLY_SPACED))]
        found = np.union1d(parts[0], kept)
    return np.asarray(found)


def _pieces(joint: np.ndarray, start: np.ndarray, end: np.ndarray, last: float) -> np.ndarray:
    """Starts and ends of the contacts and of the flights between them, joint by joint, shape (pieces, 2) [s]."""
    found = [np.empty((0, 2))]
    for number in np.unique(joint):
        here = joint == number
        edges = np.concatenate([[0.0], np.stack([start[here], end[here]], axis=1).ravel(), [last]])
        found.append(np.stack([edges[:-1], edges[1:]], axis=1))
    pieces = np.concatenate(found)
    return pieces[pieces[:, 1] > pieces[:, 0]]
