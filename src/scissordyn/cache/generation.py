"""Every edition of the kernels on disk, and cleaning up. Nothing is deleted unless the user asks for it."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from scissordyn.cache.folder import LOCK, OWNER, cache_root, current_generation, place_digest
from scissordyn.lock import hold

__all__ = ["Generation", "clean", "generations"]

GENERATION = re.compile(r"[0-9a-f]{16}-[0-9a-f]{8}")


@dataclass(frozen=True)
class Generation:
    """Machine code of one edition of the kernel sources.

    Parameters
    ----------
    folder : Path
    size : int
        Of its files [bytes].
    package : Path or None
        Where the package lies that made it; None if that is not known.
    current : bool
        Whether this package, as it is now, uses it.
    in_use : bool
        Whether a running process uses it.
    """

    folder: Path
    size: int
    package: Path | None
    current: bool
    in_use: bool

    @property
    def old(self) -> bool:
        """Whether nothing needs it: it is not in use, and its package is this one in an earlier edition, or gone."""
        ours = self.folder.name.endswith(place_digest()) or (self.package is not None and not self.package.exists())
        return ours and not (self.current or self.in_use)


def generations() -> list[Generation]:
    """Every generation on disk, the latest first.

    Returns
    -------
    list of Generation
    """
    current = current_generation().name
    try:
        folders = [path for path in cache_root().iterdir() if GENERATION.fullmatch(path.name) and path.is_dir()]
    except OSError:
        return []
    found = []
    for folder in sorted(folders, key=lambda path: path.stat().st_mtime, reverse=True):
        try:
            package = Path((folder / OWNER).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError):
            package = None
        with _sole_use(folder) as free:
            found.append(Generation(folder, _size(folder), package, folder.name == current, not free))
    return found


def clean() -> list[Generation]:
    """Delete the generations that nothing needs any more: those of earlier editions of this package, and of packages gone.

    Returns
    -------
    list of Generation
        What was deleted.
    """
    deleted = []
    for generation in generations():
        if not generation.old:
            continue
        with _sole_use(generation.folder) as free:
            if free:
                shutil.rmtree(generation.folder, ignore_errors=True)
                deleted.append(generation)
    return deleted


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


@contextlib.contextmanager
def _sole_use(folder: Path) -> Iterator[bool]:
    """Whether no process uses a generation; while it lasts none can begin to."""
    try:
        lock = os.open(folder / LOCK, os.O_RDWR)
    except FileNotFoundError:
        yield True  # made by a process that could not lock it
        return
    except OSError:
        yield False
        return
    try:
        yield hold(lock)
    finally:
        os.close(lock)
