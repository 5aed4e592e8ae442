"""Checks that results can be written, before the computation."""

from __future__ import annotations

import tempfile
from pathlib import Path

from scissordyn.errors import InputError

PICTURES = (".png", ".svg", ".pdf", ".jpg", ".jpeg")
"""Endings of pictures."""


def check_file(path: Path, case: Path, sample: str) -> None:
    """Raise `InputError` unless a file can be written there without loss of another."""
    from scissordyn.file.output_file import check_target

    if path.exists() and case.exists() and path.samefile(case):
        raise InputError(f"cannot write '{path}': it is the case file", "another name", sample)
    check_target(path, sample=sample)
    _try(path, path.parent, sample)


def check_run(path: Path, case: Path, sample: str) -> None:
    """The same for a run or a diagram, which is a NetCDF file and has no name of another kind of file."""
    from scissordyn.file.output_file import check_name

    check_file(path, case, sample)
    check_name(path)


def check_store_name(address: str) -> None:
    """Raise `InputError` for a new store with the name of a file of another kind."""
    from scissordyn.file.output_file import OTHER_ENDINGS

    if Path(address).suffix.lower() in {".nc", *OTHER_ENDINGS} - {".db"}:
        raise InputError(f"'{address}' for the store of a study", "a name that ends in .db", "-o study.db")


def check_folder(folder: Path, sample: str) -> None:
    """Raise `InputError` unless a folder exists or can be created, and is writable; a name of a picture is no folder."""
    if folder.suffix.lower() in PICTURES and not folder.is_dir():
        raise InputError(f"'{folder}' for a folder of pictures", "a folder", sample)
    existing = next(ancestor for ancestor in (folder, *folder.absolute().parents) if ancestor.exists())
    if not existing.is_dir():
        raise InputError(f"cannot write into '{folder}': '{existing}' is a file", "a folder", sample)
    _try(folder, existing, sample)


def _try(target: Path, folder: Path, sample: str) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"cannot write '{target}': {error.strerror}", "a place that can be written", sample) from None
