"""The compiled kernels of components, and what they give at rest."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from scissordyn.compiler.recipe import Recipe
from scissordyn.component.declaration import CONTEXT, Component, Declaration, Kernel
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
    kernels = {"force": declaration.force, "gap": declaration.gap, "switch": declaration.switch}
    counts = {"force": len(declaration.results), "gap": 2, "switch": 1}
    return {
        key: Recipe(kernel, _handed(kernel, declaration), tuple(f"out[{k}]" for k in range(counts[key])))
        for key, kernel in kernels.items()
        if kernel is not None
    }


def _handed(kernel: Kernel, declaration: Declaration) -> tuple[str, ...]:
    handed = [f"q[{k}]" for k in range(len(declaration.port.coordinates))]
    handed += [f"v[{k}]" for k in range(len(declaration.port.rates))]
    handed += [f"z[{k}]" for k in range(len(declaration.states))]
    handed += [f"x[{CONTEXT.index(name)}]" for name in declaration.context]
    names = arguments_of(kernel)
    table = names[-1] == "table"
    numbers = (f"p[{k}]" for k in range(len(names) - len(handed) - table))
    return (*handed, *numbers, *(["p"] if table else []))


def place_of(declaration: Declaration, argument: str) -> int:
    """Where an argument of the force kernel stands among the numbers that a component has for it."""
    assert declaration.force is not None
    given = (declaration.port.coordinates, declaration.port.rates, declaration.states, declaration.context)
    return arguments_of(declaration.force).index(argument) - sum(map(len, given))


def at_rest(component: Component, start: tuple[float, ...], at: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """What the force kernel of a component gives at rest, in plain Python."""
    declaration = component.declaration
    if declaration.force is None:
        return ()
    names = arguments_of(declaration.force)
    rest = (0.0,) * (len(declaration.port.rates) + len(declaration.states))
    context = tuple(1.0 if name == "factor" else 0.0 for name in declaration.context)
    try:
        parameters: tuple[Any, ...] = component.parameters(start)
        leading = len(start) + len(rest) + len(context)
        if names[-1] == "table":
            fixed = len(names) - leading - 1
            parameters = (*parameters[:fixed], np.array(parameters))
        result = declaration.force(*(start if at is None else at), *rest, *context, *parameters)
    except Exception as error:
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel raises {type(error).__name__} ({error}) where it starts",
            f"{len(declaration.results)} numbers: {', '.join(declaration.results)}",
        ) from None
    numbers = result if isinstance(result, tuple) else (result,)
    if len(numbers) != len(declaration.results) or not all(math.isfinite(number) for number in numbers):
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel gives {result!r} where it starts",
            f"{len(declaration.results)} finite numbers: {', '.join(declaration.results)}",
        )
    return numbers
