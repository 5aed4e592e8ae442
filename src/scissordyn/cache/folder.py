"""The folders of machine code.

Every edition of the kernel sources has a folder of its own, a generation, named by digests of the sources and of the place of
the package. A process holds a shared lock on the generation that it uses. Where that cannot be written, or somebody else can
write to it, a temporary folder takes its place.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import os
import shutil
import sys
import tempfile
import threading
from pathlib import Path

import numba
from platformdirs import user_cache_path

from scissordyn.cache.private import folder_fault, make_private
from scissordyn.lock import hold

__all__ = [
    "KERNEL_ROOMS",
    "LOCK",
    "OWNER",
    "PACKAGE",
    "adopt_folder",
    "cache_root",
    "current_generation",
    "folders",
    "place_digest",
    "shared_folder",
    "source_digest",
]

PACKAGE = Path(__file__).parents[1]
KERNEL_ROOMS = ("plugin", "laws", "control", "component", "mechanics", "integrate")

LOCK, OWNER = "in-use", "package"
"""Files beside the machine code: what users of a generation lock, and where the package that made it lies."""


def source_digest(package: Path) -> str:
    """A digest of all kernel sources under `package`, the numba version and the interpreter."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {sys.platform}".encode())
    rooms = (path for room in KERNEL_ROOMS for path in sorted((package / room).rglob("*.py")))
    sources = [package / "jit.py", package / "callee.py", *rooms]
    for path in sources:
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """The folder of all generations; the environment variable SCISSORDYN_CACHE names another place for it."""
    return Path(os.environ.get("SCISSORDYN_CACHE") or user_cache_path("scissordyn")) / "kernels"


def place_digest() -> str:
    """A digest of where this package lies."""
    return hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:8]


def current_generation() -> Path:
    """The folder of the kernels of this package as it is now."""
    return cache_root() / f"{source_digest(PACKAGE)}-{place_digest()}"


def _fault(folder: Path) -> str:
    """Why nothing in a folder is executed, in words; empty if it may be, or there is no such folder."""
    try:
        return folder_fault(folder)
    except FileNotFoundError:
        return ""
    except OSError as error:
        return f"it cannot be looked at: {error.strerror or error}"


class Folders:
    """The folders of this process, found when the first kernel is looked for."""

    def __init__(self) -> None:
        self._own: Path | None = None
        self._fault = ""
        self._spare: Path | None = None
        self._lock: int | None = None
        self._making = threading.RLock()

    def own(self) -> Path:
        """The generation of these sources, made and locked if that is possible."""
        with self._making:
            if self._own is None:
                self._own = current_generation()
                with contextlib.suppress(OSError):
                    make_private(self._own)
                self._fault = _fault(self._own)
                if not self._fault:
                    with contextlib.suppress(OSError):
                        self._hold(self._own)
            return self._own

    def _hold(self, folder: Path) -> None:
        """Lock a generation until this process ends; one that is only read, and never cleaned, may be without a lock."""
        owner = folder / OWNER
        if not owner.exists():
            owner.write_text(str(PACKAGE), encoding="utf-8")
        self._lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o600)
        hold(self._lock, shared=True)

    def readable(self) -> list[Path]:
        """Where to look for machine code: nowhere that somebody else could have put it."""
        own = self.own()
        if self._fault:
            with contextlib.suppress(OSError):
                self.give_up(self._fault)
        return [folder for folder in (self._spare, None if self._fault else own) if folder is not None]

    def writable(self) -> Path:
        """Where to keep machine code."""
        own = self.own()
        if self._fault:
            return self.give_up(self._fault)
        return own if self._spare is None else self._spare

    def adopt(self, folder: Path) -> None:
        """Keep machine code where the process that started this one does, unless somebody else could have put it there."""
        with self._making:
            if folder != self.own() and folder.is_dir() and not _fault(folder):
                self._spare = folder

    def give_up(self, why: OSError | str) -> Path:
        """From now on keep machine code in a temporary folder that is removed when the process ends."""
        with self._making:
            if self._spare is None:
                self._spare = Path(tempfile.mkdtemp(prefix="scissordyn-"))
                atexit.register(shutil.rmtree, self._spare, ignore_errors=True)
                fault = f"is not used: {why}" if isinstance(why, str) else f"cannot be written ({why.strerror or why})"
                print(
                    f"scissordyn: the kernel cache '{self.own()}' {fault}; kernels are compiled for this run only",
                    file=sys.stderr,
                )
            return self._spare


folders = Folders()
"""Of this process."""


def shared_folder() -> Path:
    """Where this process and those that it starts keep machine code: a folder that can be written.

    Returns
    -------
    Path
        Handed to `adopt_folder` in the other process.
    """
    folder = folders.writable()
    try:
        with tempfile.TemporaryFile(dir=folder) as trial:
            trial.write(bytes(4096))
    except OSError as error:
        return folders.give_up(error)
    return folder


def adopt_folder(folder: Path) -> None:
    """Keep machine code in the folder of the process that started this one.

    Parameters
    ----------
    folder : Path
        What `shared_folder` gave there.
    """
    folders.adopt(folder)
