"""The study that follows a study: the same mechanism, requirements and measures with other ranges, samples or goals."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from scissordyn.config.names import listed
from scissordyn.config.study import factors_of
from scissordyn.errors import InputError
from scissordyn.study.description import Factor, Study
from scissordyn.study.design import SAMPLED, Design
from scissordyn.study.goal import Optimisation, read_goal
from scissordyn.study.variant import with_names

__all__ = ["refined"]

POINTS = 32
"""Points of a study that follows a search, if no number is given."""


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
    """The study with some things changed.

    Parameters
    ----------
    study : Study
        With its mechanism.
    vary, uncertain : mapping of str to str, optional
        Texts as in a study file, by address; they replace or join those of the study. A number that becomes uncertain is no
        longer chosen, unless its text is a tolerance alone.
    points, samples, seed : int, optional
        As of the study if not given.
    goals : sequence of str
        Of a search of the ranges.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        For what does not fit.
    """
    named = {each.name for each in study.named}
    names, vary = _parted(vary or {}, named)
    study, uncertain = with_names(study, names), dict(uncertain or {})
    if given := named & uncertain.keys():
        raise InputError(f"'{min(given)}' as an uncertain number", "some of its names", f"--vary {min(given)}='[NAME, NAME]'")
    chosen = {each.address: each for each in study.factors}
    chosen |= {each.address: each for each in factors_of(study.mechanism, vary, Path())}
    drawn = factors_of(study.mechanism, uncertain, Path())
    taken = {each.address for each in drawn if not each.of}
    factors = tuple(each for address, each in chosen.items() if address not in taken)
    rest = tuple(each for each in study.uncertain if each.name not in {one.name for one in drawn} and each.address not in vary)
    seed_now = study.design.seed if seed is None else seed
    sampling = replace(
        study.sampling, samples=samples or study.sampling.samples, seed=study.sampling.seed if seed is None else seed
    )
    search = None
    if goals:
        units = {own.name: own.units for own in study.own_measures}
        search = Optimisation(tuple(read_goal(goal, units, list(chosen)) for goal in goals), seed=seed_now)
        search = search.over([each.variation for each in factors])
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


def _parted(given: Mapping[str, str], named: Collection[str]) -> tuple[dict[str, tuple[str, ...]], dict[str, str]]:
    """Names that the study has, and texts of numbers, by address."""
    lists = {address: names for address, text in given.items() if address in named and (names := listed(text)) is not None}
    return {address: names.values for address, names in lists.items()}, {
        address: text for address, text in given.items() if address not in lists
    }


def _needed(search: Optimisation | None, study: Study, chosen: Mapping[str, object]) -> list[str]:
    goals = search.goals if search is not None else ()
    return [goal.measure for goal in goals if goal.measure not in (*chosen, *study.measure_names)]


def _design(study: Study, factors: Sequence[Factor], points: int | None, seed: int) -> Design:
    """The design of the study; all combinations where each number has one value, a Sobol design after a search."""
    if all(each.variation.count == 1 for each in factors):
        return Design()
    kind = study.design.kind if study.design.kind in SAMPLED else "sobol" if points or study.optimisation else study.design.kind
    if kind not in SAMPLED:
        return Design(kind)
    if points is not None and points < 1:
        raise InputError(f"{points} points", "a whole number >= 1", "--points 32")
    return Design(kind, points or (study.design.points if study.design.kind == kind else POINTS), seed)
