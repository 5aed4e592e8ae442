"""Kernels of elements by pointers to their machine code: those of the package's elements are in its library.

An element of a user is compiled when it is first used, to a library that lives as long as the process.
"""

from __future__ import annotations

import ctypes
import inspect
import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from scissordyn.compiler.c import loaded
from scissordyn.compiler.kind import SourceError
from scissordyn.compiler.recipe import Recipe
from scissordyn.compiler.unit import Unit
from scissordyn.errors import InputError, did_you_mean
from scissordyn.kernel import CALLED, PYTHON, library

Kernel = Callable[..., Any]

RECIPES: dict[int, Recipe] = {}  # What was made into the function at each pointer


def check_names(what: str, key: str, kernel: Kernel, places: Mapping[str, str]) -> None:
    """Raise `InputError` if a kernel names what it cannot be given."""
    for argument in arguments_of(kernel):
        if argument not in places:
            raise InputError(
                f"{what}: its kernel '{key}' names '{argument}'{did_you_mean(argument, places)}", ", ".join(places)
            )


def arguments_of(kernel: Kernel) -> tuple[str, ...]:
    """Names of a kernel's arguments."""
    return tuple(inspect.signature(kernel).parameters)


@cache
def pointer_of(recipe: Recipe) -> int:
    """Where the machine code of an element's kernel lies."""
    if PYTHON:
        pointer = len(CALLED) + 1
        CALLED[pointer] = recipe.python()
    else:
        ours = str(recipe.function.__module__).startswith("scissordyn.")
        function = getattr(library(), recipe.symbol) if ours else _compiled(recipe)
        pointer = ctypes.cast(function, ctypes.c_void_p).value or 0
    RECIPES[pointer] = recipe
    return pointer


_KEPT: list[Any] = []
"""Libraries and functions of users' elements: they live as long as the process, since their pointers travel as numbers."""

_POINTERS = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.POINTER(ctypes.c_double)] * 6)


def _compiled(recipe: Recipe) -> Any:
    """A user's function in C; one without a source, as from a prompt, stays in Python and is about a hundred times slower."""
    unit = Unit()
    unit.kernel(recipe)
    try:
        text = unit.text()
    except SourceError:
        _KEPT.append(_POINTERS(_in_python(recipe)))
        return _KEPT[-1]
    _KEPT.append(loaded(text))
    return getattr(_KEPT[-1], recipe.symbol)


def _in_python(recipe: Recipe) -> Callable[..., float]:
    """What is called by a pointer; errors are NaN, as C has no others."""
    called = recipe.python()

    def answer(*pointers: Any) -> float:
        try:
            return called(*pointers)
        except Exception:
            for target in recipe.targets:
                if target.startswith("out"):
                    pointers[5][int(target[4:-1])] = math.nan
            return math.nan

    return answer
