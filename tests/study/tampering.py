"""Stores and files with faults: files and folders lost, cut, with flipped bits, exchanged, or turned into something else."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

__all__ = ["FAULTS", "tampered"]


def _delete(path: Path, _: list[Path], __: random.Random) -> None:
    shutil.rmtree(path) if path.is_dir() else path.unlink()


def _cut(path: Path, _: list[Path], chance: random.Random) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: chance.randrange(len(content) + 1)])


def _flip(path: Path, _: list[Path], chance: random.Random) -> None:
    content = bytearray(path.read_bytes())
    if content:
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        path.write_bytes(content)


def _exchange(path: Path, others: list[Path], chance: random.Random) -> None:
    path.write_bytes(chance.choice(others).read_bytes())


def _overwrite(path: Path, _: list[Path], chance: random.Random) -> None:
    path.write_bytes(chance.choice([b"", b"{}", b"null", b"[]", b"\0" * 64, chance.randbytes(50), b'{"files": 3}']))


def _as_folder(path: Path, _: list[Path], __: random.Random) -> None:
    path.unlink()
    path.mkdir()
    (path / "inside").write_text("of the user")


def _as_file(path: Path, _: list[Path], __: random.Random) -> None:
    shutil.rmtree(path)
    path.write_text("no folder")


FAULTS = {"cut": _cut, "flip": _flip, "exchange": _exchange, "overwrite": _overwrite, "as folder": _as_folder}
"""What may befall a file; any file or folder may be deleted, and a file be in the place of a folder."""


def tampered(folder: Path, chance: random.Random) -> str:
    """Do one thing to a file or folder below a folder, and say what."""
    every = sorted(folder.rglob("*"))
    files, folders = [path for path in every if path.is_file()], [path for path in every if path.is_dir()]
    kind = chance.random()
    if kind < 0.2 or not files:
        path, what, fault = chance.choice(every), "deleted", _delete
    elif kind < 0.25:
        path, what, fault = chance.choice(folders), "as file", _as_file
    else:
        what = chance.choice(list(FAULTS))
        path, fault = chance.choice(files), FAULTS[what]
    fault(path, files, chance)
    return f"{path.relative_to(folder)}: {what}"
