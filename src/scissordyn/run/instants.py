"""Sample times of a run: equally spaced instants; ``samples = "auto"`` adds the instants of its contacts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.integrate.integration import Samples, StepRecord
from scissordyn.model.options import DEFAULT_SAMPLES, Options

if TYPE_CHECKING:
    from scissordyn.record.trajectory import Trajectory

SAMPLES_MAX = 20_001  # Largest number of samples with ``samples = "auto"``: ten times the equally spaced samples


def sample_times(options: Options, *, curves: bool = False) -> np.ndarray:
    """Return the equally spaced sample times of a run [s]; with `curves`, also those that smooth curves need."""
    times = np.linspace(0.0, options.until, options.count)
    return np.union1d(times, np.linspace(0.0, options.until, DEFAULT_SAMPLES)) if curves else times


def select_samples(path: Trajectory, times: np.ndarray) -> Trajectory:
    """Return a trajectory with only those samples that are at given times."""
    is_selected = np.isin(path.samples.time, times)
    return replace(path, samples=Samples(*(part[is_selected] for part in path.samples)))


def add_recorded_samples(path: Trajectory) -> Trajectory:
    """Add recorded instants to the samples of a trajectory, so that no curve misses its own peaks.

    These are the start, largest force and end of every contact, the located largest values of all other monitored quantities,
    and ends of steps, up to `SAMPLES_MAX` samples.
    """
    table, recorded = path.contacts, path.recorded
    assert recorded is not None
    start = table["start"]
    spans = [table[name] for name in ("peak_time", "peak_normal_time", "duration")]
    peak_times = np.concatenate([start, *(start + span for span in spans), path.peak["largest_time"]])
    peak_times = np.unique(peak_times[np.isfinite(peak_times) & (peak_times >= 0.0) & (peak_times <= path.end)])
    time = recorded.time.copy()
    if time.size and peak_times.size:  # a requested instant and its recorded instant may differ by rounding
        rows = _nearest_rows(time, peak_times)
        same = np.abs(time[rows] - peak_times) <= 4.0 * np.spacing(peak_times)
        time[rows[same]] = peak_times[same]
    rows = choose_rows(path.samples.time, time, peak_times)
    parts = (np.concatenate([here, getattr(recorded, name)[rows]]) for name, here in path.samples._asdict().items())
    samples = Samples(*parts)._replace(time=np.concatenate([path.samples.time, time[rows]]))
    _, order = np.unique(samples.time, return_index=True)  # of equal instants the first is kept; it is an equally spaced one
    return replace(path, samples=Samples(*(part[order] for part in samples)))


def nearest_samples(path: Trajectory, times: np.ndarray) -> Samples:
    """Return the samples of a trajectory at given times, or at the nearest recorded times.

    Located largest values are recorded, so that they are reached to rounding unless a run has too many steps to record all.

    Shapes: `times` (n,) [s], finite; at least one instant must be recorded.
    """
    sources: list[Samples | StepRecord] = [path.samples] if path.recorded is None else [path.samples, path.recorded]
    rows = _nearest_rows(np.concatenate([part.time for part in sources]), times)
    increasing = np.argsort(rows, kind="stable")
    in_samples = np.searchsorted(rows[increasing], path.samples.time.size)
    source_rows = [rows[increasing[:in_samples]], rows[increasing[in_samples:]] - path.samples.time.size]
    order = np.argsort(increasing)  # only the wanted rows are copied, as a record can be long
    columns = [[getattr(part, name)[at] for part, at in zip(sources, source_rows, strict=False)] for name in Samples._fields]
    return Samples(*(np.concatenate(column)[order] for column in columns))


def _nearest_rows(time: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the index in `time` of the instant nearest to each of `times`; of equally near ones the earlier."""
    order = np.argsort(time, kind="stable")
    after = np.clip(np.searchsorted(time[order], times), 1, max(1, time.size - 1))
    near = order[np.stack([after - 1, np.minimum(after, time.size - 1)])]
    return np.asarray(np.where(np.abs(time[near[0]] - times) <= np.abs(time[near[1]] - times), near[0], near[1]))


def choose_rows(equal: np.ndarray, time: np.ndarray, preferred: np.ndarray) -> np.ndarray:
    """Return the indices of those recorded instants `time` that become samples, the `preferred` ones first.

    With the equally spaced instants `equal` there are at most `SAMPLES_MAX` samples.
    """
    chosen, room = np.zeros(0, int), max(0, SAMPLES_MAX - max(equal.size, DEFAULT_SAMPLES))
    is_preferred = np.isin(time, preferred)
    for rows in (np.flatnonzero(is_preferred), np.flatnonzero(~is_preferred)):
        if rows.size and room > chosen.size:
            chosen = np.concatenate([chosen, rows[:: -(-rows.size // (room - chosen.size))]])
    return np.sort(chosen)
