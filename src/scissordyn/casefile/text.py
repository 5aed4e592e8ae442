"""Text files of the user, TOML above all: their content, and where in it a key stands."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

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


Place = tuple[int | str, ...]  # Keys from the top of a file down, with the index of each table of a list
HANDLES = ("joint", "guide", "name", "body")  # Keys that identify a table of a list; the first one present is used

TOKEN = re.compile(
    r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*|[\[\]{}\n]',
    re.DOTALL,
)
"""What can hide the end of a line, or is one."""

PART = r"""(?:[\w-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""
KEY = re.compile(rf"\s*({PART}(?:\s*\.\s*{PART})*)\s*=")
HEADER = re.compile(rf"\s*(\[\[?)\s*({PART}(?:\s*\.\s*{PART})*)\s*\]")


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Line and text of each statement of a TOML file."""
    start, depth = 0, 0
    for token in TOKEN.finditer(text):
        mark = token[0]
        depth += (mark in "[{") - (mark in "]}")
        if mark == "\n" and depth <= 0:
            yield text.count("\n", 0, start) + 1, text[start : token.start()]
            start, depth = token.end(), 0
    yield text.count("\n", 0, start) + 1, text[start:]


def _keys(dotted: str) -> tuple[str, ...]:
    """The parts of a key such as ``a."b.c"``."""
    tree: Any = tomllib.loads(f"{dotted} = 0")
    keys = []
    while isinstance(tree, dict):
        key, tree = next(iter(tree.items()))
        keys.append(key)
    return tuple(keys)


def _places(text: str) -> Iterator[tuple[int, Place]]:
    """Line and place of each header and of each key."""
    counts: dict[Place, int] = {}
    table: Place = ()

    def counted(keys: tuple[str, ...]) -> Place:
        place: Place = ()
        for key in keys:
            place = (*place, key)
            if place in counts:
                place = (*place, counts[place])
        return place

    for line, statement in _statements(text):
        header, key = HEADER.match(statement), KEY.match(statement)
        try:
            if header:
                *outer, last = _keys(header[2])
                table = (*counted(tuple(outer)), last)
                if header[1] == "[[":
                    counts[table] = counts.get(table, -1) + 1
                if table in counts:
                    table = (*table, counts[table])
                yield line, table
            elif key:
                yield line, (*table, *_keys(key[1]))
        except tomllib.TOMLDecodeError:  # not a statement of TOML, of which the parser speaks
            continue


def line_of(text: str, place: Place) -> int:
    """The line of a place, or of the innermost table around it that is written out; 0 if there is none."""
    best, nearest = 0, 0
    for line, here in _places(text):
        list_of_tables = here[-1:] == (0,) and here[:-1] == place  # where one table is read, or none of that name
        if len(here) > best and (place[: len(here)] == here or list_of_tables):
            best, nearest = len(here), line
    return nearest


def handle(entry: Any) -> str:
    """The name of a table in a list, by which a change means it; "" if it has none."""
    return next((str(entry[key]) for key in HANDLES if isinstance(entry.get(key), str)), "") if isinstance(entry, dict) else ""


def place_text(tree: Any, place: Place) -> str:
    """A place as ``--set`` takes it, with tables of a list by their name: ``clearance.A.friction``."""
    text = ""
    for key, there in _steps(tree, place):
        if isinstance(key, int):
            text += f".{handle(there)}" if handle(there) else f" ({_ordinal(key + 1)})"
        else:
            text += f".{key}" if text else key
    return text


def inside(tree: Any, place: Place) -> Any:
    """What is at a place; None if nothing is there."""
    return [tree, *(there for _, there in _steps(tree, place))][-1]


def _steps(tree: Any, place: Place) -> Iterator[tuple[int | str, Any]]:
    """Each key of a place, and what is there."""
    for key in place:
        if isinstance(key, int) and isinstance(tree, dict) and tree:  # a single table where a list of them is read
            continue
        try:
            tree = tree[key]
        except (LookupError, TypeError):
            tree = None
        yield key, tree


def _ordinal(number: int) -> str:
    return {1: "the first", 2: "the second", 3: "the third"}.get(number, f"number {number}")


def place_of_name(tree: Any, message: str) -> Place:
    """The table of a list that a message names first, in quotes; empty if it names none."""
    tables = {
        handle(entry): (section, index)
        for section, entries in reversed(tree.items())
        if isinstance(entries, list)
        for index, entry in reversed(list(enumerate(entries)))
        if handle(entry)
    }
    return next((tables[name] for name in re.findall(r"'([^']+)'", message) if name in tables), ())
