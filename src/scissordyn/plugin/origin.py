"""Where a class of the user's is from, so that it can be had again: from its file, in a saved run, in another process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scissordyn.plugin.user_file import load_function, made_in, split_reference

_KNOWN: dict[tuple[str, str], type] = {}  # The classes that this process has made, by file and digest


def note_origin(made: Any, described: type) -> None:
    """Keep where a class is from, if it is in a file, also for pickles of its instances, which other processes get."""
    made.origin = origin = made_in(described)  # also None, lest that of a base is inherited
    if origin is not None:
        made.__reduce__ = _reduced
        _KNOWN[origin] = made


def origin_of(described: type) -> tuple[str, str] | None:
    """File and name, and the digest of the file; None for a class of the package, or of no file."""
    origin: tuple[str, str] | None = vars(described).get("origin")
    return origin


def class_in(kind: str, reference: str, folder: Path) -> tuple[Any, str]:
    """What ``"file.py:name"`` names, if it is a class, or None, and its absolute name; the file is executed."""
    path, name = split_reference(kind, reference, folder)
    loaded = load_function(kind, f"{path}:{name}")
    return loaded if isinstance(loaded, type) else None, f"{path}:{name}"


def _reduced(part: Any) -> Any:
    return _empty, type(part).origin, part.__dict__


def _empty(reference: str, digest: str) -> Any:
    """An instance whose fields the pickle puts in."""
    described: Any = _KNOWN.get((reference, digest)) or load_function("class", reference, digest)
    return described.__new__(described)
