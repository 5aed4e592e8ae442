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
from numba.core import config
from numba.extending import intrinsic
from platformdirs import user_cache_path

__all__ = ["CACHE_FOLDER", "KERNEL_ROOMS", "Handle", "kernel", "opener", "source_digest"]

KERNEL_ROOMS = ("laws", "control", "mechanics", "integrate")
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
        before = config.CACHE_DIR
        config.CACHE_DIR = str(CACHE_FOLDER)
        try:
            return numba.njit(
                cache=True,
                error_model="numpy",
                _nrt=False,
                forceinline=inline,
                no_cpython_wrapper=inline,
                no_cfunc_wrapper=inline,
            )(function)
        finally:
            config.CACHE_DIR = before

    return compile_later


class Handle:
    """A tuple of arrays in memory, handed to kernels as one address instead of hundreds of machine words.

    Parameters
    ----------
    content : NamedTuple
        The arrays; they stay alive as long as the handle.
    store : compiled function
        What `opener` returned for the tuple's class.

    Attributes
    ----------
    address : int
        What kernels get.
    """

    def __init__(self, content: Any, store: Any) -> None:
        self.content = content
        self._memory = np.zeros(16 * (1 + sum(getattr(part, "ndim", 0) + 4 for part in content)), np.int64)
        self.address = int(self._memory.ctypes.data)
        store(self.address, content)


def opener(described: type) -> tuple[Any, Any]:
    """Functions that open a `Handle` inside a kernel, and that fill one.

    Parameters
    ----------
    described : NamedTuple class
        Each field annotated `int`, or ``Annotated[ndarray, numba array type]``.

    Returns
    -------
    load : intrinsic
        From an address to the tuple, for kernels.
    store : compiled function
        Writes a tuple to an address.
    """
    hints = get_type_hints(described, include_extras=True)
    members = [types.int64 if hint is int else get_args(hint)[1] for hint in hints.values()]
    layout = types.NamedTuple(members, described)

    @intrinsic
    def load(typing_context, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            pointer = builder.inttoptr(arguments[0], context.get_value_type(layout).as_pointer())
            return builder.load(pointer)

        return layout(types.int64), generate

    @intrinsic
    def write(typing_context, address, content):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            pointer = builder.inttoptr(arguments[0], context.get_value_type(layout).as_pointer())
            builder.store(arguments[1], pointer)
            return context.get_dummy_value()

        return types.void(types.int64, layout), generate

    def store(address, content):  # type: ignore[no-untyped-def]
        write(address, content)

    return load, numba.njit(types.void(types.int64, layout))(store)
