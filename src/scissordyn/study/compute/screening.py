"""Studies of cheap runs that are verified by accurate ones: which are made, and how a budget is split between both.

The accurate runs stand in a store of their own beside that of the study. As every case has its numbers by its place alone, they
are those of the first points of the same design.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from typing import Unpack

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.run.engine import workers_of
from scissordyn.study.answer.control_variate import correlation, split
from scissordyn.study.ask.description import PILOT, Study
from scissordyn.study.ask.design import Design
from scissordyn.study.ask.requirement import Response, response_values
from scissordyn.study.compute.execute import How, execute, extend, simulated
from scissordyn.study.compute.interpolation import FEWEST, interpolation
from scissordyn.study.compute.optimise import candidates, optimise
from scissordyn.study.compute.store import Store
from scissordyn.study.compute.table import column

PILOTED = 0.05  # Of the budget, at most, for cheap runs that say how well interpolation between them predicts
SPLIT = ("random", "sobol")  # Designs whose points are independent enough for intervals, and to which points can be added
LEAST = 0.1  # Of a correlation with which a budget is split: with fewer pairs than it needs the pilot knows no better


def verified_path(path: str | os.PathLike[str]) -> str:
    """Where the accurate runs of a study stand."""
    stem, end = os.path.splitext(os.fspath(path).rstrip("/"))
    return f"{stem}.verified{end or '.db'}"


def verified_study(study: Study, points: int) -> Study:
    """The accurate runs of the first points of a study, or of so many points of its front."""
    accurate = study.accurate
    assert accurate is not None
    design, sampling = replace(study.design, points=points), study.sampling
    if study.optimisation is not None:
        design = Design("adaptive", points)
    elif not study.factors:
        design, sampling = study.design, replace(sampling, samples=min(points, sampling.samples))
    return replace(
        study,
        mechanism=accurate.mechanism,
        variants=accurate.variants,
        options=accurate.options,
        accurate=None,
        optimisation=None,
        design=design,
        sampling=sampling,
    )


def screened(study: Study, path: str | os.PathLike[str], budget: float | None = None, **how: Unpack[How]) -> Store:
    """Make the cheap runs of a study, then the accurate ones; what the stores hold already is kept."""
    _check(study, budget)
    store = Store(path)
    if study.optimisation is not None:
        store = optimise(study, path, **how)
        _confirm(study, store, {**how, "block": None})
        return store
    if budget is not None:
        study = _as_in(study, store) if store.exists() else _split(study, budget * workers_of(how.get("engine")))
    store = execute(study, path, **how)
    _verify(study, Store(verified_path(path)), {**how, "block": None})
    return store


def _check(study: Study, budget: float | None) -> None:
    """Raise `InputError` for what cannot be verified by the first of its cases."""
    verified_study(study, PILOT)  # whether the accurate mechanism has the parameters and parts
    if study.optimisation is not None:
        if budget is not None:
            raise InputError("a budget of an optimisation", "generations and population", "generations = 20")
        return
    kind, allowed = (study.design.kind, "design") if study.factors else (study.sampling.kind, "sampling")
    if kind not in SPLIT:
        what = f"cheap runs of a {kind} {allowed}, of which the first points are not a sample"
        raise InputError(what, f"a {allowed} of kind {' or '.join(SPLIT)}", f'kind = "{SPLIT[1]}"')
    if budget is not None and not study.factors:
        raise InputError("a budget of a study of one point", "numbers under [vary], with a design", 'kind = "random"')


def _as_in(study: Study, store: Store) -> Study:
    """The study with as many points of both kinds as its store was begun with."""
    accurate, there = study.accurate, store.study(reading=True).accurate
    points = PILOT if there is None else there.points
    return replace(study, design=store.design(), accurate=None if accurate is None else replace(accurate, points=points))


def _verify(study: Study, there: Store, how: How) -> None:
    """The accurate runs of the first points."""
    assert study.accurate is not None
    points = min(study.accurate.points, study.points if study.factors else study.sampling.samples)
    if there.exists() and study.factors:
        before = there.design()
        if before.points < points:
            extend(replace(verified_study(study, points), design=before), there.path, points, **how)
        points = max(points, before.points)
    execute(verified_study(study, points), there.path, **how)


def _split(study: Study, budget: float) -> Study:
    """The study with as many points of both kinds as a budget of work [s] has room for, by a pilot of both."""
    few, accurate = replace(study, design=replace(study.design, points=PILOT)), verified_study(study, PILOT)
    cheap_runs, cheap = _piloted(few)
    accurate_runs, accurate_seconds = _piloted(accurate)
    correlated = _least_correlation(few, cheap_runs, accurate_runs)
    left, unpredicted = budget - PILOT * (cheap + accurate_seconds), 1.0
    if FEWEST * cheap < PILOTED * budget:
        more = replace(study, design=replace(study.design, points=FEWEST))
        unpredicted = _unpredicted(more, _piloted(more)[0])
        left -= FEWEST * cheap
    verified, screened_points = split(max(left, 0.0), correlated, accurate_seconds, cheap, unpredicted)
    points = max(PILOT if unpredicted == 1.0 else FEWEST, screened_points)
    assert study.accurate is not None
    wanted = replace(study.accurate, points=min(max(PILOT, verified), points))
    return replace(study, design=replace(study.design, points=points), accurate=wanted)


def _piloted(study: Study) -> tuple[xr.Dataset, float]:
    """All cases of a small study, and the time of a point [s]."""
    simulated(study, np.array([0]))  # whatever is compiled or read once
    began = time.perf_counter()
    runs = simulated(study, np.arange(study.cases))
    return runs, (time.perf_counter() - began) / study.points


def _least_correlation(study: Study, cheap: xr.Dataset, accurate: xr.Dataset) -> float:
    """The least correlation of what requirements are about between cheap and accurate runs."""
    both = (cheap["status"].values == "complete") & (accurate["status"].values == "complete")
    pairs = [(response_values(cheap, some), response_values(accurate, some)) for some in _responses(study)]
    correlations = [abs(correlation(there[both], here[both])) for here, there in pairs]
    finite = [some for some in correlations if np.isfinite(some)]
    return max(LEAST, min(finite, default=LEAST))


def _unpredicted(study: Study, runs: xr.Dataset) -> float:
    """The largest part of the variance of what requirements are about that interpolation between cheap runs leaves."""
    if not np.all(runs["status"].values == "complete") or study.per_point > 1:
        return 1.0
    between = interpolation(study, runs, np.arange(study.cases))
    return max(between.unpredicted(wanted) for wanted in _responses(study)) if between is not None else 1.0


def _responses(study: Study) -> list[Response]:
    """What requirements are about, or all measures."""
    return [requirement.response for requirement in study.requirements] or [Response(name) for name in study.measure_names]


def _confirm(study: Study, store: Store, how: How) -> None:
    """Accurate runs of the best points of a search: its front, or the best of one goal."""
    assert study.accurate is not None
    there, names = Store(verified_path(store.path)), [factor.path for factor in study.factors]
    wanted = best_tried(study, store.results(), study.accurate.points)
    points = np.empty((0, len(names)))
    if there.exists():  # those of an earlier, shorter search stay
        old = there.results()
        points = np.stack([old[column(name)].values[:: study.per_point] for name in names], axis=1)
        points = points[np.isfinite(points).all(axis=1)]
    new = [row for row in wanted if not (points == row).all(axis=1).any()]
    points = np.concatenate([points, *(row[None] for row in new)])
    if not points.size:
        return
    confirmed = verified_study(study, points.shape[0])
    if there.exists() and there.cases < confirmed.cases:
        there.extend(confirmed)
    execute(confirmed, there.path, points, **how)


def best_tried(study: Study, results: xr.Dataset, most: int) -> np.ndarray:
    """Numbers of the best points of a search, shape (points, factors): of its front, evenly spread, or the best of one goal."""
    assert study.optimisation is not None
    tried = candidates(study, results).points
    goals = np.stack([tried[goal.label].values for goal in study.optimisation.goals], axis=1)
    violation = tried["violation"].values
    rows = np.flatnonzero(tried["front"].values)
    if goals.shape[1] == 1 or not rows.size:
        judged_points = np.flatnonzero(np.isfinite(violation))
        rows = judged_points[np.lexsort((goals[judged_points, 0], violation[judged_points]))][:most]
    elif rows.size > most:
        rows = rows[np.argsort(goals[rows, 0], kind="stable")]
        rows = rows[np.unique(np.linspace(0, rows.size - 1, most).round().astype(int))]
    numbers = np.stack([tried[factor.path].values[rows] for factor in study.factors], axis=1)
    return np.asarray(numbers[np.sort(np.unique(numbers, axis=0, return_index=True)[1])])
