"""Both kinds of runs of a two-fidelity study: cheap runs that accurate runs verify, and the split of a budget.

The accurate runs are in a second store next to that of the study. The numbers of a case depend only on its index, so the
accurate runs are those of the first points of the same design.
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
from scissordyn.run.response import Response
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import POINTS_MIN, Design
from scissordyn.studies.ask.requirement import response_values
from scissordyn.studies.compute.execute import How, execute, extend, simulated
from scissordyn.studies.compute.optimise import candidates, optimise, risks_and_violations
from scissordyn.studies.compute.store import Store
from scissordyn.studies.compute.table import column
from scissordyn.studies.estimate import correlation, split

# Kinds of designs with points independent enough for intervals, and to which points can be added
VERIFIABLE_DESIGNS = ("random", "sobol")


def verified_path(path: str | os.PathLike[str]) -> str:
    """Return the path of the store of a study's accurate runs, next to the store `path` of its cheap runs."""
    stem, end = os.path.splitext(os.fspath(path).rstrip("/"))
    return f"{stem}.verified{end or '.db'}"


def verified_study(study: Study, points: int) -> Study:
    """Return the study of accurate runs of the first `points` points of a study, or of `points` points of its search."""
    accurate = study.accurate
    assert accurate is not None
    design, sampling = study.design, study.sampling
    if study.optimisation is not None:
        design = Design("adaptive", points)
    elif study.factors:
        design = replace(design, points=points)
    else:
        sampling = replace(sampling, samples=min(points, sampling.samples))
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


def compute_both_fidelities(
    study: Study, path: str | os.PathLike[str], budget: float | None = None, **how: Unpack[How]
) -> Store:
    """Compute the missing cheap runs of a study, then its missing accurate runs; return the store of the cheap runs."""
    _check(study, budget)
    store = Store(path)
    if study.optimisation is not None:
        store = optimise(study, path, **how)
        _confirm(study, store, {**how, "block": None})
        return store
    if budget is not None:
        study = _with_stored_points(study, store) if store.exists() else _split(study, budget * workers_of(how.get("engine")))
    store = execute(study, path, **how)
    _verify(study, Store(verified_path(path)), {**how, "block": None})
    return store


def _check(study: Study, budget: float | None) -> None:
    """Raise `InputError` if accurate runs of its first cases cannot verify the study, or it cannot have a budget."""
    kind, allowed = (study.design.kind, "design") if study.factors else (study.sampling.kind, "sampling")
    sampled = kind in VERIFIABLE_DESIGNS
    if sampled or study.optimisation is not None:
        verified_study(study, POINTS_MIN)  # whether the accurate mechanism has the parameters and parts
    if study.optimisation is not None:
        if budget is not None:
            raise InputError("a budget of an optimisation", "generations and population", "generations = 20")
        return
    if not sampled:
        what = f"cheap runs of a {kind} {allowed}, whose first points are not a sample"
        raise InputError(what, f"a {allowed} of kind {' or '.join(VERIFIABLE_DESIGNS)}", f'kind = "{VERIFIABLE_DESIGNS[1]}"')
    if budget is not None and not study.factors:
        raise InputError("a budget of a study of one point", "numbers under [vary], with a design", 'kind = "random"')


def _with_stored_points(study: Study, store: Store) -> Study:
    """Return the study with the numbers of points that its store was created with."""
    accurate, stored = study.accurate, store.study(reading=True).accurate
    points = POINTS_MIN if stored is None else stored.points
    return replace(study, design=store.design(), accurate=None if accurate is None else replace(accurate, points=points))


def _verify(study: Study, accurate_store: Store, how: How) -> None:
    """Compute the missing accurate runs of the first points of a study."""
    assert study.accurate is not None
    points = min(study.accurate.points, study.points if study.factors else study.sampling.samples)
    if accurate_store.exists() and study.factors:
        before = accurate_store.design()
        if before.points < points:
            extend(replace(verified_study(study, points), design=before), accurate_store.path, points, **how)
        points = max(points, before.points)
    execute(verified_study(study, points), accurate_store.path, **how)


