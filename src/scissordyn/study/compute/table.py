"""The tables of a study's file: which columns there are, and rows that are checked by their digests."""

from __future__ import annotations

import json
import sqlite3
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.run.answer.measure import COMPONENT_UNIT
from scissordyn.study.ask.description import Study

MOST_COLUMNS = 1900
"""SQLite has at most 2000 columns in a table; the numbers of wider cases are the bytes of one column."""

PART = 100_000
"""Rows that are read at once."""

FIRST = ("number", "status", "cause", "warnings", "digest")
"""Columns of the table of cases before those of its numbers."""


BROKEN = (sqlite3.Error, UnicodeError, OverflowError, MemoryError)
"""What reading a file may raise in which bytes are changed."""

CHANGED = "not what was written"
UNREADABLE = "cannot be read"


@dataclass(frozen=True)
class Array:
    """Numbers of each case: dimensions beside the case, attributes, and the column of each number."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    attrs: dict[str, Any]
    columns: tuple[str, ...]


@dataclass(frozen=True)
class Columns:
    """What the numbers of a case are, and the names along the dimensions of its arrays."""

    arrays: tuple[Array, ...]
    labels: dict[str, tuple[tuple[str, ...], tuple[str, ...]]]

    @staticmethod
    def titles(name: str, dims: Sequence[str], labels: Mapping[str, Any], taken: set[str]) -> tuple[str, ...]:
        """The column of each number of an array, ``A.peak_force``; SQLite does not tell A from a."""
        titles = []
        for place in product(*(labels[dim][1] for dim in dims)):
            title, count = (first := ".".join([*place, name])), 1
            while title.lower() in taken.union(FIRST, ("numbers",)):
                count += 1
                title = f"{first} {count}"
            taken.add(title.lower())
            titles.append(title)
        return tuple(titles)

    @property
    def width(self) -> int:
        return sum(len(array.columns) for array in self.arrays)

    @property
    def names(self) -> list[str]:
        numbers = [name for array in self.arrays for name in array.columns]
        return [*FIRST, *(["numbers"] if self.width > MOST_COLUMNS else numbers)]

    def matrix(self, values: Mapping[str, np.ndarray], count: int) -> np.ndarray:
        """The numbers of some cases, a row each; NaN where there are none."""
        filled = [
            np.reshape(values[array.name], (count, -1))
            if array.name in values
            else np.full((count, len(array.columns)), np.nan)
            for array in self.arrays
        ]
        numbers = np.hstack(filled).astype(float) + 0.0  # SQLite has no negative zero
        numbers[np.isnan(numbers)] = np.nan  # and no NaN, which is NULL there
        return numbers

    def split(self, matrix: np.ndarray) -> Iterator[tuple[Array, np.ndarray]]:
        """The array of each kind of numbers along the cases."""
        first = 0
        for array in self.arrays:
            part = matrix[:, first : first + len(array.columns)]
            yield array, np.ascontiguousarray(part).reshape(len(matrix), *array.shape)
            first += len(array.columns)


def column(parameter: str) -> str:
    """Name of the array of a parameter path; NetCDF would make a group of a slash."""
    return parameter.replace("/", "_")


def columns_of(study: Study, pilot: xr.Dataset) -> Columns:
    """The columns of a study, by the dimensions and units of a few of its cases."""
    chosen, arrays, taken = {factor.path for factor in study.factors}, list[Array](), set[str]()
    labels: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {}
    for name in (*study.factor_names, *study.measure_names):
        variable, measured = pilot[name], name in study.measure_names
        dims = tuple(map(str, variable.dims[1:])) if measured else ()
        for label in (*dims, *([COMPONENT_UNIT] if dims and COMPONENT_UNIT in variable.coords else [])):
            labels[label] = tuple(map(str, pilot[label].dims)), tuple(map(str, pilot[label].values.tolist()))
        about = {"role": "measure"} if measured else {"role": "factor" if name in chosen else "uncertain", "address": name}
        titles = Columns.titles(name, dims, labels, taken)
        shape = tuple(pilot.sizes[dim] for dim in dims)
        arrays.append(Array(column(name), dims, shape, {**variable.attrs, **about}, titles))
    return Columns(tuple(arrays), labels)


def quoted(name: str) -> str:
    """A name in a command of SQL."""
    return '"' + name.replace('"', '""') + '"'


def create(connection: sqlite3.Connection, columns: Columns) -> None:
    """Make the tables of cases, blocks and notes."""
    numbers = columns.names[len(FIRST) :]
    kind = "BLOB" if columns.width > MOST_COLUMNS else "REAL"
    texts = "number INTEGER PRIMARY KEY, status INTEGER, cause TEXT, warnings TEXT, digest BLOB"
    connection.execute(f"CREATE TABLE cases ({', '.join([texts, *(f'{quoted(name)} {kind}' for name in numbers)])})")
    connection.execute(
        "CREATE TABLE blocks (number INTEGER PRIMARY KEY, rows INTEGER, seconds REAL, integration_seconds REAL, "
        "cases INTEGER, attempts INTEGER, digest BLOB)"
    )
    connection.execute("CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT, digest BLOB)")


def digest(*parts: object) -> bytes:
    """Of a note or of a block."""
    return blake2b(json.dumps(parts).encode(), digest_size=8).digest()


def _row_digests(numbers: Sequence[int], status: Sequence[int], texts: Sequence[bytes], matrix: np.ndarray) -> list[bytes]:
    content, width = matrix.tobytes(), 8 * matrix.shape[1]
    pack = struct.Struct("<qb").pack
    return [
        blake2b(pack(number, code) + content[k * width : (k + 1) * width] + text, digest_size=8).digest()
        for k, (number, code, text) in enumerate(zip(numbers, status, texts, strict=True))
    ]


def insert(
    connection: sqlite3.Connection,
    columns: Columns,
    cases: np.ndarray,
    status: np.ndarray,
    texts: Sequence[tuple[str, str]],
    matrix: np.ndarray,
) -> None:
    """Write rows of the table of cases; texts are cause and warnings."""
    numbers, codes = cases.tolist(), status.tolist()
    digests = _row_digests(numbers, codes, [f"{cause}\0{warned}".encode() for cause, warned in texts], matrix)
    wide = columns.width > MOST_COLUMNS
    values: Any = [(row.tobytes(),) for row in matrix] if wide else matrix.tolist()
    rows = ((n, s, *t, d, *v) for n, s, t, d, v in zip(numbers, codes, texts, digests, values, strict=True))
    names = ", ".join(map(quoted, columns.names))
    places = ", ".join("?" * len(columns.names))
    connection.executemany(f"INSERT OR REPLACE INTO cases ({names}) VALUES ({places})", rows)


@dataclass(frozen=True)
class Rows:
    """Rows of cases that are as they were written, in the order of their numbers, and what is wrong with others."""

    cases: np.ndarray
    status: np.ndarray
    texts: list[tuple[str, str]]
    matrix: np.ndarray
    damaged: dict[int, str]


def read(connection: sqlite3.Connection, columns: Columns, cases: int) -> Rows:
    """All rows, each checked by its digest."""
    parts = [_part(connection, columns, first, min(first + PART, cases) - 1) for first in range(0, cases, PART)]
    if len(parts) == 1:
        return parts[0]
    numbers, status = np.concatenate([part.cases for part in parts]), np.concatenate([part.status for part in parts])
    texts = [pair for part in parts for pair in part.texts]
    matrix = np.concatenate([part.matrix for part in parts])
    return Rows(numbers, status, texts, matrix, {case: why for part in parts for case, why in part.damaged.items()})


def _part(connection: sqlite3.Connection, columns: Columns, first: int, last: int) -> Rows:
    names = ", ".join(map(quoted, columns.names))
    raw, damaged = _readable(connection, f"SELECT {names} FROM cases WHERE number BETWEEN ? AND ?", first, last)
    try:
        matrix = _numbers(raw, columns)
    except (TypeError, ValueError):  # a row that has no numbers where they belong
        raw, matrix = _with_numbers(raw, columns, damaged)
    usable = [_has_types(row) for row in raw]
    damaged |= {row[0]: CHANGED for row, fits in zip(raw, usable, strict=True) if not fits}
    raw, matrix = [row for row, fits in zip(raw, usable, strict=True) if fits], matrix[usable]
    numbers, codes = [row[0] for row in raw], [row[1] for row in raw]
    expected = _row_digests(numbers, codes, [row[2] + b"\0" + row[3] for row in raw], matrix)
    same = np.array([row[4] == right for row, right in zip(raw, expected, strict=True)], bool)
    damaged |= {number: CHANGED for number, fits in zip(numbers, same, strict=True) if not fits}
    texts = [(row[2].decode(), row[3].decode()) for row, fits in zip(raw, same, strict=True) if fits]
    return Rows(np.array(numbers, int)[same], np.array(codes, np.int8)[same], texts, matrix[same], damaged)


def _has_types(row: Sequence[Any]) -> bool:
    return isinstance(row[1], int) and -128 <= row[1] < 128 and isinstance(row[2], bytes) and isinstance(row[3], bytes)


def _with_numbers(raw: list[Any], columns: Columns, damaged: dict[int, str]) -> tuple[list[Any], np.ndarray]:
    """The rows that have numbers where they belong; the others are noted as damaged."""
    rows, parts = list[Any](), [np.empty((0, columns.width))]
    for row in raw:
        try:
            parts.append(_numbers([row], columns))
            rows.append(row)
        except (TypeError, ValueError):
            damaged[row[0]] = CHANGED
    return rows, np.concatenate(parts)


def _numbers(raw: Sequence[tuple[Any, ...]], columns: Columns) -> np.ndarray:
    """The numbers of rows; NULL is NaN."""
    if not raw:
        return np.empty((0, columns.width))
    if columns.width > MOST_COLUMNS:
        return np.stack([np.frombuffer(row[5], float, columns.width) for row in raw])
    return np.array([row[5:] for row in raw], float).reshape(len(raw), columns.width)


def _readable(connection: sqlite3.Connection, query: str, first: int, last: int) -> tuple[list[Any], dict[int, str]]:
    """Rows between two numbers, without those on pages of the file that cannot be read."""
    try:
        rows = connection.execute(query, (first, last)).fetchall()
        if all(isinstance(row[0], int) for row in rows):
            numbers = np.array([row[0] for row in rows], int)
            if not numbers.size or (np.all(np.diff(numbers) > 0) and numbers[0] >= first and numbers[-1] <= last):
                return rows, {}
    except BROKEN as error:
        if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
            raise
    if first == last:
        return [], {first: UNREADABLE}
    middle = (first + last) // 2
    below, above = _readable(connection, query, first, middle), _readable(connection, query, middle + 1, last)
    return [*below[0], *above[0]], {**below[1], **above[1]}
