"""Agreement of a run with curves measured over time."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import xarray as xr

from scissordyn.annotation import shown
from scissordyn.errors import InputError
from scissordyn.file.export import TimeColumn, time_columns

CONTACT_VARIABLES = ("normal_force", "indentation", "friction_force")
"""Variables that are zero without contact; an event of such a variable is a rise above 5 % of its largest value."""


@dataclass(frozen=True)
class Measured:
    """Record of one or several measured quantities over time, without gaps.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Increasing instants [s].
    headings : tuple of str
        Names of the quantities as in the columns of `file.export.time_table`, without units: "angle of arm".
    values : ndarray, shape (n, quantities)
        Values in SI units.
    units : tuple of str
        SI units of the quantities.
    name : str
        Source of the record, for messages.
    """

    time: np.ndarray
    headings: tuple[str, ...]
    values: np.ndarray
    units: tuple[str, ...]
    name: str = "data"

    def __post_init__(self) -> None:
        for name in ("time", "values"):
            if not (isinstance(values := getattr(self, name), np.ndarray) and values.dtype.kind in "fiu"):
                raise InputError(f"{name} = {shown(values)}", "an array of numbers", "np.array([0.0, 0.1])")
        for name in ("headings", "units"):
            if not (isinstance(texts := getattr(self, name), tuple | list) and all(isinstance(text, str) for text in texts)):
                raise InputError(f"{name} = {shown(texts)}", "a tuple of texts, one per column")
        if self.time.size < 2:
            raise InputError(f"'{self.name}' has {self.time.size} instants", "at least two")
        if self.values.shape != (self.time.size, len(self.headings)) or len(self.units) != len(self.headings):
            raise InputError(
                f"'{self.name}' has values of shape {self.values.shape}", "one row per instant, one column per quantity"
            )
        if not (np.isfinite(self.time).all() and np.isfinite(self.values).all()):
            raise InputError(f"'{self.name}' has a value that is not a finite number", "finite numbers")
        backwards = np.flatnonzero(np.diff(self.time) <= 0.0)
        if backwards.size:
            k = int(backwards[0]) + 1
            raise InputError(
                f"'{self.name}': the time does not increase from {self.time[k - 1]:.9g} s to {self.time[k]:.9g} s",
                "increasing instants",
            )

    def column(self, heading: str) -> np.ndarray:
        """Return the measured values of one quantity at all n instants [SI units], shape (n,)."""
        return np.asarray(self.values[:, self.headings.index(heading)])

    def rows(self, first: int, last: int) -> Measured:
        """Return the part of the record from row `first` to row `last` - 1."""
        return self._of(slice(first, last))

    def every(self, step: int) -> Measured:
        """Return a record of every `step`-th row, from the first row."""
        return self._of(slice(None, None, step))

    def _of(self, part: slice) -> Measured:
        return replace(self, time=self.time[part], values=self.values[part])

    def segments(self, duration: float) -> list[Measured]:
        """Divide the record into parts of about equally many instants, two or more, each about `duration` long [s]."""
        parts = max(1, round((self.time[-1] - self.time[0]) / duration))
        cuts = np.linspace(0, self.time.size, min(parts, self.time.size // 2) + 1).round().astype(int)
        return [self.rows(a, b) for a, b in pairwise(cuts.tolist())]


def agreement(run: xr.Dataset, record: Measured) -> xr.Dataset:
    r"""Compute measures of agreement of a run with measured curves, over the common time.

    The measured values are m, those of the run r (linear between its samples), at n instants:

    * rmse: root mean square of r - m; nrmse: rmse divided by the range of m.
    * bias: mean of r - m.
    * correlation: Pearson correlation of r and m.
    * explained: 1 - sum (r - m)^2 / sum (m - mean m)^2 (Nash and Sutcliffe 1970); 1 for equal curves, 0 for a run that is no
      better than the mean.
    * peak_error: largest \|r\| minus largest \|m\|, divided by the latter.
    * peak_lag: time of the largest \|r\| minus time of the largest \|m\| [s]. For contact forces, peak_error and peak_lag use
      the peaks that the integrator located between samples.
    * events: number of rises of m above 5 % of its largest value for contact forces and indentations, above the middle of its
      range for other quantities; run_events: the same for r.
    * matched_events: number of pairs of mutually nearest events; event_lag: mean of run time minus measured time of the pairs
      [s]; event_deviation: root mean square of these differences [s].
    """
    columns = {column.heading: column for column in time_columns(run)}
    time = run["time"].values
    both = (record.time >= time[0]) & (record.time <= time[-1])
    if np.sum(both) < 3:
        ends = (f"from {ends_of[0]:g} s to {ends_of[-1]:g} s" for ends_of in (record.time, time))
        raise InputError(
            f"'{record.name}' {next(ends)} and a run {next(ends)} have {int(np.sum(both))} instants in common",
            "at least 3: times since the start of the run",
        )
    instants = record.time[both]
    rows, curves = [], []
    for heading in record.headings:
        if heading not in columns:
            raise InputError(f"the run has no quantity '{heading}'", "a column that 'scissordyn export' writes for this run")
        shown = np.interp(instants, time, columns[heading].of(run).astype(float))
        curves.append(shown)
        measured = record.column(heading)[both]
        rows.append(
            _measures(instants, measured, shown, columns[heading].variable, _located_peak(run, columns[heading], instants))
        )
    result = xr.Dataset(
        {name: ("column", np.array([row[name] for row in rows])) for name in rows[0]},
        coords={"column": np.array(record.headings, dtype=str), "time": instants},
        attrs={"title": "scissordyn agreement", "left_out": int(np.sum(~both))},
    )
    result["measured"] = (("time", "column"), record.values[both])
    result["run"] = (("time", "column"), np.column_stack(curves))
    result["column_unit"] = ("column", np.array(record.units, dtype=str))
    return result


def _located_peak(run: xr.Dataset, column: TimeColumn, instants: np.ndarray) -> tuple[float, float] | None:
    """Return the largest normal force of a joint between the samples, and its time; None for any other quantity."""
    if column.variable != "normal_force" or "peak_normal_force" not in run:
        return None
    joint = str(run["joint"].values[column.index[0]])
    when = run["contact_start"].values + run["peak_normal_time"].values
    here = (run["contact_joint"].values.astype(str) == joint) & (when >= instants[0]) & (when <= instants[-1])
    if not here.any():
        return None
    k = int(np.argmax(np.where(here, run["peak_normal_force"].values, -np.inf)))
    return float(run["peak_normal_force"].values[k]), float(when[k])


def _measures(
    time: np.ndarray, measured: np.ndarray, shown: np.ndarray, variable: str, located_peak: tuple[float, float] | None
) -> dict[str, float]:
    """Return the measures of agreement of one quantity by name, as `agreement` defines them."""
    difference = shown - measured
    spread, span = measured - measured.mean(), float(np.ptp(measured))
    square = float(spread @ spread)
    covariance, of_run = float(spread @ (shown - shown.mean())), float(np.sum((shown - shown.mean()) ** 2))
    rmse = math.sqrt(float(np.mean(difference**2)))
    at, mine = int(np.argmax(np.abs(measured))), int(np.argmax(np.abs(shown)))
    peak, run_peak = (
        float(abs(measured[at])),
        (float(abs(shown[mine])), float(time[mine])) if located_peak is None else located_peak,
    )
    level = (
        0.05 * float(np.max(measured)) if variable in CONTACT_VARIABLES else float(0.5 * (np.max(measured) + np.min(measured)))
    )
    events, run_events = rises(time, measured, level), rises(time, shown, level)
    lags = matched_events(events, run_events)
    return {
        "rmse": rmse,
        "nrmse": rmse / span if span else math.nan,
        "bias": float(np.mean(difference)),
        "correlation": covariance / math.sqrt(square * of_run) if square and of_run else math.nan,
        "explained": 1.0 - float(difference @ difference) / square if square else math.nan,
        "peak_error": (run_peak[0] - peak) / peak if peak else math.nan,
        "peak_lag": run_peak[1] - float(time[at]),
        "events": float(events.size),
        "run_events": float(run_events.size),
        "matched_events": float(lags.size),
        "event_lag": float(np.mean(lags)) if lags.size else math.nan,
        "event_deviation": math.sqrt(float(np.mean(lags**2))) if lags.size else math.nan,
    }


def rises(time: np.ndarray, values: np.ndarray, level: float) -> np.ndarray:
    """Return the times at which a curve, linear between its samples, rises above a level [s]."""
    k = np.flatnonzero((values[:-1] <= level) & (values[1:] > level))
    part = (level - values[k]) / (values[k + 1] - values[k])
    return np.asarray(time[k] + part * (time[k + 1] - time[k]))


def matched_events(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the time differences (second minus first) of pairs of mutually nearest events [s]."""
    if not first.size or not second.size:
        return np.empty(0)
    distance = np.abs(first[:, None] - second[None])
    nearest, back = np.argmin(distance, axis=1), np.argmin(distance, axis=0)
    pairs = [(i, j) for i, j in enumerate(nearest.tolist()) if back[j] == i]
    return np.array([second[j] - first[i] for i, j in pairs])
