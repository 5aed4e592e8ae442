"""Verdicts of a study: points that meet the requirements, their certainty, the recommended point, the worst cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.run.response import Response
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import INDEPENDENT
from scissordyn.studies.ask.requirement import (
    Requirement,
    response_label,
    response_unit,
    response_values,
    value_text,
    whole_responses,
)
from scissordyn.studies.compute.optimise import candidates
from scissordyn.studies.compute.store import COMPLETE, PENDING
from scissordyn.studies.compute.table import SLOPE_BY, SLOPE_OF, SLOPES, chosen_numbers, column
from scissordyn.studies.estimate import fraction_interval
from scissordyn.tolerance import REPORTED_FRACTION


@dataclass(frozen=True)
class FeasibleFraction:
    """Fraction of a study's range that meets a requirement, with its confidence interval."""

    label: str
    fraction: float
    low: float  # 95 % interval of Clopper and Pearson; NaN for designs that are not random samples
    high: float
    trials: int  # Points or samples that count as independent

    def __str__(self) -> str:
        interval = "" if np.isnan(self.low) else f" ({self.low:.0%} to {self.high:.0%})"
        return f"{self.label}: {self.fraction:.0%} of the range{interval}"


@dataclass(frozen=True)
class Margin:
    """Distance of a point from a requirement in the worst of its cases."""

    requirement: str
    value: float  # Value of the worst case; NaN if a case has none
    text: str  # The value with its unit, or why there is none
    margin: float  # Margin as a fraction of the bound; negative if the requirement is not met


@dataclass(frozen=True)
class Worst(Margin):
    """Case with one of the smallest margins of a study."""

    case: int
    # The chosen and the uncertain numbers and names of the case, in SI, by parameter
    numbers: dict[str, Any] = field(default_factory=dict)


def study_responses(study: Study, results: xr.Dataset) -> list[Response]:
    """Return the responses of requirements and goals, followed by those of the other measures."""
    chosen: list[Response] = [requirement.response for requirement in study.requirements]
    chosen += [goal.response for goal in study.goals if goal.measure not in study.factor_names]
    chosen += [response for response in study.responses if response.name not in {other.name for other in chosen}]
    covered = {(response.measure, response_unit(results, response)) for response in chosen}
    measures = (name for name in study.measure_names if results[name].size)  # no forces of contacts without clearance
    further = (response for name in measures for response in whole_responses(results, name))
    return chosen + [response for response in further if (response.measure, response_unit(results, response)) not in covered]


def case_values(study: Study, results: xr.Dataset, response: Response) -> np.ndarray:
    """Return a response of all cases, NaN for incomplete ones.

    A complete case without a value of a required response violates the requirement: its value counts as infinite.
    """
    values = response_values(results, response)
    if response in [requirement.response for requirement in study.requirements]:
        values = np.where(np.isnan(values), -np.inf if response.smallest else np.inf, values)
    return np.where(results["status"].values == COMPLETE, values, np.nan)


def by_point(study: Study, results: xr.Dataset) -> xr.Dataset:
    """Summarise the results of each point of the design."""
    complete = study.cells(results["status"].values == COMPLETE)
    count = len(complete)
    variables = chosen_numbers(study, results)
    differs = np.zeros(count, bool)
    for response in study_responses(study, results):
        name = response.name
        cells = study.cells(case_values(study, results, response))
        about = {"units": response_unit(results, response), "role": "response", "label": response_label(results, response)}
        about |= {key: value for key, value in results[response.measure].attrs.items() if key == "beyond"}
        together = cells.reshape(count, -1)
        variables[name] = ("point", _mean(together), {**about, "long_name": f"mean {name}"})
        extreme = np.fmin if response.smallest else np.fmax
        variables[f"worst {name}"] = ("point", extreme.reduce(together, axis=1), {**about, "role": "worst"})
        spread = _spread(cells)
        variables[f"spread {name}"] = ("point", spread, {"units": "1", "role": "spread"})
        differs |= spread > REPORTED_FRACTION  # round-off is far below, chaos far above
    for response in (response for name in study.measure_names for response in whole_responses(results, name)):
        differs |= _spread(np.where(complete, study.cells(response_values(results, response)), np.nan)) > REPORTED_FRACTION
    met = study.cells(meets_all(study, results))
    with np.errstate(invalid="ignore"):
        fraction = np.where(complete.any(axis=(1, 2)), met.sum(axis=(1, 2)) / np.maximum(complete.sum(axis=(1, 2)), 1), np.nan)
    mixed = np.any((met & complete).any(axis=2) & (~met & complete).any(axis=2), axis=1)
    variables["met"] = ("point", fraction, {"units": "1", "long_name": "fraction of cases that meet the requirements"})
    variables["complete"] = ("point", complete.mean(axis=(1, 2)), {"units": "1", "long_name": "fraction of cases complete"})
    variables["disagrees"] = ("point", differs, {"long_name": "members disagree"})
    variables["undecided"] = ("point", mixed & (study.members > 1), {"long_name": "members disagree on the requirements"})
    if SLOPES in results:  # one case of each point
        slopes = results[SLOPES].isel(case=slice(count)).where(results["status"][:count] == COMPLETE)
        variables[SLOPES] = (("point", *slopes.dims[1:]), slopes.values, slopes.attrs)
        return xr.Dataset(variables, {dim: slopes[dim].values for dim in map(str, slopes.dims[1:])})
    return xr.Dataset(variables)


