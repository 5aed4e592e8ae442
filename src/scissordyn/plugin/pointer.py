"""Kernels of elements by pointers to their machine code: those of the package's elements are in its library.

An element of a user is compiled when it is first used, to a library that lives as long as the process.
"""

from __future__ import annotations

import ctypes
import inspect
import math
from collections.abc import Callable
from functools import cache
from typing import Any

from scissordyn.compiler.c import loaded
from scissordyn.compiler.recipe import Recipe
from scissordyn.compiler.unit import Unit
from scissordyn.kernel import CALLED, PYTHON
from scissordyn.library import library

Kernel = Callable[..., Any]

RECIPES: dict[int, Recipe] = {}
"""What was made into the function at each pointer."""


def arguments_of(kernel: Kernel) -> tuple[str, ...]:
    """Names of a kernel's arguments."""
    return tuple(inspect.signature(kernel).parameters)


@cache
def pointer_of(recipe: Recipe) -> int:
    """Where the machine code of an element's kernel lies.

    Raises
    ------
    InputError
        If it cannot be compiled.
    """
    if PYTHON:
        pointer = len(CALLED) + 1
        CALLED[pointer] = recipe.python(_guarded(recipe.function))
    else:
        ours = recipe.function.__module__.startswith("scissordyn.")
        where = library() if ours else _own_library(recipe)
        pointer = ctypes.cast(getattr(where, recipe.symbol), ctypes.c_void_p).value or 0
    RECIPES[pointer] = recipe
    return pointer


_OWN: list[ctypes.CDLL] = []
"""Libraries of users' elements, kept alive: their pointers travel as numbers."""


def _own_library(recipe: Recipe) -> ctypes.CDLL:
    unit = Unit()
    unit.kernel(recipe)
    _OWN.append(loaded(unit.text()))
    return _OWN[-1]


def _guarded(kernel: Kernel) -> Callable[..., float]:
    def number(*arguments: float) -> float:
        try:
            return float(kernel(*arguments))
        except Exception:
            return math.nan

    return number
