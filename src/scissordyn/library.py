"""The library of compiled kernels, loaded once; built anew in a checkout whose kernels have changed."""

from __future__ import annotations

import ctypes
import hashlib
import subprocess
import sys
from functools import cache
from pathlib import Path

from scissordyn.errors import ScissordynError

PACKAGE = Path(__file__).parent


def library_name(machine: str = "") -> str:
    """Name of its file on another machine, or on this one."""
    return "_kernels.dll" if "windows" in machine or (not machine and sys.platform == "win32") else "_kernels.so"


PATH = PACKAGE / library_name()


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
    """The library."""
    if not PATH.is_file():
        build("no library of compiled kernels")
    loaded = _load()
    if not _is_current(loaded):
        _unload(loaded)  # under the same name the system hands out the library that it has
        build("kernels have changed since their library was built")
        loaded = _load()
    return loaded


def _load() -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(PATH))
    except OSError as error:
        raise EngineError(
            f"'{PATH}' is no library for this machine ({error}); allowed: one that was built here; type: "
            f"{Path(sys.executable).name} -m scissordyn.build"
        ) from None


def _unload(loaded: ctypes.CDLL) -> None:
    import _ctypes

    getattr(_ctypes, "FreeLibrary" if sys.platform == "win32" else "dlclose")(loaded._handle)


def _is_current(loaded: ctypes.CDLL) -> bool:
    """Whether the sources are those that the library was made of; they are read only if one is newer than the library."""
    files = _text(loaded, "SOURCES").split()
    built = PATH.stat().st_mtime
    times = [path.stat().st_mtime if path.is_file() else float("inf") for path in (PACKAGE / name for name in files)]
    if max(times) <= built:
        return True
    return _text(loaded, "DIGEST") == digest_of(files)


def _text(loaded: ctypes.CDLL, name: str) -> str:
    return ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(loaded, name))).decode()


def build(reason: str) -> None:
    """Build the library in a process of its own, which has kernels in Python."""
    print(f"scissordyn: {reason}; building it takes some seconds", file=sys.stderr)
    done = subprocess.run([sys.executable, "-m", "scissordyn.build"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise EngineError(f"{reason}, and building it failed: {(done.stderr.strip() or 'no reason given').splitlines()[-1]}")
