"""The store of a study, one SQLite file with a row for each case, written by one process."""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError, whole_number
from scissordyn.file.output_file import put_file, remove_unfinished
from scissordyn.run.engine import STATUSES
from scissordyn.studies.ask.description import OwnMeasure, Study, from_plain, to_plain
from scissordyn.studies.ask.design import INTEGER_MAX, Design
from scissordyn.studies.compute import table
from scissordyn.warning import LISTED_MAX

PENDING, COMPLETE, FAILED = range(len(STATUSES))  # Status of a case; one without a row is pending
FORMAT_VERSION = 3  # SQLite's `user_version` of a study's file: version of its format
APPLICATION_ID = 0x73636973  # SQLite's `application_id` of a study's file, "scis"

# Names of the values that a study's file stores once, about all cases
NOTE_NAMES = ("study", "fingerprint", "columns", "block", "cases")

# Names of times and counts that a study's file stores for each block of cases
TIME_NAMES = ("seconds", "integration_seconds", "cases", "attempts")

# Meaning of the text columns of a study's table of cases, by name
TEXTS = {"cause": "why a case failed", "warnings": "of a complete case, one a line"}

LOCK_SECONDS_MAX = 60.0  # [s] longest time that a writer of a study's file waits for readers


class StoreError(ScissordynError):
    """Error of the disk: a store can no longer be read or written."""


@dataclass(frozen=True)
class BlockResult:
    """Rows of a block: values by array, status, cause and warnings of each case, and times."""

    cases: np.ndarray
    values: Mapping[str, np.ndarray]
    status: np.ndarray
    texts: list[tuple[str, str]]
    times: Sequence[float] = (0.0, 0.0, 0.0)  # Seconds, seconds of integration, and number of timed cases


