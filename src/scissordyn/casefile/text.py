"""Read text files of users, mostly TOML, and find the line numbers of their keys."""

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

NESTING_MAX = 32  # [levels] largest nesting of tables and lists in a case file, or of blocks in a drawing; six are usual
FILE_BYTES_MAX = 64 * 2**20  # [bytes] largest size of a text file that is read; a million instants take about 30 MB


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
            content = file.read(FILE_BYTES_MAX + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        near = _suggest_file(path) if isinstance(error, FileNotFoundError) else ""
        raise InputError(f"cannot read '{path}': {getattr(error, 'strerror', None) or error}{near}", what, sample) from None
    if content.startswith(HDF_MAGIC):
        shown = command("scissordyn", "plot", path, "-o", "figures")
        raise InputError(f"'{path}' is a saved run or diagram, in NetCDF", what, shown)
    if len(content) > FILE_BYTES_MAX:
        raise InputError(
            f"'{path}' has more than {FILE_BYTES_MAX // 2**20} MiB", f"{what} of at most {FILE_BYTES_MAX // 2**20} MiB", sample
        )
    try:
        return content.decode("utf-8-sig")  # some editors write a byte order mark
    except UnicodeDecodeError:
        raise InputError(f"'{path}' is not a text file", f"{what} in UTF-8", sample) from None


def _suggest_file(path: Path) -> str:
    """Return a clause "did you mean ...?" with the file of the most similar name in the folder, or ""."""
    try:
        return did_you_mean(path.name, sorted(other.name for other in path.parent.iterdir() if other.is_file()))
    except (OSError, ValueError):
        return ""


Place = tuple[int | str, ...]  # place of a value: keys from the top level down, and indices in lists of tables

# keys whose value names a table in error messages about a list of tables; the first one present is used
NAME_KEYS = ("joint", "guide", "name", "body")

TOKEN_PATTERN = re.compile(
    r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*|[\[\]{}\n]', re.DOTALL
)
"""Pattern of text that can end or continue a TOML statement: a string, a comment, a bracket or a line end."""

KEY_PART_PATTERN = r"""(?:[\w-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""  # pattern of one part of a dotted TOML key

# pattern of a TOML key and the "=" after it
KEY_PATTERN = re.compile(rf"\s*({KEY_PART_PATTERN}(?:\s*\.\s*{KEY_PART_PATTERN})*)\s*=")
# Pattern of the header of a TOML table, "[a.b]" or "[[a.b]]"
HEADER_PATTERN = re.compile(rf"\s*(\[\[?)\s*({KEY_PART_PATTERN}(?:\s*\.\s*{KEY_PART_PATTERN})*)\s*\]")


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Yield line number and text of each statement of a TOML file."""
    start, depth = 0, 0
    for token in TOKEN_PATTERN.finditer(text):
        mark = token[0]
        depth += (mark in "[{") - (mark in "]}")
        if mark == "\n" and depth <= 0:
            yield text.count("\n", 0, start) + 1, text[start : token.start()]
            start, depth = token.end(), 0
    yield text.count("\n", 0, start) + 1, text[start:]


def _keys(dotted: str) -> tuple[str, ...]:
    """Split a dotted key such as ``a."b.c"`` into its parts."""
    tree: Any = tomllib.loads(f"{dotted} = 0")
    keys = []
    while isinstance(tree, dict):
        key, tree = next(iter(tree.items()))
        keys.append(key)
    return tuple(keys)


def _places(text: str) -> Iterator[tuple[int, Place]]:
    """Yield line number and place of each header and each key of a TOML file."""
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
        header, key = HEADER_PATTERN.match(statement), KEY_PATTERN.match(statement)
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
        except tomllib.TOMLDecodeError:  # invalid statement; the TOML parser reports it
            continue


def line_of(text: str, place: Place) -> int:
    """Return the line number of a place, or of the innermost table around it with a header; 0 if there is none."""
    best, nearest = 0, 0
    for line, here in _places(text):
        # the file has a list of tables where one table or no table is expected
        list_of_tables = here[-1:] == (0,) and here[:-1] == place
        if len(here) > best and (place[: len(here)] == here or list_of_tables):
            best, nearest = len(here), line
    return nearest


def table_name(entry: Any) -> str:
    """Return the value of the key that names a table in a list, or ""."""
    return (
        next((str(entry[key]) for key in NAME_KEYS if isinstance(entry.get(key), str)), "") if isinstance(entry, dict) else ""
    )


def place_text(tree: Any, place: Place) -> str:
    """Return a place as a path for ``--set``, such as ``clearance.A.friction``; tables of a list appear by name."""
    text = ""
    for key, there in _steps(tree, place):
        if isinstance(key, int):
            text += f".{table_name(there)}" if table_name(there) else f" ({_ordinal(key + 1)})"
        else:
            text += f".{key}" if text else key
    return text


def value_at(tree: Any, place: Place) -> Any:
    """Return the value at a place of parsed TOML; None if there is none."""
    return [tree, *(there for _, there in _steps(tree, place))][-1]


def _steps(tree: Any, place: Place) -> Iterator[tuple[int | str, Any]]:
    """Yield the keys of a place from the top level down, each with the value that it leads to."""
    for key in place:
        if (
            isinstance(key, int) and isinstance(tree, dict) and tree
        ):  # the file has one table where a list of tables is expected
            continue
        try:
            tree = tree[key]
        except (LookupError, TypeError):
            tree = None
        yield key, tree


def _ordinal(number: int) -> str:
    return {1: "the first", 2: "the second", 3: "the third"}.get(number, f"number {number}")


def place_of_name(tree: Any, message: str) -> Place:
    """Return the place of the first table whose name is quoted in an error message; () if there is none."""
    tables = {
        table_name(entry): (section, index)
        for section, entries in reversed(tree.items())
        if isinstance(entries, list)
        for index, entry in reversed(list(enumerate(entries)))
        if table_name(entry)
    }
    return next((tables[name] for name in re.findall(r"'([^']+)'", message) if name in tables), ())
