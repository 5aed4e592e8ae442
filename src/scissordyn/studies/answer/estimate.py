"""Estimates from many cheap runs and a few accurate ones of the same cases: means, fractions and quantiles, with intervals.

The accurate runs are paired with cheap ones, which a control variate uses: Peherstorfer, Willcox, Gunzburger, SIAM J. Sci.
Comput. 38, A3163 (2016), doi:10.1137/15M1046472. A mean is that of a regression of the accurate on the cheap response, at the
mean of all cheap runs; that mean itself, where an interpolation between them predicts further cases, is one of a regression of
the cheap on the predicted response. For a fraction, whose responses are yes and no, the same estimate is the sum over both
strata of the cheap runs; its interval has the uncertainty of all three fractions in it. A quantile is where the interval of a
fraction holds its level.

The fraction of cases that meet a bound is known better by how far cheap and accurate runs are from it. Yes and no say little
where both kinds of runs agree: a hundred pairs none of which differ leave two of a hundred open. By how much margins differ
says at which margin of a cheap run an accurate one may still be on the other side of the bound. Near each cheap margin the
accurate one is a straight line of it and the residuals of the nearest pairs; the fraction is the mean of the part of these
residuals with which the bound is met, over all cheap runs, or over the further cases whose margins an interpolation predicts,
corrected by what it misses of the cheap runs. Its variance is that of this mean, of the pairs (by leaving out groups of them,
the jackknife), and of half a pair that is like no other.

Interpolation is kriging by a Gaussian process of scikit-learn: anisotropic Matern 5/2 correlation and noise, with the lengths
and variances of largest likelihood (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5).
Between cheap runs it is the third and cheapest model of an estimate, over all numbers that vary, chosen and uncertain. Runs are
predicted in four groups, each by an interpolation between runs of the others, which predicts a fourth of the further cases too:
what it misses there is what it misses of its group, in the mean. Nothing else is believed of it: an estimate takes this mean,
and where interpolation says little it changes little. Residuals of runs that are left out one by one would not do: they depend
on each other.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

from scissordyn.record.transmitted import CHUNK_ROWS
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import POINTS_MIN, Design
from scissordyn.studies.ask.requirement import Response, response_values
from scissordyn.studies.compute.table import column
from scissordyn.tolerance import CONFIDENCE_LEVEL, STANDARD_ERRORS_MAX

POSTERIOR_DRAWS = 4000  # [draws] of the three fractions; the ends of the interval of the sum are known to 0.02 of its width
# [-] successes and failures added to those of a fraction (Brown, Cai, DasGupta, Statist. Sci. 16, 101 (2001))
JEFFREYS_PRIOR = 0.5
REGRESSION_PAIRS_MIN = 4  # [pairs of runs] smallest number for a regression
MARGIN_PAIRS_MIN = 16  # [pairs of runs] smallest number for which margins are used
MARGIN_CORRELATION_MIN = 0.8  # [-] correlation above which margins estimate better than success and failure
JACKKNIFE_GROUPS = 32  # [groups] left out in turn by the jackknife
JACKKNIFE_QUANTILES = 1000  # [quantiles] that represent the cheap margins in the jackknife


STARTS = (0.3, 1.0)  # Correlation lengths of the unit cube from which the likelihood is climbed
LENGTHS, NOISE, VARIANCES = (0.05, 20.0), (1e-8, 1.0), (1e-2, 1e4)  # Within which the likelihood is climbed
LOGARITHM_RATIO_MIN = 5.0  # [-] ratio of largest to smallest value above which the logarithm is interpolated
INTERPOLATION_RUNS_MIN = 32  # [runs] smallest number for an interpolation
VALIDATION_GROUPS = 4  # [groups] of runs; each is predicted by an interpolation between the others
FITTED_RUNS_MAX = 128  # [runs] largest number for kriging, whose effort grows with its third power
PREDICTED_CASES = 2**16  # [cases] predicted by the interpolation


@dataclass(frozen=True)
class Estimate:
    """A number known from cheap and accurate runs."""

    value: float  # Estimate from both kinds of runs, then its 95 % interval
    low: float
    high: float
    cheap: float  # Estimate from the cheap runs alone
    accurate: float  # Estimate from the accurate runs alone, then its interval
    accurate_low: float
    accurate_high: float
    correlation: float  # Correlation of the pairs; NaN if one of them does not vary
    screened: int  # Number of cheap runs, and of accurate ones
    verified: int
    interpolated: bool = False  # True if the estimate includes an interpolation between the cheap runs

    @property
    def width(self) -> float:
        return self.high - self.low

    @property
    def saved(self) -> float:
        """Factor by which more accurate runs alone would be needed for this interval; NaN without an interval."""
        alone = self.accurate_high - self.accurate_low
        return (alone / self.width) ** 2 if self.width > 0.0 and math.isfinite(alone) else math.nan


@dataclass(frozen=True)
class Predicted:
    """Prediction of an interpolation between cheap runs."""

    of_runs: np.ndarray  # (N,) Of these runs, each by others
    others: np.ndarray  # (M,) Of further cases


def correlation(accurate: np.ndarray, cheap: np.ndarray) -> float:
    """Return the correlation of the pairs; NaN if one of the two does not vary."""
    spread = float(np.std(accurate)) * float(np.std(cheap)) if accurate.size > 1 else 0.0
    return float(np.mean((accurate - accurate.mean()) * (cheap - cheap.mean())) / spread) if spread > 0.0 else math.nan


def population_mean(cheap: np.ndarray, predicted: Predicted | None = None) -> tuple[float, float]:
    """Return the mean of the cheap response over all possible cases, and its variance.

    Shapes: `cheap` (N,).
    """
    alone = float(cheap.mean()), float(np.var(cheap, ddof=1)) / cheap.size
    if predicted is None or not np.ptp(predicted.of_runs) > 0.0:
        return alone
    squares, slope, value, residual = _regressed(cheap, predicted.of_runs, float(predicted.others.mean()))
    shift = float(predicted.others.mean() - predicted.of_runs.mean())
    variance = residual * (1.0 / cheap.size + shift**2 / squares)
    return value, variance + slope**2 * float(np.var(predicted.others, ddof=1)) / predicted.others.size


def unseen_outliers(pairs: int) -> float:
    """Return the mean square of the fraction of cases without correlation, if none was seen among the pairs.

    The part has the distribution of Jeffreys.
    """
    part = stats.beta(JEFFREYS_PRIOR, pairs + JEFFREYS_PRIOR)
    return float(part.var() + part.mean() ** 2)


def _regressed(wanted: np.ndarray, predictor: np.ndarray, at: float) -> tuple[float, float, float, float]:
    """Fit a regression: sum of squares, slope, value at a given point, variance of the residuals."""
    squares = float(np.sum((predictor - predictor.mean()) ** 2))
    slope = float(np.sum((predictor - predictor.mean()) * (wanted - wanted.mean()))) / squares
    rest = wanted - wanted.mean() - slope * (predictor - predictor.mean())
    value = float(wanted.mean()) + slope * (at - float(predictor.mean()))
    return squares, slope, value, float(np.sum(rest**2)) / (wanted.size - 2)


def mean_estimate(accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray, predicted: Predicted | None = None) -> Estimate:
    """Estimate the mean of the accurate response.

    Shapes: `accurate` (m,), `paired` (m,), `cheap` (N,).
    """
    m, n = accurate.size, cheap.size
    alone = _student(accurate)
    if m < REGRESSION_PAIRS_MIN or not np.ptp(paired) > 0.0:
        return Estimate(*alone, _mean(cheap), *alone, math.nan, n, m)
    centre, uncertain = population_mean(cheap, predicted)
    squares, slope, value, residual = _regressed(accurate, paired, centre)
    variance = residual * (1.0 / m + (centre - float(paired.mean())) ** 2 / squares) + slope**2 * uncertain
    variance += unseen_outliers(m) * float(np.var(accurate, ddof=1))
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE_LEVEL, m - 2)) * math.sqrt(variance)
    correlated, interpolated = correlation(accurate, paired), predicted is not None
    return Estimate(value, value - half, value + half, _mean(cheap), *alone, correlated, n, m, interpolated)


def fraction_estimate(accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray) -> Estimate:
    """Estimate the fraction of cases that are true in accurate runs.

    Shapes: `accurate` (m,), `paired` (m,), `cheap` (N,).
    """
    accurate, paired, cheap = (np.asarray(values, float) for values in (accurate, paired, cheap))
    m, n = accurate.size, cheap.size
    correlated = correlation(accurate, paired)
    if not m:
        return Estimate(math.nan, 0.0, 1.0, _mean(cheap), math.nan, 0.0, 1.0, correlated, n, m)
    alone = float(accurate.mean()), *fraction_interval(float(accurate.sum()), m, JEFFREYS_PRIOR)
    if not all(np.all((values == 0.0) | (values == 1.0)) for values in (accurate, paired, cheap)):
        by_mean = mean_estimate(accurate, paired, cheap)
        if m >= REGRESSION_PAIRS_MIN and by_mean.high > by_mean.low:
            low, high, value = max(0.0, by_mean.low), min(1.0, by_mean.high), min(1.0, max(0.0, by_mean.value))
            return Estimate(value, low, high, _mean(cheap), *alone, correlated, n, m)
        return Estimate(*alone, _mean(cheap), *alone, correlated, n, m)
    yes, total = float(cheap.sum()), float(n)
    pairs = [(float(accurate[paired == stratum].sum()), int(np.sum(paired == stratum))) for stratum in (1.0, 0.0)]
    weights = (yes / total, 1.0 - yes / total)
    # a stratum without a pair gets the mean of all pairs
    within = [hits / of if of else float(accurate.mean()) for hits, of in pairs]
    value = weights[0] * within[0] + weights[1] * within[1]
    numbers = np.random.default_rng(0)
    share = numbers.beta(yes + JEFFREYS_PRIOR, total - yes + JEFFREYS_PRIOR, POSTERIOR_DRAWS)
    hits_if_yes, hits_if_no = (
        numbers.beta(hits + JEFFREYS_PRIOR, of - hits + JEFFREYS_PRIOR, POSTERIOR_DRAWS) for hits, of in pairs
    )
    tail = 0.5 * (1.0 - CONFIDENCE_LEVEL)
    low, high = (float(values) for values in np.quantile(share * hits_if_yes + (1.0 - share) * hits_if_no, [tail, 1.0 - tail]))
    low = 0.0 if accurate.sum() == 0.0 else min(low, value)
    high = 1.0 if accurate.sum() == m else max(high, value)
    return Estimate(value, low, high, _mean(cheap), *alone, correlated, n, m)


def quantile_estimates(accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray, levels: Sequence[float]) -> list[Estimate]:
    order = np.argsort(accurate, kind="stable")
    values, correlated = accurate[order], correlation(accurate, paired)
    steps, alone = [], []
    for x in values:
        # the cheap response that splits the pairs as x does
        threshold = np.sort(paired)[int(np.sum(accurate <= x)) - 1]
        step = fraction_estimate(accurate <= x, paired <= threshold, cheap <= threshold)
        steps.append((step.value, step.low, step.high))
        alone.append((step.accurate, step.accurate_low, step.accurate_high))
    quantiles = []
    for level in levels:
        both, single = _inverted(values, steps, level), _inverted(values, alone, level)
        cheap_value = float(np.quantile(cheap, level, method="inverted_cdf")) if cheap.size else math.nan
        quantiles.append(Estimate(*both, cheap_value, *single, correlated, cheap.size, accurate.size))
    return quantiles


def _inverted(values: np.ndarray, fractions: list[tuple[float, float, float]], level: float) -> tuple[float, float, float]:
    """Find the value at which a rising fraction reaches a level, and the interval of this value."""
    if not values.size:
        return math.nan, -math.inf, math.inf
    middle, low, high = (np.maximum.accumulate(np.array(ends)) for ends in zip(*fractions, strict=True))
    at, first, last = (int(np.searchsorted(rising, level)) for rising in (middle, high, low))
    return (
        float(values[min(at, values.size - 1)]),
        float(values[first]) if first > 0 else -math.inf,
        float(values[last]) if last < values.size else math.inf,
    )


def cost_ratio(correlated: float, accurate_seconds: float, cheap_seconds: float, unpredicted: float = 1.0) -> float:
    """Return the optimal number of cheap runs for each accurate run; 1 if cheap runs do not reduce the cost.

    sqrt(u rho^2/(1 - rho^2) w/w_cheap), Peherstorfer et al. 2016, with two models, or three of which the third costs nothing
    and leaves the part u of the variance of the second; one accurate run for a hundred thousand cheap ones at most.
    """
    squared = min(correlated**2, 1.0 - 1e-10) if math.isfinite(correlated) else 0.0
    ratio = math.sqrt(unpredicted * squared / (1.0 - squared) * accurate_seconds / max(cheap_seconds, 1e-12))
    return min(max(1.0, ratio), 1e5)


def split(
    budget: float, correlated: float, accurate_seconds: float, cheap_seconds: float, unpredicted: float = 1.0
) -> tuple[int, int]:
    ratio = cost_ratio(correlated, accurate_seconds, cheap_seconds, unpredicted)
    verified = max(1, int(budget / (accurate_seconds + ratio * cheap_seconds)))
    screened = max(verified, int((budget - verified * accurate_seconds) / max(cheap_seconds, 1e-12)))
    return verified, screened


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if values.size else math.nan


def _student(values: np.ndarray) -> tuple[float, float, float]:
    """Return the mean with Student's interval."""
    value = _mean(values)
    if values.size < 2:
        return value, -math.inf, math.inf
    error = float(np.std(values, ddof=1)) / math.sqrt(values.size)
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE_LEVEL, values.size - 1)) * error
    return value, value - half, value + half


