"""The least-squares problem of a fit: free numbers, weighted residuals of all records, and their derivatives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError, command
from scissordyn.file.export import TimeColumn
from scissordyn.identification.forward import KINEMATIC, FailedRunError, curves, motion, state_values
from scissordyn.identification.start import Chart, placed_at
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import Place, changed_all, find, number
from scissordyn.run.options import Options
from scissordyn.study.ask.distribution import Interval, Normal, Variation


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


def with_values(mechanism: Mechanism, free: Sequence[Free], values: Sequence[float]) -> Mechanism:
    changes = {parameter.path: float(value) for parameter, value in zip(free, values, strict=True)}
    return changed_all(mechanism, changes, {parameter.path: parameter.places for parameter in free})


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

    @property
    def size(self) -> int:
        return 0 if self.chart is None else self.chart.size


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
    # Standard deviations of the jumps of a state from one segment to the next, by `forward.state_values`
    jumps: np.ndarray | None = None
    runs: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        sizes = [segment.size for segment in self.segments]
        self.offsets = len(self.free) + np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        self.monitors = not {column.variable for column in self.columns} <= KINEMATIC
        self.known = [k for k, parameter in enumerate(self.free) if np.isfinite(parameter.deviation)]

    @property
    def unknowns(self) -> int:
        return int(self.offsets[-1])

    def start(self) -> np.ndarray:
        """The unknowns that the search starts from."""
        return np.concatenate(
            [[parameter.start / parameter.scale for parameter in self.free], np.zeros(self.unknowns - len(self.free))]
        )

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        rest = np.full(self.unknowns - len(self.free), np.inf)
        ends = [np.array([getattr(parameter, name) / parameter.scale for parameter in self.free]) for name in ("low", "high")]
        # the search scales steps by distances to bounds, for which one that is never reached is as bad as a wrong unit
        low, high = (np.where(np.abs(end) < FARTHEST, end, sign * np.inf) for end, sign in zip(ends, (-1.0, 1.0), strict=True))
        return np.concatenate([low, -rest]), np.concatenate([high, rest])

    def values(self, unknowns: np.ndarray) -> np.ndarray:
        """The free numbers in SI."""
        return np.array(
            [parameter.scale * unknown for parameter, unknown in zip(self.free, unknowns[: len(self.free)], strict=True)]
        )

    def fitted(self, unknowns: np.ndarray) -> Mechanism:
        return with_values(self.mechanism, self.free, self.values(unknowns).tolist())

    def numbers(self, unknowns: np.ndarray, k: int) -> np.ndarray:
        """The state at the start of a segment."""
        return unknowns[self.offsets[k] : self.offsets[k + 1]]

    def segment_curves(self, mechanism: Mechanism, k: int, numbers: np.ndarray) -> np.ndarray:
        """Curves of one segment in units of SI, and its states at both ends if jumps are compared, in one array."""
        segment, record = self.segments[k], self.segments[k].record
        times = record.time
        if segment.chart is not None:
            mechanism, times = placed_at(mechanism, segment.chart.bodies(numbers)), times - times[0]
        goes_on = self.jumps is not None and k + 1 < len(self.segments) and self.segments[k + 1].follows
        if goes_on:
            times = np.append(times, self.segments[k + 1].record.time[0] - record.time[0])
        self.runs += 1
        run = motion(mechanism, self.options, times, monitor=self.monitors)
        curves_of_run = curves(run, self.columns)[: record.time.size] + segment.turns
        return curves_of_run if self.jumps is None else np.concatenate([curves_of_run.ravel(), *state_values(run)])

    def every_curve(self, unknowns: np.ndarray, mechanism: Mechanism | None = None) -> list[np.ndarray]:
        fitted = self.fitted(unknowns) if mechanism is None else mechanism
        return [self.segment_curves(fitted, k, self.numbers(unknowns, k)) for k in range(len(self.segments))]

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """Differences between runs and records over their standard deviations; large where a run fails."""
        try:
            return self.joined(self.every_curve(unknowns), unknowns)
        except FailedRunError:
            rows = sum(segment.record.values.size for segment in self.segments)
            rows += 0 if self.jumps is None else self.jumps.size * sum(segment.follows for segment in self.segments)
            return np.full(rows + len(self.known), REJECTED)

    def joined(self, found: Sequence[np.ndarray], unknowns: np.ndarray) -> np.ndarray:
        """Residuals of curves: records segment by segment, then jumps, then what was known before."""
        parts = [self.misfit(curve, k) for k, curve in enumerate(found)]
        if self.jumps is not None:
            parts += [self._jump(found[k - 1], found[k]) for k, segment in enumerate(self.segments) if segment.follows]
        values = self.values(unknowns)
        parts.append(np.array([(values[k] - self.free[k].mean) / self.free[k].deviation for k in self.known]))
        return np.concatenate(parts)

    def misfit(self, curve: np.ndarray, k: int) -> np.ndarray:
        """Weighted residuals of one segment, row by row."""
        record = self.segments[k].record
        shown = curve.ravel()[: record.values.size].reshape(record.values.shape)
        return np.asarray(((shown - record.values) / self.deviation).ravel())

    def _jump(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        assert self.jumps is not None
        size = self.jumps.size
        difference = after[-2 * size : -size] - before[-size:]
        angles = size // 6  # one angle, one angular velocity, two coordinates and two velocities of each body
        difference[:angles] -= 2.0 * np.pi * np.round(difference[:angles] / (2.0 * np.pi))
        return np.asarray(difference / self.jumps)

    def jacobian(self, unknowns: np.ndarray, *, accurate: bool = False) -> np.ndarray:
        """Derivatives of the residuals; a segment depends on the free numbers and on its own start."""
        low, high = self.bounds()
        fitted = self.fitted(unknowns)
        base = self.every_curve(unknowns, fitted)
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

    def _moved(self, unknowns: np.ndarray, column: int, base: Sequence[np.ndarray], made: Mechanism) -> np.ndarray:
        """Residuals with one unknown changed: all runs for a free number, one for the start of a segment."""
        if column < len(self.free):
            return self.joined(self.every_curve(unknowns), unknowns)
        k = int(np.searchsorted(self.offsets, column, side="right")) - 1
        moved = list(base)
        moved[k] = self.segment_curves(made, k, self.numbers(unknowns, k))
        return self.joined(moved, unknowns)
