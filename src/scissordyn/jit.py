"""Compiled kernels and where their machine code is kept.

Numba's on-disk cache watches only the file of the function it loads: edit a law, and a caller in another file would still
run the old one. So the cache folder is named by a digest of every kernel source, of this interpreter and of numba.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic
from platformdirs import user_cache_path

__all__ = ["CACHE_FOLDER", "KERNEL_ROOMS", "Handle", "kernel", "opener", "source_digest"]

KERNEL_ROOMS = ("plugin", "laws", "control", "mechanics", "integrate")
KEPT_GENERATIONS = 4
"""Older cache folders beyond this number are deleted when a new one is made."""


def source_digest(package: Path) -> str:
    """A digest of all kernel sources under `package`, the numba version and the interpreter."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {sys.platform}".encode())
    sources = [package / "jit.py", *(path for room in KERNEL_ROOMS for path in sorted((package / room).rglob("*.py")))]
    for path in sources:
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    package = Path(__file__).parent
    root = Path(os.environ.get("SCISSORDYN_CACHE") or user_cache_path("scissordyn")) / "kernels"
    folder = root / f"{source_digest(package)}-{hashlib.sha256(str(package).encode()).hexdigest()[:8]}"
    if not folder.exists():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            generations = sorted(root.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
            for old in generations[KEPT_GENERATIONS:]:
                shutil.rmtree(old, ignore_errors=True)
        except OSError:  # a read-only home: the machine code lives as long as this process's temporary folder
            folder = Path(tempfile.mkdtemp(prefix="scissordyn-"))
    return folder


CACHE_FOLDER = _cache_folder()
settings: Any = numba.config
"""numba makes its settings when it is imported, so that no type checker can know them."""


def kernel(*, inline: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function to machine code, kept on disk under `CACHE_FOLDER`.

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
        before = settings.CACHE_DIR
        settings.CACHE_DIR = str(CACHE_FOLDER)
        try:
            return numba.njit(  # type: ignore[call-overload]
                cache=True,
                error_model="numpy",
                _nrt=False,
                forceinline=inline,
                no_cpython_wrapper=inline,
                no_cfunc_wrapper=inline,
            )(function)
        finally:
            settings.CACHE_DIR = before

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
        self._memory = np.array([word for part in content for word in _words(part)], np.int64)
        self.address = int(self._memory.ctypes.data)

    def exchange(self, **parts: Any) -> None:
        """Put other arrays, of the same type, in the place of some; the address stays."""
        self.content = self.content._replace(**parts)
        self._memory[:] = [word for part in self.content for word in _words(part)]


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
