"""The study that follows a study: the same mechanism, requirements and measures with other ranges, samples or goals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scissordyn.config.names import listed
from scissordyn.config.study import factors_of
from scissordyn.config.variation import read_variation
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.study.ask.description import Factor, Study
from scissordyn.study.ask.design import SAMPLED, Design
from scissordyn.study.ask.factor import with_places
from scissordyn.study.ask.requirement import Optimisation, read_goal
from scissordyn.units import Quantity

POINTS = 32  # Points of a study that follows a search, if no number is given


def refined(
    study: Study,
    *,
    vary: Mapping[str, str] | None = None,
    uncertain: Mapping[str, str] | None = None,
    points: int | None = None,
    samples: int | None = None,
    seed: int | None = None,
    goals: Sequence[str] = (),
) -> Study:
    """The study with some things changed."""
    apart = {factor.name: factor for factor in study.apart}
    places = {parameter: _places(apart[parameter], text) for parameter, text in (vary or {}).items() if parameter in apart}
    study, vary, uncertain = (
        with_places(study, places),
        {parameter: text for parameter, text in (vary or {}).items() if parameter not in places},
        dict(uncertain or {}),
    )
    if clash := apart.keys() & uncertain.keys():
        raise InputError(f"'{min(clash)}' as an uncertain number", "some of its values", command("--vary", f"{min(clash)}=..."))
    chosen = {factor.path: factor for factor in study.factors}
    chosen |= {factor.path: factor for factor in factors_of(study.mechanism, vary, Path())}
    drawn = factors_of(study.mechanism, uncertain, Path())
    taken = {factor.path for factor in drawn if not factor.of}
    factors = tuple(factor for parameter, factor in chosen.items() if parameter not in taken)
    rest = tuple(
        factor for factor in study.uncertain if factor.name not in {factor.name for factor in drawn} and factor.path not in vary
    )
    seed_now = study.design.seed if seed is None else seed
    sampling = replace(
        study.sampling, samples=samples or study.sampling.samples, seed=study.sampling.seed if seed is None else seed
    )
    search = None
    if goals:
        units = {measure.name: measure.units for measure in study.own_measures}
        search = Optimisation(tuple(read_goal(goal, units, list(chosen)) for goal in goals), seed=seed_now)
        search = search.over([factor.variation for factor in factors])
    measures = tuple(dict.fromkeys([*study.measures, *_needed(search, study, chosen)]))
    return replace(
        study,
        factors=factors,
        uncertain=(*rest, *drawn),
        sampling=sampling if (*rest, *drawn) else replace(sampling, samples=1),
        design=search.design(1, len(factors)) if search is not None else _design(study, factors, points, seed_now),
        optimisation=search,
        measures=measures,
    )


def _places(factor: Factor, text: str) -> list[int]:
    """Places of some names or levels of a study."""
    every: Any = factor.variation
    names = listed(text)
    if factor.labels:
        values: Sequence[Any] = (text,) if names is None else names.values
        other = next((value for value in values if value not in factor.labels), None)
        near = did_you_mean(str(other), factor.labels)
    else:
        values = read_variation(text, Quantity(factor.si), parameter=factor.path).levels().tolist()
        other = next((value for value in values if not np.isclose(every.values, value, rtol=1e-5, atol=0.0).any()), None)
        near = ""
    if other is not None:
        raise InputError(f"'{factor.path}' = '{text}'{near}", f"values of the study: {', '.join(factor.texts)}")
    return [factor.labels.index(value) if factor.labels else int(factor.places(value)) for value in values]


def _needed(search: Optimisation | None, study: Study, chosen: Mapping[str, object]) -> list[str]:
    goals = search.goals if search is not None else ()
    return [goal.measure for goal in goals if goal.measure not in (*chosen, *study.measure_names)]


def _design(study: Study, factors: Sequence[Factor], points: int | None, seed: int) -> Design:
    """The design of the study; all combinations where each number has one value, a Sobol design after a search."""
    if all(factor.variation.count == 1 for factor in factors):
        return Design()
    kind = study.design.kind if study.design.kind in SAMPLED else "sobol" if points or study.optimisation else study.design.kind
    if kind not in SAMPLED:
        return Design(kind)
    if points is not None and points < 1:
        raise InputError(f"{points} points", "a whole number >= 1", "--points 32")
    return Design(kind, points or (study.design.points if study.design.kind == kind else POINTS), seed)
