"""Text files of the user: regular files of a sensible size, and nothing without an end."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.file.output_file import HDF_MAGIC

LARGEST = 64 * 2**20  # Largest text file that is read [bytes]: a table of a million instants takes about 30 MB


def read_text(path: Path, what: str, sample: str = "") -> str:
    try:
        regular = stat.S_ISREG(os.stat(path).st_mode)
        if path.suffix == ".db" and regular:
            shown = command("scissordyn", "study", "report", path, "-o", "report.html")
            raise InputError(f"cannot read '{path}': it is the store of a study", what, shown)
        if not regular:
            kind = "a folder" if path.is_dir() else "not a regular file"
            raise InputError(f"cannot read '{path}': it is {kind}", what, "" if path.is_dir() else sample)
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        near = _near(path) if isinstance(error, FileNotFoundError) else ""
        raise InputError(f"cannot read '{path}': {getattr(error, 'strerror', None) or error}{near}", what, sample) from None
    if content.startswith(HDF_MAGIC):
        shown = command("scissordyn", "plot", path, "-o", "figures")
        raise InputError(f"'{path}' is a saved run or diagram, in NetCDF", what, shown)
    if len(content) > LARGEST:
        raise InputError(f"'{path}' has more than {LARGEST // 2**20} MiB", f"{what} of at most {LARGEST // 2**20} MiB", sample)
    try:
        return content.decode("utf-8-sig")  # with or without the mark that some editors put first
    except UnicodeDecodeError:
        raise InputError(f"'{path}' is not a text file", f"{what} in UTF-8", sample) from None


def _near(path: Path) -> str:
    """A question for the file beside a missing one that has nearly its name."""
    try:
        return did_you_mean(path.name, sorted(other.name for other in path.parent.iterdir() if other.is_file()))
    except (OSError, ValueError):
        return ""