class Store:
    """The store of one study, in a file.

    Each row has a digest: the case of a changed row is pending again. A block of cases is written in one transaction: after a
    kill or on a full disk it is complete or absent.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        text = os.fspath(path)
        if "://" in text:
            raise InputError(f"'{text}' as a store", "a file on a disk", "-o study.db")
        self.path = str(Path(text).expanduser().absolute())
        self._writer: sqlite3.Connection | None = None

    # --- beginning ------------------------------------------------------------------------------------------------------

    def exists(self) -> bool:
        """Return True if there is a study; raise `InputError` if there is anything else."""
        path = Path(self.path)
        with _one_line(self.path):
            if path.is_dir():
                raise self._no_study(path)
            if not path.exists() or not path.stat().st_size:
                return False
        try:
            with self._open() as connection:
                pragmas = [connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version")]
        except sqlite3.OperationalError as error:
            raise StoreError(f"'{self.path}' cannot be read: {error}") from None
        except table.READ_ERRORS:
            pragmas = [0, 0]
        application, version = pragmas
        if application != APPLICATION_ID:
            raise self._no_study(path)
        if version != FORMAT_VERSION:
            what = f"'{path}' is a study of format {version}, and not of format {FORMAT_VERSION}"
            raise InputError(what, "the version of scissordyn that made it", "-o another.db")
        return True

    def check_writable(self) -> None:
        """Raise `InputError` if the store cannot be written; called before anything is computed for it."""
        target = Path(os.path.realpath(self.path))
        if not target.parent.is_dir():
            raise InputError(f"'{self.path}' as a store: no folder '{target.parent}'", "a folder that exists", "-o study.db")
        # SQLite writes its journal next to the file
        for place in (target.parent, target):
            if place.exists() and not os.access(place, os.W_OK):
                raise InputError(f"'{place}' can only be read", "a file and folder that can be written", "-o study.db")

    def has_content(self) -> bool:
        """Return True if the file exists and is not empty."""
        return Path(self.path).is_file() and Path(self.path).stat().st_size > 0

    def _no_study(self, path: Path) -> InputError:
        return InputError(f"'{path}' is not a study, or its first page is damaged", "the file of a study", "-o study.db")

    def create(self, study: Study, pilot: xr.Dataset, block: int) -> None:
        """Create the file of a study; `pilot` has all measures of at least one case, and `block` is the cases per block."""
        self.create_with(table.columns_of(study, pilot), study.to_plain(), study.fingerprint(), block, study.cases)

    def create_with(self, columns: table.Columns, study: Any, fingerprint: Mapping[str, str], block: int, cases: int) -> None:
        """Create the file with its notes, complete or not at all."""
        values = (study, fingerprint, to_plain(columns), block, cases)
        with self._new_file(columns, dict(zip(NOTE_NAMES, values, strict=True)), instead=False):
            pass

    @contextmanager
    def _new_file(self, columns: table.Columns, notes: Mapping[str, Any], *, instead: bool) -> Iterator[sqlite3.Connection]:
        """Create a store without rows in memory; at the end it is written in one piece, as a new file or as a replacement."""
        with _one_line(self.path), closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
            connection.execute("BEGIN")
            table.create(connection, columns)
            for name, value in notes.items():
                _note(connection, name, value)
            yield connection
            connection.execute("COMMIT")
            connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            connection.execute(f"PRAGMA user_version = {FORMAT_VERSION}")
            content = connection.serialize()
        with _one_line(self.path):
            if not instead and not self.has_content():
                Path(os.path.realpath(self.path)).unlink(missing_ok=True)  # an empty file
            try:
                put_file(self.path, content, new=not instead)
            except FileExistsError:
                what = f"'{self.path}' was made by another process meanwhile"
                raise InputError(what, "the same command again") from None

    # --- notes ----------------------------------------------------------------------------------------------------------

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        """Open a connection for the writer, or a connection for reading."""
        if self._writer is not None:
            yield self._writer
            return
        with closing(self._connect()) as connection:
            yield connection

    def _connect(self) -> sqlite3.Connection:
        uri = f"{Path(os.path.realpath(self.path)).as_uri()}?mode=rw"
        connection = sqlite3.connect(uri, timeout=LOCK_SECONDS_MAX, uri=True, isolation_level=None, check_same_thread=False)
        connection.text_factory = bytes  # a changed byte may be no text
        connection.execute("PRAGMA cell_size_check = 1")
        return connection

    def _value(self, name: str) -> Any:
        with self._reading() as connection:
            row = connection.execute("SELECT value, digest FROM notes WHERE name = ?", (name,)).fetchone()
        if row is None or not isinstance(row[0], bytes) or row[1] != table.digest(name, row[0].decode(errors="replace")):
            what = f"the note '{name}' in '{self.path}' is damaged"
            raise InputError(what, "a copy that is whole; any tool for SQLite reads the rows", "-o another.db")
        with self._sound(name):
            return json.loads(row[0])

    @contextmanager
    def _sound(self, name: str) -> Iterator[None]:
        """Raise `InputError` if a note has the right digest but unusable content, as written by another program."""
        try:
            yield
        except ScissordynError:
            raise
        except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError):
            what = f"the note '{name}' in '{self.path}' is not one that scissordyn writes"
            raise InputError(what, "a copy that is whole; any tool for SQLite reads the rows", "-o another.db") from None

    @contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        if self._writer is None and not self.has_content():
            raise InputError(f"no study at '{self.path}'", "the store of a study")
        with _one_line(self.path), self._open() as connection:
            yield connection

    def study(
        self, *, allow_code: Sequence[Path] = (), own_measures: Sequence[OwnMeasure] = (), reading: bool = False
    ) -> Study:
        """Return the study of the store; with `reading`, no function of the user is needed or executed."""
        plain = self._value("study")
        with self._sound("study"):
            study = Study.from_plain(plain, allow_code=allow_code, own_measures=own_measures, reading=reading)
            missing = {*map(table.column, study.factor_names), *study.measure_names}.difference(self._columns.array_names)
            if missing:
                raise LookupError(f"no columns of {', '.join(missing)}")
            return study

    def design(self) -> Design:
        """Return the design with its present number of points."""
        plain = self._value("study")
        with self._sound("study"):
            return Design(**plain["design"])

    def check(self, study: Study) -> None:
        """Raise `InputError` if the store belongs to another study, or to another version of the program."""
        stored = self._value("fingerprint")
        with self._sound("fingerprint"):
            differs = [name for name, digest in study.fingerprint().items() if stored.get(name) != digest]
        if differs:
            raise InputError(
                f"'{self.path}' holds another study (differs in {', '.join(differs)})",
                "the store of the same study, or a name that is not taken",
                "-o another.db",
            )

    @property
    def _columns(self) -> table.Columns:
        plain = self._value("columns")
        with self._sound("columns"):
            columns: table.Columns = from_plain(table.Columns, plain)
            columns.check()
        return columns

    @property
    def block(self) -> int:
        return self._count("block")

    @property
    def cases(self) -> int:
        return whole_number("cases", self._count("cases"))

    def _count(self, name: str) -> int:
        count = self._value(name)
        with self._sound(name):
            return whole_number(name, count, 1, INTEGER_MAX)

    # --- rows -----------------------------------------------------------------------------------------------------------

    def _rows(self) -> table.Rows:
        """Return the intact rows of all cases; rows that are missing from a block count as damaged."""
        cases, block, columns = self.cases, self.block, self._columns
        with self._reading() as connection:
            rows = table.read(connection, columns, cases)
            written = _blocks(connection)
        is_intact = np.zeros(cases, bool)
        is_intact[rows.cases] = True
        for number, (size, _) in written.items():
            first = number * block
            for case in first + np.flatnonzero(~is_intact[first : min(first + min(size, block), cases)]):
                rows.damaged.setdefault(int(case), "missing")
        return rows

    def status(self) -> np.ndarray:
        """Return the status of every case, shape (cases,); damaged rows are pending."""
        rows = self._rows()
        return rows.filled(self.cases, rows.status, PENDING)

    def damage(self) -> dict[int, str]:
        """Return the cases whose rows were damaged after they were written, and why; they count as pending."""
        return dict(sorted(self._rows().damaged.items()))

    def times(self) -> dict[str, np.ndarray]:
        """Return seconds, seconds of integration, cases and attempts of every block; zero where they are unreadable."""
        with self._reading() as connection:
            written = _blocks(connection)
        noted = np.zeros((-(-self.cases // self.block), len(TIME_NAMES)))
        for number, (_, times) in written.items():
            if 0 <= number < len(noted):
                noted[number] = times
        return dict(zip(TIME_NAMES, noted.T, strict=True))

    def write(self, result: BlockResult) -> None:
        """Write the rows of cases of one block, all or none, and add its times to those that the store has."""
        cases, columns = result.cases, self._columns
        block = int(cases[0]) // self.block
        ends = block * self.block, (block + 1) * self.block - 1
        with self.alone(), self._transaction() as connection:
            matrix = columns.matrix(result.values, cases.size)
            table.insert(connection, columns, table.Rows(cases, result.status, result.texts, matrix))
            size = connection.execute("SELECT count(*) FROM cases WHERE number BETWEEN ? AND ?", ends).fetchone()[0]
            before = _blocks(connection, f"WHERE number = {block}").get(block, (0, (0.0,) * 4))[1]
            added = [float(old + new) for old, new in zip(before, (*result.times, 1.0), strict=True)]
            _write_block(connection, block, size, added)

    def extend(self, study: Study) -> None:
        """Change the study to more points of the same design."""
        with self.alone(), self._transaction() as connection:
            _note(connection, "study", study.to_plain())
            _note(connection, "cases", study.cases)

    def conclude(self, facts: Sequence[Mapping[str, Any]]) -> None:
        """Write the answers of the study as plain data, for other tools."""
        with self.alone(), self._transaction() as connection:
            _note(connection, "conclusions", facts)

    def describe_search(self, summary: Mapping[str, Any]) -> None:
        """Write how a search along derivatives has ended."""
        with self.alone(), self._transaction() as connection:
            _note(connection, "search", summary)

    def search(self) -> dict[str, Any]:
        """Return how a search along derivatives has ended; empty before its end."""
        with self._reading() as connection:
            has_ended = connection.execute("SELECT 1 FROM notes WHERE name = 'search'").fetchone()
        return dict(self._value("search")) if has_ended else {}

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """Commit the changes of the block, or undo them after an error."""
        assert self._writer is not None
        with _one_line(self.path):
            try:
                yield self._writer
                self._writer.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):
                    self._writer.execute("ROLLBACK")
                raise
            finally:
                with suppress(sqlite3.Error):
                    self._writer.execute("BEGIN IMMEDIATE")

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Exclude other writing processes; damaged rows are deleted first."""
        if self._writer is not None:
            yield
            return
        self.check_writable()
        try:
            self._writer = self._locked()
            with suppress(OSError):
                remove_unfinished(self.path)
            damaged = self._rows()
            if damaged.damaged:
                self._drop_damaged_rows(damaged)
            yield
        finally:
            if self._writer is not None:
                self._writer.close()
                self._writer = None

    def _locked(self) -> sqlite3.Connection:
        """Return a connection that holds the lock for writing, which does not block readers."""
        with _one_line(self.path):
            number = os.stat(self.path).st_ino
            connection = self._connect()
            try:
                connection.execute("PRAGMA busy_timeout = 0")
                connection.execute("BEGIN IMMEDIATE")
                connection.execute(f"PRAGMA busy_timeout = {int(1e3 * LOCK_SECONDS_MAX)}")
                if os.stat(self.path).st_ino == number:
                    return connection
            except BaseException as error:
                connection.close()
                if not isinstance(error, sqlite3.OperationalError) or "locked" not in str(error):
                    raise
            connection.close()
        raise InputError(f"'{self.path}' is being computed by another process", "one process at a time")

    def _drop_damaged_rows(self, rows: table.Rows) -> None:
        """Replace the file by one with only the intact rows, as SQLite cannot write to pages that it cannot read."""
        notes = {name: self._value(name) for name in NOTE_NAMES}
        with self._reading() as connection:
            written = _blocks(connection)
        columns = self._columns
        with self._new_file(columns, notes, instead=True) as connection:
            table.insert(connection, columns, rows)
            damaged = {case // notes["block"] for case in rows.damaged}
            for number, (size, times) in written.items():
                _write_block(connection, number, 0 if number in damaged else size, times)
        assert self._writer is not None
        self._writer.close()
        self._writer = None
        self._writer = self._locked()

    def results(self) -> xr.Dataset:
        """Return all arrays in memory, with point, sample and member of each case.

        Cases of damaged rows are pending and without values; the attribute `damage` lists them, if there are any.
        """
        rows, cases, plain, columns = self._rows(), self.cases, self._value("study"), self._columns
        variables: dict[str, Any] = {}
        for array, values in columns.split(rows.matrix):
            variables[array.name] = (("case", *array.dims), rows.filled(cases, values, np.nan), array.attrs)
        texts = rows.filled(cases, np.array(rows.texts, object).reshape(-1, len(TEXTS)), "")
        for k, (name, meaning) in enumerate(TEXTS.items()):
            variables[name] = ("case", texts[:, k], {"long_name": meaning})
        about = {"long_name": "status", "flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
        variables["status"] = ("case", rows.filled(cases, rows.status, PENDING), about)
        labels = {name: (dims, np.array(texts, object)) for name, (dims, texts) in columns.labels.items()}
        with self._sound("study"):
            samples, members = int(plain["sampling"]["samples"]), int(plain["members"])
        point, rest = np.divmod(np.arange(cases), samples * members)
        sample, member = np.divmod(rest, members)
        places = {"point": ("case", point), "sample": ("case", sample), "member": ("case", member)}
        attrs = {"title": "scissordyn study", "samples": samples, "members": members}
        if rows.damaged:
            attrs["damage"] = damage_text(rows.damaged)
        return xr.Dataset(variables, {**labels, **places}, attrs)


def damage_text(damaged: Mapping[int, str]) -> str:
    """Return the cases of damaged rows in words."""
    shown = [f"{number} ({why})" for number, why in sorted(damaged.items())[:LISTED_MAX]]
    more = [f"{len(damaged) - LISTED_MAX} more"] if len(damaged) > LISTED_MAX else []
    what = "row is damaged and its case" if len(damaged) == 1 else "rows are damaged and their cases"
    return f"{len(damaged)} {what} pending: {', '.join(shown + more)}"


def _note(connection: sqlite3.Connection, name: str, value: Any) -> None:
    text = json.dumps(value)
    row = (name, text, table.digest(name, text))
    connection.execute("INSERT OR REPLACE INTO notes (name, value, digest) VALUES (?, ?, ?)", row)


def _write_block(connection: sqlite3.Connection, number: int, size: int, times: Sequence[float]) -> None:
    row = (number, size, *times[:2], *map(int, times[2:]))
    connection.execute("INSERT OR REPLACE INTO blocks VALUES (?, ?, ?, ?, ?, ?, ?)", (*row, table.digest(*row)))


def _blocks(connection: sqlite3.Connection, where: str = "") -> dict[int, tuple[int, tuple[float, ...]]]:
    """Return the number of written rows and the times of each block, without unreadable blocks."""
    try:
        rows = connection.execute(f"SELECT * FROM blocks {where}").fetchall()
    except table.READ_ERRORS as error:
        if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
            raise
        return {}
    return {row[0]: (row[1], row[2:6]) for row in rows if _is_whole(row)}


def _is_whole(row: tuple[Any, ...]) -> bool:
    return all(isinstance(cell, (int, float)) for cell in row[:6]) and row[6] == table.digest(*row[:6])


@contextmanager
def _one_line(path: str) -> Iterator[None]:
    """Raise errors of the disk and of the database as errors of one line."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error) or type(error).__name__
        raise StoreError(f"'{path}' cannot be read or written: {reason}; completed cases are kept") from error
    except table.READ_ERRORS as error:
        raise StoreError(f"'{path}' cannot be read or written: {error}; completed cases are kept") from error
