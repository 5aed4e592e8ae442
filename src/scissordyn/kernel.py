"""Kernels: plain Python functions of numbers and arrays, which `compiler` translates to C when the package is built.

A kernel calls other kernels. Python calls an `entry`, a kernel with annotated arguments. An entry runs in the package's
library. With SCISSORDYN_ENGINE=python it runs as a Python function, and every index is checked. The library is loaded once; in
a checkout it is built again if kernels have changed.
"""

from __future__ import annotations

import ctypes
import hashlib
import inspect
import math
import os
import sys
import threading
import weakref
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

from scissordyn.errors import ScissordynError

PACKAGE = Path(__file__).parent  # Folder of this package


def library_name(machine: str = "") -> str:
    """Return the file name of the library for a machine, by default for this one."""
    return "_kernels.dll" if "windows" in machine or (not machine and sys.platform == "win32") else "_kernels.so"


LIBRARY = PACKAGE / library_name()  # path of the package's library


class EngineError(ScissordynError):
    """Error: no library of compiled kernels fits."""


def digest_of(files: list[str]) -> str:
    """Return the digest of sources, given by their names below the package; a missing file counts as empty."""
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
        _unload(loaded)  # otherwise the system returns the same loaded library
        build_library("kernels have changed since their library was built")
        loaded = _load()
    return loaded


def _load() -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(LIBRARY))
    except OSError as error:
        raise EngineError(
            f"'{LIBRARY}' is not a library for this machine ({error}); expected a library built on this machine; for example "
            f"{Path(sys.executable).name} -m scissordyn.build"
        ) from None


def _unload(loaded: ctypes.CDLL) -> None:
    import _ctypes

    getattr(_ctypes, "FreeLibrary" if sys.platform == "win32" else "dlclose")(loaded._handle)


def _is_current(loaded: ctypes.CDLL) -> bool:
    """Return True if the library was built from the current sources; sources are read only if one is newer."""
    files = _text(loaded, "SOURCES").split()
    built = LIBRARY.stat().st_mtime
    times = [path.stat().st_mtime if path.is_file() else float("inf") for path in (PACKAGE / name for name in files)]
    if max(times) <= built:
        return True
    return _text(loaded, "DIGEST") == digest_of(files)


def _text(loaded: ctypes.CDLL, name: str) -> str:
    return ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(loaded, name))).decode()


