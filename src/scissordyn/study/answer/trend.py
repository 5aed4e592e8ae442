"""How responses go with the numbers that vary: power laws and straight lines, by least squares, judged by cross-validation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

from scissordyn.study.answer.control_variate import CONFIDENCE
from scissordyn.study.answer.verdict import answered, case_values
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.requirement import response_unit
from scissordyn.study.compute.table import column

CLEAR = 0.5  # Predicted share of the variance, each point left out in turn, from which a trend is stated
EXTRA = 2  # Points more than coefficients from which one is fitted
ALIKE = 0.05  # Difference of the predicted shares of two forms that fit equally well

FAR = 10.0
"""A trend is followed beyond the data by as much as their range, of the logarithms where these enter, or by this factor."""


@dataclass(frozen=True)
class Trend:
    """A response as a function of the numbers that vary."""

    response: str
    units: str  # Of the response
    # "power", constant times powers of the numbers (those that are not positive enter as an exponential), or "linear", constant
    # plus multiples
    form: str
    # Parameter paths; of a name but the first of a list, "PARAMETER = NAME in place of FIRST", a number that is 1 or 0
    numbers: tuple[str, ...]
    constant: float  # Of the logarithm of the response, or of the response
    slopes: np.ndarray  # Exponents, or change of the response per unit of the number
    intervals: np.ndarray  # Half of the 95 % intervals of the slopes: jackknife over the points, Student's t
    logarithmic: tuple[bool, ...]  # Whether a number enters by its logarithm
    ranges: np.ndarray  # Smallest and largest value in the data
    r2: float  # Coefficient of determination of the fit, of the logarithms for a power law
    predicted: float  # The same with each point predicted by the others, of the response itself; below 0 for a useless fit
    error: float  # Root mean square of these predictions' errors, as a fraction of the mean response
    points: int

    @property
    def clear(self) -> bool:
        """Whether the trend predicts points that it has not seen."""
        return self.predicted >= CLEAR

    @property
    def effects(self) -> np.ndarray:
        """Change of the response over the range of each number: of its logarithm for a power law."""
        terms = [self.term(k, high) - self.term(k, low) for k, (low, high) in enumerate(self.ranges)]
        return np.asarray(self.slopes * np.array(terms))

    @property
    def significant(self) -> np.ndarray:
        """Whether the interval of each slope excludes 0."""
        return np.asarray(np.abs(self.slopes) > self.intervals)

    def term(self, k: int, value: float) -> float:
        """How a number enters: its logarithm or itself."""
        return math.log(value) if self.logarithmic[k] else float(value)

    def value(self, numbers: dict[str, float]) -> float:
        """The response at given numbers in SI."""
        total = self._total(numbers)
        return math.exp(total) if self.form == "power" else total

    def _total(self, numbers: dict[str, float], without: int = -1) -> float:
        terms = enumerate(zip(self.numbers, self.slopes, strict=True))
        return self.constant + sum(float(slope) * self.term(k, numbers[name]) for k, (name, slope) in terms if k != without)

    def inverse(self, name: str, response: float, numbers: dict[str, float]) -> float:
        """The value of a number at which the response is a given one, the others as they are; NaN if there is none."""
        k = self.numbers.index(name)
        wanted = response if self.form == "linear" else (math.log(response) if response > 0.0 else math.nan)
        with np.errstate(all="ignore"):
            term = float(np.float64(wanted - self._total(numbers, k)) / self.slopes[k])
            return float(np.exp(np.float64(term))) if self.logarithmic[k] else term

    def reached(self, name: str, bound: float, numbers: dict[str, float]) -> float:
        """Where the trend reaches a bound; NaN where not near the data, or only beyond 0, where positive numbers end."""
        value, k = self.inverse(name, bound, numbers), self.numbers.index(name)
        if not math.isfinite(value) or (self.ranges[k, 0] > 0.0 >= value):
            return math.nan
        place, (low, high) = self.term(k, value), (self.term(k, end) for end in self.ranges[k])
        reach = max(high - low, math.log(FAR) if self.logarithmic[k] else 0.0)
        return value if low - reach <= place <= high + reach else math.nan


def trends(study: Study, results: xr.Dataset) -> dict[str, tuple[Trend, ...]]:
    """Both forms of trend of each response as `fitted` orders them; not of too few points, nor of shares that are 0 or 1."""
    numbers = with_indicators(
        study, {name: study.cells(results[column(name)].values)[..., 0].ravel() for name in study.factor_names}
    )
    x = np.stack(list(numbers.values()), axis=1)
    groups = np.arange(x.shape[0]) // study.sampling.samples if study.factors else np.arange(x.shape[0])
    by_response = {}
    for response in answered(study, results):
        cells = study.cells(case_values(study, results, response)).reshape(-1, study.members)
        there = np.isfinite(cells)
        if np.isinf(cells).any():  # a trend of the cases that have a number would hide those that fail for want of one
            continue
        if np.isin(cells[there], (0.0, 1.0)).all():  # through yes and no goes neither a power nor a line
            continue
        values = np.where(there, cells, 0.0).sum(axis=1) / np.where(there.any(axis=1), there.sum(axis=1), np.nan)
        both = fitted(x, values, groups, tuple(numbers), response.name, response_unit(results, response))
        if both:
            by_response[response.name] = both
    return by_response


def with_indicators(study: Study, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The same numbers, with 1 or 0 for each name but the first in place of where it stands."""
    named = [factor for factor in study.apart if factor.labels]
    numbers_of_cases = {name: value for name, value in numbers.items() if name not in {factor.name for factor in named}}
    for factor in named:
        first, *others = factor.labels
        for place, label in enumerate(others, 1):
            numbers_of_cases[f"{factor.name} = {label} in place of {first}"] = 1.0 * (numbers[factor.name] == place)
    return numbers_of_cases