def fraction_interval(successes: float, trials: int, prior: float = 0.0) -> tuple[float, float]:
    """Return the interval of a fraction by Clopper and Pearson, or by Jeffreys with a prior of `JEFFREYS_PRIOR`.

    That of Clopper and Pearson is conservative where successes are fractions, and for stratified samples.
    """
    tail, failures = 0.5 * (1.0 - CONFIDENCE_LEVEL), trials - successes
    low = 0.0 if successes <= 0.0 else float(stats.beta.ppf(tail, successes + prior, failures + 1.0 - prior))
    high = 1.0 if failures <= 0.0 else float(stats.beta.ppf(1.0 - tail, successes + 1.0 - prior, failures + prior))
    return low, high


def fraction_by_margins(
    accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray, predicted: Predicted | None = None
) -> Estimate:
    """Estimate the fraction of cases whose accurate margin is positive.

    Shapes: `accurate` (m,), `paired` (m,), `cheap` (N,).
    """
    by_strata = fraction_estimate(accurate > 0.0, paired > 0.0, cheap > 0.0)
    m = accurate.size
    if m < MARGIN_PAIRS_MIN or not all(np.all(np.isfinite(margins)) for margins in (accurate, paired, cheap)):
        return by_strata
    correlated = correlation(accurate, paired)
    if not correlated >= MARGIN_CORRELATION_MIN:
        return by_strata
    order = np.argsort(paired, kind="stable")
    accurate, paired = accurate[order], paired[order]
    chances = _chances(accurate, paired, paired)
    spread = math.sqrt(float(np.sum(chances * (1.0 - chances))) + JEFFREYS_PRIOR**2)
    if abs(float(np.sum(accurate > 0.0) - np.sum(chances))) > STANDARD_ERRORS_MAX * spread:
        return by_strata
    if predicted is not None:
        predicted = Predicted(*(_chances(accurate, paired, margins) for margins in (predicted.of_runs, predicted.others)))
    value, variance = population_mean(_chances(accurate, paired, cheap), predicted)
    value = min(1.0, max(0.0, value))
    variance += _variance_of_pairs(accurate, paired, np.sort(cheap))
    variance += unseen_outliers(m) * (1.0 / 12.0 + (0.5 - value) ** 2)  # of them any part meets the bound
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE_LEVEL, min(m, JACKKNIFE_GROUPS) - 1)) * math.sqrt(variance)
    low, high = max(0.0, value - half), min(1.0, value + half)
    return replace(by_strata, value=value, low=low, high=high, correlation=correlated, interpolated=predicted is not None)


