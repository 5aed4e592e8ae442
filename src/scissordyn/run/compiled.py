"""The compiled loop, and the mechanics that it calls by pointers: each is compiled, or read from disk, when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.core.registry import cpu_target

from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import Problem, make_problem, problem_type
from scissordyn.mechanics import functions

__all__ = ["compiled_loop", "compiled_mechanics", "loop_is_on_disk"]


@cache
def compiled_mechanics() -> Problem:
    """Typed pointers to the mechanics."""
    return make_problem(functions.FUNCTIONS)


@cache
def compiled_loop() -> Callable[[Problem, np.ndarray, np.ndarray, int, np.ndarray], None]:
    """`integrate.advance.advance_all`; to have numba look at its arguments at each call would take as long as many steps."""
    kinds = _kinds()
    loop.advance_all.compile(kinds)
    compiled: Callable[..., None] = loop.advance_all.overloads[kinds].entry_point
    return compiled


def loop_is_on_disk() -> bool:
    """Whether the loop was compiled before; it needs the types of the pointers only."""
    return bool(loop.advance_all._cache.holds(_kinds(), cpu_target.target_context.codegen()))


def _kinds() -> tuple[Any, ...]:
    numbers = types.int64[::1]
    return problem_type(), numbers, numbers, types.int64, numbers
