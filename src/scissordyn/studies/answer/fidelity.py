"""Fractions, means and quantiles from cheap and accurate runs together, and points of a search that both have computed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.studies.answer.verdict import study_responses
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.requirement import Requirement, response_unit, response_values
from scissordyn.studies.compute.optimise import candidates
from scissordyn.studies.compute.store import COMPLETE
from scissordyn.studies.estimate import (
    Estimate,
    fraction_estimate,
    mean_estimate,
    quantile_estimates,
)

if TYPE_CHECKING:
    import pandas as pd


QUANTILE_LEVELS = (0.5, 0.95)  # Probabilities of the quantiles that are estimated from coarse and fine runs


@dataclass(frozen=True)
class Corrected:
    """Fraction, mean or quantile of a study, estimated from cheap and accurate runs."""

    label: str
    kind: str  # One of "fraction", "mean", "quantile"
    units: str
    estimate: Estimate


def estimates(study: Study, cheap: xr.Dataset, accurate: xr.Dataset) -> list[Corrected]:
    """Estimate the fractions that meet the requirements, and means and quantiles of the responses, from both kinds of runs."""
    trials, size = _trials(study, cheap), _trials(study, accurate).shape[0]
    complete = _complete(cheap, trials)
    pairs = complete[:size] & _complete(accurate, trials[:size])
    has_one_case = trials.shape[1] == 1

    def by_trial(results: xr.Dataset, values: np.ndarray) -> np.ndarray:
        rows = trials[: results.sizes["case"] // trials.shape[1]]
        return np.asarray(values[rows].mean(axis=1), float)

    def paired_values(values: Callable[[xr.Dataset], np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        cheap_values, accurate_values = by_trial(cheap, values(cheap)), by_trial(accurate, values(accurate))
        return accurate_values[pairs], cheap_values[:size][pairs], cheap_values[complete]

    def met_fraction(requirements: Sequence[Requirement]) -> Estimate:
        return fraction_estimate(*paired_values(lambda runs: np.all([part.met_in(runs) for part in requirements], axis=0)))

    numbers = [Corrected(response.label, "fraction", "1", met_fraction([response])) for response in study.requirements]
    if study.requirements:
        numbers.append(Corrected("all requirements", "fraction", "1", met_fraction(study.requirements)))
    for response in study_responses(study, cheap):
        values_of_runs = paired_values(partial(response_values, response=response))
        if not all(np.all(np.isfinite(estimate)) for estimate in values_of_runs):
            continue
        units = response_unit(cheap, response)
        numbers.append(Corrected(f"mean {response.name}", "mean", units, mean_estimate(*values_of_runs)))
        if has_one_case:
            for level, estimate in zip(QUANTILE_LEVELS, quantile_estimates(*values_of_runs, QUANTILE_LEVELS), strict=True):
                numbers.append(Corrected(f"{level:.0%} quantile of {response.name}", "quantile", units, estimate))
    return numbers


def _trials(study: Study, results: xr.Dataset) -> np.ndarray:
    """Return the cases of each independent trial, shape (trials, cases of a trial)."""
    width = study.per_point if study.factors else study.members
    return np.arange(results.sizes["case"] // width * width).reshape(-1, width)


def _complete(results: xr.Dataset, trials: np.ndarray) -> np.ndarray:
    return np.asarray((results["status"].values[trials] == COMPLETE).all(axis=1))


def confirmed(study: Study, accurate: xr.Dataset, cheap: xr.Dataset) -> pd.DataFrame:
    """Return a table of the points of a search that were also run accurately, with the results of both kinds of runs."""
    import pandas as pd

    cheap_points, accurate_points = candidates(study, cheap).points, candidates(study, accurate).points
    numbers, accurate_numbers = (points[study.paths].to_array().values.T for points in (cheap_points, accurate_points))
    places = [int(np.flatnonzero((numbers == row).all(axis=1))[0]) for row in accurate_numbers]
    table = {name: accurate_points[name].values for name in study.paths}
    for name in (*(goal.label for goal in study.goals), "violation"):
        table[name], table[f"accurate {name}"] = cheap_points[name].values[places], accurate_points[name].values
    return pd.DataFrame({**table, "front": accurate_points["front"].values}, index=pd.Index(places, name="point"))