def build_library(reason: str) -> None:
    """Build the library in a separate process, which runs kernels as Python functions."""
    print(f"scissordyn: {reason}; building it takes some seconds", file=sys.stderr)
    import subprocess

    done = subprocess.run([sys.executable, "-m", "scissordyn.build"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise EngineError(f"{reason}, and building it failed: {(done.stderr.strip() or 'no reason given').splitlines()[-1]}")


PYTHON = os.environ.get("SCISSORDYN_ENGINE", "") == "python"  # True if kernels run as plain Python


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
    """Mark a function as a kernel; it is translated to C if another kernel calls it."""
    return function


def vectorized(function: Callable[..., Any]) -> Any:
    """Mark a kernel with short loops, which are also compiled for processors with wider vectors; the bits are the same.

    The compiler does not inline such a kernel: it must do more than a call costs.
    """
    function.prefix = "VECTORIZED "  # type: ignore[attr-defined]
    return function


def vectorized_loops(function: Callable[..., Any]) -> Any:
    """Mark a kernel with long loops over many instants, which the compiler itself vectorizes; otherwise as `vectorized`."""
    function.prefix = "VECTORIZED_LOOPS "  # type: ignore[attr-defined]
    return function


def equals(x: float, value: float) -> bool:
    """Return True if x has a value and its derivatives are zero.

    A formula for this value alone is right then: no product with a factor 0, or a square instead of a power.
    """
    return x == value


def value_of(x: float) -> float:
    """Return the value of a dual number without its derivatives; a plain number is returned unchanged."""
    return x


def derivative(x: float, k: int) -> float:
    """Return derivative k of a dual number; 0 for a plain number."""
    return 0.0


ENTRIES: dict[str, Entry] = {}  # all entries by their symbols in the library


def entry(function: Callable[..., Any]) -> Any:
    """Mark a kernel that Python calls; arguments are `int`, `float`, arrays such as `F1` and named tuples of these."""
    entry_point = Entry(function)
    ENTRIES[entry_point.symbol] = entry_point
    return entry_point


class Entry:
    """Kernel that Python can call as a function of the library."""

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.python = function
        self.symbol = f"{function.__module__.removeprefix('scissordyn.').replace('.', '_')}_{function.__name__}"

    @cached_property
    def hints(self) -> dict[str, Any]:
        """Types of the arguments and of the result, by name."""
        hints = get_type_hints(self.python, include_extras=True)
        return {name: hints[name] for name in (*inspect.signature(self.python).parameters, "return")}

    def bound(self, compiled: ctypes.CDLL) -> Callable[..., Any]:
        """Return a Python function that calls the entry in a library."""
        called = getattr(compiled, self.symbol)
        kinds = [hint for name, hint in self.hints.items() if name != "return"]
        fields = [_field(self.python.__name__, "argument", hint) for hint in kinds]
        called.argtypes = [part for hint in kinds for part in _words(hint)]
        called.restype = {int: ctypes.c_int64, float: ctypes.c_double, bool: ctypes.c_bool}.get(self.hints["return"])

        def call(*arguments: Any) -> Any:
            words: list[Any] = []
            blocks = []
            for field, argument in zip(fields, arguments, strict=True):
                if field.array is not None:
                    words += _array_words(argument, field.array, self.python.__name__)
                elif field.nested:
                    blocks.append(_memory_of(argument, field.hint))
                    words.append(blocks[-1].ctypes.data)
                else:
                    words.append(int(argument) if field.hint is int else argument)
            return called(*words)

        return call

    @cached_property
    def _called(self) -> Callable[..., Any]:
        if PYTHON:
            return lambda *arguments: self.python(*map(with_attributes, arguments))
        return self.bound(library())

    def __call__(self, *arguments: Any) -> Any:
        """Run the kernel."""
        return self._called(*arguments)


def _words(hint: Any) -> list[Any]:
    """Return the C types of an argument."""
    if get_origin(hint) is Annotated:
        dimensions = get_args(hint)[1].dimensions
        return [ctypes.c_void_p, *[ctypes.c_int64] * (dimensions + (dimensions == 2))]
    return [{int: ctypes.c_int64, float: ctypes.c_double}.get(hint, ctypes.c_void_p)]


_EMPTY_ADDRESS = np.zeros(1).ctypes.data  # address that kernels get for arrays without entries


def address_of(array: np.ndarray) -> int:
    """Return the address of a contiguous, writable array, in a quarter of the time of `array.ctypes.data`."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array)) if array.size else _EMPTY_ADDRESS  # type: ignore[arg-type]


def _array_words(array: Any, kind: ArrayType, owner: str) -> tuple[int, ...]:
    """Return the fields of the C type of an array: address, shape, and for two dimensions the distance of rows.

    An array of another type raises `TypeError`, because the library would read and write wrong memory.
    """
    if not (
        isinstance(array, np.ndarray) and array.dtype == kind.dtype and array.ndim == kind.dimensions and array.flags.carray
    ):
        raise TypeError(
            f"{owner}: {_describe_value(array)} instead of a contiguous, writable "
            f"{kind.dtype} array of dimension {kind.dimensions}"
        )
    address = address_of(array)
    return (address, *array.shape, array.shape[1]) if array.ndim == 2 else (address, *array.shape)


def _describe_value(part: Any) -> str:
    if isinstance(part, np.ndarray):
        return f"{'' if part.flags.carray else 'not contiguous or read-only '}{part.dtype} array, dimension {part.ndim}"
    return type(part).__name__


class Handle:
    """Named tuple of arrays, or of named tuples, laid out in memory as in C; kernels receive its address."""

    def __init__(self, content: Any, words: np.ndarray | None = None) -> None:
        """Write the addresses of all arrays, unless they are given as `words`."""
        self.content = content
        self.lock = threading.RLock()  # held by one thread at a time where several may evaluate the same system
        self._memory = _memory_of(content, type(content)) if words is None else words
        self.address = int(self._memory.ctypes.data)
        _HANDLES[self.address] = self

    def replace(self, **parts: Any) -> None:
        """Replace fields by others of the same type; the address of the tuple does not change."""
        described: Any = type(self.content)
        self.content = self.content._replace(**parts)
        first = 0
        for name, field in zip(described._fields, _fields_in_memory(described), strict=True):
            if name in parts:
                words: list[int] = []
                _append_field(field, parts[name], words)
                self._memory[first : first + field.words] = words
            first += field.words
        self.__dict__.pop("opened", None)

    def exchange(self, part: str, **arrays: Any) -> None:
        """Replace arrays of a part by arrays of the same type; the address of the tuple does not change."""
        self.replace(**{part: getattr(self.content, part)._replace(**arrays)})

    @cached_property
    def opened(self) -> Any:
        """Content for kernels that run in Python: structured arrays have attributes instead of named columns."""
        return with_attributes(self.content)


class Template:
    """Named tuple from which handles are copied; each copy has its arrays in one piece of memory.

    Parts in `shared` are not copied: all copies have those of the template, unless a copy is given its own.
    """

    def __init__(self, content: Any, shared: Collection[str] = ()) -> None:
        self._words, self._parts = list[int](), list[tuple[type, list[Any], int, int]]()
        self._views = list[tuple[Any, ...]]()  # shape, type and first byte of each array that is copied
        self._places = list[tuple[int, int, int]]()  # its part, place in the part, and word of its address
        self.shared = dict[str, tuple[_Field, int, int, int]]()  # field, part, place in it and first word, by name
        self._size = 0
        sources = list[np.ndarray]()
        self._add(content, type(content), shared, 0, 0, sources)
        self._memory = np.zeros(self._size, np.uint8)
        for source, array in zip(sources, self._arrays(self._memory), strict=True):
            array[...] = source
        self._image, self._addresses = np.array(self._words, np.int64), np.array([word for *_, word in self._places], int)

    def _add(
        self, content: Any, described: type, shared: Collection[str], parent: int, place: int, sources: list[np.ndarray]
    ) -> None:
        """Add a named tuple, which is an entry of a parent."""
        number = len(self._parts)
        self._parts.append((described, list(content), parent, place))
        for at, (field, part) in enumerate(zip(_fields_in_memory(described), content, strict=True)):
            if field.name in shared:
                self.shared[field.name] = field, number, at, len(self._words)
                _append_field(field, part, self._words)
            elif field.nested:
                self._add(part, field.hint, shared, number, at, sources)
            elif field.array is None or not part.size:  # arrays without entries are the same in all copies
                _append_field(field, part, self._words)
            else:
                self._views.append((part.shape, part.dtype, self._size))
                self._places.append((number, at, len(self._words)))
                self._words += [self._size, *_array_words(part, field.array, field.name)[1:]]
                self._size += part.nbytes + -part.nbytes % 64  # a cache line has 64 bytes
                sources.append(part)

    def _arrays(self, memory: np.ndarray) -> list[np.ndarray]:
        return [np.ndarray(shape, dtype, memory, first) for shape, dtype, first in self._views]

    def copy(self, shared: Mapping[str, Any]) -> Handle:
        """Return a handle with copies of all arrays; `shared` replaces the shared parts, by type and field."""
        memory, words, parts = self._memory.copy(), self._image.copy(), [list(part) for _, part, *_ in self._parts]
        words[self._addresses] += address_of(memory)
        for (part, place, _), array in zip(self._places, self._arrays(memory), strict=True):
            parts[part][place] = array
        for name, value in shared.items():
            field, part, place, first = self.shared[name]
            if parts[part][place] is value:
                continue
            parts[part][place], written = value, list[int]()
            _append_field(field, value, written)
            words[first : first + field.words] = written
        for number in range(len(parts) - 1, 0, -1):
            described, _, parent, place = self._parts[number]
            parts[parent][place] = described(*parts[number])
        return Handle(self._parts[0][0](*parts[0]), words)


_HANDLES: weakref.WeakValueDictionary[int, Handle] = weakref.WeakValueDictionary()  # handles by their address


class CheckedArray(np.ndarray):
    """NumPy array that raises `IndexError` for an index that is invalid in C: negative or beyond the end."""

    def _check(self, index: Any) -> None:
        for part, size in zip(index if isinstance(index, tuple) else (index,), self.shape, strict=False):
            ends = (part.start or 0, size if part.stop is None else part.stop) if isinstance(part, slice) else (part, part + 1)
            if not 0 <= ends[0] <= ends[1] <= size:
                raise IndexError(f"index {part} of an array with {size} entries")

    def __getitem__(self, index: Any) -> Any:
        """Return an entry or a part after checking the index."""
        self._check(index)
        return super().__getitem__(index)

    def __setitem__(self, index: Any, value: Any) -> None:
        """Set an entry or a part after checking the index."""
        self._check(index)
        super().__setitem__(index, value)


def with_attributes(content: Any) -> Any:
    """Convert arrays, also inside tuples, for kernels that run in Python: with checked indices, columns as attributes."""
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
    """Return name and type of each field of a named tuple."""
    return tuple(get_type_hints(described, include_extras=True).items())


class _Field(NamedTuple):
    """Field of a named tuple in memory."""

    name: str
    hint: Any  # type, without parameters
    array: ArrayType | None  # element type and dimensions of an array
    nested: bool  # True for a named tuple
    words: int  # number of words


@cache
def _fields_in_memory(described: type) -> list[_Field]:
    """Return all fields of a named tuple; the cache saves half of the time of `_append_words`."""
    return [_field(described.__name__, name, hint) for name, hint in fields_of(described)]


def _field(owner: str, name: str, hint: Any) -> _Field:
    name, kind = f"{owner}.{name}", get_origin(hint) or hint
    if kind is Annotated:
        return _Field(name, kind, get_args(hint)[1], False, len(_words(hint)))
    if hasattr(kind, "_fields"):
        return _Field(name, kind, None, True, sum(field.words for field in _fields_in_memory(kind)))
    return _Field(name, kind, None, False, len(get_args(hint)) or 1)


def _append_words(content: Any, described: type, words: list[int]) -> None:
    for field, part in zip(_fields_in_memory(described), content, strict=True):
        _append_field(field, part, words)


def _append_field(field: _Field, part: Any, words: list[int]) -> None:
    name, hint, array, nested, _ = field
    if array is not None:
        words += _array_words(part, array, name)
    elif hint is tuple:
        words += part
    elif not isinstance(part, hint):
        raise TypeError(f"{name}: {_describe_value(part)} instead of {hint.__name__}")
    elif nested:
        _append_words(part, hint, words)
    else:
        words.append(part if isinstance(part, int) else int(np.float64(part).view(np.int64)))


class Opener:
    """Function with which kernels read the named tuple at an address; in C it does nothing but change the type."""

    def __init__(self, described: type) -> None:
        self.described = described
        self.__name__ = f"open_{described.__name__.lower()}"

    def __call__(self, address: int) -> Any:
        """Return the named tuple at an address, when kernels run in Python."""
        return _HANDLES[int(address)].opened


opener = Opener


CALLED: dict[int, Callable[..., float]] = {}  # in Python, functions by the integers that replace kernel pointers


def call_at(address: int, q: Any, v: Any, z: Any, x: Any, p: Any, out: Any) -> Any:
    """Call the kernel at a pointer; `compiler.recipe` describes the arrays or tuples of its arguments."""
    if int(address) in CALLED:
        return CALLED[int(address)](q, v, z, x, p, out)
    arrays = [np.asarray(numbers, float) for numbers in (q, v, z, x, p, out)]
    if not all(array.flags.c_contiguous for array in arrays):
        raise TypeError("call_at: the arrays are not contiguous; expected np.ascontiguousarray(z, float)")
    return _AT_POINTER(int(address))(*(array.ctypes.data for array in arrays))


# C type of a kernel behind a pointer: six pointers as arguments, a double as result
_AT_POINTER = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 6)


if PYTHON:
    # floats and integers behave as in C: division by zero is infinite, and floor keeps large values
    np.seterr(all="ignore")
    _floor = math.floor
    math.floor = lambda x: _floor(x) if math.isfinite(x) else float(np.floor(x))  # type: ignore[assignment]
