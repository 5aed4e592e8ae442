"""From the kernels of a component to machine code with one signature, called by its address.

Whatever its port, a kernel is reached through ``void f(double *q, double *v, double *z, double *x, double *p, double *out)``:
coordinates, rates, states, context, parameters, and results. The code of the package's own components is kept on disk like
every kernel; that of a user's file is compiled once in a process.
"""

from __future__ import annotations

import inspect
import math
import re
from functools import cache
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

from scissordyn.component.declaration import CONTEXT, Component, Declaration, Kernel
from scissordyn.errors import InputError
from scissordyn.jit import callback

__all__ = ["Kernels", "call_kernel", "kernels_of", "probe"]

POINTER = types.CPointer(types.float64)
SIGNATURE = types.void(*([POINTER] * 6))


class Kernels:
    """Addresses of the compiled kernels of a component class; 0 for one that it does not have.

    Parameters
    ----------
    force, gap, switch : int
    """

    def __init__(self, force: int, gap: int, switch: int) -> None:
        self.force, self.gap, self.switch = force, gap, switch


def _called(kernel: Kernel, declaration: Declaration, parameters: int, results: int) -> str:
    """Source of the function of one signature around a kernel."""
    arguments = [f"q[{k}]" for k in range(len(declaration.port.coordinates))]
    arguments += [f"v[{k}]" for k in range(len(declaration.port.rates))]
    arguments += [f"z[{k}]" for k in range(len(declaration.states))]
    arguments += [f"x[{CONTEXT.index(name)}]" for name in declaration.context]
    names = list(inspect.signature(getattr(kernel, "py_func", kernel)).parameters)
    if names[-1] == "table":
        arguments += [f"p[{k}]" for k in range(len(names) - len(arguments) - 1)] + ["p"]
    else:
        arguments += [f"p[{k}]" for k in range(parameters)]
    answer = ", ".join(f"out[{k}]" for k in range(results))
    body = f"{answer} = own({', '.join(arguments)})"
    return f"def {_name(kernel)}(q, v, z, x, p, out):\n    {body}\n"


def _name(kernel: Kernel) -> str:
    """Name of the function of one signature around a kernel; a lambda has none of its own."""
    return "kernel_" + re.sub(r"\W", "_", kernel.__name__)


def _compiled(kernel: Kernel, declaration: Declaration, parameters: int, results: int) -> Any:
    plain = kernel.py_func if isinstance(kernel, Dispatcher) else kernel
    file = inspect.getfile(plain)
    ours = plain.__module__.startswith("scissordyn.")
    scope: dict[str, Any] = {
        "own": kernel if isinstance(kernel, Dispatcher) else numba.njit(error_model="numpy")(plain),
        "__name__": plain.__module__,
        "__file__": file,
    }
    exec(compile(_called(kernel, declaration, parameters, results), file, "exec"), scope)
    return callback(scope[_name(kernel)], SIGNATURE, stored=ours)


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
    addresses = []
    for kernel, results in ((declaration.force, len(declaration.results)), (declaration.gap, 2), (declaration.switch, 1)):
        if kernel is None:
            addresses.append(0)
            continue
        try:
            made = _compiled(kernel, declaration, parameters, results)
        except numba.core.errors.NumbaError as error:
            cause = next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
            raise InputError(
                f"kernel '{kernel.__name__}' of component '{described.__name__}' cannot be compiled: {cause}",
                f"numbers, math and numpy functions of numbers; {results} numbers as the result",
            ) from None
        _KEPT.append(made)
        addresses.append(int(made.address))
    return Kernels(*addresses)


_KEPT: list[Any] = []
"""Compiled functions live as long as the process: their addresses travel as numbers."""


@intrinsic
def call_kernel(typing_context, address, q, v, z, x, p, out):
    """Call the kernel at an address with six arrays."""

    def generate(context, builder, signature, arguments):
        data = ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [data] * 6)
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        handed = [
            builder.bitcast(context.make_array(array)(context, builder, value).data, data)
            for array, value in zip(signature.args[1:], arguments[1:], strict=True)
        ]
        builder.call(function, handed)
        return context.get_dummy_value()

    return types.void(address, q, v, z, x, p, out), generate


def probe(component: Component, start: tuple[float, ...]) -> None:
    """Raise `InputError` for a component whose force kernel gives no finite numbers where it is placed, at rest.

    Parameters
    ----------
    component : Component
    start : tuple of float
        Coordinates of its port.
    """
    declaration = component.declaration
    if declaration.force is None:
        return
    plain = getattr(declaration.force, "py_func", declaration.force)
    rest = (0.0,) * (len(declaration.port.rates) + len(declaration.states))
    context = tuple(1.0 if name == "factor" else 0.0 for name in declaration.context)
    try:
        parameters: tuple[Any, ...] = component.parameters(start)
        given = len(start) + len(rest) + len(context)
        if list(inspect.signature(plain).parameters)[-1] == "table":
            fixed = len(inspect.signature(plain).parameters) - given - 1
            parameters = (*parameters[:fixed], np.array(parameters))
        found = plain(*start, *rest, *context, *parameters)
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