def fitted(
    x: np.ndarray, values: np.ndarray, groups: np.ndarray, names: tuple[str, ...], response: str = "", units: str = "1"
) -> tuple[Trend, ...]:
    """Power law and straight line through values of a response: the power law first unless the line predicts better.

    Shapes: `x` (n, numbers), `values` (n,), `groups` (n,).
    """
    there = np.isfinite(values) & np.all(np.isfinite(x), axis=1)
    x, values, groups = x[there], values[there], np.unique(groups[there], return_inverse=True)[1]
    varies = [k for k in range(x.shape[1]) if values.size and np.ptp(x[:, k]) > 0.0]
    x, names = x[:, varies], tuple(names[k] for k in varies)
    count = int(groups.max(initial=-1)) + 1
    if not names or count < len(names) + 1 + EXTRA or np.ptp(values) <= 1e-12 * np.max(np.abs(values)):
        return ()
    ranges = np.stack([x.min(axis=0), x.max(axis=0)], axis=1)
    forms = (["power"] if values.min() > 0.0 and (ranges[:, 0] > 0.0).any() else []) + ["linear"]
    both = []
    for form in forms:
        logarithmic = tuple(form == "power" and bool(low > 0.0) for low in ranges[:, 0])
        terms = np.where(logarithmic, np.log(np.where(logarithmic, x, 1.0)), x)
        y = np.log(values) if form == "power" else values
        slopes, constant, intervals, inner, outer = _jackknife(terms, y, groups, count)
        predictions = np.exp(np.clip(outer, -700.0, 700.0)) if form == "power" else outer
        errors = values - predictions
        r2 = 1.0 - float(np.sum((y - inner) ** 2) / np.sum((y - y.mean()) ** 2))
        predicted = 1.0 - float(np.sum(errors**2) / np.sum((values - values.mean()) ** 2))
        error = float(np.sqrt(np.mean(errors**2)) / np.mean(np.abs(values)))
        both.append(
            Trend(response, units, form, names, constant, slopes, intervals, logarithmic, ranges, r2, predicted, error, count)
        )
    return tuple(sorted(both, key=lambda trend: -trend.predicted - ALIKE * (trend.form == "power")))


def _jackknife(
    terms: np.ndarray, y: np.ndarray, groups: np.ndarray, count: int
) -> tuple[np.ndarray, float, np.ndarray, np.ndarray, np.ndarray]:
    """Slopes, constant, half intervals of the slopes, fitted values, and those with the group of each row left out."""
    middle, width = terms.mean(axis=0), np.ptp(terms, axis=0)
    design = np.column_stack([np.ones(y.size), (terms - middle) / width])  # well conditioned whatever the units are
    products, sums = design[:, :, None] * design[:, None, :], design * y[:, None]
    of_group = np.zeros((count, *products.shape[1:])), np.zeros((count, sums.shape[1]))
    np.add.at(of_group[0], groups, products)
    np.add.at(of_group[1], groups, sums)
    whole = np.linalg.pinv(products.sum(axis=0), hermitian=True) @ sums.sum(axis=0)
    inverses = np.linalg.pinv(products.sum(axis=0) - of_group[0], hermitian=True)
    without = np.einsum("gij,gj->gi", inverses, sums.sum(axis=0) - of_group[1])
    variance = (count - 1) / count * np.sum((without - without.mean(axis=0)) ** 2, axis=0)
    wide = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, max(count - design.shape[1], 1)) * np.sqrt(variance)
    slopes = whole[1:] / width
    outer = np.einsum("ij,ij->i", design, without[groups])
    return slopes, float(whole[0] - slopes @ middle), wide[1:] / width, design @ whole, outer