def _chances(accurate: np.ndarray, paired: np.ndarray, margins: np.ndarray) -> np.ndarray:
    """Return the fraction of residuals near each cheap margin that make the accurate margin positive."""
    near = min(accurate.size, max(POINTS_MIN, round(2.0 * math.sqrt(accurate.size))))
    there, here = (np.lib.stride_tricks.sliding_window_view(pairs, near) for pairs in (accurate, paired))
    middle, centre = there.mean(axis=1), here.mean(axis=1)
    apart = here - centre[:, None]
    squares = np.sum(apart**2, axis=1)
    varies = squares > np.finfo(float).eps * np.sum(here**2, axis=1)
    slope = np.divide(np.sum(apart * there, axis=1), squares, out=np.ones_like(squares), where=varies)
    residuals = (there - middle[:, None] - slope[:, None] * apart) * math.sqrt(near / (near - 2.0))
    place = (np.searchsorted(paired, margins) + np.searchsorted(paired, margins, side="right") - near) // 2
    first = np.clip(place, 0, accurate.size - near)
    expected = middle[first] + slope[first] * (margins - centre[first])
    return np.asarray(np.mean(residuals[first] > -expected[:, None], axis=1))


def _variance_of_pairs(accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray) -> float:
    """Estimate the variance of the fraction by a jackknife over groups of pairs spread evenly over the margins."""
    groups = min(accurate.size, JACKKNIFE_GROUPS)
    count = min(cheap.size, JACKKNIFE_QUANTILES)
    places = cheap[((np.arange(count) + 0.5) * (cheap.size / count)).astype(int)]
    group = np.arange(accurate.size) % groups
    left = np.array([np.mean(_chances(accurate[group != k], paired[group != k], places)) for k in range(groups)])
    return (groups - 1.0) / groups * float(np.sum((left - left.mean()) ** 2))


