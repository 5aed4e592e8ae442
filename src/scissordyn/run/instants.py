"""Sample times of a run: equally spaced instants; ``samples = "auto"`` adds the instants of its contacts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.integrate.integration import Samples, StepRecord
from scissordyn.model.options import DEFAULT_SAMPLES, Options

if TYPE_CHECKING:
    from scissordyn.record.trajectory import Trajectory

SAMPLES_MAX = 20_001  # [samples] largest number with ``samples = "auto"``: ten times the equally spaced samples


def sample_times(options: Options, *, curves: bool = False) -> np.ndarray:
    """Return the equally spaced sample times of a run [s]; with `curves`, also those that smooth curves need."""
    times = np.linspace(0.0, options.until, options.count)
    return np.union1d(times, np.linspace(0.0, options.until, DEFAULT_SAMPLES)) if curves else times


def select_samples(path: Trajectory, times: np.ndarray) -> Trajectory:
    """Return a trajectory with only those samples that are at given times."""
    wanted = np.isin(path.samples.time, times)
    return replace(path, samples=Samples(*(part[wanted] for part in path.samples)))


def add_recorded_samples(path: Trajectory) -> Trajectory:
    """Add recorded instants to the samples of a trajectory, so that no curve misses its own peaks.

    These are the start, largest force and end of every contact, the located largest values of all other monitored quantities,
    and ends of steps, up to `SAMPLES_MAX` samples.
    """
    table, kept = path.contacts, path.recorded
    assert kept is not None
    start = table["start"]
    spans = [table[name] for name in ("peak_time", "peak_normal_time", "duration")]
    wanted = np.concatenate([start, *(start + span for span in spans), path.peak["largest_time"]])
    wanted = np.unique(wanted[np.isfinite(wanted) & (wanted >= 0.0) & (wanted <= path.end)])
    time = kept.time.copy()
    if time.size and wanted.size:  # a requested instant and its recorded instant may differ by rounding
        order = np.argsort(time, kind="stable")
        after = np.clip(np.searchsorted(time[order], wanted), 1, max(1, time.size - 1))
        near = order[np.stack([after - 1, np.minimum(after, time.size - 1)])]
        row = np.where(np.abs(time[near[0]] - wanted) <= np.abs(time[near[1]] - wanted), near[0], near[1])
        same = np.abs(time[row] - wanted) <= 4.0 * np.spacing(wanted)
        time[row[same]] = wanted[same]
    rows = choose_rows(path.samples.time, time, wanted)
    parts = (np.concatenate([here, getattr(kept, name)[rows]]) for name, here in path.samples._asdict().items())
    samples = Samples(*parts)._replace(time=np.concatenate([path.samples.time, time[rows]]))
    _, order = np.unique(samples.time, return_index=True)  # of equal instants the first is kept; it is an equally spaced one
    return replace(path, samples=Samples(*(part[order] for part in samples)))


def nearest_samples(path: Trajectory, times: np.ndarray) -> Samples:
    """Return the samples of a trajectory at given times, or at the nearest recorded times.

    Located largest values are recorded, so that they are reached to rounding unless a run has too many steps to record all.

    Shapes: `times` (n,) [s], finite; at least one instant must be recorded.
    """
    kept: list[Samples | StepRecord] = [path.samples] if path.recorded is None else [path.samples, path.recorded]
    time = np.concatenate([part.time for part in kept])
    order = np.argsort(time, kind="stable")
    after = np.clip(np.searchsorted(time[order], times), 1, max(1, time.size - 1))
    near = order[np.stack([after - 1, np.minimum(after, time.size - 1)])]
    rows = np.where(np.abs(time[near[0]] - times) <= np.abs(time[near[1]] - times), near[0], near[1])
    increasing = np.argsort(rows, kind="stable")
    in_samples = np.searchsorted(rows[increasing], path.samples.time.size)
    taken = [rows[increasing[:in_samples]], rows[increasing[in_samples:]] - path.samples.time.size]
    order = np.argsort(increasing)  # only the wanted rows are copied, as a record can be long
    columns = [[getattr(part, name)[at] for part, at in zip(kept, taken, strict=False)] for name in Samples._fields]
    return Samples(*(np.concatenate(column)[order] for column in columns))


def choose_rows(equal: np.ndarray, time: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the indices of those recorded instants `time` that become samples, the `wanted` ones first.

    With the equally spaced instants `equal` there are at most `SAMPLES_MAX` samples.
    """
    chosen, room = np.zeros(0, int), max(0, SAMPLES_MAX - max(equal.size, DEFAULT_SAMPLES))
    is_wanted = np.isin(time, wanted)
    for rows in (np.flatnonzero(is_wanted), np.flatnonzero(~is_wanted)):
        if rows.size and room > chosen.size:
            chosen = np.concatenate([chosen, rows[:: -(-rows.size // (room - chosen.size))]])
    return np.sort(chosen)
