"""Kernels: plain Python functions of numbers and arrays, which `compiler` translates to C when the package is built.

A kernel calls other kernels. What Python calls is an `entry`, a kernel whose arguments are annotated: it runs in the library of
the package, or, with SCISSORDYN_ENGINE=python, as the Python function that it is, and the bounds of every index are checked.
The library is loaded once; it is built anew in a checkout whose kernels have changed.
"""

from __future__ import annotations

import ctypes
import hashlib
import inspect
import math
import os
import subprocess
import sys
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np

from scissordyn.errors import ScissordynError

PACKAGE = Path(__file__).parent


def library_name(machine: str = "") -> str:
    """Name of its file on another machine, or on this one."""
    return "_kernels.dll" if "windows" in machine or (not machine and sys.platform == "win32") else "_kernels.so"


LIBRARY = PACKAGE / library_name()


class EngineError(ScissordynError):
    """There is no library of compiled kernels that fits."""


def digest_of(files: list[str]) -> str:
    """Of sources by their names below the package; of a file that is gone, of nothing."""
    total = hashlib.sha256()
    for name in files:
        path = PACKAGE / name
        total.update(f"{name}\n".encode() + (path.read_bytes() if path.is_file() else b""))
    return total.hexdigest()


@cache
def library() -> ctypes.CDLL:
    if not LIBRARY.is_file():
        build_library("no library of compiled kernels")
    loaded = _load()
    if not _is_current(loaded):
        _unload(loaded)  # under the same name the system hands out the library that it has
        build_library("kernels have changed since their library was built")
        loaded = _load()
    return loaded


def _load() -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(LIBRARY))
    except OSError as error:
        raise EngineError(
            f"'{LIBRARY}' is no library for this machine ({error}); allowed: one that was built here; type: "
            f"{Path(sys.executable).name} -m scissordyn.build"
        ) from None


def _unload(loaded: ctypes.CDLL) -> None:
    import _ctypes

    getattr(_ctypes, "FreeLibrary" if sys.platform == "win32" else "dlclose")(loaded._handle)


def _is_current(loaded: ctypes.CDLL) -> bool:
    """Whether the sources are those that the library was made of; they are read only if one is newer than the library."""
    files = _text(loaded, "SOURCES").split()
    built = LIBRARY.stat().st_mtime
    times = [path.stat().st_mtime if path.is_file() else float("inf") for path in (PACKAGE / name for name in files)]
    if max(times) <= built:
        return True
    return _text(loaded, "DIGEST") == digest_of(files)


def _text(loaded: ctypes.CDLL, name: str) -> str:
    return ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(loaded, name))).decode()


