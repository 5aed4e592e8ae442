"""Answers of a study: what follows from the results in its store, computed at the first use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING, Self

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.studies.answer.fidelity import Corrected, confirmed, estimates
from scissordyn.studies.answer.grouped import grouped, grouped_lines
from scissordyn.studies.answer.surface import Surface, between_points
from scissordyn.studies.answer.trend import Trend, sensitivity, trends
from scissordyn.studies.answer.verdict import (
    FeasibleFraction,
    Recommendation,
    Worst,
    by_point,
    feasible_fraction,
    recommended,
    recommended_point,
    worst_cases,
)
from scissordyn.studies.ask.description import Study
from scissordyn.studies.compute.fidelity import verified_path
from scissordyn.studies.compute.optimise import Optimum, candidates
from scissordyn.studies.compute.store import COMPLETE, FAILED, PENDING, Store

if TYPE_CHECKING:
    import pandas as pd

# Integer that a study's store saves for the status of a case, by name of the status
STATUS_CODES = {"complete": COMPLETE, "failed": FAILED, "pending": PENDING}


class Answers:
    """A study, its store, and the answers that sentences, tables and pictures show."""

    def __init__(self, study: Study, store: Store) -> None:
        self.study, self.store = study, store

    # --- results --------------------------------------------------------------------------------------------------------

    @cached_property
    def dataset(self) -> xr.Dataset:
        """All cases: factors, uncertain numbers and measures along `case`, with status (0 pending, 1 complete, 2 failed)."""
        return self.store.results()

    @cached_property
    def points(self) -> xr.Dataset:
        """Results of each point of the design.

        Its numbers; the mean of each response, its ``worst`` value and relative ``spread`` of members; `met` and `complete`,
        fractions of its cases; `disagrees` and `undecided`, whether members differ, and on the requirements.
        """
        return by_point(self.study, self.dataset)

    @property
    def counts(self) -> dict[str, int]:
        """Number of cases of each status."""
        status = self.dataset["status"].values
        return {name: int(np.sum(status == code)) for name, code in STATUS_CODES.items()}

    @property
    def damage(self) -> str:
        """Rows of the store that are damaged, whose cases are pending; empty if there are none."""
        return str(self.dataset.attrs.get("damage", ""))

    @property
    def causes(self) -> dict[str, list[int]]:
        """Failed cases by cause, the most frequent first; causes that differ only in numbers are one."""
        failed = np.flatnonzero(self.dataset["status"].values == FAILED).tolist()
        return grouped((str(self.dataset["cause"].values[case]), case) for case in failed)

    @property
    def warnings(self) -> dict[str, list[int]]:
        """Complete cases by warning, the most frequent first; warnings that differ only in numbers are one."""
        return grouped_lines(self.dataset["warnings"].values)

    # --- answers --------------------------------------------------------------------------------------------------------

    @property
    def requirements(self) -> list[FeasibleFraction]:
        """The fraction of the range that meets each requirement, with its 95 % interval."""
        return self.fractions[:-1]

    @property
    def feasible(self) -> FeasibleFraction:
        """The fraction of the range that meets all requirements, with its 95 % interval."""
        return self.fractions[-1]

    @cached_property
    def fractions(self) -> list[FeasibleFraction]:
        """The fractions of the range that meet each requirement, and all of them."""
        self._need_requirements()
        return feasible_fraction(self.study, self.dataset)

    def worst(self, count: int = 5) -> list[Worst]:
        """Return the cases farthest beyond a requirement, or nearest to it, worst first."""
        self._need_requirements()
        cases = worst_cases(self.study, self.dataset, count)
        return [replace(case, numbers=self.study.labelled(case.numbers)) for case in cases]

    def recommend(self) -> Recommendation:
        """Return the point that meets the requirements most often, or is nearest to meeting them.

        Returns
        -------
        Recommendation
            Its numbers, the margin of each requirement in its worst case, the least first, and the probability that
            it meets all of them, with its interval.

        Raises
        ------
        InputError
            If the study has no requirements, or no case is complete.
        """
        self._need_requirements()
        if self.recommendation is None:
            raise InputError("a recommendation of points that all failed", "a study with complete cases", "result.causes")
        return replace(self.recommendation, numbers=self.study.labelled(self.recommendation.numbers))

    @cached_property
    def recommendation(self) -> Recommendation | None:
        """The recommended point, with indices for names; None without requirements, or while no point is computed."""
        return recommended(self.study, self.dataset) if self.study.requirements else None

    @cached_property
    def between(self) -> Callable[[str], Surface | None]:
        """Function that returns the surface of a response by its name, or None if the points do not predict each other."""
        return cache(partial(between_points, self.study, self.points))

    @cached_property
    def fitted(self) -> dict[str, tuple[Trend, ...]]:
        """Both forms of trend of each response, the better predictor first."""
        return trends(self.study, self.dataset)

    @property
    def trends(self) -> dict[str, Trend]:
        """Power law or straight line of each response, whichever predicts left-out points better."""
        return {name: both[0] for name, both in self.fitted.items()}

    @cached_property
    def verified(self) -> Self | None:
        """The accurate runs of a study of cheap ones: their own study and store; None if there are none."""
        store = Store(verified_path(self.store.path))
        if self.study.accurate is None or not store.exists():
            return None
        return type(self)(store.study(reading=True), store)

    @cached_property
    def estimates(self) -> list[Corrected]:
        """Fractions, means and quantiles from cheap and accurate runs together, `estimate` of each with its 95 % interval."""
        return estimates(self.study, self.dataset, self._verified().dataset)

    @cached_property
    def confirmed(self) -> pd.DataFrame:
        """The points of a search by cheap runs that were run accurately: numbers, goals and violation by both kinds of runs."""
        self._need_goals()
        return confirmed(self.study, self._verified().dataset, self.dataset)

    def _verified(self) -> Self:
        if (verified := self.verified) is None:
            raise InputError("a study without accurate runs", "cheap runs", "screen={'rtol': 1e-3}")
        return verified

    def _need_requirements(self) -> None:
        if not self.study.requirements:
            raise InputError("a study without requirements", "bounds on measures", "requirements={'peak_force': 500.0}")

    def _need_goals(self) -> None:
        if self.study.optimisation is None:
            raise InputError("a study without goals", "goals", "result.optimise('minimise peak_force', store='best.db')")

    @cached_property
    def indices(self) -> tuple[dict[str, xr.Dataset], dict[str, str]]:
        """Sensitivity indices by response, and the reasons why other responses have none."""
        return sensitivity(self.study, self.dataset)

    def sensitivity(self, response: str = "") -> xr.Dataset | dict[str, xr.Dataset]:
        """Return sensitivity indices of responses: Sobol indices of a Saltelli design, elementary effects of a Morris design.

        Parameters
        ----------
        response : str
            Name of a response; if empty, all responses that have indices.

        Returns
        -------
        Dataset, or dict of str to Dataset
            Along `factor`, with 95 % intervals; by response if none is named.
        """
        indices, left_out = self.indices
        if self.study.design.kind not in ("saltelli", "morris"):
            what = f"sensitivity of a {self.study.design.kind} design"
            raise InputError(what, "a design for indices", "design='saltelli', or design='morris'")
        if not response:
            return indices
        if response not in indices:
            why = left_out.get(response, "no such response")
            raise InputError(f"no indices of '{response}': {why}", ", ".join(indices) or "none")
        return indices[response]

    @cached_property
    def optimum(self) -> Optimum:
        """All points that a search has tried, with goals, `violation`, `front` and `generation`; and which is the best."""
        self._need_goals()
        return candidates(self.study, self.dataset)

    @property
    def front(self) -> pd.DataFrame:
        """Pareto front: the points that meet the requirements and that no other such point dominates."""
        points = self.optimum.points
        numbered = points.assign_coords(point=np.arange(points.sizes["point"]))
        return numbered.isel(point=np.flatnonzero(points["front"].values)).to_dataframe()

    @property
    def best(self) -> dict[str, float | str]:
        """The numbers of the best point, in SI, and its names.

        Of one goal the best point that meets the requirements (the least violation if none does); without a goal the point
        most of whose cases meet the requirements, of several that whose worst case has the largest margin.
        """
        return self.study.labelled(self._best())

    def _best(self) -> dict[str, float]:
        if self.study.optimisation is None:
            self._need_requirements()
            points, place = self.points, recommended_point(self.study, self.dataset)
        else:
            points, place = self.optimum.points, self.optimum.best
            if len(self.study.goals) == 1 and self.verified is not None:
                (goal,) = self.study.goals
                order = ["accurate violation", f"accurate {goal.label}"]
                place = int(self.confirmed.sort_values(order, ascending=[True, not goal.maximise]).index[0])
        if place < 0:
            if len(self.study.goals) == 1:
                raise InputError("no point has a value of the goal and of all requirements", "other ranges", "result.causes")
            what = f"the best point for {len(self.study.goals)} goals"
            raise InputError(what, "one goal; of several there is a front", "result.front")
        return {path: float(points[path][place]) for path in self.study.paths}
