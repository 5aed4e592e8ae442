"""Sensitivity: Sobol indices of a Saltelli design and Morris's elementary effects, by SALib."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.extra import library
from scissordyn.study.answer.verdict import answered, by_point
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.design import DRAWN_IN, FEWEST, MORRIS_LEVELS, morris_numbers

RESAMPLES = 500  # Resamples of the bootstrap
SEED = 1  # Of the resamples for indices of Sobol; with 0 the library draws others in each call


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
