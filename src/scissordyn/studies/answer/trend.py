"""Trends of responses: power laws and straight lines, judged by cross-validation, SALib's indices, rank correlations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import ndtri, stdtrit

from scissordyn.errors import InputError
from scissordyn.lookup import library
from scissordyn.plot.scale import Scale, scale_of
from scissordyn.studies.answer.section import Section
from scissordyn.studies.answer.verdict import by_point, case_values, slopes_of_points, study_responses
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import MORRIS_LEVELS, MORRIS_SCALE, POINTS_MIN, morris_numbers
from scissordyn.studies.ask.requirement import response_unit
from scissordyn.studies.compute.table import column
from scissordyn.tolerance import CONFIDENCE_LEVEL
from scissordyn.units import counted
from scissordyn.warning import LISTED_MAX

# [-] smallest predicted share of a reported trend: share of the variance when each point is left out in turn
PREDICTED_SHARE_MIN = 0.5
SHARE_MIN = 0.05  # [-] smallest gain of predicted share with which a trend is preferred to the power law
BOOTSTRAP_RESAMPLES = 500  # Number of bootstrap resamples for intervals of sensitivity indices and frequencies of ranks

EXTRAPOLATION_RATIO_MAX = 10.0
"""Largest factor by which a parameter is extrapolated beyond its data if it enters a trend by its logarithm.

Every parameter may be extrapolated by the width of its data.
"""


@dataclass(frozen=True)
class Trend:
    """A response as a function of the numbers that vary."""

    response: str
    units: str  # Unit of the response
    # "power", constant times powers of the numbers (those that are not positive enter as an exponential), or "linear", constant
    # plus multiples
    form: str
    # Parameter paths, and indicators (1 or 0) "PARAMETER = NAME instead of FIRST" of a list of names
    numbers: tuple[str, ...]
    constant: float  # Constant term of the response or of its logarithm
    slopes: np.ndarray  # Exponents, or change of the response per unit of the number
    intervals: np.ndarray  # Half of the 95 % intervals of the slopes: jackknife over the points, Student's t
    logarithmic: tuple[bool, ...]  # True for each parameter that enters by its logarithm
    ranges: np.ndarray  # Smallest and largest value in the data
    r2: float  # Coefficient of determination of the fit, of the logarithms for a power law
    predicted: float  # Share of the response's variance predicted with each point left out; below 0 for a useless fit
    error: float  # Root mean square error at points left out of the fit, as a fraction of the mean response
    points: int

    @property
    def clear(self) -> bool:
        """True if the trend predicts points that were left out of its fit."""
        return self.predicted >= PREDICTED_SHARE_MIN

    @property
    def effects(self) -> np.ndarray:
        """Change of the response over the range of each number: of its logarithm for a power law."""
        terms = [self.term(k, high) - self.term(k, low) for k, (low, high) in enumerate(self.ranges)]
        return np.asarray(self.slopes * np.array(terms))

    @property
    def significant(self) -> np.ndarray:
        """Mask of the slopes whose interval excludes 0."""
        return np.asarray(np.abs(self.slopes) > self.intervals)

    def term(self, k: int, value: float) -> float:
        """Return the regressor of a parameter value: its logarithm or the value itself."""
        return math.log(value) if self.logarithmic[k] else float(value)

    def value(self, numbers: dict[str, float]) -> float:
        """Return the response at given parameter values in SI units."""
        total = self._total(numbers)
        return math.exp(total) if self.form == "power" else total

    def _total(self, numbers: dict[str, float], without: int = -1) -> float:
        terms = enumerate(zip(self.numbers, self.slopes, strict=True))
        return self.constant + sum(float(slope) * self.term(k, numbers[name]) for k, (name, slope) in terms if k != without)

    def inverse(self, name: str, response: float, numbers: dict[str, float]) -> float:
        """Return the value of a parameter at which the trend has a given response; NaN if none exists."""
        k = self.numbers.index(name)
        total = response if self.form == "linear" else (math.log(response) if response > 0.0 else math.nan)
        with np.errstate(all="ignore"):
            term = float(np.float64(total - self._total(numbers, k)) / self.slopes[k])
            return float(np.exp(np.float64(term))) if self.logarithmic[k] else term

    def parameter_at_bound(self, name: str, bound: float, numbers: dict[str, float]) -> float:
        """Return the value of a parameter where the trend reaches a bound; NaN if it is far from the data or not positive."""
        value, k = self.inverse(name, bound, numbers), self.numbers.index(name)
        if not math.isfinite(value) or (self.ranges[k, 0] > 0.0 >= value):
            return math.nan
        place, (low, high) = self.term(k, value), (self.term(k, end) for end in self.ranges[k])
        reach = max(high - low, math.log(EXTRAPOLATION_RATIO_MAX) if self.logarithmic[k] else 0.0)
        return value if low - reach <= place <= high + reach else math.nan


def trends(study: Study, results: xr.Dataset) -> dict[str, tuple[Trend, ...]]:
    """Return both trends of each response as `fit_trends` orders them; none for few points or responses of only 0 and 1."""
    numbers = with_indicators(
        study, {name: study.cells(results[column(name)].values)[..., 0].ravel() for name in study.factor_names}
    )
    x = np.stack(list(numbers.values()), axis=1)
    points = by_point(study, results) if study.gradients else xr.Dataset()
    groups = np.arange(x.shape[0]) // study.sampling.samples if study.factors else np.arange(x.shape[0])
    by_response = {}
    for response in study_responses(study, results):
        cells = study.cells(case_values(study, results, response)).reshape(-1, study.members)
        is_finite = np.isfinite(cells)
        if np.isinf(cells).any():  # a trend of the cases that have a number would hide those that fail for want of one
            continue
        if np.isin(cells[is_finite], (0.0, 1.0)).all():  # yes and no follow neither a power law nor a line
            continue
        values = np.where(is_finite, cells, 0.0).sum(axis=1) / np.where(is_finite.any(axis=1), is_finite.sum(axis=1), np.nan)
        slopes = slopes_of_points(points, response.name, tuple(numbers)) if study.gradients else np.full(x.shape, np.nan)
        forms = fit_trends(x, values, groups, tuple(numbers), response.name, response_unit(results, response), slopes)
        if forms:
            by_response[response.name] = forms
    return by_response


def with_indicators(study: Study, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameter values in which the index of a name is replaced by an indicator (1 or 0) of each name but the first."""
    named = [factor for factor in study.variant_factors if factor.labels]
    numbers_of_cases = {name: value for name, value in numbers.items() if name not in {factor.name for factor in named}}
    for factor in named:
        first, *others = factor.labels
        for place, label in enumerate(others, 1):
            numbers_of_cases[f"{factor.name} = {label} instead of {first}"] = 1.0 * (numbers[factor.name] == place)
    return numbers_of_cases


