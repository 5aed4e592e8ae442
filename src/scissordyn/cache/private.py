"""Whether a folder or a file is this user's alone: machine code is executed, so that nobody else may have put it there."""

from __future__ import annotations

import os
import stat
from pathlib import Path

__all__ = ["file_fault", "folder_fault", "make_private"]

UNIX = hasattr(os, "geteuid")
"""Elsewhere a user's folder for caches is his own by the rights that it inherits."""

OTHERS = stat.S_IWGRP | stat.S_IWOTH

LINKS = 40
"""Links that lead to each other without end are followed so often."""


def make_private(folder: Path) -> None:
    """Make a folder, and those that it lies in, for this user alone whatever his default rights are."""
    if not folder.is_dir():
        make_private(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)


def folder_fault(folder: Path) -> str:
    """What is wrong with a folder that only this user, and root, is to be able to write to, in words; empty if nothing is.

    Nobody else may be able to put another one in its place either: by writing to any folder on its path, or by changing a link
    on it. In a folder with the sticky bit, such as /tmp, others cannot replace what is his.

    Parameters
    ----------
    folder : Path
        That exists.

    Returns
    -------
    str
    """
    if not UNIX:
        return ""
    trusted = {0, os.geteuid(), os.stat("/").st_uid}  # of a container's root folder, that of the machine
    place, rest = Path("/"), [*reversed(folder.absolute().parts[1:])]
    links = 0
    while True:
        found = os.lstat(place)
        if found.st_uid not in trusted:
            return f"'{place}' belongs to {_user(found.st_uid)}"
        if stat.S_ISLNK(found.st_mode):
            links += 1
            if links > LINKS:
                return f"'{place}' is a link without end"
            rest += reversed(Path(os.readlink(place)).parts)
            place = place.parent
        elif found.st_mode & OTHERS and not (found.st_mode & stat.S_ISVTX and rest):
            return f"'{place}' can be written by others; type: chmod go-w '{place}'"
        if not rest:
            return "" if found.st_uid in (0, os.geteuid()) else f"'{place}' belongs to {_user(found.st_uid)}"
        # ".." as the system reads it: from where links have led to
        step = rest.pop()
        place = place.parent if step == ".." else place / step


def file_fault(handle: int) -> str:
    """What is wrong with an open file that only this user, or root, is to have written, in words; empty if nothing is."""
    if not UNIX:
        return ""
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode):
        return "is no regular file"
    if found.st_uid not in (0, os.geteuid()):
        return f"belongs to {_user(found.st_uid)}"
    return "can be written by others" if found.st_mode & OTHERS else ""


def _user(number: int) -> str:
    try:
        import pwd

        return f"user '{pwd.getpwuid(number).pw_name}'"
    except (ImportError, KeyError):
        return f"user {number}"
