"""A study with the results in its store: answers, tables, pictures, and further computation."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import xarray as xr
from markupsafe import Markup

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.engine import Engine
from scissordyn.run.simulate import simulate
from scissordyn.studies.answer.answers import Answers
from scissordyn.studies.answer.conclusion import Conclusion, conclude
from scissordyn.studies.answer.page import design_size, page
from scissordyn.studies.answer.report import LAYOUT, StudyPictures, as_html, export, table, write_figures, write_report
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.ask.requirement import Optimisation, read_goal
from scissordyn.studies.compute.execute import How, Progress, execute, extend
from scissordyn.studies.compute.fidelity import compute_both_fidelities
from scissordyn.studies.compute.optimise import optimise
from scissordyn.studies.compute.store import Store
from scissordyn.studies.compute.table import column

if TYPE_CHECKING:
    import pandas as pd

FilePath = str | os.PathLike[str]
ShowProgress = Callable[[Progress], None] | None


class StudyResult(Answers):
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
        super().__init__(study, store)
        self._build = build

    @property
    def table(self) -> pd.DataFrame:
        """Table with one row for each case, in SI units; the headings show the units."""
        return table(self.dataset)

    @cached_property
    def conclusion(self) -> Conclusion:
        """Sentences (at most five), tables of requirements, recommended point and trends, and next steps."""
        return conclude(self, self.store.path)

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