def fit_trends(
    x: np.ndarray,
    values: np.ndarray,
    groups: np.ndarray,
    names: tuple[str, ...],
    response: str = "",
    units: str = "1",
    slopes: np.ndarray | None = None,
) -> tuple[Trend, ...]:
    """Fit a power law and a straight line to values of a response; the power law is first unless the line predicts better.

    Each form is fitted to the values alone and to values and derivatives, if there are any; the better predictor counts.
    Shapes: `x` (n, parameters), `values` (n,), `groups` (n,), `slopes` (n, parameters), NaN where they are unknown.
    """
    is_finite = np.isfinite(values) & np.all(np.isfinite(x), axis=1)
    x, values, groups = x[is_finite], values[is_finite], groups[is_finite]
    groups = _joined(np.unique(groups, return_inverse=True)[1], x)
    varies = [k for k in range(x.shape[1]) if values.size and np.ptp(x[:, k]) > 0.0]
    x, names = x[:, varies], tuple(names[k] for k in varies)
    unknown = np.full(x.shape, np.nan)
    derivatives = unknown if slopes is None else slopes[is_finite][:, varies]
    count = int(groups.max(initial=-1)) + 1
    if not names or np.ptp(values) <= 1e-12 * np.max(np.abs(values)):
        return ()
    forms = (["power"] if values.min() > 0.0 and (x.min(axis=0) > 0.0).any() else []) + ["linear"]
    fitted = list[Trend]()
    for used_slopes in (unknown, derivatives) if np.isfinite(derivatives).any() else (unknown,):
        slope_counts = np.isfinite(used_slopes).sum(axis=1)
        # the jackknife leaves out one group, and needs one more than coefficients then
        if count + slope_counts.sum() - 1 - slope_counts.max() > len(names) + 1 and count >= POINTS_MIN // 2:
            fitted += [_fit(form, x, values, groups, used_slopes, names, (response, units)) for form in forms]

    def better(trend: Trend) -> float:
        return trend.predicted + SHARE_MIN * (trend.form == "power")

    best = [max((trend for trend in fitted if trend.form == form), key=better) for form in forms if fitted]
    return tuple(sorted(best, key=lambda trend: -better(trend)))


