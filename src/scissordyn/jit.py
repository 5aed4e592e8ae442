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
from typing import Any

import numba
from numba.core import config
from platformdirs import user_cache_path

__all__ = ["CACHE_FOLDER", "KERNEL_ROOMS", "kernel", "source_digest"]

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


def kernel(*signature: Any, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function to machine code, kept on disk under `CACHE_FOLDER`.

    Parameters
    ----------
    *signature
        An explicit numba signature, for functions that others call through a typed pointer; without one
        the function is compiled for the types of its first call.
    **options
        Passed to `numba.njit`.

    Returns
    -------
    decorator
    """

    def compile_later(function: Callable[..., Any]) -> Any:
        before = config.CACHE_DIR
        config.CACHE_DIR = str(CACHE_FOLDER)
        try:
            return numba.njit(*signature, cache=True, error_model="numpy", **options)(function)
        finally:
            config.CACHE_DIR = before

    return compile_later
