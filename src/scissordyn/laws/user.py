"""A user's own law: a plain Python function, compiled by numba and called by address."""

from __future__ import annotations

import inspect
import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Literal

import numba
import numpy as np
from numba import types
from numba.core.errors import NumbaError

from scissordyn.errors import InputError
from scissordyn.laws.contact import PARAMETERS, JointContact
from scissordyn.laws.pointer import USER
from scissordyn.laws.user_file import load_function

__all__ = ["UserDamping", "UserElastic", "UserFriction"]

Function = Callable[..., float]

INDENTATIONS = tuple(np.logspace(-9, -3, 13))
RATES = (-10.0, -0.5, -1e-4, 0.0, 1e-4, 0.5, 10.0)
APPROACHES = (1e-6, 1e-2, 1.0, 10.0)
FORCES = (0.0, 1.0, 1e3, 1e6)
SPEEDS = (*(-np.logspace(1, -9, 11)), 0.0, *np.logspace(-9, 1, 11))
"""Where a law is tried before it is believed: nm to mm, rest to 10 m/s, nothing to 1 MN."""


@cache
def _compiled(function: Function, leading: tuple[str, ...], count: int) -> Any:
    """The function as machine code ``float64 f(float64, ..., float64*)`` in which an exception has become NaN."""
    if isinstance(function, numba.core.dispatcher.Dispatcher):
        function = function.py_func
    # one call with the right number of arguments has to be spelled out for the compiler
    numbers = ", ".join(leading)
    handed = ", ".join((*leading, *(f"p[{k}]" for k in range(count))))
    text = f"def law({numbers}, p):\n    try:\n        return float(own({handed}))\n    except Exception:\n        return nan\n"
    scope: dict[str, Any] = {"own": numba.njit(error_model="numpy")(function), "nan": math.nan}
    exec(text, scope)
    signature = types.float64(*([types.float64] * len(leading)), types.CPointer(types.float64))
    return numba.cfunc(signature, error_model="numpy")(scope["law"])


def _called(function: Function, arguments: tuple[float, ...]) -> str:
    """What the plain function does at these arguments, in words."""
    try:
        return f"gives {function(*arguments)!r}"
    except Exception as error:
        return f"raises {type(error).__name__}: {error}"


def _row(
    kind: str, function: Function | str, digest: str, parameters: tuple[float, ...], leading: tuple[str, ...]
) -> tuple[float, ...]:
    """Address and parameters of a law that has been found fit to run."""
    if isinstance(function, str):
        function = load_function(function, digest)
    if not callable(function):
        raise InputError(f"{function!r} as a {kind} law", "a function or 'file.py:function'")
    label = f"{kind} law '{getattr(function, '__name__', function)}'"
    wanted = ", ".join((*leading, *(f"parameter {k + 1}" for k in range(len(parameters)))))
    if len(parameters) > PARAMETERS - 1 or not all(math.isfinite(value) for value in parameters):
        raise InputError(f"{label}: parameters = {parameters!r}", f"at most {PARAMETERS - 1} finite numbers")
    try:
        inspect.signature(function).bind(*leading, *parameters)
    except TypeError as error:
        raise InputError(f"{label} cannot be called ({error})", f"a function of ({wanted})") from None
    try:
        compiled = _compiled(function, leading, len(parameters))
    except NumbaError as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        cause = next((line for line in reversed(lines) if not line.startswith(("File", "During", "^", "<", "-"))), "unknown cause")
        # the cause proper comes after numba's account of the way it took
        named = [line for line in lines if "NameError" in line or "not defined" in line or "Untyped global" in line or "Unknown attribute" in line]
        raise InputError(f"{label} cannot be compiled: {(named or [cause])[-1]}", "floats, math and numpy functions of numbers") from None
    address = float(compiled.address)
    if int(address) != compiled.address:
        raise InputError(f"{label} lies at address {compiled.address:#x}", "an address below 2**53")
    return (address, *(float(value) for value in parameters))


def _probe(kind: str, function: Function | str, digest: str, parameters: tuple[float, ...], leading: tuple[str, ...], grid: Iterable[tuple[float, ...]]) -> None:
    """Raise `InputError` at the first point of a grid where the compiled law is not a finite number."""
    row = np.array(_row(kind, function, digest, parameters, leading))
    plain = load_function(function, digest) if isinstance(function, str) else function
    compiled = _compiled(plain, leading, len(parameters)).ctypes
    pointer = row[1:].ctypes.data_as(compiled.argtypes[-1])
    for point in grid:
        if not math.isfinite(compiled(*point, pointer)):
            where = ", ".join(f"{name} = {value:g}" for name, value in zip(leading, point, strict=True))
            what = _called(plain, (*map(float, point), *parameters))
            raise InputError(f"{kind} law '{plain.__name__}' {what} at {where}", "a finite number there")


@dataclass(frozen=True)
class UserElastic:
    """An elastic part of the user's own.

    Parameters
    ----------
    function : callable or str
        ``f(indentation, *parameters)`` [m] to the force [N], or ``"file.py:f"``.
    parameters : tuple of float
        Further arguments.
    digest : str
        Of the file that holds the function, so that a saved run does not silently run an edited law; empty for any.

    Raises
    ------
    InputError
        If the function cannot be compiled, raises or gives no finite number between 1 nm and 1 mm.
    """

    function: Function | str
    parameters_: tuple[float, ...] = ()
    digest: str = ""
