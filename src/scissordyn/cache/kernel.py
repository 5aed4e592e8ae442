"""Machine code on disk: a file for each function and signature."""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import os
import pickle
import re
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.serialize import dumps

from scissordyn.cache.folder import KERNEL_ROOMS, PACKAGE, folders

__all__ = ["KernelCache"]

HEAD = b"scissordyn kernel 3\n"
"""First bytes of a file of machine code: what it is and in which layout."""


@cache
def _file_digest(path: str) -> str:
    """A digest of the source file of a kernel outside the kernel rooms; those inside name the generation."""
    try:
        inside = any(Path(path).is_relative_to(PACKAGE / room) for room in KERNEL_ROOMS)
        return "" if inside else hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return ""


class _Result(CompileResultCacheImpl):
    """How numba takes a compiled function apart and puts it together; where it lies is not numba's choice."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._py_file = inspect.getfile(function)
        self._locator = self  # numba asks it for the file and line of its warnings


class KernelCache(FunctionCache):
    """The machine code of one function, a file for each signature.

    A file that is not whole is deleted and the function compiled anew. Where files cannot be written, they go to a temporary
    folder; never beside the sources.

    Parameters
    ----------
    function : callable
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._name = repr(function)
        self._py_func = function
        self._impl = _Result(function)
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """The folder that machine code is written to."""
        return str(folders.writable())

    def flush(self) -> None:
        """Forget nothing: a file is replaced when the function is compiled anew."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function from disk, or None; numba loads its tables for compiling, slow to load, when it compiles."""
        if not self._enabled:
            return None
        key, name = self._key(sig, target_context.codegen())
        for folder in folders.readable():
            file = folder / name
            try:
                found = _unpacked(file.read_bytes(), key)
                return None if found is None else self._impl.rebuild(target_context, found)
            except FileNotFoundError:
                continue
            except Exception:  # half a file, or one of another layout: pickles and the linker raise whatever they like
                with contextlib.suppress(OSError):
                    file.unlink()
        return None

    def holds(self, sig: Any, codegen: Any) -> bool:
        """Whether there is a file for a signature."""
        _, name = self._key(sig, codegen)
        return any((folder / name).exists() for folder in folders.readable())

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function on disk, where there is room for it."""
        if not (self._enabled and self._impl.check_cachable(data)):
            return
        key, name = self._key(sig, data.codegen)
        packed = dumps((key, _foreign(data.library), _kept(self._impl.reduce(data), data.library)))
        content = HEAD + hashlib.sha256(packed).digest() + packed
        try:
            _write(folders.writable() / name, content)
        except OSError as error:
            # the disk may be full there too: then this process alone has the function
            with contextlib.suppress(OSError):
                _write(folders.give_up(error) / name, content)

    def _key(self, sig: Any, codegen: Any) -> tuple[Any, str]:
        own = self._index_key(sig, codegen)  # type: ignore[no-untyped-call]
        key = own, _file_digest(self._impl._py_file)
        where = f"{self._impl._py_file}:{self._impl._lineno}"
        digest = hashlib.sha256(f"{where} {key!r}".encode()).hexdigest()[:24]
        plain = re.sub(r"[^\w.]", "", self._py_func.__qualname__)[:80]
        return key, f"{Path(self._impl._py_file).stem}.{plain}-{digest}.nbc"


def _kept(reduced: Any, library: Any) -> Any:
    """What is kept of a compiled function: in place of its intermediate code, which takes long to read, the names in it.

    Callers have intermediate code of their own, see `callee`; numba asks for the names to find the machine code.
    """
    (name, kind, (machine_code, _)), *rest = reduced
    defined = [each.name for each in library.get_defined_functions()]
    variables = [each.name for each in library._final_module.global_variables if not each.is_declaration]
    lines = [f'define void @"{each}"() {{ unreachable }}' for each in defined]
    lines += [f'@"{each}" = global i8 0' for each in variables]
    names = llvm.parse_assembly("\n".join(lines))  # type: ignore[no-untyped-call]
    return (name, kind, (machine_code, names.as_bitcode())), *rest


def _foreign(library: Any) -> tuple[str, ...]:
    """Names that machine code refers to and does not define: functions of the interpreter, of numba and of the C library."""
    module = library._final_module
    declared = [each.name for each in (*module.functions, *module.global_variables) if each.is_declaration]
    return tuple(name for name in declared if not name.startswith("llvm."))


def _unpacked(content: bytes, key: Any) -> Any:
    """What was kept under a key; None if the file is that of another key, or calls what this process does not have.

    Raises
    ------
    ValueError
        If the file is not whole.
    """
    start = len(HEAD) + hashlib.sha256().digest_size
    packed = content[start:]
    if content[:start] != HEAD + hashlib.sha256(packed).digest():
        raise ValueError("not a whole file of machine code")
    stored, foreign, data = pickle.loads(packed)
    # the linker ends the process at a name that it does not know
    known = all(llvm.address_of_symbol(name) is not None for name in foreign)  # type: ignore[no-untyped-call]
    return data if stored == key and known else None


def _write(target: Path, content: bytes) -> None:
    """Write a file whole or not at all."""
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=".", suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(name, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise
