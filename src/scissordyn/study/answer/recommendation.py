"""The point of a study to build: its margins, what binds, and the probability that it meets the requirements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.study.answer.control_variate import fraction_interval
from scissordyn.study.answer.verdict import meets_all
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.requirement import response_values, value_text
from scissordyn.study.compute.optimise import candidates
from scissordyn.study.compute.store import COMPLETE, PENDING
from scissordyn.study.compute.table import column


@dataclass(frozen=True)
class Margin:
    """How far a point is from a requirement in the worst of its cases."""

    requirement: str
    value: float  # Of the worst case; NaN if a case has none
    text: str  # The value with its unit, or why there is none
    margin: float  # As a fraction of the bound; negative where the requirement is not met


@dataclass(frozen=True)
class Recommendation:
    """The point of a study that meets the requirements most often or, where none does, is nearest to meeting them."""

    point: int
    numbers: dict[str, Any]  # The numbers and names that are chosen, in SI
    feasible: bool  # Whether all its cases meet all requirements
    margins: tuple[Margin, ...]  # The least first: it is of the requirement that binds
    # Fraction of its samples of the uncertain numbers that meet all requirements, with all members; failed cases do not
    probability: float
    # 95 % interval of Clopper and Pearson of the probability; NaN without samples. The point was chosen by the same samples,
    # so that the probability is rather too large: samples drawn anew decide
    low: float
    high: float
    samples: int  # Samples of the point that are computed

    @property
    def binding(self) -> str:
        """The requirement with the least margin."""
        return self.margins[0].requirement


def recommended(study: Study, results: xr.Dataset) -> Recommendation | None:
    """The recommended point of a study with requirements; None while no point is computed."""
    place = recommended_point(study, results)
    if place < 0:
        return None
    rows = slice(place * study.per_point, (place + 1) * study.per_point)
    here = results.isel(case=rows)
    done = here["status"].values.reshape(-1, study.members) != PENDING
    trials = done.all(axis=1)
    successes = int((meets_all(study, here).reshape(-1, study.members) & done).all(axis=1)[trials].sum())
    count = int(trials.sum())
    probability = successes / count if count else float("nan")
    low, high = fraction_interval(successes, count) if study.uncertain and count else (float("nan"), float("nan"))
    margins = []
    for requirement in study.requirements:
        values = response_values(here, requirement.response)[done.ravel()]
        margin = requirement.margin(values)
        worst = int(np.argmin(margin))
        text = value_text(here, requirement.response, int(np.flatnonzero(done)[worst]))
        margins.append(Margin(requirement.label, float(values[worst]), text, float(margin[worst])))
    return Recommendation(
        place,
        {factor.path: float(here[column(factor.path)][0]) for factor in study.factors},
        bool(count) and successes == count,
        tuple(sorted(margins, key=lambda requirement: requirement.margin)),
        probability,
        low,
        high,
        count,
    )


def least_margins(study: Study, results: xr.Dataset) -> np.ndarray:
    """Margin of each case from the requirement that it is farthest beyond, or nearest to, shape (cases,)."""
    return np.asarray(np.min([requirement.margin_in(results) for requirement in study.requirements], axis=0))


def recommended_point(study: Study, results: xr.Dataset) -> int:
    """The point most of whose cases meet the requirements, of several that whose worst case has the largest margin.

    Of a search for one goal it is the best point. Failed cases meet nothing.
    """
    if study.optimisation is not None and len(study.optimisation.goals) == 1:
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
