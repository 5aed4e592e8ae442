"""The instants at which a run has samples: equally spaced ones, and with ``samples = "auto"`` those of its contacts too."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.integrate.integration import Samples, StepRecord
from scissordyn.model.options import EQUALLY_SPACED, Options

if TYPE_CHECKING:
    from scissordyn.record.trajectory import Trajectory

MOST_INSTANTS = 20_001  # Most samples of ``samples = "auto"``: ten times the equally spaced ones
ROUNDED = 4.0  # Roundings by which the sum of a start and a duration may miss the instant that was recorded


def sample_times(options: Options, *, curves: bool = False) -> np.ndarray:
    """The equally spaced instants of a run [s], with those of curves if these are wanted too."""
    times = np.linspace(0.0, options.until, options.count)
    return np.union1d(times, np.linspace(0.0, options.until, EQUALLY_SPACED)) if curves else times


def sampled_at(path: Trajectory, times: np.ndarray) -> Trajectory:
    """A trajectory with those of its samples alone that are at some instants."""
    wanted = np.isin(path.samples.time, times)
    return replace(path, samples=Samples(*(part[wanted] for part in path.samples)))


def with_recorded(path: Trajectory) -> Trajectory:
    """A trajectory with the instants among its samples that its integration has kept, so that no curve misses its own peaks.

    These are start, largest force and end of every contact, the located largest values of everything else that is monitored,
    and as many ends of steps as `MOST_INSTANTS` leaves room for.
    """
    table, kept = path.contacts(), path.recorded
    assert kept is not None
    start = table["start"]
    spans = [table[name] for name in ("peak_time", "peak_normal_time", "duration")]
    wanted = np.concatenate([start, *(start + span for span in spans), path.peak["largest_time"]])
    wanted = np.unique(wanted[np.isfinite(wanted) & (wanted >= 0.0) & (wanted <= path.end)])
    time = kept.time.copy()
    if time.size and wanted.size:  # an instant and the one that was recorded for it may differ by rounding
        order = np.argsort(time, kind="stable")
        after = np.clip(np.searchsorted(time[order], wanted), 1, max(1, time.size - 1))
        near = order[np.stack([after - 1, np.minimum(after, time.size - 1)])]
        row = np.where(np.abs(time[near[0]] - wanted) <= np.abs(time[near[1]] - wanted), near[0], near[1])
        same = np.abs(time[row] - wanted) <= ROUNDED * np.spacing(wanted)
        time[row[same]] = wanted[same]
    rows = chosen_rows(path.samples.time, time, wanted)
    parts = (np.concatenate([here, getattr(kept, name)[rows]]) for name, here in path.samples._asdict().items())
    samples = Samples(*parts)._replace(time=np.concatenate([path.samples.time, time[rows]]))
    _, order = np.unique(samples.time, return_index=True)  # of equal instants the first, which is one of the equally spaced
    return replace(path, samples=Samples(*(part[order] for part in samples)))


def nearest_samples(path: Trajectory, times: np.ndarray) -> Samples:
    """Return the samples of a trajectory at given instants, or at the nearest ones that the integration has kept.

    Located largest values are kept, so that they are met to rounding unless a run has too many steps to keep all.

    Shapes: `times` (n,) [s], finite; at least one instant is kept.
    """
    kept: list[Samples | StepRecord] = [path.samples] if path.recorded is None else [path.samples, path.recorded]
    time = np.concatenate([part.time for part in kept])
    order = np.argsort(time, kind="stable")
    after = np.clip(np.searchsorted(time[order], times), 1, max(1, time.size - 1))
    near = order[np.stack([after - 1, np.minimum(after, time.size - 1)])]
    rows = np.where(np.abs(time[near[0]] - times) <= np.abs(time[near[1]] - times), near[0], near[1])
    return Samples(*(np.concatenate([getattr(part, name) for part in kept])[rows] for name in Samples._fields))


def chosen_rows(equal: np.ndarray, time: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Which recorded instants become samples beside equally spaced ones: those that are wanted, and a part of the others."""
    chosen, room = np.zeros(0, int), max(0, MOST_INSTANTS - max(equal.size, EQUALLY_SPACED))
    is_wanted = np.isin(time, wanted)
    for rows in (np.flatnonzero(is_wanted), np.flatnonzero(~is_wanted)):
        if rows.size and room > chosen.size:
            chosen = np.concatenate([chosen, rows[:: -(-rows.size // (room - chosen.size))]])
    return np.sort(chosen)
