"""A study with the results in its store: answers, tables, pictures, and further computation."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import xarray as xr
from markupsafe import Markup

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.engine import Engine
from scissordyn.run.simulate import simulate
from scissordyn.studies.answer.conclusion import Conclusion, conclude
from scissordyn.studies.answer.fidelity import Corrected, compute_both_fidelities, confirmed, estimates, verified_path
from scissordyn.studies.answer.grouped import grouped, grouped_lines
from scissordyn.studies.answer.page import design_size, page
from scissordyn.studies.answer.report import LAYOUT, StudyPictures, as_html, export, table, write_figures, write_report
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
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.ask.requirement import Optimisation, read_goal
from scissordyn.studies.compute.execute import How, Progress, execute, extend
from scissordyn.studies.compute.optimise import Optimum, candidates, optimise
from scissordyn.studies.compute.store import COMPLETE, FAILED, PENDING, Store
from scissordyn.studies.compute.table import column

if TYPE_CHECKING:
    import pandas as pd

FilePath = str | os.PathLike[str]
ShowProgress = Callable[[Progress], None] | None
STATUS_CODES = {"complete": COMPLETE, "failed": FAILED, "pending": PENDING}  # Stored status of a case by its name


class StudyResult:
    """A study and the results in its store, which are read at the first use.

    Parameters
    ----------
    study : Study
        Description of the study.
    store : Store
    build : callable, optional
        Function that returns the study with its mechanism and functions, if `study` was only read.
    """

    def __init__(self, study: Study, store: Store, build: Callable[[], Study] | None = None) -> None:
        self.study, self.store, self._build = study, store, build

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
    def table(self) -> pd.DataFrame:
        """Table with one row for each case, in SI units; the headings show the units."""
        return table(self.dataset)

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
    def conclusion(self) -> Conclusion:
        """Sentences (at most five), tables of requirements, recommended point and trends, and next steps."""
        return conclude(self, self.store.path)

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
    def verified(self) -> StudyResult | None:
        """The accurate runs of a study of cheap ones: their own study and store; None if there are none."""
        store = Store(verified_path(self.store.path))
        if self.study.accurate is None or not store.exists():
            return None
        return StudyResult(store.study(reading=True), store)

    @cached_property
    def estimates(self) -> list[Corrected]:
        """Fractions, means and quantiles from cheap and accurate runs together, `estimate` of each with its 95 % interval."""
        return estimates(self.study, self.dataset, self._verified().dataset)

    @cached_property
    def confirmed(self) -> pd.DataFrame:
        """The points of a search by cheap runs that were run accurately: numbers, goals and violation by both kinds of runs."""
        self._need_goals()
        return confirmed(self.study, self._verified().dataset, self.dataset)

    def _verified(self) -> StudyResult:
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
                order = ["accurate violation", f"accurate {self.study.goals[0].label}"]
                place = int(self.confirmed.sort_values(order).index[0])
        if place < 0:
            if len(self.study.goals) == 1:
                raise InputError("no point has a value of the goal and of all requirements", "other ranges", "result.causes")
            what = f"the best point for {len(self.study.goals)} goals"
            raise InputError(what, "one goal; of several there is a front", "result.front")
        return {path: float(points[path][place]) for path in self.study.paths}

    @property
    def design(self) -> Mechanism:
        """The mechanism with the numbers of the best point."""
        return self.built().mechanism_of(self._best(), nominal=True)

    @property
    def plot(self) -> StudyPictures:
        """Pictures: ``result.plot.map()``, ``curves()``, ``requirements()``, ``sensitivity()``, ``front()``."""
        return StudyPictures(self)

    # --- one case again -------------------------------------------------------------------------------------------------

    def mechanism(self, case: int) -> Mechanism:
        """Return the mechanism with the parameter values of a case."""
        if isinstance(case, bool) or not 0 <= case < self.dataset.sizes["case"]:
            raise InputError(f"case {case!r}", f"0 to {self.dataset.sizes['case'] - 1}", "result.replay(0)")
        numbers = {parameter: float(self.dataset[column(parameter)][case]) for parameter in self.study.factor_names}
        return self.built().mechanism_of(numbers)

    def replay(self, case: int) -> xr.Dataset:
        """Simulate a case again, with histories.

        Parameters
        ----------
        case : int

        Returns
        -------
        Dataset
            As from `simulate`. Its measures are those of member 0, bit for bit; other members start perturbed in the study.
        """
        return simulate(self.mechanism(case), **{**self.study.options.keywords, "trust": False})

    # --- going on -------------------------------------------------------------------------------------------------------

    def resume(self, *, engine: Engine = None, retry: bool = False, progress: ShowProgress = None) -> StudyResult:
        """Compute the pending cases.

        Parameters
        ----------
        engine : Executor or int, optional
            Executor, or number of threads; by default one thread per processor.
        retry : bool
            Repeat failed cases.
        progress : callable, optional
            Called after each block with its progress: `complete`, `failed`, `cases`, `rate` [1/s], `left` [s].

        Returns
        -------
        StudyResult
            The same, with the present results.
        """
        study = replace(self.built(), design=self.store.design())  # which may have more points by now
        return self._now(computed(study, self.store.path, engine=engine, retry=retry, progress=progress))

    def extend(self, points: int, *, engine: Engine = None, progress: ShowProgress = None) -> StudyResult:
        """Add points to a random, Sobol or Saltelli design, or generations to an optimisation, and compute them.

        Parameters
        ----------
        points : int
            Number of points (of base points of a Saltelli design), or of generations, from now on.
        engine, progress
            As for `resume`.

        Returns
        -------
        StudyResult
            The same, with the present results.
        """
        study = self.built()
        if study.optimisation is not None:
            study = replace(study, optimisation=replace(study.optimisation, generations=points))
        return self._now(computed(study, self.store.path, points=points, engine=engine, progress=progress))

    def optimise(
        self,
        *goals: str,
        store: FilePath,
        risk: str = "mean",
        population: int = 0,
        generations: int = 20,
        seed: int = 0,
        method: str = "evolution",
        engine: Engine = None,
        progress: ShowProgress = None,
    ) -> StudyResult:
        """Search the ranges of this study for the best points.

        Parameters
        ----------
        *goals : str
            ``"minimise peak_force"``, ``"maximise A.clearance"``. One is searched by CMA-ES, several by NSGA-II; all
            combinations are tried where names are chosen, which have no order.
        store : path
            Store of the search; an existing one is continued.
        risk : str
            Statistic of a goal over uncertain numbers and members: "mean", "worst", "quantile 95 %", "cvar 95 %".
        population, generations, seed : int
            Candidates of a generation (0 for the method's own choice), number of generations, seed of the method.
        method : str
            "evolution", or "gradient": SLSQP along exact derivatives to the next optimum, for one goal, one point a generation.
        engine, progress
            As for `resume`.

        Returns
        -------
        StudyResult
            Result of the search.
        """
        study = self.built()
        options = {"risk": risk, "population": population, "generations": generations, "seed": seed, "method": method}
        study = replace(study, **searching(study, study.factors, goals, **options))
        return computed(study, store, engine=engine, progress=progress)

    def built(self) -> Study:
        """Return the study with its mechanism and functions, ready to compute."""
        return self.study if self._build is None else self._build()

    def _now(self, now: StudyResult) -> StudyResult:
        """Take over the store of a computed result and forget the data read before; return this result."""
        study, build = replace(self.study, design=now.study.design), self._build
        vars(self).clear()
        self.study, self.store, self._build = study, now.store, build
        return self

    # --- files and notebooks --------------------------------------------------------------------------------------------

    def export(self, path: FilePath) -> Path:
        """Write all cases as a table, .csv or .parquet, or as a NetCDF file, .nc."""
        return export(self.dataset, Path(path))

    def report(self, path: FilePath, *, figures: FilePath | None = None) -> Path:
        """Write one HTML or PDF file with tables and pictures.

        Parameters
        ----------
        path : path
            Ends in .html, or in .pdf where there is a browser that prints.
        figures : path, optional
            A folder for the pictures as files.
        """
        written = write_report(self, Path(path))
        if figures is not None:
            write_figures(self, Path(figures))
        return written

    def __repr__(self) -> str:
        done = ", ".join(f"{count} {name}" for name, count in self.counts.items() if count or name == "complete")
        parts = [f"{design_size(self.study)}: {done}"]
        parts += [str(self.feasible)] if self.study.requirements else []
        parts += [self.damage] if self.damage else []
        return f"<study '{self.store.path}': {'; '.join(parts)}>"

    def _repr_html_(self) -> str:
        head = Markup("<b>Study {}</b>").format(Path(self.store.path).name)
        return head + as_html(page(self, self.store.path, LAYOUT.rows))


def searching(study: Study, factors: Sequence[Factor], goals: Sequence[str], **options: Any) -> dict[str, Any]:
    """Return the fields that turn a study into a search over these factors."""
    names = [factor.path for factor in (*factors, *study.factors)]  # also those that are uncertain from now on
    units = {measure.name: measure.units for measure in study.own_measures}
    search_goals = tuple(read_goal(goal, units, names) for goal in goals)
    search = Optimisation(search_goals, **options).over([factor.variation for factor in factors])
    needed = [goal.measure for goal in search_goals if goal.measure not in (*names, *study.factor_names, *study.measure_names)]
    measures = (*study.measures, *dict.fromkeys(needed))
    return {"optimisation": search, "design": search.design(1, len(factors)), "measures": measures}


def computed(
    study: Study, path: FilePath, *, points: int | None = None, budget: float | None = None, **how: Unpack[How]
) -> StudyResult:
    """Compute the missing cases of a study, of more points of it or of a search, and return its result."""
    if budget is not None and (study.accurate is None or points is not None):
        sample = '[screen] with set = ["run.rtol=1e-3"], or screen={"rtol": 1e-3}'
        raise InputError("a budget of a study without cheap and accurate runs", "a study with both", sample)
    if study.accurate is not None and points is None:
        store = compute_both_fidelities(study, path, budget, **how)
    elif study.optimisation is not None:
        store = optimise(study, path, **how)
    elif points is not None:
        store = extend(study, path, points, **how)
    else:
        store = execute(study, path, **how)
    return StudyResult(replace(study, design=store.design()), store)