def _joined(groups: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the group indices of cases, in which groups with a point (row of `x`) in common are one."""
    point = np.unique(x, axis=0, return_inverse=True)[1].ravel()
    first_of_point, first = np.full(len(x), len(x)), np.arange(len(x))
    np.minimum.at(first_of_point, point, groups)
    np.minimum.at(first, groups, first_of_point[point])
    return np.unique(first[groups], return_inverse=True)[1]


def _fit(
    form: str,
    x: np.ndarray,
    values: np.ndarray,
    groups: np.ndarray,
    slopes: np.ndarray,
    names: tuple[str, ...],
    named: tuple[str, str],
) -> Trend:
    """Return the trend of a form; `named` has the response and its unit."""
    ranges = np.stack([x.min(axis=0), x.max(axis=0)], axis=1)
    logarithmic = tuple(form == "power" and bool(low > 0.0) for low in ranges[:, 0])
    terms = np.where(logarithmic, np.log(np.where(logarithmic, x, 1.0)), x)
    y = np.log(values) if form == "power" else values
    slopes = slopes * np.where(logarithmic, x, 1.0) / (values[:, None] if form == "power" else 1.0)
    coefficients, constant, intervals, inner, outer = _jackknife(terms, y, groups, slopes)
    predictions = np.exp(np.clip(outer, -700.0, 700.0)) if form == "power" else outer
    errors = values - predictions
    r2 = 1.0 - float(np.sum((y - inner) ** 2) / np.sum((y - y.mean()) ** 2))
    predicted = 1.0 - float(np.sum(errors**2) / np.sum((values - values.mean()) ** 2))
    error = float(np.sqrt(np.mean(errors**2)) / np.mean(np.abs(values)))
    count = int(groups.max()) + 1
    return Trend(*named, form, names, constant, coefficients, intervals, logarithmic, ranges, r2, predicted, error, count)


def _jackknife(
    terms: np.ndarray, y: np.ndarray, groups: np.ndarray, derivatives: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray, np.ndarray, np.ndarray]:
    """Return slopes, constant, half intervals of slopes, fitted values, and predictions of left-out groups.

    A derivative by a term, multiplied by the term's width, counts as much as a value.
    """
    middle, width, count = terms.mean(axis=0), np.ptp(terms, axis=0), int(groups.max()) + 1
    values = np.column_stack([np.ones(y.size), (terms - middle) / width])  # well conditioned in any units
    point, term = np.nonzero(np.isfinite(derivatives))
    design = np.vstack([values, np.eye(values.shape[1])[1 + term]])
    products, sums = design[:, :, None] * design[:, None, :], design.copy()
    sums *= np.append(y, derivatives[point, term] * width[term])[:, None]
    group_products, group_sums = np.zeros((count, *products.shape[1:])), np.zeros((count, sums.shape[1]))
    row_groups = np.append(groups, groups[point])
    np.add.at(group_products, row_groups, products)
    np.add.at(group_sums, row_groups, sums)
    coefficients = np.linalg.pinv(products.sum(axis=0), hermitian=True) @ sums.sum(axis=0)
    inverses = np.linalg.pinv(products.sum(axis=0) - group_products, hermitian=True)
    left_out = np.einsum("gij,gj->gi", inverses, sums.sum(axis=0) - group_sums)
    variance = (count - 1) / count * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0)
    degrees = max(count - values.shape[1], 1) if not point.size else count - 1
    half_widths = stdtrit(degrees, 0.5 + 0.5 * CONFIDENCE_LEVEL) * np.sqrt(variance)
    slopes = coefficients[1:] / width
    outer = np.einsum("ij,ij->i", values, left_out[groups])
    return slopes, float(coefficients[0] - slopes @ middle), half_widths[1:] / width, values @ coefficients, outer


def sobol_indices(values: np.ndarray, names: list[str]) -> xr.Dataset:
    """Return first-order and total Sobol indices with bootstrap intervals.

    Shapes: `values` (base points (factors + 2),).
    """
    sobol = library("SALib.analyze.sobol", "study", "an index of Sobol")
    rows, whole, problem = _whole_rows(values, names, 2, "base points")
    used = rows[whole].ravel()
    if not np.ptp(used) > 0.0:
        raise InputError("a response that is the same at all points", "a response that varies")
    # with the seed 0 the library draws new numbers in each call
    analysed = sobol.analyze(problem, used, calc_second_order=False, num_resamples=BOOTSTRAP_RESAMPLES, seed=1)
    keys = {"first": "S1", "first_interval": "S1_conf", "total": "ST", "total_interval": "ST_conf"}
    indices = {name: ("factor", np.asarray(analysed[key], float), {"units": "1"}) for name, key in keys.items()}
    return xr.Dataset(indices, {"factor": names}, {"left_out": int(np.sum(~whole)), "method": "sobol"})


def morris_indices(points: np.ndarray, values: np.ndarray, names: list[str]) -> xr.Dataset:
    """Return the mean absolute elementary effects of Morris with bootstrap intervals.

    Shapes: `points` (trajectories (factors + 1), factors).
    """
    morris = library("SALib.analyze.morris", "study", "an elementary effect")
    rows, whole, problem = _whole_rows(values, names, 1, "trajectories")
    used = points.reshape(*rows.shape, len(names))[whole].reshape(-1, len(names))
    analysed = morris.analyze(
        problem, used, rows[whole].ravel(), num_levels=MORRIS_LEVELS, num_resamples=BOOTSTRAP_RESAMPLES, seed=0
    )
    keys = {"effect": "mu_star", "effect_interval": "mu_star_conf", "deviation": "sigma"}
    effects: dict[str, Any] = {
        name: ("factor", np.asarray(analysed[key], float) / MORRIS_SCALE, {}) for name, key in keys.items()
    }
    return xr.Dataset(effects, {"factor": names}, {"left_out": int(np.sum(~whole)), "method": "morris"})


def _whole_rows(values: np.ndarray, names: list[str], further: int, what: str) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Return a row of values for each base point or trajectory, a mask of complete rows, and SALib's problem description.

    A row has as many values as `names`, and `further` more; `what` names the rows in an error.
    """
    rows = values.reshape(-1, len(names) + further)
    whole = np.all(np.isfinite(rows), axis=1)
    if whole.sum() < POINTS_MIN:
        raise InputError(f"{whole.sum()} complete {what}", f"at least {POINTS_MIN}")
    return rows, whole, {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}


def sensitivity(study: Study, results: xr.Dataset) -> tuple[dict[str, xr.Dataset], dict[str, str]]:
    """Return the sensitivity indices of each response, if the design supports indices."""
    if study.design.kind not in ("saltelli", "morris"):
        return {}, {}
    points = by_point(study, results)
    names = study.paths
    indices, left_out = dict[str, xr.Dataset](), dict[str, str]()
    for name in (response.name for response in study_responses(study, results)):
        values = np.asarray(points[name].values)
        try:
            if study.design.kind == "saltelli":
                table = sobol_indices(values, names)
            else:
                table = morris_indices(morris_numbers(study.design, len(names)), values, names)
            indices[name] = table.assign_attrs({key: points[name].attrs[key] for key in ("units", "label")})
        except InputError as error:
            left_out[name] = str(error)
    return indices, left_out


def sensitivities(indices: dict[str, xr.Dataset]) -> list[Section]:
    """Return a table of sensitivity indices for each response."""
    tables = []
    for name, table in indices.items():
        factors = [table.sel(factor=factor) for factor in table["factor"].values]
        if table.attrs["method"] == "morris":
            scale = scale_of(table["effect"].assign_attrs(units=table.attrs["units"]))
            head = (scale.label("mean effect"), scale.label("deviation"))
            cells = [[_within(row, "effect", scale), *scale.cells(float(row["deviation"]))] for row in factors]
        else:
            head = ("first order", "total")
            cells = [[_within(row, key, Scale(1.0, "")) for key in ("first", "total")] for row in factors]
        rows = [(str(row["factor"].item()), *texts) for row, texts in zip(factors, cells, strict=True)]
        left_out = table.attrs["left_out"]
        notes = (f"{counted(left_out, 'base point')} with failed cases left out.",) if left_out else ()
        tables.append(Section((f"{name} depends on", *head), rows, f"What {name} depends on", notes))
    return tables


def _within(row: xr.Dataset, key: str, scale: Scale) -> str:
    """Return an index with half of its interval as text."""
    value, half = scale.cells(float(row[key]), float(row[f"{key}_interval"]))
    return f"{value} ± {half}"


def rankings(study: Study, results: xr.Dataset, fitted: Mapping[str, tuple[Trend, ...]]) -> list[Section]:
    """Return a table of rank correlations with the parameters, and their intervals, for each response without a clear trend."""
    names = [factor.name for factor in study.varied if not factor.labels]
    if len(names) < 2 or study.design.kind in ("saltelli", "morris"):
        return []
    numbers = np.stack([results[column(name)].values[:: study.members] for name in names], axis=1)
    tables = list[Section]()
    for response in study_responses(study, results):
        values = case_values(study, results, response)[:: study.members]
        rows = ~np.isnan(values) & np.all(np.isfinite(numbers), axis=1)
        clear = any(trend.clear for trend in fitted.get(response.name, ())[:1])
        if clear or rows.sum() < POINTS_MIN or np.unique(values[rows]).size < 3:
            continue
        tables.append(_table(response.name, names, numbers[rows], values[rows]))
    return tables


def _table(response: str, names: list[str], numbers: np.ndarray, values: np.ndarray) -> Section:
    correlations, order, first, chance = rank_parameters(numbers, values)
    count = np.array([np.unique(numbers[:, k]).size for k in range(len(names))])
    # half of the interval of the inverse hyperbolic tangent (Bonett and Wright 2000, doi:10.1007/BF02294183)
    normal = ndtri(0.5 + 0.5 * CONFIDENCE_LEVEL)
    half = normal * np.sqrt((1.0 + 0.5 * correlations**2) / np.maximum(count - 3, 1))
    rows = []
    for k in order[:LISTED_MAX]:
        middle = math.atanh(max(-0.9999, min(0.9999, correlations[k])))
        low, high = (math.tanh(middle + sign * half[k]) for sign in (-1.0, 1.0))
        beyond = "yes" if abs(correlations[k]) > chance[k] else "no"
        rows.append((names[k], f"{correlations[k]:+.2f}", f"{low:+.2f} to {high:+.2f}", beyond, f"{first[k]:.0%}"))
    head = (f"{response} goes with", "rank correlation", "95 % interval", "beyond chance", "first in resamples")
    note = (
        f"{values.size} samples of {len(names)} parameters: by chance alone the largest correlation exceeds "
        f"{float(chance.max()):.2f} in 5 % of such samples."
    )
    return Section(head, rows, f"Parameters that {response} correlates with", (note,))


def rank_parameters(numbers: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return rank correlations, their order by size, how often each is the largest, and the size that chance exceeds in 5 %.

    A parameter with fewer distinct values than samples counts with the number of its values.
    """
    correlations = _correlations(numbers, values)
    order = np.argsort(-np.abs(correlations), kind="stable")
    draw = np.random.default_rng(0).integers(values.size, size=(BOOTSTRAP_RESAMPLES, values.size))
    winners = [int(np.argmax(np.abs(_correlations(numbers[rows], values[rows])))) for rows in draw]
    first = np.bincount(winners, minlength=numbers.shape[1]) / BOOTSTRAP_RESAMPLES
    count = np.array([max(np.unique(column).size, 4) for column in numbers.T])
    level = CONFIDENCE_LEVEL ** (1.0 / numbers.shape[1])
    t = stdtrit(count - 2, 0.5 + 0.5 * level)
    return correlations, order, first, t / np.sqrt(count - 2 + t**2)


def _correlations(numbers: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return Spearman's correlation of each column with the values; 0 for a constant column."""
    from scipy.stats import rankdata  # scipy.stats takes longer to import than a small study

    x = rankdata(numbers, axis=0)
    x, y = x - x.mean(axis=0), rankdata(values)
    y = y - y.mean()
    spread = np.sqrt(np.sum(x**2, axis=0) * np.sum(y**2))
    return np.asarray(np.divide(x.T @ y, spread, out=np.zeros_like(spread), where=spread > 0.0))
