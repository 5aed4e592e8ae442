"""Optimisation: generations of candidates, each a batch of cases in the store, from which a search can be resumed."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Design, design_values, quantiles
from scissordyn.studies.ask.requirement import Optimisation, response_label, response_unit, response_values, risk_value
from scissordyn.studies.compute.descent import Descent
from scissordyn.studies.compute.execute import How, execute
from scissordyn.studies.compute.store import COMPLETE, PENDING, Store
from scissordyn.studies.compute.table import about_number, chosen_numbers, column


@dataclass(frozen=True)
class Optimum:
    """Result of an optimisation."""

    # Along `point`: the factors, one variable for each goal (its risk), `violation`, `front` (whether no other point is
    # better in all goals), `generation`
    points: xr.Dataset
    # Index of the best point for one goal: it meets the requirements or violates them least; -1 with several goals
    best: int


class _Cma:
    """CMA-ES: candidates that meet the requirements come before those that do not.

    `ask` returns candidates in the unit cube, shape (population, factors). `tell` takes their goals, shape (population,
    goals), to be minimised, and their violation, shape (population,), 0 if all requirements are met.
    """

    def __init__(self, dimensions: int, population: int, seed: int) -> None:
        import cma

        numbers = np.random.default_rng(seed)
        options = {
            "bounds": [0.0, 1.0],
            "popsize": population,
            "verbose": -9,
            "seed": np.nan,
            "randn": lambda *shape: numbers.standard_normal(shape),
        }
        # the library fails in one dimension: a second one is searched that counts for nothing
        self.strategy, self.dimensions = (
            cma.CMAEvolutionStrategy([0.5] * max(dimensions, 2), sigma0=0.3, inopts=options),
            dimensions,
        )
        self.largest = -np.inf

    def ask(self) -> np.ndarray:
        self.proposed = self.strategy.ask()
        return np.array(self.proposed)[:, : self.dimensions]

    def tell(self, goals: np.ndarray, violation: np.ndarray) -> None:
        meets = violation <= 0.0
        self.largest = max(self.largest, *goals[meets, 0], -np.inf)
        behind = self.largest if np.isfinite(self.largest) else 0.0
        self.strategy.tell(self.proposed, np.where(meets, goals[:, 0], behind + violation).tolist())


class _Nsga2:
    def __init__(self, dimensions: int, population: int, seed: int, goals: int) -> None:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import Problem
        from pymoo.termination import get_termination

        self.problem = Problem(n_var=dimensions, n_obj=goals, n_ieq_constr=1, xl=0.0, xu=1.0)
        self.algorithm = NSGA2(pop_size=population)
        self.algorithm.setup(self.problem, termination=get_termination("n_gen", 10**9), seed=seed, verbose=False)

    def ask(self) -> np.ndarray:
        self.proposed = self.algorithm.ask()
        return np.array(self.proposed.get("X"), float)

    def tell(self, goals: np.ndarray, violation: np.ndarray) -> None:
        from pymoo.core.evaluator import Evaluator
        from pymoo.problems.static import StaticProblem

        Evaluator().eval(StaticProblem(self.problem, F=goals, G=violation[:, None]), self.proposed)
        self.algorithm.tell(infills=self.proposed)


def proposer(optimisation: Optimisation, dimensions: int) -> _Cma | _Nsga2:
    """Return the search method of an optimisation: CMA-ES for one goal, NSGA-II for several."""
    population = optimisation.size(dimensions)
    try:
        if len(optimisation.goals) == 1:
            return _Cma(dimensions, population, optimisation.seed)
        return _Nsga2(dimensions, population, optimisation.seed, len(optimisation.goals))
    except ImportError as error:
        raise InputError(f"{error.name} is not installed", "the extra 'study'", "pip install 'scissordyn[study]'") from None


def optimise(study: Study, path: str | os.PathLike[str], **how: Unpack[How]) -> Store:
    """Search for the best points; every point that is tried is in the store.

    The method draws its random numbers by its seed, so that it proposes the same candidates again when it gets the same
    results: what the store holds is not computed again.
    """
    plan, count, store = study.optimisation, len(study.factors), Store(path)
    if plan is None or not count:
        raise InputError("a study without a goal or without a factor", "goals, and numbers to choose", "'minimise peak_force'")
    how["retry"] = False
    descent = Descent(study) if plan.method == "gradient" else None
    method, width = None if plan.every or descent else proposer(plan, count), plan.size(count)
    variations = [factor.variation for factor in study.factors]
    points = np.empty((0, count))
    for generation in range(plan.generations):
        if descent is not None:
            proposed = descent.ask()
            if not proposed.size:
                break
            new = quantiles(variations, proposed)
        elif method is not None:
            new = quantiles(variations, method.ask())
        else:
            new = design_values(Design("grid"), variations, study.base(), np.arange(width))
        points = np.concatenate([points, new])
        extended = replace(study, design=plan.design(generation + 1, count))
        stored_points = store.cases // study.per_point if store.exists() else 0
        if stored_points < points.shape[0] and stored_points:
            store.check(extended)
            store.extend(extended)
        how["generation"] = generation + 1
        missing = stored_points > points.shape[0] and (store.status()[: extended.cases] == PENDING).any()
        if stored_points <= points.shape[0] or missing:
            store = execute(extended, store.path, points, **how)
        results = store.results().isel(case=slice(0, points.shape[0] * study.per_point))
        _check_points(results, study, points, store)
        tried = candidates(extended, results).points.isel(point=slice(-width, None))
        goals = np.stack([goal.sign * tried[goal.label].values for goal in plan.goals], axis=1)
        if descent is not None:
            descent.tell(proposed[0], float(goals[0, 0]), margins(extended, results)[-1])
        elif method is not None:
            method.tell(*_finite(goals, tried["violation"].values))
    if descent is not None:
        descent.ask()  # whether the last point ends the search
        store.describe_search(descent.summary())
    return store


def _check_points(results: xr.Dataset, study: Study, points: np.ndarray, store: Store) -> None:
    """Raise `InputError` if the store has other points than the method proposes, for example after a change of version."""
    done = results["status"].values != PENDING
    for k, factor in enumerate(study.factors):
        stored = results[column(factor.path)].values
        if not np.array_equal(stored[done], np.repeat(points[:, k], study.per_point)[done]):
            raise InputError(
                f"'{store.path}' holds points that the method does not propose", "the version of the library that made it"
            )


def _finite(goals: np.ndarray, violation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Replace infinite values by large ones, so that candidates with failed cases rank last."""
    failed = ~np.all(np.isfinite(goals), axis=1) | ~np.isfinite(violation)
    worst = np.max(violation[~failed], initial=0.0)
    return np.where(failed[:, None], 0.0, goals), np.where(failed, worst + 1.0, violation)


def candidates(study: Study, results: xr.Dataset) -> Optimum:
    """Return goals and violation of every point that was tried."""
    plan = study.optimisation
    assert plan is not None
    variables = chosen_numbers(study, results)
    matrix, violation = risks_and_violations(study, results)
    for goal, values in zip(plan.goals, matrix.T, strict=True):
        chosen = goal.measure in study.factor_names
        unit = about_number(study, results, goal.measure) if chosen else {"units": response_unit(results, goal.response)}
        label = goal.measure if chosen else response_label(results, goal.response)
        about = {**unit, "long_name": f"{plan.risk} of {goal.response.name}", "label": label}
        variables[goal.label] = ("point", goal.sign * values, about)
    complete = np.asarray(study.cells(results["status"].values == COMPLETE).all(axis=(1, 2)))
    front, usable = np.zeros(len(complete), bool), complete & (violation <= 0.0)
    front[usable] = nondominated(matrix[usable])
    about = {"units": "1", "long_name": "violation of the requirements, as a fraction of the bounds"}
    variables["violation"] = ("point", violation, about)
    variables["front"] = ("point", front, {"long_name": "no other point is better in all goals"})
    generation = np.arange(len(complete)) // plan.size(len(study.factors))
    variables["generation"] = ("point", generation, {"long_name": "generation"})
    best = -1
    if len(plan.goals) == 1 and np.isfinite(violation).any():
        least = violation <= max(0.0, float(np.min(violation)))
        best = int(np.flatnonzero(least)[np.argmin(matrix[least, 0])])
    return Optimum(xr.Dataset(variables), best)


def risks_and_violations(study: Study, results: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return the risk of each goal to minimise, shape (points, goals), and the violation of the requirements, shape (points,).

    Points with failed cases have NaN as risk and an infinite violation.
    """
    plan = study.optimisation
    assert plan is not None

    def risk(values: np.ndarray) -> np.ndarray:
        return risk_value(study.cells(values).reshape(-1, study.per_point), plan.risk)

    goals = []
    for goal in plan.goals:
        chosen = goal.measure in study.factor_names
        values = results[column(goal.measure)].values if chosen else response_values(results, goal.response)
        goals.append(risk(goal.sign * values))
    beyond = np.maximum(-margins(study, results), 0.0)
    violation = np.sum(np.where(np.isnan(beyond), np.inf, beyond), axis=1)
    violation[~np.all(np.isfinite(goals), axis=0)] = np.inf
    return np.stack(goals, axis=1), violation


def margins(study: Study, results: xr.Dataset) -> np.ndarray:
    """Return the margin of each point to each requirement by the risk of the search, shape (points, requirements)."""
    plan = study.optimisation
    assert plan is not None
    columns = [
        -risk_value(study.cells(-requirement.margin_in(results)).reshape(-1, study.per_point), plan.risk)
        for requirement in study.requirements
    ]
    return np.array(columns).T.reshape(results.sizes["case"] // study.per_point, len(columns))


def nondominated(goals: np.ndarray) -> np.ndarray:
    """Return a mask (points,) of the points that no other dominates: better in one goal (points, goals), worse in none."""
    best = np.zeros(goals.shape[0], bool)
    order = np.lexsort(goals.T[::-1])
    front = np.empty((0, goals.shape[1]))
    for place in order:  # in this order a point can only be dominated by one before it
        candidate = goals[place]
        best[place] = not np.any(np.all(front <= candidate, axis=1) & np.any(front < candidate, axis=1))
        if best[place]:
            front = np.concatenate([front, candidate[None]])
    return best
