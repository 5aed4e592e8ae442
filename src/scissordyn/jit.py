"""Compiled kernels and the tuples of arrays that they are handed.

Numba's on-disk cache watches only the file of the function it loads: edit a law, and a caller in another file would still
run the old one. So machine code is kept by `cache`, in a folder named by a digest of every kernel source, of this interpreter
and of numba.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model
from numba.np.numpy_support import as_dtype

from scissordyn.cache.kernel import KernelCache
from scissordyn.callee import CalleeCompiler

__all__ = ["F1", "F2", "F3", "I1", "I2", "Handle", "callback", "kernel", "opener"]

F1 = Annotated[np.ndarray, types.float64[::1]]
F2 = Annotated[np.ndarray, types.float64[:, ::1]]
F3 = Annotated[np.ndarray, types.float64[:, :, ::1]]
I1 = Annotated[np.ndarray, types.int64[::1]]
I2 = Annotated[np.ndarray, types.int64[:, ::1]]


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
        options: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}
        unwrapped: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": CalleeCompiler}
        callee: Any = numba.njit(**options, **unwrapped, forceinline=inline)(function)
        if inline:
            return callee
        compiled: Any = numba.njit(**options)(function)
        # other kernels are given the callee
        compiled.get_call_template, compiled.get_overload = callee.get_call_template, callee.get_overload
        # numba's own cache may choose a folder beside the sources, and fails on a file that is cut off
        compiled._cache = KernelCache(function)
        return compiled

    return compile_later


def callback(function: Callable[..., Any], signature: Any, *, stored: bool) -> Any:
    """Compile a function to machine code that is called by its address.

    Parameters
    ----------
    function : callable
    signature : numba signature
    stored : bool
        Whether its machine code is kept on disk. Then it must not allocate, as a `kernel`: numba introduces its functions that
        allocate and free to the linker when it first compiles, and in a process that only loads machine code they are missing.

    Returns
    -------
    CFunc
        Its attribute `address` is where it is called, as long as it lives.
    """
    arguments, result = normalize_signature(signature)
    made: Any = CFunc(function, (arguments, result), locals={}, options={"error_model": "numpy", "_nrt": not stored})
    if stored:
        made._cache = KernelCache(function)
    made.compile()
    return made


_NOTHING = np.zeros(1)
_NOWHERE = _NOTHING.ctypes.data
"""Where arrays without entries are said to be."""


class Handle:
    """A tuple of arrays, or of such tuples, in memory: kernels get its address instead of thousands of machine words.

    Parameters
    ----------
    content : NamedTuple
        Integers, floats, C-contiguous arrays and further such tuples; they stay alive as long as the handle.

    Attributes
    ----------
    address : int
        What kernels get; `opener` makes the function that turns it back into the tuple.

    Raises
    ------
    TypeError
        If an array is not of the type that its field declares.
    """

    def __init__(self, content: Any) -> None:
        self.content = content
        words: list[int] = []
        _append_words(content, words)
        self._memory = np.array(words, np.int64)
        self.address = int(self._memory.ctypes.data)

    def exchange(self, part: str, **arrays: Any) -> None:
        """Put other arrays, of the same type, in the place of some of a part; the address stays."""
        content = self.content._replace(**{part: getattr(self.content, part)._replace(**arrays)})
        words: list[int] = []
        _append_words(content, words)
        self.content, self._memory[:] = content, words


@cache
def _declared(described: type) -> tuple[tuple[str, Any, int], ...]:
    """Name, element type and dimensions of each array of a tuple; the type alone of numbers and inner tuples, with -1."""
    found: list[tuple[str, Any, int]] = []
    for name, hint in get_type_hints(described, include_extras=True).items():
        kind = get_args(hint)[1] if get_origin(hint) is Annotated else None
        found.append((name, hint, -1) if kind is None else (name, as_dtype(kind.dtype), kind.ndim))
    return tuple(found)


def _append_words(content: Any, words: list[int]) -> None:
    """The tuple as numba lays it out in memory; an array as owner, parent, items, item size, data, shape and strides.

    Kernels read memory by the declaration alone: another type would be read as garbage and written beyond.
    """
    for (name, kind, dimensions), part in zip(_declared(content.__class__), content, strict=True):
        if dimensions >= 0:
            if not (isinstance(part, np.ndarray) and part.dtype == kind and part.ndim == dimensions and part.flags.carray):
                raise TypeError(
                    f"{type(content).__name__}.{name}: {_what(part)} in place of a contiguous, writable {kind} array, "
                    f"dimension {dimensions}"
                )
            # the address by the buffer, which takes a quarter of the time of part.ctypes.data
            address = ctypes.addressof(ctypes.c_char.from_buffer(part)) if part.size else _NOWHERE  # type: ignore[arg-type]
            words += (0, 0, part.size, part.itemsize, address, *part.shape, *part.strides)
        elif not isinstance(part, kind):
            raise TypeError(f"{type(content).__name__}.{name}: {_what(part)} in place of {kind.__name__}")
        elif isinstance(part, tuple):
            _append_words(part, words)
        else:
            words.append(part if isinstance(part, int) else int(np.float64(part).view(np.int64)))


def _what(part: Any) -> str:
    if isinstance(part, np.ndarray):
        return f"{'' if part.flags.carray else 'not contiguous or read-only '}{part.dtype} array, dimension {part.ndim}"
    return type(part).__name__


class _Opened(types.Type):
    """An address in kernels: the fields of the tuple there are loaded when they are named."""

    def __init__(self, described: type) -> None:
        self.described = described
        super().__init__(f"Opened[{described.__module__}.{described.__qualname__}]")


@register_model(_Opened)
class _OpenedModel(models.PrimitiveModel):
    def __init__(self, manager: Any, opened: _Opened) -> None:
        super().__init__(manager, opened, ir.IntType(64))


@cache
def _members(described: type) -> dict[str, tuple[Any, int]]:
    """Numba type and place, in words, of each field of a tuple as `Handle` lays it out."""
    found: dict[str, tuple[Any, int]] = {}
    place = 0
    for name, hint in get_type_hints(described, include_extras=True).items():
        if hint in (int, float):
            found[name] = (types.int64 if hint is int else types.float64, place)
            place += 1
        elif get_origin(hint) is Annotated:
            array = get_args(hint)[1]
            found[name] = (array, place)
            place += 5 + 2 * array.ndim
        else:
            found[name] = (_Opened(hint), place)
            place += _words(hint)
    return found


def _words(described: type) -> int:
    """How many words a tuple takes."""
    member, place = list(_members(described).values())[-1]
    if isinstance(member, _Opened):
        return place + _words(member.described)
    return place + (5 + 2 * member.ndim if isinstance(member, types.Array) else 1)


@infer_getattr
class _OpenedAttributes(AttributeTemplate):
    key = _Opened

    def generic_resolve(self, opened: _Opened, name: str) -> Any:  # type: ignore[override]
        member = _members(opened.described).get(name)
        return None if member is None else member[0]


@lower_getattr_generic(_Opened)
def _load_member(context, builder, opened, address, name):
    """The field at its place; what the words say never changes while a kernel runs, so that it can be kept in registers."""
    member, place = _members(opened.described)[name]
    there = builder.add(address, ir.Constant(ir.IntType(64), 8 * place))
    if isinstance(member, _Opened):
        return there
    value = context.get_value_type(member)
    if not isinstance(member, types.Array):
        return _invariant(builder, builder.inttoptr(there, value.as_pointer()))
    # word by word: an aggregate that is loaded as a whole is slow to compile
    parts = ir.Constant(value, ir.Undefined)
    return _load_aggregate(builder, there, value, parts)[0]


def _invariant(builder, pointer):
    loaded = builder.load(pointer)
    loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded


def _load_aggregate(builder, there, kind, parts):
    """An aggregate of words from memory; returns it and where it ends."""
    elements = kind.elements if isinstance(kind, ir.LiteralStructType) else [kind.element] * kind.count
    for index, element in enumerate(elements):
        if isinstance(element, ir.LiteralStructType | ir.ArrayType):
            inner, there = _load_aggregate(builder, there, element, ir.Constant(element, ir.Undefined))
        else:
            inner = _invariant(builder, builder.inttoptr(there, element.as_pointer()))
            there = builder.add(there, ir.Constant(ir.IntType(64), 8))
        parts = builder.insert_value(parts, inner, index)
    return parts, there


def opener(described: type) -> Any:
    """A function that kernels open the `Handle` of a tuple with.

    What it returns is one word, however large the tuple; its fields are read where kernels name them.

    Parameters
    ----------
    described : NamedTuple class
        Each field annotated `int`, `float`, ``Annotated[ndarray, numba array type]``, or another such class.

    Returns
    -------
    intrinsic
        From an address to the tuple.
    """
    opened = _Opened(described)

    @intrinsic
    def load(typing_context, address):
        def generate(context, builder, signature, arguments):
            return arguments[0]

        return opened(types.int64), generate

    return load
