"""The instants of ``samples = "auto"``: equally spaced ones, and those of the contacts themselves."""

from __future__ import annotations

import numpy as np

from scissordyn.run.contacts import columns, contacts
from scissordyn.run.options import EQUALLY_SPACED
from scissordyn.run.trajectory import Trajectory

__all__ = ["MOST_INSTANTS", "own_instants"]

MOST_INSTANTS = 20_001
"""Most samples of ``samples = "auto"``: ten times the equally spaced ones."""

WITHIN = 8
"""Instants inside each contact and each flight of a joint, at most."""


def own_instants(path: Trajectory) -> np.ndarray:
    """Instants at which a trajectory is recorded so that no curve misses its own peaks.

    Equally spaced ones; start, largest force and end of every contact; the located largest values of everything else that is
    monitored; and inside each contact and each flight of a joint as many more as `MOST_INSTANTS` leaves room for.

    Parameters
    ----------
    path : Trajectory
        Of the whole run; it does not depend on its samples.

    Returns
    -------
    ndarray
        Increasing [s].
    """
    table = columns(contacts(path.log, path.peak[: len(path.plan.contacts)]))
    start, end = table["start"], table["start"] + table["duration"]
    end = np.where(np.isfinite(end), end, path.end)
    located = np.concatenate([start, start + table["peak_time"], end, path.peak["largest_time"]])
    parts = [np.linspace(0.0, path.end, EQUALLY_SPACED), located]
    pieces = _pieces(table["joint"], start, end, path.end)
    room = MOST_INSTANTS - EQUALLY_SPACED - located.size
    inside = min(WITHIN, room // max(1, len(pieces)))
    if inside > 0 and len(pieces):
        part = (np.arange(inside) + 1.0) / (inside + 1.0)
        parts.append((pieces[:, :1] + (pieces[:, 1:] - pieces[:, :1]) * part).ravel())
    found = np.unique(np.concatenate(parts))
    found = found[np.isfinite(found) & (found >= 0.0) & (found <= path.end)]
    if (
        found.size > MOST_INSTANTS
    ):  # more contacts than samples: the equally spaced ones stay, and every so manieth of the others
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