def slopes_of_points(points: xr.Dataset, response: str, names: Sequence[str]) -> np.ndarray:
    """Return the derivatives (points, names) of a response by varied numbers, NaN where they are not known."""
    if SLOPES not in points or response not in points[SLOPE_OF].values:
        return np.full((points.sizes["point"], len(names)), np.nan)
    return np.asarray(points[SLOPES].sel({SLOPE_OF: response}).reindex({SLOPE_BY: list(names)}).values, float)


def _spread(cells: np.ndarray) -> np.ndarray:
    """Return the largest relative difference between members of a sample, shape (points, samples, members) to (points,)."""
    with np.errstate(invalid="ignore"):  # of numbers that are infinite
        difference = np.fmax.reduce(cells, axis=-1) - np.fmin.reduce(cells, axis=-1)
        spread = difference / np.maximum(np.fmax.reduce(np.abs(cells), axis=-1), 1e-300)
    return np.asarray(np.where(np.isnan(spread), 0.0, spread).max(axis=-1))


def _mean(values: np.ndarray) -> np.ndarray:
    is_number = ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(is_number, values, 0.0).sum(axis=-1) / is_number.sum(axis=-1))


def meets_all(study: Study, results: xr.Dataset) -> np.ndarray:
    """Return a mask (cases,) of the cases that are complete and meet all requirements."""
    met = results["status"].values == COMPLETE
    for requirement in study.requirements:
        met = met & requirement.met_in(results)
    return np.asarray(met)


def feasible_fraction(study: Study, results: xr.Dataset) -> list[FeasibleFraction]:
    """Return the fractions of the range that meet each requirement, and all of them, without failed cases."""
    masks = [(requirement.label, requirement.met_in(results)) for requirement in study.requirements]
    labelled_masks = [*masks, ("all requirements", meets_all(study, results))] if masks else []
    complete, fractions_met = study.cells(results["status"].values == COMPLETE), []
    by_samples = len(complete) == 1  # one point with uncertain numbers: its samples are the trials
    kind, axis = (study.sampling.kind, (0, 2)) if by_samples else (study.design.kind, (1, 2))
    completed = complete.sum(axis=axis)
    for label, is_met in labelled_masks:
        fractions = (study.cells(is_met) & complete).sum(axis=axis)[completed > 0] / completed[completed > 0]
        fraction = float(np.mean(fractions)) if fractions.size else np.nan
        sampled = fractions.size and kind in INDEPENDENT and (by_samples or study.factors)
        low, high = fraction_interval(fraction * fractions.size, fractions.size) if sampled else (np.nan, np.nan)
        fractions_met.append(FeasibleFraction(label, fraction, low, high, int(fractions.size)))
    return fractions_met


def worst_cases(study: Study, results: xr.Dataset, count: int = 5) -> list[Worst]:
    """Return the cases with the smallest margins: one of each point, or of each sample of a single point."""
    place = np.arange(results.sizes["case"]) // (study.per_point if study.factors else study.members)
    complete = results["status"].values == COMPLETE
    worst: dict[int, Worst] = {}
    for requirement in study.requirements:
        values = response_values(results, requirement.response)
        margins = np.where(complete, case_margins(requirement, results), np.inf)
        order = np.argsort(margins, kind="stable")
        _, first = np.unique(place[order], return_index=True)  # the case with the least margin of each point or sample
        for case in order[np.sort(first)[:count]].tolist():
            at, margin = int(place[case]), float(margins[case])
            if margin < (worst[at].margin if at in worst else np.inf):
                text = value_text(results, requirement.response, case)
                numbers = {name: float(results[column(name)][case]) for name in study.factor_names}
                worst[at] = Worst(requirement.label, float(values[case]), text, margin, case, numbers)
    return sorted(worst.values(), key=lambda case: case.margin)[:count]


