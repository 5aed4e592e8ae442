"""Compiled kernels and the tuples of arrays that they are handed.

Numba's on-disk cache watches only the file of the function it loads: edit a law, and a caller in another file would still
run the old one. So machine code is kept by `cache`, in a folder named by a digest of every kernel source, of this interpreter
and of numba.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, get_args, get_type_hints

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic
from numba.np.numpy_support import as_dtype

from scissordyn.cache.kernel import KernelCache

__all__ = ["Handle", "kernel", "opener"]


def kernel(*, inline: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function to machine code, kept on disk by `cache`.

    The function must not allocate: reference counts are switched off, which makes a kernel several times faster, and numba
    refuses to compile an allocation then.

    Parameters
    ----------
    inline : bool
        Make it part of every caller, for small functions that are handed large tuples of arrays. Such a function cannot be
        called from Python.

    Returns
    -------
    decorator
    """

    def compile_later(function: Callable[..., Any]) -> Any:
        compiled = numba.njit(  # type: ignore[call-overload]
            error_model="numpy",
            _nrt=False,
            forceinline=inline,
            no_cpython_wrapper=inline,
            no_cfunc_wrapper=inline,
        )(function)
        # numba's own cache may choose a folder beside the sources, and fails on a file that is cut off
        compiled._cache = KernelCache(function)
        return compiled

    return compile_later


class Handle:
    """A tuple of arrays in memory, handed to kernels as one address instead of hundreds of machine words.

    Parameters
    ----------
    content : NamedTuple
        Integers and contiguous arrays; they stay alive as long as the handle.

    Attributes
    ----------
    address : int
        What kernels get; `opener` makes the function that turns it back into the tuple.
    """

    def __init__(self, content: Any) -> None:
        self.content = content
        self._members = _members(type(content))  # type: ignore[arg-type]
        for name, part in zip(self._members, content, strict=True):
            self._check(name, part)
        self._memory = np.array([word for part in content for word in _words(part)], np.int64)
        self.address = int(self._memory.ctypes.data)

    def exchange(self, **parts: Any) -> None:
        """Put other arrays, of the same type, in the place of some; the address stays."""
        for name, part in parts.items():
            self._check(name, part)
        self.content = self.content._replace(**parts)
        self._memory[:] = [word for part in self.content for word in _words(part)]

    def _check(self, name: str, part: Any) -> None:
        """Kernels read memory by the declaration alone, so that another type would be read as garbage and written beyond."""
        member = self._members[name]
        if member is None:
            if isinstance(part, int):
                return
        elif isinstance(part, np.ndarray) and part.dtype == member[0] and part.ndim == member[1] and part.flags.carray:
            return
        given, wanted = type(part).__name__, "an int"
        if isinstance(part, np.ndarray):
            given = f"{'' if part.flags.carray else 'not contiguous or read-only '}{part.dtype} array, dimension {part.ndim}"
        if member is not None:
            wanted = f"a contiguous, writable {member[0]} array, dimension {member[1]}"
        raise TypeError(f"{type(self.content).__name__}.{name}: {given}, not {wanted}")


@cache
def _members(described: type) -> dict[str, tuple[np.dtype[Any], int] | None]:
    """Type and dimension of each array that a tuple declares; None for an integer."""
    return {
        name: None if hint is int else (as_dtype(get_args(hint)[1].dtype), get_args(hint)[1].ndim)
        for name, hint in get_type_hints(described, include_extras=True).items()
    }


def _words(part: Any) -> tuple[int, ...]:
    """An integer or an array as numba lays it out in memory: owner, parent, items, item size, data, shape, strides."""
    if isinstance(part, np.ndarray):
        return 0, 0, part.size, part.itemsize, part.ctypes.data, *part.shape, *part.strides
    return (part,)


def opener(described: type) -> Any:
    """A function that kernels open the `Handle` of a tuple with.

    Parameters
    ----------
    described : NamedTuple class
        Each field annotated `int`, or ``Annotated[ndarray, numba array type]``.

    Returns
    -------
    intrinsic
        From an address to the tuple.
    """
    hints = get_type_hints(described, include_extras=True)
    members = [types.int64 if hint is int else get_args(hint)[1] for hint in hints.values()]
    layout = types.NamedTuple(members, described)

    @intrinsic
    def load(typing_context, address):
        def generate(context, builder, signature, arguments):
            pointer = builder.inttoptr(arguments[0], context.get_value_type(layout).as_pointer())
            return builder.load(pointer)

        return layout(types.int64), generate

    return load
