"""Least-squares problem of a fit: free parameters, runs for the records, weighted residuals and their derivatives."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError, command
from scissordyn.file.export import TimeColumn, time_columns
from scissordyn.identification.chart import Chart
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import Place, changed_all, find, number
from scissordyn.plan.plan import plan
from scissordyn.record.dataset import results
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.trajectory import compute, record_trajectory
from scissordyn.studies.ask.distribution import Distribution, Interval, Variation


class FailedRunError(Exception):
    """Error: a run of a fit ended before the last instant of its record."""


KINEMATIC_VARIABLES = {
    f"{rate}{name}"
    for rate, names in (("", ("position", "velocity", "acceleration", "angle")), ("angular_", ("velocity", "acceleration")))
    for name in names
} | {f"slider_{name}" for name in ("position", "velocity", "acceleration")}
"""Variables of a run that follow from the motion alone; if a fit uses only these, its runs compute no forces and energies."""

STATE_VARIABLES = ("angle", "angular_velocity", "position", "velocity")  # variables of a run with the state of the bodies


def motion(mechanism: Mechanism, options: Options, times: np.ndarray, *, monitor: bool = True) -> xr.Dataset:
    """Run a mechanism and return its motion at given instants; raise `FailedRunError` if the run ends before the last."""
    try:
        tables = plan(mechanism)
        chosen = dataclasses.replace(options, until=float(times[-1]), samples=2, trust=False)
        path, record = record_trajectory(tables, chosen, compute(tables, chosen, times=times, monitor=monitor))
    except InputError as error:
        raise FailedRunError(str(error)) from None
    if path.status == "interrupted":
        raise KeyboardInterrupt
    if path.status != "complete":
        raise FailedRunError(path.cause)
    return as_dataset(results(tables, "", path, record))


def columns_of(mechanism: Mechanism, options: Options) -> dict[str, TimeColumn]:
    """Return the quantities that a run of a mechanism has over time, by column heading."""
    run = motion(mechanism, options, np.array([0.0, 1e-3 * options.until]))
    return {column.heading: column for column in time_columns(run)}


def curves(run: xr.Dataset, columns: Sequence[TimeColumn]) -> np.ndarray:
    """Return the values of quantities of a run over time, shape (instants, columns)."""
    return np.column_stack([column.of(run).astype(float) for column in columns])


class SegmentRun(NamedTuple):
    """Curves of a run for a segment, and the states at its first and last instant."""

    curves: np.ndarray  # (instants, columns)
    first: np.ndarray  # State at the first instant: angles, angular velocities, positions and velocities of the bodies
    last: np.ndarray  # State at the last instant


@dataclass(frozen=True)
class Free:
    """Parameter that a fit may change, with its range and prior knowledge."""

    path: str
    unit: str  # SI unit
    start: float  # Initial value of the search
    scale: float  # Typical change of the parameter; the unknown of the search is the parameter divided by its scale
    low: float  # Lower bound
    high: float  # Upper bound
    mean: float  # Value of the parameter by an independent measurement, such as weighing
    deviation: float  # Standard deviation of `mean`; infinite without an independent measurement
    places: Sequence[Place]  # Attributes of the mechanism that `path` names, from `find`
    least: float  # Least value that the mechanism may have; intervals end there
    most: float  # Largest value that the mechanism may have


def free_parameter(mechanism: Mechanism, parameter: str, variation: Variation | None = None) -> Free:
    """Return a free parameter of a fit, with its start value, bounds and scale."""
    first = number(mechanism, parameter)
    quantity, value = first.quantity, float(first.value)
    assert quantity is not None, "number() gives one with a unit"
    low = max((bound for bound in (quantity.minimum, quantity.above) if bound is not None), default=-math.inf)
    high = min((bound for bound in (quantity.maximum, quantity.below) if bound is not None), default=math.inf)
    least, most = low, high
    mean, deviation, scale = value, math.inf, abs(value)
    if isinstance(variation, Interval):
        low, high = max(low, variation.low), min(high, variation.high)
        scale = scale or high - low
    elif isinstance(variation, Distribution) and variation.name in ("norm", "truncnorm"):
        arguments, (lowest, highest) = dict(variation.arguments), variation.ends
        mean, deviation = arguments["loc"], arguments["scale"]
        low, high = max(low, lowest), min(high, highest)
        value, scale = mean, abs(mean) or deviation
    elif variation is not None:
        raise InputError(
            f"the values of the free parameter '{parameter}' are neither a range nor normal",
            "a range, or a normal distribution: a value with its standard deviation",
            command("--free", f"{parameter}=norm(loc=0.1, scale=0.01) {quantity.unit}"),
        )
    if not scale > 0.0:
        raise InputError(
            f"the free parameter '{parameter}' is zero and has no range, so its scale is unknown",
            "a range, or a value other than zero in the case",
            command("--free", f"{parameter}=0..1 {quantity.unit}"),
        )
    if not low <= value <= high:
        raise InputError(
            f"'{parameter}' starts at {value:g}, outside its range from {low:g} to {high:g}", "a range around its value"
        )
    return Free(parameter, quantity.unit, value, scale, low, high, mean, deviation, find(mechanism, parameter), least, most)


@dataclass(frozen=True)
class Segment:
    """Record, or part of a record, that is compared with one run."""

    record: Measured
    chart: Chart | None  # Coordinates of the estimated start; None if the case gives the start
    turns: np.ndarray  # (columns,) Full turns to add to the angles of the run [rad]; 0 for other quantities
    follows: bool = False  # True if this segment continues the previous one
    runs: int = 0  # Number of runs that estimated the start


def records_of(segments: Sequence[Segment]) -> dict[str, Any]:
    """Return times, segment indices and measured values of all segments as variables of a Dataset, over one index `row`."""
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
    """Least-squares problem: residuals as functions of the free parameters and of the starts of segments.

    The unknowns are the free parameters, divided by their scales, then the states at the start of every segment.
    """

    mechanism: Mechanism
    options: Options
    free: Sequence[Free]
    segments: Sequence[Segment]
    columns: Sequence[TimeColumn]
    deviation: np.ndarray  # (columns,) Standard deviations of the measured quantities
    # Standard deviations that weight jumps of the state between segments, in the order of `STATE_VARIABLES`; None: no penalty
    jumps: np.ndarray | None = None
    estimated: bool = False  # True if the standard deviations were estimated from the residuals
    runs: int = field(default=0, init=False)
    derivatives: str = field(default="", init=False)  # "exact" or "differences"; "" before the first Jacobian
    # The last unknowns, which may be none, and their runs; None before the first
    last_runs: tuple[bytes | None, list[SegmentRun]] = field(default=(None, []), init=False)
    last_jacobian: tuple[bytes | None, np.ndarray] = field(default=(None, np.zeros(0)), init=False)  # The same of derivatives
    exact_derivatives_failure: str = field(default="", init=False)  # Reason why exact derivatives do not exist

    def __post_init__(self) -> None:
        sizes = [0 if segment.chart is None else segment.chart.size for segment in self.segments]
        self.offsets = len(self.free) + np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        self.monitors = not {column.variable for column in self.columns} <= KINEMATIC_VARIABLES
        self.scale = np.array([parameter.scale for parameter in self.free])
        self.prior_indices = [k for k, parameter in enumerate(self.free) if np.isfinite(parameter.deviation)]

    @property
    def unknowns(self) -> int:
        """Number of unknowns: free parameters and coordinates of the starts of segments."""
        return int(self.offsets[-1])

    @property
    def measured(self) -> int:
        """Number of measured values; their residuals come first."""
        return sum(segment.record.values.size for segment in self.segments)

    def start(self) -> np.ndarray:
        """Return the unknowns at the start of the search: the parameters of the case, and the estimated starts."""
        starts = [parameter.start for parameter in self.free] / self.scale
        return np.concatenate([starts, np.zeros(self.unknowns - len(self.free))])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds of the unknowns; the starts of segments have no bounds."""
        rest = np.full(self.unknowns - len(self.free), np.inf)
        ends = [[getattr(parameter, name) for parameter in self.free] / self.scale for name in ("low", "high")]
        # least_squares scales steps by the distance to a bound: bounds beyond 1e4 scales are treated as infinite
        low, high = (np.where(np.abs(end) < 1e4, end, sign * np.inf) for end, sign in zip(ends, (-1.0, 1.0), strict=True))
        return np.concatenate([low, -rest]), np.concatenate([high, rest])

    def values(self, unknowns: np.ndarray) -> np.ndarray:
        """Return the values of the free parameters in SI units: unknowns times scale."""
        return np.asarray(self.scale * unknowns[: len(self.free)])

    def fitted_mechanism(self, unknowns: np.ndarray) -> Mechanism:
        """Return the mechanism with the free parameters set to the unknowns."""
        changes = dict(zip((parameter.path for parameter in self.free), self.values(unknowns).tolist(), strict=True))
        return changed_all(self.mechanism, changes, {parameter.path: parameter.places for parameter in self.free})

    def run_segment(self, mechanism: Mechanism, k: int, unknowns: np.ndarray) -> SegmentRun:
        """Run segment `k` and return its curves in SI units.

        If the jump to the next segment is penalised, the run continues to the start of that segment.
        """
        segment, record = self.segments[k], self.segments[k].record
        times = record.time
        if segment.chart is not None:
            state = unknowns[self.offsets[k] : self.offsets[k + 1]]
            mechanism, times = segment.chart.mechanism_at(mechanism, state), times - times[0]
        if self.jumps is not None and k + 1 < len(self.segments) and self.segments[k + 1].follows:
            times = np.append(times, self.segments[k + 1].record.time[0] - record.time[0])
        self.runs += 1
        run = motion(mechanism, self.options, times, monitor=self.monitors)
        first, last = (np.concatenate([run.variables[name].values[at].ravel() for name in STATE_VARIABLES]) for at in (0, -1))
        return SegmentRun(curves(run, self.columns)[: record.time.size] + segment.turns, first, last)

    def run_segments(self, unknowns: np.ndarray, mechanism: Mechanism | None = None) -> list[SegmentRun]:
        """Run all segments and return their curves and end states; the last ones are kept."""
        if self.last_runs[0] != unknowns.tobytes():
            fitted = self.fitted_mechanism(unknowns) if mechanism is None else mechanism
            runs = [self.run_segment(fitted, k, unknowns) for k in range(len(self.segments))]
            self.last_runs = unknowns.tobytes(), runs
        return self.last_runs[1]

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """Return the residual vector: run minus record, divided by the standard deviation; 1000 everywhere if a run fails."""
        try:
            return self.join_residuals(self.run_segments(unknowns), unknowns)
        except FailedRunError:
            rows = self.measured
            rows += 0 if self.jumps is None else self.jumps.size * sum(segment.follows for segment in self.segments)
            return np.full(rows + len(self.prior_indices), 1e3)  # large residuals make the search reject this trial

    def join_residuals(self, segment_runs: Sequence[SegmentRun], unknowns: np.ndarray) -> np.ndarray:
        """Return the residual vector: records by segment and row, then jumps between segments, then prior knowledge."""
        parts = [
            ((part.curves - segment.record.values) / self.deviation).ravel()
            for part, segment in zip(segment_runs, self.segments, strict=True)
        ]
        if self.jumps is not None:
            parts += [
                self._jump(segment_runs[k - 1], segment_runs[k]) for k, segment in enumerate(self.segments) if segment.follows
            ]
        values = self.values(unknowns)
        parts.append(np.array([(values[k] - self.free[k].mean) / self.free[k].deviation for k in self.prior_indices]))
        return np.concatenate(parts)

    def _jump(self, before: SegmentRun, after: SegmentRun) -> np.ndarray:
        """Return the scaled difference between the end state of a segment and the start state of the next one."""
        difference = after.first - before.last
        angles = difference.size // 6  # for each body: one angle, one angular velocity, two coordinates and two velocities
        difference[:angles] -= math.tau * np.round(difference[:angles] / math.tau)
        return np.asarray(difference / self.jumps)