@dataclass(frozen=True)
class Recommendation:
    """The point of a study that meets the requirements most often or, where none does, is nearest to meeting them."""

    point: int
    numbers: dict[str, Any]  # The numbers and names that are chosen, in SI
    feasible: bool  # True if all cases of the point meet all requirements
    margins: tuple[Margin, ...]  # The least first
    # Fraction of its samples of the uncertain numbers that meet all requirements, with all members; failed cases do not
    probability: float
    # 95 % interval of Clopper and Pearson of the probability; NaN without samples. The same samples chose the point, so the
    # probability is biased upwards; only new samples test it
    low: float
    high: float
    samples: int  # Samples of the point that are computed
    # The requirement with the least margin among those that some computed case does not meet; empty if all cases meet all
    binding: str


def recommended(study: Study, results: xr.Dataset) -> Recommendation | None:
    """Return the recommended point of a study with requirements; None if no point is computed."""
    place = recommended_point(study, results)
    if place < 0:
        return None
    here = results.isel(case=slice(place * study.per_point, (place + 1) * study.per_point))
    done = here["status"].values.reshape(-1, study.members) != PENDING
    count = int(done.all(axis=1).sum())
    successes = int(meets_all(study, here).reshape(-1, study.members).all(axis=1).sum())
    probability = successes / count if count else np.nan
    low, high = fraction_interval(successes, count) if study.uncertain and count else (np.nan, np.nan)
    rows, margins, violated = np.flatnonzero(done), list[Margin](), set[str]()
    complete = results["status"].values == COMPLETE
    for requirement in study.requirements:
        point_margins = case_margins(requirement, results)[place * study.per_point : (place + 1) * study.per_point]
        worst = int(rows[np.argmin(point_margins[rows])])
        value, text = response_values(here, requirement.response)[worst], value_text(here, requirement.response, worst)
        margins.append(Margin(requirement.label, float(value), text, float(point_margins[worst])))
        if not requirement.met_in(results)[complete].all():
            violated.add(requirement.label)
    margins.sort(key=lambda requirement: requirement.margin)
    return Recommendation(
        place,
        {factor.path: float(here[column(factor.path)][0]) for factor in study.factors},
        bool(count) and successes == count,
        tuple(margins),
        probability,
        low,
        high,
        count,
        next((margin.requirement for margin in margins if margin.requirement in violated), ""),
    )


def case_margins(requirement: Requirement, results: xr.Dataset) -> np.ndarray:
    """Return the margins of all cases (cases,), as fractions of the bound, or for a bound of 0 of the largest value."""
    margins = requirement.margin_in(results)
    if requirement.bound:
        return margins
    sizes = np.abs(response_values(results, requirement.response))
    return margins / (float(np.max(sizes, initial=0.0, where=np.isfinite(sizes))) or 1.0)


def least_margins(study: Study, results: xr.Dataset) -> np.ndarray:
    """Return the least margin of each case over all requirements, shape (cases,)."""
    return np.asarray(np.min([case_margins(requirement, results) for requirement in study.requirements], axis=0))


def recommended_point(study: Study, results: xr.Dataset) -> int:
    """Return the index of the point with most cases that meet the requirements, or -1 if no case is complete.

    Of equal points, the one with the largest smallest margin counts. A search for one goal returns its best point. Failed
    cases meet no requirement.
    """
    if len(study.goals) == 1:
        return candidates(study, results).best
    status = study.cells(results["status"].values)
    done = (status != PENDING).sum(axis=(1, 2))
    if not (status == COMPLETE).any():
        return -1
    met = study.cells(meets_all(study, results)).sum(axis=(1, 2)) / np.maximum(done, 1)
    least = np.where(status == PENDING, np.inf, study.cells(least_margins(study, results))).min(axis=(1, 2))
    least = np.where((status == COMPLETE).any(axis=(1, 2)), least, -np.inf)
    first = np.flatnonzero((met == met.max()) & (done > 0))
    return int(first[np.argmax(least[first])])
