"""Tables of a study's file: their columns, and rows that are checked by their digests."""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from itertools import pairwise, product
from struct import Struct, error, pack
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.plot.scale import Scale, scale_of
from scissordyn.studies.ask.description import Study

CHUNK_CASES_MAX = 100_000  # Largest number of cases in memory at once: in a worker's block, or read from a study's file

# Largest number of columns of numbers in a study's file; SQLite has at most 2000. More are packed into one column
COLUMNS_MAX = 1900

# Columns of a study's table of cases before the columns of numbers
FIRST_COLUMNS = ("number", "status", "cause", "warnings", "digest")

# Errors that SQLite and Python raise for a study's file with damaged bytes
READ_ERRORS = (sqlite3.Error, UnicodeError, OverflowError, MemoryError)
ROW = Struct("<qb")  # Binary format of a case's number and status for its digest

NAN = float("nan")  # Not a number, for NULL in a study's file

SLOPES = "derivative"
"""Variable of a study's Dataset with derivatives of responses (dimension `SLOPE_OF`) by varied parameters (`SLOPE_BY`).

It is NaN where a derivative is not valid.
"""

# Dimensions of the derivatives in a study's Dataset: responses, and varied parameters
SLOPE_OF, SLOPE_BY = "derivative_of", "derivative_by"

CHANGED = "not what was written"  # reason why a row of a study's table is damaged: its digest differs
UNREADABLE = "cannot be read"  # reason why a row of a study's table is damaged: SQLite cannot read it


@dataclass(frozen=True)
class Array:
    """Variable with a value for each case: further dimensions, attributes, and the column of each number."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    attrs: dict[str, Any]
    columns: tuple[str, ...]


@dataclass(frozen=True)
class Columns:
    """Columns of a case's row, and the names along the dimensions of its arrays."""

    arrays: tuple[Array, ...]
    labels: dict[str, tuple[tuple[str, ...], tuple[str, ...]]]

    @classmethod
    def of(cls, variables: Mapping[str, xr.DataArray]) -> Columns:
        """Return the columns of a store: one for each variable along the cases, and for each entry of its other dimensions."""
        arrays, taken = list[Array](), set[str]()
        labels: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {}
        for name, variable in variables.items():
            dims = tuple(map(str, variable.dims[1:]))
            for label in (*dims, *(unit for dim in dims if (unit := f"{dim}_unit") in variable.coords)):
                labels[label] = tuple(map(str, variable[label].dims)), tuple(map(str, variable[label].values.tolist()))
            address = str(variable.attrs.get("address", name))
            places = product(*(labels[dim][1] for dim in dims))
            titles = tuple(_title(".".join([*place, address]), taken) for place in places)
            arrays.append(Array(name, dims, variable.shape[1:], dict(variable.attrs), titles))
        return cls(tuple(arrays), labels)

    def check(self) -> None:
        """Raise `ValueError` or `TypeError` unless shapes, titles and labels of the arrays fit each other."""
        for array in self.arrays:
            if not isinstance(array.name, str) or not all(isinstance(title, str) for title in array.columns):
                raise TypeError(f"array {array.name!r}: names must be text")
            if not all(type(size) is int and size >= 0 for size in array.shape):
                raise TypeError(f"array '{array.name}': shape {array.shape!r} must be whole numbers")
            if array.shape != tuple(len(self.labels[dim][1]) for dim in array.dims):
                raise ValueError(f"array '{array.name}': shape {array.shape!r} must have an entry for each label")
            if math.prod(array.shape) != len(array.columns):
                raise ValueError(f"array '{array.name}': shape {array.shape!r} needs as many columns")
            dict(array.attrs)

    @property
    def array_names(self) -> list[str]:
        return [array.name for array in self.arrays]

    @property
    def width(self) -> int:
        return sum(len(array.columns) for array in self.arrays)

    @property
    def names(self) -> list[str]:
        numbers = [name for array in self.arrays for name in array.columns]
        return [*FIRST_COLUMNS, *(["numbers"] if self.width > COLUMNS_MAX else numbers)]

    def matrix(self, values: Mapping[str, np.ndarray], count: int) -> np.ndarray:
        """Return the values of some cases, one row each; NaN where a case has none."""
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
        """Return the array of each variable along the cases."""
        first = 0
        for array in self.arrays:
            part = matrix[:, first : first + len(array.columns)]
            yield array, np.ascontiguousarray(part).reshape(len(matrix), *array.shape)
            first += len(array.columns)


def column(parameter: str) -> str:
    """Return the variable name of a parameter path, without slashes, which would make groups in NetCDF."""
    return parameter.replace("/", "_")


def about_number(study: Study, results: xr.Dataset, name: str) -> dict[str, Any]:
    """Return attributes of a varied parameter: its unit and the user's unit, or its names."""
    shown = next((factor.shown for factor in study.varied if factor.name == name), {})
    return {"units": results[column(name)].attrs.get("units", "1"), **shown}


def number_scale(study: Study, results: xr.Dataset, name: str, *values: float) -> Scale:
    """Return the scale and unit in which values of a factor are shown."""
    return scale_of(xr.DataArray(list(values), attrs=about_number(study, results, name)))


def chosen_numbers(study: Study, results: xr.Dataset) -> dict[str, Any]:
    """Return the chosen parameter values of each point, as variables along `point`."""
    variables: dict[str, Any] = {}
    for factor in study.factors:
        variable = results[column(factor.path)]
        variables[factor.path] = ("point", study.cells(variable.values)[:, 0, 0], {**variable.attrs, **factor.shown})
    return variables


def _title(first: str, taken: set[str]) -> str:
    """Return an unused column title such as ``A.peak_force``; SQLite does not distinguish A from a."""
    title, count = first, 1
    while title.lower() in taken.union(FIRST_COLUMNS, ("numbers",)):
        count += 1
        title = f"{first} {count}"
    taken.add(title.lower())
    return title


