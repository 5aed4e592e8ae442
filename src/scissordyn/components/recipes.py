"""Recipes of the kernels of all laws, controllers and components."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations

from scissordyn.compiler.recipe import Recipe
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.declaration import recipes_of
from scissordyn.components.film.film import Film
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION
from scissordyn.plugin.element import recipes


def catalogue_recipes() -> Iterator[Recipe]:
    """Yield the recipes of all elements of the catalogues, for each set of states that they may have."""
    for catalogue in (ELASTIC, DAMPING, FRICTION, CONTROLLERS):
        for element in catalogue.values():
            declared = element.declaration
            names = tuple(state.name for state in declared.states)
            # if `states` is a property, an instance may have only some of the declared states
            for present in _subsets(names) if isinstance(getattr(element, "states", ()), property) else [names]:
                yield from recipes(declared, present).values()
    for component in (*COMPONENTS.values(), Film):
        yield from recipes_of(component).values()


def _subsets(names: tuple[str, ...]) -> Iterable[tuple[str, ...]]:
    return (part for count in range(len(names) + 1) for part in combinations(names, count))
