"""Seals of blocks: the program that computed a block, and a digest of each of its files, once all are on the disk."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import secrets
from collections.abc import Mapping
from pathlib import Path

RECORD = "record"
"""Group of what vouches for the arrays: the seals, the copies of the descriptions, the lock."""

DIGITS = 16
"""Hexadecimal digits of a digest that are kept."""

UNSEALED = "its seal is missing"


def chunk_file(folder: Path, name: str, dimensions: int, block: int) -> Path:
    """Where the chunk of a block lies; other dimensions than the cases are in one chunk."""
    return folder.joinpath(name, "c", str(block), *["0"] * (dimensions - 1))


def _seal_file(folder: Path, block: int) -> Path:
    return folder / RECORD / "seals" / f"{block}.json"


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:DIGITS]


def seal(folder: Path, block: int, arrays: Mapping[str, int], program: str) -> None:
    """Wait until all files of a block are on the disk, and write their digests."""
    digests, folders = dict[str, str](), set[Path]()
    for name, dimensions in arrays.items():
        path = chunk_file(folder, name, dimensions, block)
        try:
            with open(path, "rb") as file:
                digests[name] = _digest(file.read())
                os.fsync(file.fileno())
        except FileNotFoundError:  # nothing but the fill value
            digests[name] = ""
            continue
        folders.update(path.parents[:dimensions])
    for each in sorted(folders, key=lambda one: -len(one.parts)):
        sync_folder(each)
    path = _seal_file(folder, block)
    path.parent.mkdir(exist_ok=True)
    write_beside(path, json.dumps({"program": program, "files": digests}).encode())


def fault(folder: Path, block: int, arrays: Mapping[str, int], program: str) -> str | None:
    """What is wrong with a block."""
    try:
        found = json.loads(_seal_file(folder, block).read_bytes())
        digests, by = dict(found["files"]), found["program"]
    except FileNotFoundError:
        return UNSEALED if chunk_file(folder, "status", 1, block).exists() else ""
    except (OSError, ValueError, TypeError, KeyError):
        return "its seal cannot be read"
    if by != program:
        return "another program computed it"
    for name, dimensions in arrays.items():
        path = chunk_file(folder, name, dimensions, block)
        try:
            there = _digest(path.read_bytes())
        except (FileNotFoundError, NotADirectoryError):
            there = ""
        except OSError:
            return f"{name} cannot be read"
        if there != digests.get(name):
            return f"{name} is missing" if not there else f"{name} is not what was written"
    return None


def make_room(folder: Path, block: int, arrays: Mapping[str, int]) -> None:
    """Remove the files of a block that is not whole."""
    for name, dimensions in arrays.items():
        path = chunk_file(folder, name, dimensions, block)
        clear_way(folder, path)
        path.unlink(missing_ok=True)
    path = _seal_file(folder, block)
    clear_way(folder, path)
    path.unlink(missing_ok=True)


def clear_way(folder: Path, path: Path) -> None:
    """Move aside what is in the way of a file of the store: a folder of its name, or no folder above it."""
    for each in reversed(path.relative_to(folder).parents[:-1]):
        above = folder / each
        if os.path.lexists(above) and not above.is_dir():
            _move_aside(above)
    if path.is_dir() and not path.is_symlink():
        _move_aside(path)


def _move_aside(path: Path) -> None:
    os.rename(path, path.with_name(f"{path.name}.{secrets.token_hex(8)}.aside"))


def sync_folder(folder: Path) -> None:
    """Have the names in a folder on the disk; some file systems cannot, and need not."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def write_beside(path: Path, content: bytes) -> None:
    """Write a file of the store whole or not at all, and wait until it is on the disk."""
    part = path.with_name(f"{path.name}.{secrets.token_hex(16)}.partial")
    handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        with open(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)
