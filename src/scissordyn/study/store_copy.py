"""Copies of the descriptions in a store: two files, each with all of them and a digest, from which a broken one is restored."""

from __future__ import annotations

import base64
import hashlib
import json
from pathlib import Path

from scissordyn.study.seal import RECORD, clear_way, write_beside

COPIES = (f"{RECORD}/description.json", f"{RECORD}/description.copy.json")


def keep(folder: Path, blocks: tuple[str, ...]) -> None:
    """Write both copies of what the store holds beside its blocks: descriptions, and labels of dimensions."""
    chunks = [folder / name / "c" for name in blocks]
    labels = [path for path in folder.glob("*/c/*") if path.parent not in chunks and path.name.isdigit()]
    files = {
        path.relative_to(folder).as_posix(): base64.b64encode(path.read_bytes()).decode()
        for path in sorted([*folder.rglob("zarr.json"), *labels])
    }
    text = json.dumps(files)
    content = json.dumps({"digest": _digest(text), "files": text}).encode()
    for copy in COPIES:
        write_beside(folder / copy, content)


def kept(folder: Path) -> dict[str, bytes] | None:
    """The files as they are to be, by name; None if neither copy is whole."""
    for copy in COPIES:
        found = _files(_content(folder / copy))
        if found is not None:
            return found
    return None


def broken(folder: Path, files: dict[str, bytes]) -> list[str]:
    """The names of those that are not as they are to be."""
    wrong = [name for name, content in files.items() if _content(folder / name) != content]
    first, second = (_content(folder / copy) for copy in COPIES)
    if first != second:  # a writer that was killed between them leaves two whole ones, of which the first counts
        wrong.append(COPIES[0] if _files(first) is None else COPIES[1])
    return wrong


def mend(folder: Path, files: dict[str, bytes], wrong: list[str]) -> None:
    """Write these files anew."""
    contents = [_content(folder / copy) for copy in COPIES]
    sound = next((content for content in contents if content is not None and _files(content) is not None), b"")
    for name in wrong:
        path = folder / name
        clear_way(folder, path)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_beside(path, sound if name in COPIES else files[name])


def _files(content: bytes | None) -> dict[str, bytes] | None:
    """What a copy holds; None if it is not whole."""
    try:
        found = json.loads(content or b"")
        if found["digest"] != _digest(found["files"]):
            return None
        return {name: base64.b64decode(text) for name, text in json.loads(found["files"]).items()}
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
