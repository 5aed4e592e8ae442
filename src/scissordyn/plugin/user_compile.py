"""From a user's plain Python function to machine code that the kernels can call, tried before it is believed."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher

from scissordyn.errors import InputError
from scissordyn.plugin.pointer import PARAMETERS
from scissordyn.plugin.user_file import load_function

__all__ = ["Function", "probe", "row"]

Function = Callable[..., float]


@cache
def _compiled(function: Function, leading: tuple[str, ...], count: int) -> Any:
    """The function as machine code ``float64 f(float64, ..., float64*)`` in which an exception has become NaN."""
    plain = function.py_func if isinstance(function, Dispatcher) else function
    # a call with the right number of arguments has to be spelled out for the compiler
    handed = ", ".join((*leading, *(f"p[{k}]" for k in range(count))))
    text = f"""
def law({", ".join(leading)}, p):
    try:
        return float(own({handed}))
    except Exception:
        return nan
"""
    scope: dict[str, Any] = {"own": numba.njit(error_model="numpy")(plain), "nan": math.nan}
    exec(text, scope)
    signature = types.float64(*([types.float64] * len(leading)), types.CPointer(types.float64))
    return numba.cfunc(signature, error_model="numpy")(scope["law"])


def _cause(error: Exception) -> str:
    """The line of numba's long account that says what it cannot do."""
    lines = [line.strip() for line in str(error).splitlines()]
    telling = (
        "Untyped global name",
        "Unknown attribute",
        "No implementation of function",
        "Unsupported",
        "is not defined",
        "Cannot",
    )
    found = [line for line in lines if any(words in line for words in telling)]
    text = next(iter([*found, *filter(None, lines)]), type(error).__name__)
    return text.rstrip(":").removeprefix("- ")


def _answer(function: Function, arguments: tuple[float, ...]) -> str:
    """What the function does without the compiler, in words."""
    plain = function.py_func if isinstance(function, Dispatcher) else function
    try:
        return f"gives {plain(*arguments)!r}"
    except Exception as error:
        return f"raises {type(error).__name__} ({error})"


def _loaded(kind: str, function: Function | str, digest: str) -> tuple[Function, str]:
    """The function itself, and what an error message calls it."""
    loaded = load_function(kind, function, digest) if isinstance(function, str) else function
    if not callable(loaded):
        raise InputError(f"{function!r} as a {kind}", "a function or 'file.py:function'")
    return loaded, f"{kind} '{getattr(loaded, '__name__', loaded)}'"


def row(
    kind: str, function: Function | str, digest: str, constants: tuple[float, ...], leading: tuple[str, ...]
) -> tuple[float, ...]:
    """What the kernels read: the address of the compiled function, then its constants.

    Parameters
    ----------
    kind : str
        What the function stands for, such as "friction law", for messages.
    function : callable or str
        The function, or ``"file.py:function"``.
    digest : str
        Of that file, or empty.
    constants : tuple of float
        Arguments after the leading ones.
    leading : tuple of str
        Names of the arguments that every function of this kind gets.

    Returns
    -------
    tuple of float

    Raises
    ------
    InputError
        If the function cannot be called like this or cannot be compiled.
    """
    loaded, label = _loaded(kind, function, digest)
    if len(constants) > PARAMETERS - 1 or not all(math.isfinite(value) for value in constants):
        raise InputError(f"{label}: constants = {constants!r}", f"at most {PARAMETERS - 1} finite numbers")
    try:
        inspect.signature(loaded).bind(*leading, *constants)
    except TypeError as error:
        wanted = ", ".join((*leading, *(f"constant_{k + 1}" for k in range(len(constants)))))
        raise InputError(f"{label} cannot be called: {error}", f"a function of ({wanted})") from None
    try:
        address = _compiled(loaded, leading, len(constants)).address
    except Exception as error:  # beside its own errors numba lets through whatever a constant expression raises
        # most often the function simply does not give a number; numba says that in terms of its own
        answer = _answer(loaded, (*(1e-3 for _ in leading), *constants))
        cause = (
            _cause(error)
            if "float64" in answer or answer.removeprefix("gives ").startswith(tuple("-0123456789"))
            else f"it {answer}"
        )
        raise InputError(f"{label} cannot be compiled: {cause}", "numbers, math and numpy functions of numbers") from None
    if int(float(address)) != address:
        raise InputError(f"{label} lies at address {address:#x}", "an address below 2**53, which a float64 holds exactly")
    return (float(address), *(float(value) for value in constants))


def probe(
    kind: str,
    function: Function | str,
    digest: str,
    constants: tuple[float, ...],
    leading: tuple[str, ...],
    grid: Iterable[tuple[float, ...]],
    *,
    right: Callable[[tuple[float, ...], float], bool] | None = None,
    allowed: str = "a finite number there",
) -> np.ndarray:
    """Try the compiled function at every point of a grid of leading arguments.

    Parameters
    ----------
    kind, function, digest, constants, leading
        As for `row`.
    grid : iterable of tuple of float
        The points.
    right : callable, optional
        Whether the finite answer at a point can be right.
    allowed : str
        What it may be, for the message.

    Returns
    -------
    ndarray, shape (points,)
        The answers.

    Raises
    ------
    InputError
        At the first point where it is not a finite number or not right; says what the plain function does there.
    """
    parameters = np.array(row(kind, function, digest, constants, leading))
    loaded, label = _loaded(kind, function, digest)
    compiled = _compiled(loaded, leading, len(constants)).ctypes
    pointer = parameters[1:].ctypes.data_as(compiled.argtypes[-1])
    found = []
    for point in grid:
        value = compiled(*point, pointer)
        if not math.isfinite(value) or (right is not None and not right(point, value)):
            what = _answer(loaded, (*point, *constants))
            where = ", ".join(f"{name} = {number:g}" for name, number in zip(leading, point, strict=True))
            raise InputError(f"{label} {what} at {where}", allowed)
        found.append(value)
    return np.array(found)
