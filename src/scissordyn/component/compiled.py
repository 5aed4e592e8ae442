"""The compiled kernels of components, and what they give at rest."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from scissordyn.compiler.recipe import Recipe
from scissordyn.component.declaration import Component
from scissordyn.errors import InputError
from scissordyn.plugin.pointer import arguments_of, pointer_of


class Kernels:
    """Pointers to the compiled kernels of a component class; 0 for one that it does not have."""

    def __init__(self, force: int, gap: int, switch: int) -> None:
        self.force, self.gap, self.switch = force, gap, switch


@cache
def kernels_of(described: type[Component]) -> Kernels:
    pointers = {key: pointer_of(recipe) for key, recipe in recipes_of(described).items()}
    return Kernels(*(pointers.get(key, 0) for key in ("force", "gap", "switch")))


def recipes_of(described: type[Component]) -> dict[str, Recipe]:
    """What the kernels of a component class are made into, by their names."""
    declaration = described.declaration
    places, counts, recipes = declaration.places, {"force": len(declaration.results), "gap": 2, "switch": 1}, {}
    for key, kernel in declaration.kernels.items():
        handed = tuple(places[name] for name in arguments_of(kernel))
        recipes[key] = Recipe(kernel, handed, tuple(f"out[{k}]" for k in range(counts[key])))
    return recipes


def at_rest(component: Component, start: tuple[float, ...], at: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """What the force kernel of a component gives at rest, in plain Python."""
    declaration = component.declaration
    if declaration.force is None:
        return ()
    arguments, names = arguments_of(declaration.force), declaration.numbers
    values: dict[str, Any] = dict.fromkeys(declaration.places, 0.0) | {"factor": 1.0}
    values |= zip(declaration.port.coordinates, start if at is None else at, strict=True)
    try:
        numbers = component.parameters(start)
        if not len(names) <= len(numbers) <= (len(numbers) if "table" in arguments else len(names)):
            raise TypeError(f"{len(numbers)} numbers for {', '.join(names)}")
        values |= {**dict(zip(names, numbers, strict=False)), "table": np.array(numbers)}
        result = declaration.force(*map(values.__getitem__, arguments))
    except Exception as error:
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel raises {type(error).__name__} ({error}) where it starts",
            f"{len(declaration.results)} numbers: {', '.join(declaration.results)}",
        ) from None
    results = result if isinstance(result, tuple) else (result,)
    if len(results) != len(declaration.results) or not all(math.isfinite(number) for number in results):
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel gives {result!r} where it starts",
            f"{len(declaration.results)} finite numbers: {', '.join(declaration.results)}",
        )
    return results
