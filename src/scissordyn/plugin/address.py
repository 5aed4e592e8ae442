"""Kernels of elements as machine code with one signature, called by their address.

Whatever its slot, a kernel is reached through ``double f(double *q, double *v, double *z, double *x, double *p, double *out)``:
inputs, their rates, states, context, parameters and further results. Handing the functions themselves to the kernels of
mechanics would compile these again for every new element and never keep them on disk; an address is one more number. The code
of the package's own elements is kept on disk like every kernel; that of a user is compiled once in a process.
"""

from __future__ import annotations

import hashlib
import inspect
import re
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

from scissordyn.jit import callback
from scissordyn.jit import kernel as compile_inside

__all__ = ["ANSWER", "Kernel", "Recipe", "address_of", "arguments_of", "call_at", "plain_kernel", "recipe_of"]

Kernel = Callable[..., Any]

POINTER = types.CPointer(types.float64)
SIGNATURE = types.float64(*([POINTER] * 6))

ANSWER = "answer"
"""Among the places of a kernel's results: the number that the call itself returns."""

GUARDED = """def {name}(q, v, z, x, p, out):
    try:
        return float(own({handed}))
    except Exception:
        return nan
"""
"""Around a function of the user's, whose exceptions become NaN."""

PLAIN = """def {name}(q, v, z, x, p, out):
    {targets} = own({handed})
    return {answer}
"""


def plain_kernel(kernel: Kernel) -> Kernel:
    """The Python function behind a kernel."""
    return kernel.py_func if isinstance(kernel, Dispatcher) else kernel


def arguments_of(kernel: Kernel) -> tuple[str, ...]:
    """Names of a kernel's arguments."""
    return tuple(inspect.signature(plain_kernel(kernel)).parameters)


PLAINLY = bool(getattr(numba.core.config, "DISABLE_JIT", False))
"""Whether everything runs as plain Python, in which the compiler is left out to find a fault."""

_KEPT: dict[int, Any] = {}
"""Compiled functions by address: they live as long as the process, since their addresses travel as numbers."""


class Recipe(NamedTuple):
    """What the machine code at an address was made of: a function, what it is handed, and where its results go."""

    function: Kernel
    handed: tuple[str, ...]
    targets: tuple[str, ...]
    guarded: bool


_RECIPES: dict[int, Recipe] = {}


def recipe_of(address: int) -> Recipe:
    """What the machine code at an address was made of, for another compiler."""
    return _RECIPES[address]


@cache
def address_of(kernel: Kernel, handed: tuple[str, ...], targets: tuple[str, ...], *, guarded: bool = False) -> int:
    """Where the machine code of a kernel lies.

    Parameters
    ----------
    kernel : callable
    handed : tuple of str
        What it is handed, such as ``"q[0]"`` or ``"p[3]"``.
    targets : tuple of str
        Where its results go, such as ``"out[0]"``; `ANSWER` is what the call returns.
    guarded : bool
        Whether an exception is to become NaN; then it gives one number.

    Returns
    -------
    int
    """
    plain = plain_kernel(kernel)
    text = (GUARDED if guarded else PLAIN).format(
        name="{name}",
        handed=", ".join(handed),
        targets=", ".join(targets),
        answer=ANSWER if ANSWER in targets else "0.0",
    )
    # by its name the code of a kernel on disk is told from that of another one in the same file, or with other parameters
    digest = hashlib.sha256(f"{plain.__code__.co_firstlineno} {text}".encode()).hexdigest()[:8]
    name = "kernel_" + re.sub(r"\W", "_", plain.__name__) + f"_{digest}"
    ours = plain.__module__.startswith("scissordyn.")
    scope: dict[str, Any] = {
        "own": kernel,
        "nan": float("nan"),
        "__name__": plain.__module__,
        "__file__": inspect.getfile(plain),
    }
    if not (isinstance(kernel, Dispatcher) or PLAINLY):
        scope["own"] = compile_inside(inline=True)(plain) if ours else numba.njit(error_model="numpy")(plain)
    exec(compile(text.format(name=name), scope["__file__"], "exec"), scope)
    if PLAINLY:
        address = len(_KEPT) + 1
        _KEPT[address] = scope[name]
        _RECIPES[address] = Recipe(plain, handed, targets, guarded)
        return address
    made = callback(scope[name], SIGNATURE, stored=ours)
    _KEPT[int(made.address)] = made
    _RECIPES[int(made.address)] = Recipe(plain, handed, targets, guarded)
    return int(made.address)


def _pointer(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Where numbers lie: those of an array, or of a tuple on the stack; nowhere for an empty tuple."""
    double = ir.DoubleType()
    if isinstance(kind, types.Array):
        return builder.bitcast(context.make_array(kind)(context, builder, value).data, double.as_pointer())
    if not kind.count:
        return ir.Constant(double.as_pointer(), None)
    place = cgutils.alloca_once(builder, double, size=kind.count)
    for k, number in enumerate(cgutils.unpack_tuple(builder, value)):
        builder.store(number, builder.gep(place, [ir.Constant(ir.IntType(32), k)]))
    return place


def _call_plainly(address, q, v, z, x, p, out):
    """Call the function that stands for the kernel at an address."""
    return _KEPT[int(address)](q, v, z, x, p, out)


@intrinsic
def _call(typing_context, address, q, v, z, x, p, out):
    kinds = (q, v, z, x, p, out)
    if any(isinstance(kind, types.Array) and (kind.layout != "C" or kind.dtype != types.float64) for kind in kinds):
        raise numba.TypingError("a kernel is handed floats that lie one after the other: np.ascontiguousarray(z, float)")

    def generate(context, builder, signature, arguments):
        double = ir.DoubleType()
        function = builder.inttoptr(arguments[0], ir.FunctionType(double, [double.as_pointer()] * 6).as_pointer())
        numbers = [_pointer(context, builder, kind, value) for kind, value in zip(kinds, arguments[1:], strict=True)]
        return builder.call(function, numbers)

    return types.float64(address, *kinds), generate


call_at: Any = _call_plainly if PLAINLY else _call
"""Calls the kernel at an address: ``call_at(address, q, v, z, x, p, out)``, each an array or a tuple of floats."""