def columns_of(study: Study, runs: xr.Dataset) -> Columns:
    """Return the columns of a study, from the dimensions and units of some of its cases."""
    chosen = {factor.path for factor in study.factors}
    variables = {
        column(name): runs[name].assign_attrs(role="factor" if name in chosen else "uncertain", address=name)
        for name in study.factor_names
    }
    variables |= {name: runs[name].assign_attrs(role="measure") for name in study.measure_names}
    return Columns.of(variables | ({SLOPES: runs[SLOPES].assign_attrs(role="derivative")} if study.gradients else {}))


def quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def create(connection: sqlite3.Connection, columns: Columns) -> None:
    """Make the tables of cases, blocks and notes."""
    numbers = columns.names[len(FIRST_COLUMNS) :]
    kind = "BLOB" if columns.width > COLUMNS_MAX else "REAL"
    texts = "number INTEGER PRIMARY KEY, status INTEGER, cause TEXT, warnings TEXT, digest BLOB"
    connection.execute(f"CREATE TABLE cases ({', '.join([texts, *(f'{quoted(name)} {kind}' for name in numbers)])})")
    connection.execute(
        "CREATE TABLE blocks (number INTEGER PRIMARY KEY, rows INTEGER, seconds REAL, integration_seconds REAL, "
        "cases INTEGER, attempts INTEGER, digest BLOB)"
    )
    connection.execute("CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT, digest BLOB)")


def digest(*parts: object) -> bytes:
    """Return the digest of a note or of a block."""
    return blake2b(json.dumps(parts).encode(), digest_size=8).digest()


def _row_digest(number: int, status: int, numbers: bytes, cause: bytes, warned: bytes) -> bytes:
    return blake2b(ROW.pack(number, status) + numbers + cause + b"\0" + warned, digest_size=8).digest()


@dataclass(frozen=True)
class Rows:
    """Intact rows of cases in the order of their numbers, and the faults of damaged rows."""

    cases: np.ndarray
    status: np.ndarray
    texts: list[tuple[str, str]]  # Cause and warnings
    matrix: np.ndarray
    damaged: dict[int, str] = field(default_factory=dict)

    def filled(self, cases: int, values: np.ndarray, nothing: object) -> np.ndarray:
        """Return an array with one row for each of `cases`, with `nothing` in the rows that are missing here."""
        all_rows = np.full((cases, *values.shape[1:]), nothing, values.dtype)
        all_rows[self.cases] = values
        return all_rows


def insert(connection: sqlite3.Connection, columns: Columns, rows: Rows) -> None:
    """Write rows of the table of cases."""
    wide, cells = columns.width > COLUMNS_MAX, []
    for number, code, text, numbers in zip(rows.cases.tolist(), rows.status.tolist(), rows.texts, rows.matrix, strict=True):
        content = numbers.tobytes()
        digest = _row_digest(number, code, content, *(part.encode() for part in text))
        cells.append((number, code, *text, digest, *([content] if wide else numbers.tolist())))
    names = ", ".join(map(quoted, columns.names))
    places = ", ".join("?" * len(columns.names))
    connection.executemany(f"INSERT OR REPLACE INTO cases ({names}) VALUES ({places})", cells)


def read(connection: sqlite3.Connection, columns: Columns, cases: int) -> Rows:
    """Read all rows and check each by its digest."""
    query = f"SELECT {', '.join(map(quoted, columns.names))} FROM cases WHERE number BETWEEN ? AND ?"
    numbers, status, texts = list[int](), list[int](), list[tuple[str, str]]()
    content, damaged = bytearray(), dict[int, str]()
    for first in range(0, cases, CHUNK_CASES_MAX):
        rows, unreadable = _readable(connection, query, first, min(first + CHUNK_CASES_MAX, cases) - 1)
        damaged |= dict.fromkeys(unreadable, UNREADABLE)
        for row in rows:
            if (whole := _whole_numbers(row, columns.width)) is None:
                damaged[row[0]] = CHANGED
                continue
            numbers.append(row[0])
            status.append(row[1])
            texts.append((row[2].decode(), row[3].decode()))
            content += whole
    matrix = np.frombuffer(bytes(content)).reshape(len(numbers), columns.width)
    return Rows(np.array(numbers, int), np.array(status, np.int8), texts, matrix, damaged)


def _whole_numbers(row: Sequence[Any], width: int) -> bytes | None:
    """Return the values of a row as bytes, with NULL as NaN; None if the row differs from what was written."""
    number, status, cause, warned, right, *values = row
    try:
        content = values[0] if width > COLUMNS_MAX else pack(f"{width}d", *(NAN if v is None else v for v in values))
        same = len(content) == 8 * width and right == _row_digest(number, status, content, cause, warned)
    except (TypeError, error):
        return None
    return content if same else None


def _readable(connection: sqlite3.Connection, query: str, first: int, last: int) -> tuple[list[Any], list[int]]:
    """Read rows between two indices; return them and the indices on unreadable pages of the file."""
    try:
        rows = connection.execute(query, (first, last)).fetchall()
        numbers = [row[0] for row in rows]
        whole = all(isinstance(number, int) and first <= number <= last for number in numbers)
        if whole and all(below < above for below, above in pairwise(numbers)):
            return rows, []
    except READ_ERRORS as failure:
        if isinstance(failure, sqlite3.OperationalError) and "locked" in str(failure):
            raise
    if first == last:
        return [], [first]
    middle = (first + last) // 2
    below, above = _readable(connection, query, first, middle), _readable(connection, query, middle + 1, last)
    return [*below[0], *above[0]], [*below[1], *above[1]]
