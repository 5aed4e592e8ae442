"""Fraction of cases that meet a bound, from how far cheap and accurate runs are from it.

Yes and no say little where both kinds of runs agree: a hundred pairs none of which differs leave two of a hundred open. By how
much margins differ says at which margin of a cheap run an accurate one may still be on the other side of the bound. Near each
cheap margin the accurate one is a straight line of it and the residuals of the nearest pairs; the fraction is the mean of the
part of these residuals with which the bound is met, over all cheap runs, or over the further cases whose margins an
interpolation predicts, corrected by what it misses of the cheap runs. Its variance is that of this mean, of the pairs (by
leaving out groups of them, the jackknife), and of half a pair that is like no other.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from scissordyn.study.answer.control_variate import (
    CONFIDENCE,
    JEFFREYS,
    Estimate,
    Predicted,
    correlation,
    fraction_estimate,
    population_mean,
    unseen_outliers,
)

FEWEST = 16  # Pairs with which margins are used
CORRELATED = 0.8  # Of the margins, from which they say more than yes and no
NEAREST = 8  # The fewest pairs of a straight line
GROUPS = 32  # Of the jackknife
PLACES = 1000  # Quantiles of the cheap margins that stand for all of them in the jackknife

CONTRADICTED = 2.0
"""Standard deviations between the pairs that meet the bound and as many as margins predict, from which margins are not used."""


def fraction_by_margins(
    accurate: np.ndarray, paired: np.ndarray, cheap: np.ndarray, predicted: Predicted | None = None
) -> Estimate:
    """Fraction of the cases whose accurate margin is positive.

    Shapes: `accurate` (m,), `paired` (m,), `cheap` (N,).
    """
    by_strata = fraction_estimate(accurate > 0.0, paired > 0.0, cheap > 0.0)
    m, n = accurate.size, cheap.size
    if m < FEWEST or not all(np.all(np.isfinite(margins)) for margins in (accurate, paired, cheap)):
        return by_strata
    correlated = correlation(accurate, paired)
    if not correlated >= CORRELATED:
        return by_strata
    order = np.argsort(paired, kind="stable")
    accurate, paired = accurate[order], paired[order]
    chances = _chances(accurate, paired, paired)
    spread = math.sqrt(float(np.sum(chances * (1.0 - chances))) + JEFFREYS**2)
    if abs(float(np.sum(accurate > 0.0) - np.sum(chances))) > CONTRADICTED * spread:
        return by_strata
    predicted_chances = None
    if predicted is not None:
        predicted_chances = Predicted(
            *(_chances(accurate, paired, margins) for margins in (predicted.of_runs, predicted.others))
        )
    value, variance = population_mean(_chances(accurate, paired, cheap), predicted_chances)
    value = min(1.0, max(0.0, value))
    variance += _variance_of_pairs(accurate, paired, np.sort(cheap))
    variance += unseen_outliers(m) * (1.0 / 12.0 + (0.5 - value) ** 2)  # of them any part meets the bound
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, min(m, GROUPS) - 1)) * math.sqrt(variance)
    alone = by_strata.accurate, by_strata.accurate_low, by_strata.accurate_high
    low, high = max(0.0, value - half), min(1.0, value + half)
    return Estimate(value, low, high, by_strata.cheap, *alone, correlated, n, m, predicted_chances is not None)


def _chances(accurate: np.ndarray, paired: np.ndarray, margins: np.ndarray) -> np.ndarray:
    """Part of the residuals near each cheap margin with which the accurate one is positive; pairs in the order of `paired`."""
    near = min(accurate.size, max(NEAREST, round(2.0 * math.sqrt(accurate.size))))
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
    """Of the fraction, by leaving out groups of pairs that are spread evenly over the margins."""
    groups = min(accurate.size, GROUPS)
    places = cheap[((np.arange(min(cheap.size, PLACES)) + 0.5) * (cheap.size / min(cheap.size, PLACES))).astype(int)]
    group = np.arange(accurate.size) % groups
    left = np.array([np.mean(_chances(accurate[group != k], paired[group != k], places)) for k in range(groups)])
    return (groups - 1.0) / groups * float(np.sum((left - left.mean()) ** 2))
