"""Estimates from many cheap runs and a few accurate ones of the same cases: means, fractions and quantiles, with intervals.

Accurate runs are paired with cheap ones, which are a control variate (Peherstorfer, Willcox, Gunzburger, SIAM J. Sci. Comput.
38, A3163, 2016, doi:10.1137/15M1046472). A mean is that of a regression of the accurate on the cheap response, at the mean of
all cheap runs. For a fraction, whose responses are 0 and 1, it is the sum over both strata of the cheap runs, whose interval
contains the uncertainty of all three fractions. A quantile is where the interval of a fraction contains its level.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv, stdtrit

from scissordyn.tolerance import CONFIDENCE_LEVEL

# Number of draws from each fraction's posterior distribution; the sum's interval is accurate to 0.02 of its width
POSTERIOR_DRAWS = 4000
# [-] added to the successes and to the failures of a fraction (Brown, Cai, DasGupta, Statist. Sci. 16, 101 (2001))
JEFFREYS_PRIOR = 0.5
REGRESSION_PAIRS_MIN = 4  # Smallest number of pairs of coarse and fine runs for a regression; residuals need degrees of freedom


@dataclass(frozen=True)
class Estimate:
    """Estimate of a number from cheap and accurate runs, with its 95 % interval."""

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

    @property
    def width(self) -> float:
        return self.high - self.low

    @property
    def saved(self) -> float:
        """Number of accurate runs that alone give an interval as narrow, divided by `verified`; NaN without an interval."""
        alone = self.accurate_high - self.accurate_low
        return (alone / self.width) ** 2 if self.width > 0.0 and math.isfinite(alone) else math.nan


def correlation(accurate: np.ndarray, cheap: np.ndarray) -> float:
    """Return the correlation of the pairs; NaN if one of the two does not vary."""
    spread = float(np.std(accurate)) * float(np.std(cheap)) if accurate.size > 1 else 0.0
    return float(np.mean((accurate - accurate.mean()) * (cheap - cheap.mean())) / spread) if spread > 0.0 else math.nan


def mean_estimate(accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray) -> Estimate:
    """Estimate the mean of the accurate response by a control variate, with Student's interval.

    Shapes: `accurate` (m,), `paired` (m,) cheap runs of the same cases, `cheap` (N,) all cheap runs.
    """
    m, n = accurate.size, cheap.size
    alone = _student(accurate)
    if m < REGRESSION_PAIRS_MIN or not np.ptp(paired) > 0.0:
        return Estimate(*alone, _mean(cheap), *alone, math.nan, n, m)
    deviations = paired - paired.mean()
    squares = float(np.sum(deviations**2))
    slope = float(np.sum(deviations * (accurate - accurate.mean()))) / squares
    shift = float(cheap.mean() - paired.mean())
    value = float(accurate.mean()) + slope * shift
    residual = float(np.sum((accurate - accurate.mean() - slope * deviations) ** 2)) / (m - 2)
    variance = residual * (1.0 / m + shift**2 / squares) + slope**2 * float(np.var(cheap, ddof=1)) / n
    half = float(stdtrit(m - 2, 0.5 + 0.5 * CONFIDENCE_LEVEL)) * math.sqrt(variance)
    return Estimate(value, value - half, value + half, _mean(cheap), *alone, correlation(accurate, paired), n, m)


def fraction_estimate(accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray) -> Estimate:
    """Estimate the fraction of cases whose accurate run gives 1 (true) and not 0.

    Shapes: `accurate` (m,), `paired` (m,) cheap runs of the same cases, `cheap` (N,) all cheap runs.
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
    """Estimate the quantiles of the accurate response at given levels.

    Shapes: `accurate` (m,), `paired` (m,) cheap runs of the same cases, `cheap` (N,) all cheap runs.
    """
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
        combined, accurate_only = _inverted(values, steps, level), _inverted(values, alone, level)
        cheap_value = float(np.quantile(cheap, level, method="inverted_cdf")) if cheap.size else math.nan
        quantiles.append(Estimate(*combined, cheap_value, *accurate_only, correlated, cheap.size, accurate.size))
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


def cost_ratio(correlated: float, accurate_seconds: float, cheap_seconds: float) -> float:
    """Return the optimal number of cheap runs for each accurate run; 1 if cheap runs do not reduce the cost.

    sqrt(rho^2/(1 - rho^2) w/w_cheap), Peherstorfer et al. 2016.
    """
    squared = correlated**2 if math.isfinite(correlated) else 0.0
    unexplained = max(1.0 - squared, np.finfo(float).eps)  # known to round-off
    return max(1.0, math.sqrt(squared / unexplained * accurate_seconds / cheap_seconds))


def split(budget: float, correlated: float, accurate_seconds: float, cheap_seconds: float) -> tuple[int, int]:
    """Return the numbers of accurate and of cheap runs within a budget of work [s]."""
    ratio = cost_ratio(correlated, accurate_seconds, cheap_seconds)
    verified = max(1, int(budget / (accurate_seconds + ratio * cheap_seconds)))
    screened = max(verified, int((budget - verified * accurate_seconds) / cheap_seconds))
    return verified, screened


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if values.size else math.nan


def _student(values: np.ndarray) -> tuple[float, float, float]:
    """Return the mean with Student's interval."""
    value = _mean(values)
    if values.size < 2:
        return value, -math.inf, math.inf
    error = float(np.std(values, ddof=1)) / math.sqrt(values.size)
    half = float(stdtrit(values.size - 1, 0.5 + 0.5 * CONFIDENCE_LEVEL)) * error
    return value, value - half, value + half


def fraction_interval(successes: float, trials: int, prior: float = 0.0) -> tuple[float, float]:
    """Return the interval of a fraction by Clopper and Pearson, or by Jeffreys with a prior of `JEFFREYS_PRIOR`.

    That of Clopper and Pearson is conservative where successes are fractions, and for stratified samples.
    """
    tail, failures = 0.5 * (1.0 - CONFIDENCE_LEVEL), trials - successes
    low = 0.0 if successes <= 0.0 else float(betaincinv(successes + prior, failures + 1.0 - prior, tail))
    high = 1.0 if failures <= 0.0 else float(betaincinv(successes + 1.0 - prior, failures + prior, 1.0 - tail))
    return low, high
