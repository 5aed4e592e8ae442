"""A call through an address that travels in a row of numbers.

A compiled function of the user lives at an address of this process. Handing the function itself to the kernels would compile
them again for every new law and never keep them on disk; an address is one more number, and the kernels stay as they are.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["PARAMETERS", "USER", "call_at"]

PARAMETERS = 16
"""Width of one row of numbers, a law's or a controller's, in the parameter tables that kernels read."""

USER = 99
"""The kernel kind of a user's own function, in every dispatch."""


@intrinsic
def call_at(typing_context, numbers, row):
    """Call ``float64 f(float64, ..., float64*)`` at the address that ``row[0]`` holds.

    Parameters
    ----------
    numbers : tuple of float
        The leading arguments.
    row : ndarray
        Address, then the law's parameters; the function gets a pointer to the parameters.

    Notes
    -----
    User space ends below 2**53 on every platform that numba knows, so a float64 holds an address exactly.
    """
    if not (isinstance(numbers, types.UniTuple) and numbers.dtype == types.float64):
        return None

    def generate(context, builder, signature, arguments):
        double, data = ir.DoubleType(), ir.DoubleType().as_pointer()
        array = context.make_array(row)(context, builder, arguments[1])
        first = builder.bitcast(array.data, data)
        address = builder.fptoui(builder.load(first), context.get_value_type(types.uintp))
        kind = ir.FunctionType(double, [double] * numbers.count + [data])
        function = builder.inttoptr(address, kind.as_pointer())
        parameters = builder.gep(first, [ir.Constant(ir.IntType(32), 1)])
        return builder.call(function, [*cgutils.unpack_tuple(builder, arguments[0]), parameters])

    return types.float64(numbers, row), generate