def _split(study: Study, budget: float) -> Study:
    """Return the study with the numbers of cheap and accurate points within a budget of work [s], from pilot runs."""
    cheap_study = replace(study, design=replace(study.design, points=POINTS_MIN))
    accurate_study = verified_study(study, POINTS_MIN)
    cheap_runs, cheap = _run_pilot(cheap_study)
    accurate_runs, accurate_seconds = _run_pilot(accurate_study)
    correlated = _least_correlation(cheap_study, cheap_runs, accurate_runs)
    left = budget - POINTS_MIN * (cheap + accurate_seconds)
    verified, screened_points = split(max(left, 0.0), correlated, accurate_seconds, cheap)
    points = max(POINTS_MIN, screened_points)
    assert study.accurate is not None
    settings = replace(study.accurate, points=min(max(POINTS_MIN, verified), points))
    return replace(study, design=replace(study.design, points=points), accurate=settings)


def _run_pilot(study: Study) -> tuple[xr.Dataset, float]:
    """Compute all cases of a small study; return them and the time of a point [s]."""
    simulated(study, np.array([0]))  # compile and read first
    began = time.perf_counter()
    runs = simulated(study, np.arange(study.cases))
    return runs, (time.perf_counter() - began) / study.points


def _least_correlation(study: Study, cheap: xr.Dataset, accurate: xr.Dataset) -> float:
    """Return the smallest correlation of both kinds of runs over the responses of requirements, or over all measures."""
    responses = [requirement.response for requirement in study.requirements] or [Response(name) for name in study.measure_names]
    complete = (cheap["status"].values == "complete") & (accurate["status"].values == "complete")
    pairs = [(response_values(cheap, response), response_values(accurate, response)) for response in responses]
    correlations = [
        abs(correlation(accurate_values[complete], cheap_values[complete])) for cheap_values, accurate_values in pairs
    ]
    return min((value for value in correlations if np.isfinite(value)), default=0.0)


def _confirm(study: Study, store: Store, how: How) -> None:
    """Compute accurate runs of the best points of a search: its front, or the best points of one goal."""
    assert study.accurate is not None
    accurate_store, names = Store(verified_path(store.path)), study.paths
    best = best_tried(study, store.results(), study.accurate.points)
    points = np.empty((0, len(names)))
    if accurate_store.exists():  # those of an earlier, shorter search stay
        old = accurate_store.results()
        points = np.stack([old[column(name)].values[:: study.per_point] for name in names], axis=1)
        points = points[np.isfinite(points).all(axis=1)]
    new = [row for row in best if not (points == row).all(axis=1).any()]
    points = np.concatenate([points, *(row[None] for row in new)])
    if not points.size:
        return
    confirmed = verified_study(study, points.shape[0])
    if accurate_store.exists() and accurate_store.cases < confirmed.cases:
        accurate_store.extend(confirmed)
    execute(confirmed, accurate_store.path, points, **how)


def best_tried(study: Study, results: xr.Dataset, most: int) -> np.ndarray:
    """Return the best points of a search, shape (points, factors): evenly spread on its front, or the best of one goal."""
    tried = candidates(study, results).points
    goals, violation = risks_and_violations(study, results)
    rows = np.flatnonzero(tried["front"].values)
    if goals.shape[1] == 1 or not rows.size:
        judged_points = np.flatnonzero(np.isfinite(violation))
        rows = judged_points[np.lexsort((goals[judged_points, 0], violation[judged_points]))][:most]
    elif rows.size > most:
        rows = rows[np.argsort(goals[rows, 0], kind="stable")]
        rows = rows[np.unique(np.linspace(0, rows.size - 1, most).round().astype(int))]
    numbers = tried[study.paths].to_array().values.T[rows]
    return np.asarray(numbers[np.sort(np.unique(numbers, axis=0, return_index=True)[1])])
