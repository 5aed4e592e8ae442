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
