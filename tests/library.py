"""Kernels of tests, compiled to libraries of their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from scissordyn.compiler.c import loaded
from scissordyn.compiler.unit import Unit
from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import Problem
from scissordyn.kernel import I1, PYTHON, Entry


def in_c(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function with annotated arguments, compiled with all that it calls."""
    entry, unit = Entry(function), Unit()
    if PYTHON:
        return entry
    unit.entry(entry)
    return entry.bound(loaded(unit.text()))


def loop_of(functions: Mapping[str, Any]) -> Callable[..., None]:
    """The time loop of a problem, by the names of its functions."""
    return _loop(Problem(**functions))


@cache
def _loop(problem: Problem) -> Callable[..., None]:
    def advance_problem(systems: I1, addresses: I1, most_steps: int, statuses: I1) -> None:
        for k in range(systems.size):
            statuses[k] = loop.advance(problem, systems[k], addresses[k], most_steps)

    return in_c(advance_problem)
