"""The compiled kernels of components, and what they give at rest."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numba
import numpy as np

from scissordyn.component.declaration import CONTEXT, Component, Declaration, Kernel
from scissordyn.errors import InputError
from scissordyn.plugin.address import address_of, arguments_of, plain_kernel

__all__ = ["Kernels", "at_rest", "kernels_of"]


class Kernels:
    """Addresses of the compiled kernels of a component class; 0 for one that it does not have.

    Parameters
    ----------
    force, gap, switch : int
    """

    def __init__(self, force: int, gap: int, switch: int) -> None:
        self.force, self.gap, self.switch = force, gap, switch


@cache
def kernels_of(described: type[Component], parameters: int) -> Kernels:
    """The compiled kernels of a component class.

    Parameters
    ----------
    described : type
    parameters : int
        How many numbers its kernels read.

    Returns
    -------
    Kernels

    Raises
    ------
    InputError
        If a kernel cannot be compiled.
    """
    declaration = described.declaration
    found = []
    for kernel, results in ((declaration.force, len(declaration.results)), (declaration.gap, 2), (declaration.switch, 1)):
        if kernel is None:
            found.append(0)
            continue
        try:
            targets = tuple(f"out[{k}]" for k in range(results))
            found.append(address_of(kernel, _handed(kernel, declaration, parameters), targets))
        except numba.core.errors.NumbaError as error:
            cause = next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
            raise InputError(
                f"kernel '{kernel.__name__}' of component '{described.__name__}' cannot be compiled: {cause}",
                f"numbers, math and numpy functions of numbers; {results} numbers as the result",
            ) from None
    return Kernels(*found)


def _handed(kernel: Kernel, declaration: Declaration, parameters: int) -> tuple[str, ...]:
    """What a kernel is handed."""
    given = [f"q[{k}]" for k in range(len(declaration.port.coordinates))]
    given += [f"v[{k}]" for k in range(len(declaration.port.rates))]
    given += [f"z[{k}]" for k in range(len(declaration.states))]
    given += [f"x[{CONTEXT.index(name)}]" for name in declaration.context]
    names = arguments_of(kernel)
    if names[-1] == "table":
        return (*given, *(f"p[{k}]" for k in range(len(names) - len(given) - 1)), "p")
    return (*given, *(f"p[{k}]" for k in range(parameters)))


def at_rest(component: Component, start: tuple[float, ...], at: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """What the force kernel of a component gives at rest, in plain Python.

    Parameters
    ----------
    component : Component
    start : tuple of float
        Coordinates of its port as placed.
    at : tuple of float, optional
        Coordinates at which it is called; `start` if not given.

    Returns
    -------
    tuple of float
        Empty for a constraint.

    Raises
    ------
    InputError
        If it raises an error or does not give as many finite numbers as declared.
    """
    declaration = component.declaration
    if declaration.force is None:
        return ()
    plain, names = plain_kernel(declaration.force), arguments_of(declaration.force)
    rest = (0.0,) * (len(declaration.port.rates) + len(declaration.states))
    context = tuple(1.0 if name == "factor" else 0.0 for name in declaration.context)
    try:
        parameters: tuple[Any, ...] = component.parameters(start)
        given = len(start) + len(rest) + len(context)
        if names[-1] == "table":
            fixed = len(names) - given - 1
            parameters = (*parameters[:fixed], np.array(parameters))
        found = plain(*(start if at is None else at), *rest, *context, *parameters)
    except Exception as error:
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel raises {type(error).__name__} ({error}) where it starts",
            f"{len(declaration.results)} numbers: {', '.join(declaration.results)}",
        ) from None
    numbers = found if isinstance(found, tuple) else (found,)
    if len(numbers) != len(declaration.results) or not all(math.isfinite(number) for number in numbers):
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel gives {found!r} where it starts",
            f"{len(declaration.results)} finite numbers: {', '.join(declaration.results)}",
        )
    return numbers