def build_library(reason: str) -> None:
    """Build the library in a process of its own, which has kernels in Python."""
    print(f"scissordyn: {reason}; building it takes some seconds", file=sys.stderr)
    done = subprocess.run([sys.executable, "-m", "scissordyn.build"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise EngineError(f"{reason}, and building it failed: {(done.stderr.strip() or 'no reason given').splitlines()[-1]}")


PYTHON = os.environ.get("SCISSORDYN_ENGINE", "") == "python"  # Whether kernels run as plain Python


@dataclass(frozen=True)
class ArrayType:
    """Element type and dimensions of a contiguous, writable array."""

    dtype: np.dtype
    dimensions: int


F1 = Annotated[np.ndarray, ArrayType(np.dtype(float), 1)]
F2 = Annotated[np.ndarray, ArrayType(np.dtype(float), 2)]
F3 = Annotated[np.ndarray, ArrayType(np.dtype(float), 3)]
I1 = Annotated[np.ndarray, ArrayType(np.dtype(np.int64), 1)]
I2 = Annotated[np.ndarray, ArrayType(np.dtype(np.int64), 2)]


def kernel(function: Callable[..., Any]) -> Any:
    """A function that is translated where another kernel calls it."""
    return function


def vanishes(x: float) -> bool:
    """Whether what x multiplies can be left out: x is zero, and so are its derivatives, if it has some."""
    return x == 0.0


ENTRIES: dict[str, Entry] = {}  # All entries by the names of their symbols in the library


def entry(function: Callable[..., Any]) -> Any:
    """A kernel that Python calls: `int`, `float`, arrays such as `F1` and named tuples of these as arguments."""
    entry_point = Entry(function)
    ENTRIES[entry_point.symbol] = entry_point
    return entry_point


class Entry:
    """A kernel that Python calls."""

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.python = function
        self.symbol = f"{function.__module__.removeprefix('scissordyn.').replace('.', '_')}_{function.__name__}"

    @cached_property
    def hints(self) -> dict[str, Any]:
        """Types of the arguments, and of what it returns."""
        hints = get_type_hints(self.python, include_extras=True)
        return {name: hints[name] for name in (*inspect.signature(self.python).parameters, "return")}

    def bound(self, compiled: ctypes.CDLL) -> Callable[..., Any]:
        """The function of that name in a library, for arguments as they are in Python."""
        called = getattr(compiled, self.symbol)
        kinds = [hint for name, hint in self.hints.items() if name != "return"]
        called.argtypes = [part for hint in kinds for part in _words(hint)]
        called.restype = {int: ctypes.c_int64, float: ctypes.c_double, bool: ctypes.c_bool}.get(self.hints["return"])

        def call(*arguments: Any) -> Any:
            words: list[Any] = []
            blocks = []
            for hint, argument in zip(kinds, arguments, strict=True):
                if hint is int:
                    words.append(int(argument))
                elif hint is float:
                    words.append(argument)
                elif get_origin(hint) is Annotated:
                    words += _array_words(argument, get_args(hint)[1], self.python.__name__)
                else:
                    blocks.append(_memory_of(argument, hint))
                    words.append(blocks[-1].ctypes.data)
            return called(*words)

        return call

    @cached_property
    def _called(self) -> Callable[..., Any]:
        if PYTHON:
            return lambda *arguments: self.python(*map(with_attributes, arguments))
        return self.bound(library())

    def __call__(self, *arguments: Any) -> Any:
        """Run it."""
        return self._called(*arguments)


def _words(hint: Any) -> list[Any]:
    """Types in C of an argument."""
    if get_origin(hint) is Annotated:
        dimensions = get_args(hint)[1].dimensions
        return [ctypes.c_void_p, *[ctypes.c_int64] * (dimensions + (dimensions == 2))]
    return [{int: ctypes.c_int64, float: ctypes.c_double}.get(hint, ctypes.c_void_p)]


_NOWHERE = np.zeros(1).ctypes.data  # Where arrays without entries begin


def _array_words(array: Any, kind: ArrayType, owner: str) -> tuple[int, ...]:
    """Where an array lies, its shape, and in two dimensions the distance of its rows: what the C type of an array holds.

    The library reads memory by the declaration alone: another type would be read as garbage and written beyond.
    """
    if not (
        isinstance(array, np.ndarray) and array.dtype == kind.dtype and array.ndim == kind.dimensions and array.flags.carray
    ):
        raise TypeError(
            f"{owner}: {_what(array)} in place of a contiguous, writable {kind.dtype} array, dimension {kind.dimensions}"
        )
    # the address by the buffer, which takes a quarter of the time of array.ctypes.data
    address = ctypes.addressof(ctypes.c_char.from_buffer(array)) if array.size else _NOWHERE  # type: ignore[arg-type]
    return (address, *array.shape, array.shape[1]) if array.ndim == 2 else (address, *array.shape)


def _what(part: Any) -> str:
    if isinstance(part, np.ndarray):
        return f"{'' if part.flags.carray else 'not contiguous or read-only '}{part.dtype} array, dimension {part.ndim}"
    return type(part).__name__


class Handle:
    """A tuple of arrays, or of such tuples, in memory as C has it: kernels get its address."""

    def __init__(self, content: Any) -> None:
        self.content = content
        self._memory = _memory_of(content, type(content))
        self.address = int(self._memory.ctypes.data)
        _HANDLES[self.address] = self

    def exchange(self, part: str, **arrays: Any) -> None:
        """Put other arrays, of the same type, in the place of some of a part; the address stays."""
        content = self.content._replace(**{part: getattr(self.content, part)._replace(**arrays)})
        self._memory[:] = _memory_of(content, type(content))
        self.content = content
        self.__dict__.pop("opened", None)

    @cached_property
    def opened(self) -> Any:
        """The content with attributes in the place of named columns, as kernels in Python read it."""
        return with_attributes(self.content)


_HANDLES: weakref.WeakValueDictionary[int, Handle] = weakref.WeakValueDictionary()


class CheckedArray(np.ndarray):
    """An array whose indices are within its bounds, as they have to be in C: neither from the end nor beyond it."""

    def _check(self, index: Any) -> None:
        for part, size in zip(index if isinstance(index, tuple) else (index,), self.shape, strict=False):
            ends = (part.start or 0, size if part.stop is None else part.stop) if isinstance(part, slice) else (part, part + 1)
            if not 0 <= ends[0] <= ends[1] <= size:
                raise IndexError(f"index {part} of an array with {size} entries")

    def __getitem__(self, index: Any) -> Any:
        """An entry or a part."""
        self._check(index)
        return super().__getitem__(index)

    def __setitem__(self, index: Any, value: Any) -> None:
        """Put an entry or a part."""
        self._check(index)
        super().__setitem__(index, value)


def with_attributes(content: Any) -> Any:
    """Arrays, also inside tuples, as kernels in Python read them: checked, or with entries that have attributes."""
    if isinstance(content, tuple) and hasattr(content, "_fields"):
        return type(content)(*map(with_attributes, content))
    if not isinstance(content, np.ndarray):
        return content
    return content.view(np.recarray if content.dtype.names else CheckedArray)


def _memory_of(content: Any, described: type) -> np.ndarray:
    words: list[int] = []
    _append_words(content, described, words)
    return np.array(words, np.int64)


@cache
def fields_of(described: type) -> tuple[tuple[str, Any], ...]:
    """Name and type of each field of a named tuple."""
    return tuple(get_type_hints(described, include_extras=True).items())


@cache
def _fields_in_memory(described: type) -> list[tuple[str, Any, ArrayType | None]]:
    """Full name, type and, of an array, its kind: asked for each time, they would take half of the time of `_append_words`."""
    return [
        (f"{described.__name__}.{name}", get_origin(hint) or hint, get_args(hint)[1] if get_origin(hint) is Annotated else None)
        for name, hint in fields_of(described)
    ]


def _append_words(content: Any, described: type, words: list[int]) -> None:
    for (name, hint, array), part in zip(_fields_in_memory(described), content, strict=True):
        if array is not None:
            words += _array_words(part, array, name)
        elif hint is tuple:
            words += part
        elif not isinstance(part, hint):
            raise TypeError(f"{name}: {_what(part)} in place of {hint.__name__}")
        elif isinstance(part, tuple):
            _append_words(part, hint, words)
        else:
            words.append(part if isinstance(part, int) else int(np.float64(part).view(np.int64)))


class Opener:
    """What kernels open the `Handle` of a named tuple with; in C an address is the tuple itself."""

    def __init__(self, described: type) -> None:
        self.described = described
        self.__name__ = f"open_{described.__name__.lower()}"

    def __call__(self, address: int) -> Any:
        """From an address to the tuple, in Python."""
        return _HANDLES[int(address)].opened


opener = Opener


CALLED: dict[int, Callable[..., float]] = {}  # Functions by the numbers that stand for kernel pointers in Python


def call_at(address: int, q: Any, v: Any, z: Any, x: Any, p: Any, out: Any) -> Any:
    """Call the kernel at a pointer: arrays, or tuples of floats; see `compiler.recipe`."""
    if int(address) in CALLED:
        return CALLED[int(address)](q, v, z, x, p, out)
    arrays = [np.asarray(numbers, float) for numbers in (q, v, z, x, p, out)]
    if not all(array.flags.c_contiguous for array in arrays):
        raise TypeError("call_at: numbers that do not lie one after the other; allowed: np.ascontiguousarray(z, float)")
    return _AT_POINTER(int(address))(*(array.ctypes.data for array in arrays))


_AT_POINTER = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 6)


if PYTHON:
    # numbers divide as in C, where an integer has an end
    np.seterr(all="ignore")
    _floor = math.floor
    math.floor = lambda x: _floor(x) if math.isfinite(x) else float(np.floor(x))  # type: ignore[assignment]
