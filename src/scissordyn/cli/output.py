"""Whether results can be written, found out before the work starts."""

from __future__ import annotations

import tempfile
from pathlib import Path

from scissordyn.errors import InputError

__all__ = ["check_file", "check_folder"]


def check_file(path: Path, case: Path, sample: str) -> None:
    """Raise `InputError` unless a file can be written there without loss of another.

    Parameters
    ----------
    path : Path
        Where the result is to go.
    case : Path
        The case file or saved run, which must not be overwritten by its result.
    sample : str
        What the user could type.
    """
    from scissordyn.simulation.output_file import check_target

    if path.exists() and case.exists() and path.samefile(case):
        raise InputError(f"cannot write '{path}': it is the case file", "another name", sample)
    check_target(path, sample=sample)
    _try(path, path.parent, sample)


def check_folder(folder: Path, sample: str) -> None:
    """Raise `InputError` unless a folder is there or can be made, and takes files."""
    existing = next(ancestor for ancestor in (folder, *folder.absolute().parents) if ancestor.exists())
    if not existing.is_dir():
        raise InputError(f"cannot write into '{folder}': '{existing}' is a file", "a folder", sample)
    _try(folder, existing, sample)


def _try(target: Path, folder: Path, sample: str) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"cannot write '{target}': {error.strerror}", "a place that exists and can be written", sample
        ) from None