class Kriging:
    """A response as a function of numbers, interpolated between points.

    Shapes: `x` (n, numbers), `values` (n,), `logarithmic` (numbers,), `left_out` (n,).
    """

    def __init__(self, x: np.ndarray, values: np.ndarray, logarithmic: np.ndarray) -> None:
        self._log = np.asarray(logarithmic, bool)
        terms = self._terms(x)
        self._low, self._width = terms.min(axis=0), np.maximum(np.ptp(terms, axis=0), 1e-300)
        self.of_logarithm = bool(values.min() > 0.0 and values.max() > LOGARITHM_RATIO_MIN * values.min())
        y = np.log(values) if self.of_logarithm else np.asarray(values, float)
        self._shift, self._scale = float(y.mean()), float(y.std()) or 1.0
        self.process = _likeliest(self._unit(x), (y - self._shift) / self._scale)
        self._leave_out(values)

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the predicted response and its standard deviation.

        Shapes: `x` (m, numbers); returns `mean, deviation` (m,).
        """
        mean, deviation = self.process.predict(self._unit(x), return_std=True)
        y, deviation = self._shift + self._scale * mean, self._scale * deviation
        return (np.exp(y), np.exp(y) * deviation) if self.of_logarithm else (y, deviation)

    def expected(self, x: np.ndarray) -> np.ndarray:
        """Return the predicted response at many points, without its uncertainty.

        Shapes: `x` (m, numbers).
        """
        parts = [self.process.predict(self._unit(part)) for part in np.array_split(x, max(1, x.shape[0] // CHUNK_ROWS))]
        y = self._shift + self._scale * np.concatenate(parts)
        return np.exp(y) if self.of_logarithm else y

    def _terms(self, x: np.ndarray) -> np.ndarray:
        return np.where(self._log, np.log(np.where(self._log, x, 1.0)), x)

    def _unit(self, x: np.ndarray) -> np.ndarray:
        return np.asarray((self._terms(x) - self._low) / self._width)

    def _leave_out(self, values: np.ndarray) -> None:
        """Predict each point from the others in closed form (Rasmussen and Williams, equations 5.10 to 5.12)."""
        inverse = np.linalg.inv(self.process.L_ @ self.process.L_.T)
        y = self._shift + self._scale * (self.process.y_train_ - self.process.alpha_ / np.diag(inverse))
        self.left_out = np.exp(y) if self.of_logarithm else y
        errors = values - self.left_out
        spread = float(np.sum((values - values.mean()) ** 2))
        self.predicted = 1.0 - float(np.sum(errors**2)) / spread if spread > 0.0 else 0.0
        self.error = float(np.sqrt(np.mean(errors**2)) / max(float(np.mean(np.abs(values))), 1e-300))


def _likeliest(x: np.ndarray, y: np.ndarray) -> Any:
    """Fit a Gaussian process from several starts and return the one with the largest likelihood."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    processes = []
    for start in STARTS:
        correlation = Matern([start] * x.shape[1], LENGTHS, nu=2.5)
        kernel = ConstantKernel(1.0, VARIANCES) * correlation + WhiteKernel(1e-4, NOISE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a number at its bound: a length without influence
            processes.append(GaussianProcessRegressor(kernel, alpha=1e-10).fit(x, y))
    return max(processes, key=lambda process: process.log_marginal_likelihood_value_)


class Interpolation:
    """Responses of cheap runs, what others say of each, and those of further cases of the same study.

    Shapes: `x` (n, numbers), `further` (m, numbers), `logarithmic` (numbers,).
    """

    def __init__(self, x: np.ndarray, further: np.ndarray, logarithmic: np.ndarray, runs: xr.Dataset) -> None:
        self._x, self._further, self._logarithmic, self._runs = x, further, logarithmic, runs
        self.response = cache(self._response)

    def unpredicted(self, wanted: Response) -> float:
        """Return the fraction of a response's variance that the interpolation does not predict; 1 without interpolation."""
        predicted = self.response(wanted)
        if predicted is None:
            return 1.0
        values = response_values(self._runs, wanted)
        return min(1.0, float(np.mean((values - predicted.of_runs) ** 2) / np.var(values)))

    def _response(self, wanted: Response) -> Predicted | None:
        """Return a response at the runs and at the further cases; None if it is not finite or does not vary."""
        values = response_values(self._runs, wanted)
        if not np.all(np.isfinite(values)) or np.ptp(values) == 0.0:
            return None
        of_runs, others = [], []
        # parts that follow each other: every fourth point of a Sobol sequence fills a fourth of the cube alone
        parts = (np.array_split(np.arange(x.shape[0]), VALIDATION_GROUPS) for x in (self._x, self._further))
        for here, there in zip(*parts, strict=True):
            fitted = np.setdiff1d(np.arange(values.size), here)[:FITTED_RUNS_MAX]
            model = Kriging(self._x[fitted], values[fitted], self._logarithmic)
            of_runs.append(model.expected(self._x[here]))
            others.append(model.expected(self._further[there]))
        return Predicted(np.concatenate(of_runs), np.concatenate(others))


def interpolation(study: Study, results: xr.Dataset, cases: Sequence[int] | np.ndarray) -> Interpolation | None:
    """Return an interpolation between the runs of a study; None for few runs, or if names vary."""
    varied = study.varied
    if len(cases) < max(INTERPOLATION_RUNS_MIN, 4 * len(varied)) or any(factor.labels for factor in varied):
        return None
    numbers = _evenly_spread(study).numbers(np.arange(PREDICTED_CASES))
    runs = results.isel(case=np.asarray(cases))
    return Interpolation(
        np.stack([runs[column(name)].values for name in study.factor_names], axis=1),
        np.stack([numbers[name] for name in study.factor_names], axis=1),
        np.array([factor.logarithmic for factor in varied]),
        runs,
    )


def _evenly_spread(study: Study) -> Study:
    """Return the study with further cases on a Sobol sequence over all parameters."""
    sampling = study.sampling
    if not study.factors:
        return replace(study, sampling=replace(sampling, kind="sobol", samples=PREDICTED_CASES))
    return replace(
        study,
        design=Design("sobol", PREDICTED_CASES, study.design.seed),
        sampling=sampling if sampling.common else replace(sampling, kind="sobol"),
    )
