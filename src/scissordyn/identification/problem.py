"""The least-squares problem of a fit: free numbers, runs beside the records, weighted residuals and their derivatives."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError, command
from scissordyn.file.export import TimeColumn, time_columns
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import Place, changed_all, find, number
from scissordyn.plan.plan import plan
from scissordyn.record.dataset import results
from scissordyn.run.trajectory import compute, recorded
from scissordyn.studies.ask.distribution import Interval, Normal, Variation

if TYPE_CHECKING:
    from scissordyn.identification.start import Chart

TURN = 2.0 * math.pi


class FailedRunError(Exception):
    """A run that did not reach the end of its record."""


KINEMATIC = {
    f"{rate}{name}"
    for rate, names in (("", ("position", "velocity", "acceleration", "angle")), ("angular_", ("velocity", "acceleration")))
    for name in names
} | {f"slider_{name}" for name in ("position", "velocity", "acceleration")}
"""Variables for which no energies need to be integrated."""

STATE = ("angle", "angular_velocity", "position", "velocity")


def motion(mechanism: Mechanism, options: Options, times: np.ndarray, *, monitor: bool = True) -> xr.Dataset:
    """A run of a mechanism, sampled at some instants."""
    try:
        tables = plan(mechanism)
        chosen = dataclasses.replace(options, until=float(times[-1]), samples=2, trust=False)
        path, record = recorded(tables, chosen, compute(tables, chosen, times=times, monitor=monitor))
    except InputError as error:
        raise FailedRunError(str(error)) from None
    if path.status == "interrupted":
        raise KeyboardInterrupt
    if path.status != "complete":
        raise FailedRunError(path.cause)
    return results(tables, "", path, record).dataset()


def columns_of(mechanism: Mechanism, options: Options) -> dict[str, TimeColumn]:
    """The quantities that a run of a mechanism has over time, by heading."""
    run = motion(mechanism, options, np.array([0.0, 1e-3 * options.until]))
    return {column.heading: column for column in time_columns(run)}


def curves(run: xr.Dataset, columns: Sequence[TimeColumn]) -> np.ndarray:
    """Values of some columns, shape (instants, columns)."""
    return np.column_stack([column.of(run).astype(float) for column in columns])


class Shown(NamedTuple):
    """What a run shows of a segment, and the states at its first and last instant."""

    curves: np.ndarray  # (instants, columns)
    first: np.ndarray  # Of each body angle and place, and their rates
    last: np.ndarray


@dataclass(frozen=True)
class Free:
    """A number that a fit may change, and what is known of it before."""

    path: str
    unit: str  # In SI
    start: float  # Where the search starts
    scale: float  # Size of changes that matter; the unknown of the search is the number over its scale
    low: float  # Bounds
    high: float
    mean: float  # Of what was measured otherwise, such as by weighing; an infinite deviation if nothing was
    deviation: float
    places: Sequence[Place]  # What `find` has found for the parameter path


def free_parameter(mechanism: Mechanism, parameter: str, variation: Variation | None = None) -> Free:
    """A number that a fit may change."""
    first = number(mechanism, parameter)
    quantity, value = first.quantity, float(first.value)
    assert quantity is not None, "number() gives one with a unit"
    low = max((bound for bound in (quantity.minimum, quantity.above) if bound is not None), default=-math.inf)
    high = min((bound for bound in (quantity.maximum, quantity.below) if bound is not None), default=math.inf)
    mean, deviation, scale = value, math.inf, abs(value)
    if isinstance(variation, Interval):
        low, high = max(low, variation.low), min(high, variation.high)
        scale = scale or high - low
    elif isinstance(variation, Normal):
        mean, deviation = variation.mean, variation.deviation
        low, high = max(low, variation.low), min(high, variation.high)
        value, scale = mean, abs(mean) or deviation
    elif variation is not None:
        raise InputError(
            f"'{parameter}' free over a {variation.kind} distribution",
            "a range, or a value with its standard deviation",
            command("--free", f"{parameter}=normal(0.1, 0.01) {quantity.unit}"),
        )
    if not scale > 0.0:
        raise InputError(
            f"'{parameter}' starts at zero and has no range, so that the size of its changes is unknown",
            "a range, or another value in the case",
            command("--free", f"{parameter}=0..1 {quantity.unit}"),
        )
    if not low <= value <= high:
        raise InputError(
            f"'{parameter}' starts at {value:g}, outside its range from {low:g} to {high:g}", "a range around its value"
        )
    return Free(parameter, quantity.unit, value, scale, low, high, mean, deviation, find(mechanism, parameter))


STEP = 1e-5  # Of a finite difference, as a fraction of the scale of a number
ACCURATE_STEP = 1e-4  # Of a central difference; its error is its square
FARTHEST = 1e4  # Bounds that are farther away, in scales of a number, are none
REJECTED = 1e3  # Residuals of a trial whose run fails, as a multiple of a standard deviation: the search turns back from it


@dataclass(frozen=True)
class Segment:
    """A record, or a part of one, that one run follows."""

    record: Measured
    chart: Chart | None  # Of its start; None where the case says how it starts
    turns: np.ndarray  # (columns,) Whole turns of measured angles [rad]
    follows: bool = False  # Whether the segment before it goes on into it


def records_of(segments: Sequence[Segment]) -> dict[str, Any]:
    """Variables of a Dataset with the rows of all segments."""
    records = [segment.record for segment in segments]
    return {
        "time": ("row", np.concatenate([record.time for record in records]), {"units": "s", "long_name": "time"}),
        "segment": (
            "row",
            np.repeat(np.arange(len(records)), [record.time.size for record in records]),
            {"long_name": "segment"},
        ),
        "measured": (
            ("row", "column"),
            np.concatenate([record.values for record in records]),
            {"long_name": "measured value, in the unit of its column"},
        ),
        "column_unit": ("column", np.array(records[0].units, dtype=str), {"long_name": "unit"}),
        "column": np.array(records[0].headings, dtype=str),
    }


@dataclass
class Problem:
    """Residuals over free numbers and starts of segments.

    The unknowns are the free numbers, each over its scale, then the states at the start of every segment.
    """

    mechanism: Mechanism
    options: Options
    free: Sequence[Free]
    segments: Sequence[Segment]
    columns: Sequence[TimeColumn]
    deviation: np.ndarray  # (columns,) Standard deviations of the measured quantities
    # Standard deviations of the jumps of a state from one segment to the next, in the order of `STATE`
    jumps: np.ndarray | None = None
    runs: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        sizes = [0 if segment.chart is None else segment.chart.size for segment in self.segments]
        self.offsets = len(self.free) + np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        self.monitors = not {column.variable for column in self.columns} <= KINEMATIC
        self.scale = np.array([parameter.scale for parameter in self.free])
        self.known = [k for k, parameter in enumerate(self.free) if np.isfinite(parameter.deviation)]

    @property
    def unknowns(self) -> int:
        return int(self.offsets[-1])

    def start(self) -> np.ndarray:
        """The unknowns that the search starts from."""
        starts = [parameter.start for parameter in self.free] / self.scale
        return np.concatenate([starts, np.zeros(self.unknowns - len(self.free))])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        rest = np.full(self.unknowns - len(self.free), np.inf)
        ends = [[getattr(parameter, name) for parameter in self.free] / self.scale for name in ("low", "high")]
        # the search scales steps by distances to bounds, for which one that is never reached is as bad as a wrong unit
        low, high = (np.where(np.abs(end) < FARTHEST, end, sign * np.inf) for end, sign in zip(ends, (-1.0, 1.0), strict=True))
        return np.concatenate([low, -rest]), np.concatenate([high, rest])

    def values(self, unknowns: np.ndarray) -> np.ndarray:
        """The free numbers in SI."""
        return np.asarray(self.scale * unknowns[: len(self.free)])

    def fitted(self, unknowns: np.ndarray) -> Mechanism:
        changes = dict(zip((parameter.path for parameter in self.free), self.values(unknowns).tolist(), strict=True))
        return changed_all(self.mechanism, changes, {parameter.path: parameter.places for parameter in self.free})

    def shown(self, mechanism: Mechanism, k: int, unknowns: np.ndarray) -> Shown:
        """What a run shows of one segment, in SI; it goes on to the next one if the jump there counts."""
        segment, record = self.segments[k], self.segments[k].record
        times = record.time
        if segment.chart is not None:
            state = unknowns[self.offsets[k] : self.offsets[k + 1]]
            mechanism, times = segment.chart.placed(mechanism, state), times - times[0]
        if self.jumps is not None and k + 1 < len(self.segments) and self.segments[k + 1].follows:
            times = np.append(times, self.segments[k + 1].record.time[0] - record.time[0])
        self.runs += 1
        run = motion(mechanism, self.options, times, monitor=self.monitors)
        first, last = (np.concatenate([run.variables[name].values[at].ravel() for name in STATE]) for at in (0, -1))
        return Shown(curves(run, self.columns)[: record.time.size] + segment.turns, first, last)

    def everything_shown(self, unknowns: np.ndarray, mechanism: Mechanism | None = None) -> list[Shown]:
        fitted = self.fitted(unknowns) if mechanism is None else mechanism
        return [self.shown(fitted, k, unknowns) for k in range(len(self.segments))]

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """Differences between runs and records over their standard deviations; large where a run fails."""
        try:
            return self.joined(self.everything_shown(unknowns), unknowns)
        except FailedRunError:
            rows = sum(segment.record.values.size for segment in self.segments)
            rows += 0 if self.jumps is None else self.jumps.size * sum(segment.follows for segment in self.segments)
            return np.full(rows + len(self.known), REJECTED)

    def joined(self, shown: Sequence[Shown], unknowns: np.ndarray) -> np.ndarray:
        """Residuals: records segment by segment, row by row, then jumps, then what was known before."""
        parts = [
            ((part.curves - segment.record.values) / self.deviation).ravel()
            for part, segment in zip(shown, self.segments, strict=True)
        ]
        if self.jumps is not None:
            parts += [self._jump(shown[k - 1], shown[k]) for k, segment in enumerate(self.segments) if segment.follows]
        values = self.values(unknowns)
        parts.append(np.array([(values[k] - self.free[k].mean) / self.free[k].deviation for k in self.known]))
        return np.concatenate(parts)

    def _jump(self, before: Shown, after: Shown) -> np.ndarray:
        difference = after.first - before.last
        angles = difference.size // 6  # one angle, one angular velocity, two coordinates and two velocities of each body
        difference[:angles] -= TURN * np.round(difference[:angles] / TURN)
        return np.asarray(difference / self.jumps)

    def jacobian(self, unknowns: np.ndarray, *, accurate: bool = False) -> np.ndarray:
        """Derivatives of the residuals; a segment depends on the free numbers and on its own start."""
        low, high = self.bounds()
        fitted = self.fitted(unknowns)
        base = self.everything_shown(unknowns, fitted)
        reference = self.joined(base, unknowns)
        matrix = np.zeros((reference.size, self.unknowns))
        for column in range(self.unknowns):
            width = ACCURATE_STEP if accurate else STEP
            # a state has directions, lengths and their rates: steps are fractions of one, of the rate for large ones
            width *= max(1.0, abs(unknowns[column])) if column >= len(self.free) else 1.0
            ends: list[tuple[float, np.ndarray]] = []
            for sense in (1.0, -1.0):
                moved = unknowns.copy()
                moved[column] = np.clip(unknowns[column] + sense * width, low[column], high[column])
                if sense < 0.0 and not accurate and ends[0][0] != unknowns[column]:
                    ends.append((unknowns[column], reference))
                else:
                    ends.append((moved[column], self._moved(moved, column, base, fitted)))
            (first, above), (second, below) = ends
            matrix[:, column] = (above - below) / (first - second)
        return matrix

    def _moved(self, unknowns: np.ndarray, column: int, base: Sequence[Shown], fitted: Mechanism) -> np.ndarray:
        """Residuals with one unknown changed: all runs for a free number, one for the start of a segment."""
        if column < len(self.free):
            return self.joined(self.everything_shown(unknowns), unknowns)
        k = int(np.searchsorted(self.offsets, column, side="right")) - 1
        return self.joined([*base[:k], self.shown(fitted, k, unknowns), *base[k + 1 :]], unknowns)
