"""What responses depend on: Sobol indices and Morris's elementary effects by SALib, and rank correlations of any sample."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

from scissordyn.errors import InputError
from scissordyn.lookup import library
from scissordyn.plot.scale import Scale, scale_of
from scissordyn.study.answer.control_variate import CONFIDENCE
from scissordyn.study.answer.fact import Section
from scissordyn.study.answer.trend import Trend
from scissordyn.study.answer.verdict import answered, by_point, case_values
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.design import DRAWN_IN, FEWEST, MORRIS_LEVELS, morris_numbers
from scissordyn.study.compute.table import column
from scissordyn.units import counted

RESAMPLES = 500  # Resamples of the bootstrap
SEED = 1  # Of the resamples for indices of Sobol; with 0 the library draws others in each call
FEWEST_RANKED = 6  # Values of a response below which nothing is ranked
RANKED = 6  # Numbers that a table has
RANKED_RESAMPLES = 400  # Of the bootstrap that says how often a number is the first


def sobol_indices(values: np.ndarray, names: list[str]) -> xr.Dataset:
    """First-order and total Sobol indices with bootstrap intervals.

    Shapes: `values` (base points (factors + 2).
    """
    sobol = library("SALib.analyze.sobol", "study", "an index of Sobol")
    rows = values.reshape(-1, len(names) + 2)
    whole = np.all(np.isfinite(rows), axis=1)
    _check_count(int(whole.sum()), "base points")
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    used = rows[whole].ravel()
    if not np.ptp(used) > 0.0:
        raise InputError("a response that is the same at all points", "one that varies")
    analysed = sobol.analyze(problem, used, calc_second_order=False, num_resamples=RESAMPLES, seed=SEED)
    keys = {"first": "S1", "first_interval": "S1_conf", "total": "ST", "total_interval": "ST_conf"}
    about = {"units": "1"}
    return xr.Dataset(
        {name: ("factor", np.asarray(analysed[key], float), about) for name, key in keys.items()},
        coords={"factor": names},
        attrs={"left_out": int(np.sum(~whole)), "method": "sobol"},
    )


def morris_indices(points: np.ndarray, values: np.ndarray, names: list[str]) -> xr.Dataset:
    """Mean absolute elementary effects of Morris with bootstrap intervals.

    Shapes: `points` (trajectories (factors + 1).
    """
    morris = library("SALib.analyze.morris", "study", "an elementary effect")
    d = len(names)
    rows = values.reshape(-1, d + 1)
    whole = np.all(np.isfinite(rows), axis=1)
    _check_count(int(whole.sum()), "trajectories")
    problem = {"num_vars": d, "names": names, "bounds": [[0.0, 1.0]] * d}
    used = points.reshape(-1, d + 1, d)[whole].reshape(-1, d)
    analysed = morris.analyze(problem, used, rows[whole].ravel(), num_levels=MORRIS_LEVELS, num_resamples=RESAMPLES, seed=0)
    keys = {"effect": "mu_star", "effect_interval": "mu_star_conf", "deviation": "sigma"}
    return xr.Dataset(
        {name: ("factor", np.asarray(analysed[key], float) / DRAWN_IN, {}) for name, key in keys.items()},
        coords={"factor": names},
        attrs={"left_out": int(np.sum(~whole)), "method": "morris"},
    )


def _check_count(count: int, what: str) -> None:
    if count < FEWEST:
        raise InputError(f"{count} complete {what}", f"at least {FEWEST}")


def sensitivity(study: Study, results: xr.Dataset) -> tuple[dict[str, xr.Dataset], dict[str, str]]:
    """Indices of each response, if the design is one for indices."""
    if study.design.kind not in ("saltelli", "morris"):
        return {}, {}
    points = by_point(study, results)
    names: list[str] = [factor.path for factor in study.factors]
    indices: dict[str, Any] = {}
    left_out: dict[str, str] = {}
    for name in (response.name for response in answered(study, results)):
        values = np.asarray(points[name].values)
        try:
            if study.design.kind == "saltelli":
                indices[name] = sobol_indices(values, names)
            else:
                indices[name] = morris_indices(morris_numbers(study.design, len(names)), values, names)
        except InputError as error:
            left_out[name] = str(error)
            continue
        indices[name].attrs["units"] = points[name].attrs["units"]
    return indices, left_out


def sensitivities(indices: dict[str, xr.Dataset]) -> list[Section]:
    """A table for each response of what it depends on."""
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
    """An index with half of its interval."""
    value, half = scale.cells(float(row[key]), float(row[f"{key}_interval"]))
    return f"{value} ± {half}"


def rankings(study: Study, results: xr.Dataset, fitted: Mapping[str, tuple[Trend, ...]]) -> list[Section]:
    """A table for each response without a clear trend: the numbers by their rank correlation with it, and how sure that is."""
    names = [factor.name for factor in study.varied if not factor.labels]
    if len(names) < 2 or study.design.kind in ("saltelli", "morris"):
        return []
    numbers = np.stack([results[column(name)].values[:: study.members] for name in names], axis=1)
    tables = list[Section]()
    for response in answered(study, results):
        values = case_values(study, results, response)[:: study.members]
        rows = ~np.isnan(values) & np.all(np.isfinite(numbers), axis=1)
        clear = any(trend.clear for trend in fitted.get(response.name, ())[:1])
        if clear or rows.sum() < FEWEST_RANKED or np.unique(values[rows]).size < 3:
            continue
        tables.append(_table(response.name, names, numbers[rows], values[rows]))
    return tables


def _table(response: str, names: list[str], numbers: np.ndarray, values: np.ndarray) -> Section:
    correlations, order, first, chance = ranked(numbers, values)
    count = np.array([np.unique(numbers[:, k]).size for k in range(len(names))])
    half = _half_width(correlations, count)
    rows = []
    for k in order[:RANKED]:
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
    draw = np.random.default_rng(0).integers(values.size, size=(RANKED_RESAMPLES, values.size))
    winners = [int(np.argmax(np.abs(_correlations(numbers[rows], values[rows])))) for rows in draw]
    first = np.bincount(winners, minlength=numbers.shape[1]) / RANKED_RESAMPLES
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
