"""The mechanisms that names make: of sections, materials, oils, laws, whatever a case has a word for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.address import changed_all, number
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.measure import MEASURES, parts_of
from scissordyn.study.distribution import Names
from scissordyn.study.factor import Factor

if TYPE_CHECKING:
    from scissordyn.study.description import Study

__all__ = ["by_variant", "check_names", "labelled", "made", "own_names", "with_names"]


def by_variant(study: Study, values: Mapping[str, np.ndarray]) -> Iterator[tuple[Mechanism, np.ndarray]]:
    """The cases of each mechanism that names make, of those that have any.

    Parameters
    ----------
    study : Study
    values : mapping of str to ndarray
        By `Study.addresses`; names that are missing are those of the mechanism itself.

    Yields
    ------
    mechanism : Mechanism
    cases : ndarray of int
        Their places in the values.
    """
    count = len(next(iter(values.values())))
    places: dict[str, Any] = {**own_names(study), **values}
    chosen = [np.broadcast_to(places[factor.name], count).astype(int) for factor in study.named]
    which = np.ravel_multi_index(chosen, _counts(study)) if chosen else np.zeros(count, int)
    for one in np.unique(which):
        yield study.variants[one] if chosen else study.mechanism, np.flatnonzero(which == one)


def made(study: Study, values: Mapping[str, float], *, nominal: bool = False) -> Mechanism:
    """The mechanism of a case.

    Parameters
    ----------
    study : Study
    values : mapping of str to float
        By `Study.addresses`.
    nominal : bool
        Whether what is chosen alone is given: all else is as in the mechanism itself.
    """
    ((mechanism, _),) = by_variant(study, {name: np.array([value]) for name, value in values.items()})
    names = {factor.name for factor in study.named}
    numbers = {name: value for name, value in values.items() if name not in names} if nominal else study.applied(values)
    return changed_all(mechanism, numbers)


def labelled(study: Study, values: Mapping[str, float]) -> dict[str, float | str]:
    """Numbers by address, with the names in place of what stands for them."""
    labels = {factor.name: factor.labels for factor in study.named}
    return {name: labels[name][int(value)] if name in labels else value for name, value in values.items()}


def own_names(study: Study) -> dict[str, int]:
    """The places of the names of the mechanism itself, of the first ones if it is none of the variants."""
    own = study.variants.index(study.mechanism) if study.mechanism in study.variants else 0
    places = map(int, np.unravel_index(own, _counts(study)))
    return dict(zip((each.name for each in study.named), places, strict=True))


def with_names(study: Study, given: Mapping[str, Sequence[str]]) -> Study:
    """The study with some of its names only.

    Parameters
    ----------
    study : Study
    given : mapping of str to sequence of str
        By address.
    """
    if not given:
        return study
    places = []
    for factor in study.named:
        for name in given.get(factor.name, ()):
            if name not in factor.labels:
                what = f"'{factor.name}' = '{name}'{did_you_mean(name, factor.labels)}"
                raise InputError(what, f"names of the study: {', '.join(factor.labels)}")
        places.append([factor.labels.index(name) for name in given.get(factor.name, factor.labels)])
    kept = np.arange(len(study.variants)).reshape(_counts(study))[np.ix_(*places)].ravel()

    def fewer(factors: tuple[Factor, ...]) -> tuple[Factor, ...]:
        return tuple(
            replace(each, variation=Names(tuple(given[each.name]))) if each.name in given else each for each in factors
        )

    variants = tuple(study.variants[place] for place in kept)
    return replace(study, factors=fewer(study.factors), uncertain=fewer(study.uncertain), variants=variants)


def check_names(study: Study) -> None:
    """Raise `InputError` for a design that needs an order of names, or variants that measures cannot be compared of."""
    if not study.named:
        return
    what = f"'{study.named[0].address}': names, which have no order, in a"
    if study.design.kind == "morris":
        raise InputError(f"{what} Morris design", "a design for Sobol indices", 'kind = "saltelli"')
    chosen = [goal.measure for goal in study.optimisation.goals] if study.optimisation is not None else []
    if any(factor.address in chosen for factor in study.named):
        raise InputError(f"a goal about {what.removesuffix(' in a')}", "a goal about a measure or a number", "'minimise mass'")
    if study.design.kind == "one-at-a-time" and study.mechanism not in study.variants:
        raise InputError(f"{what} one-at-a-time design, without those of the case", "the names of the case among them")
    for factor in (each for each in (*study.factors, *study.uncertain) if not each.labels):
        units = {quantity.unit for each in study.variants if (quantity := number(each, factor.address).quantity) is not None}
        if len(units) > 1:
            raise InputError(f"'{factor.address}' in [{'] and ['.join(sorted(units))}], by name", "a number of one unit")
    dims = {dim for name in study.measures for dim in MEASURES[name].dims}
    first, *others = (parts_of(variant) for variant in study.variants)
    differs = next((dim for parts in others for dim in dims if parts[dim] != first[dim]), None)
    if differs is not None:
        what = f"measures of each {differs}, of which names make different ones"
        raise InputError(what, f"names with which each {differs} stays, or other measures")


def _counts(study: Study) -> list[int]:
    return [factor.variation.count for factor in study.named]
