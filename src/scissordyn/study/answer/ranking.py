"""Which numbers a response without a clear trend goes with most: rank correlations, from any sample."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy import stats

from scissordyn.study.answer.control_variate import CONFIDENCE
from scissordyn.study.answer.summary import Section
from scissordyn.study.answer.trend import Trend
from scissordyn.study.answer.verdict import answered, case_values
from scissordyn.study.ask.description import Study
from scissordyn.study.compute.table import column

FEWEST = 6  # Values of a response below which nothing is ranked
SHOWN = 6  # Numbers that a table has
RESAMPLES = 400  # Of the bootstrap that says how often a number is the first


def rankings(study: Study, results: xr.Dataset, fitted: Mapping[str, tuple[Trend, ...]]) -> list[Section]:
    """A table for each response without a clear trend: the numbers by their rank correlation with it, and how sure that is."""
    names = [factor.name for factor in (*study.factors, *study.uncertain) if not factor.labels]
    if len(names) < 2 or study.design.kind in ("saltelli", "morris"):
        return []
    numbers = np.stack([results[column(name)].values[:: study.members] for name in names], axis=1)
    tables = list[Section]()
    for response in answered(study, results):
        values = case_values(study, results, response)[:: study.members]
        rows = ~np.isnan(values) & np.all(np.isfinite(numbers), axis=1)
        clear = any(trend.clear for trend in fitted.get(response.name, ())[:1])
        if clear or rows.sum() < FEWEST or np.unique(values[rows]).size < 3:
            continue
        tables.append(_table(response.name, names, numbers[rows], values[rows]))
    return tables


def _table(response: str, names: list[str], numbers: np.ndarray, values: np.ndarray) -> Section:
    correlations, order, first, chance = ranked(numbers, values)
    count = np.array([np.unique(numbers[:, k]).size for k in range(len(names))])
    half = _half_width(correlations, count)
    rows = []
    for k in order[:SHOWN]:
        middle = math.atanh(max(-0.9999, min(0.9999, correlations[k])))
        low, high = (math.tanh(middle + sign * half[k]) for sign in (-1.0, 1.0))
        beyond = "yes" if abs(correlations[k]) > chance[k] else "no"
        rows.append((names[k], f"{correlations[k]:+.2f}", f"{low:+.2f} to {high:+.2f}", beyond, f"{first[k]:.0%}"))
    head = (f"{response} goes with", "rank correlation", "95 % interval", "beyond chance", "first in resamples")
    note = (
        f"{values.size} samples of {len(names)} numbers: among so many, chance alone reaches {float(chance.max()):.2f} in size "
        "in 5 % of samples."
    )
    return Section(head, rows, f"What {response} goes with", (note,))


def ranked(numbers: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rank correlations, the order of their sizes, how often each is the first, and what chance reaches (5 % over all).

    A number that has fewer values than there are samples, as one that is the same at several points, counts as so many samples.
    """
    correlations = _correlations(numbers, values)
    order = np.argsort(-np.abs(correlations), kind="stable")
    draw = np.random.default_rng(0).integers(values.size, size=(RESAMPLES, values.size))
    winners = [int(np.argmax(np.abs(_correlations(numbers[rows], values[rows])))) for rows in draw]
    first = np.bincount(winners, minlength=numbers.shape[1]) / RESAMPLES
    count = np.array([max(np.unique(column).size, 4) for column in numbers.T])
    level = CONFIDENCE ** (1.0 / numbers.shape[1])
    t = stats.t.ppf(0.5 + 0.5 * level, count - 2)
    return correlations, order, first, t / np.sqrt(count - 2 + t**2)


def _correlations(numbers: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Spearman's, of each column with the values; 0 for what does not vary."""
    x = stats.rankdata(numbers, axis=0)
    x, y = x - x.mean(axis=0), stats.rankdata(values)
    y = y - y.mean()
    spread = np.sqrt(np.sum(x**2, axis=0) * np.sum(y**2))
    return np.asarray(np.divide(x.T @ y, spread, out=np.zeros_like(spread), where=spread > 0.0))


def _half_width(correlations: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Half of the interval of the inverse hyperbolic tangent (Bonett and Wright 2000, doi:10.1007/BF02294183)."""
    normal = stats.norm.ppf(0.5 + 0.5 * CONFIDENCE)
    return np.asarray(normal * np.sqrt((1.0 + 0.5 * correlations**2) / np.maximum(count - 3, 1)))
