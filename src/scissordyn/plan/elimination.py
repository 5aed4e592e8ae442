"""Elimination of linear constraints before a run; a column is the index of a variable."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from scissordyn.errors import AssemblyError
from scissordyn.kernel import F1, I1, entry, kernel
from scissordyn.tolerance import ASSEMBLY_TOL, DATA_TOL

DRIVE_PREFIX = "the drive of"  # First words of a drive constraint's name in messages
Expression = dict[int, float]  # Linear combination: coefficient by column


PIVOT_FRACTION_MIN = 1e-3
"""Smallest preferred pivot of a linear constraint, as a fraction of its largest coefficient.

If no preferred column has such a pivot, any column is used.
"""

CLOSING_DISPLACEMENT_MAX, CLOSING_RATIO_MAX = 0.02, 30.0
"""Limits of the displacement that makes the placed bodies meet all constraints.

The first limit is in mechanism sizes, the second a multiple of the constraints' error before the displacement. Lengths that
need a displacement above both limits are rounded numbers that contradict each other.
"""

Rows = tuple[np.ndarray, np.ndarray, np.ndarray]  # Sparse rows: starts, columns, values


class Solved(NamedTuple):
    """Variables for which constraints have been solved, each as a linear combination of other variables."""

    row: I1  # (columns,) Constraint that was solved for the column; -1 for a free column
    first: I1  # (columns,) First entry of the column's expression
    length: I1  # (columns,) Number of entries
    column: I1  # (capacity,) Column of each entry
    value: F1  # (capacity,) Coefficient of each entry


class Sums(NamedTuple):
    """Scratch arrays in which the terms of one sparse row are added up."""

    total: F1  # (columns,) Coefficient of each column
    listed: I1  # (columns,) 1 for a column in `touched`
    touched: I1  # (columns,) Columns with an entry


DONE, CONTRADICTS, FULL = -1, -2, -3
"""Results of `eliminate` and `expand_rows`: all rows are done; a constraint contradicts earlier ones; arrays are too small."""


def add(*terms: Expression) -> Expression:
    """Return the sum of expressions."""
    total: Expression = {}
    for term in terms:
        for column, coefficient in term.items():
            total[column] = total.get(column, 0.0) + coefficient
    return total


def scaled(factor: float, expression: Expression) -> Expression:
    """Return a multiple of an expression."""
    return {column: factor * coefficient for column, coefficient in expression.items()}


@kernel
def add_to_sums(column, value, entries, sums):
    """Add a coefficient to a column of the row in `sums`, which has entries in `entries` columns; return their new number."""
    if sums.listed[column] == 0:
        sums.listed[column] = 1
        sums.touched[entries] = column
        sums.total[column] = 0.0
        entries += 1
    sums.total[column] += value
    return entries


@kernel
def resolve(columns, values, start, count, solved, sums, round_off):
    """Write an equation to `sums` with solved variables replaced; return the number of variables that `sums.touched` lists.

    A solved column is replaced by its expression, in the order of solution: an expression contains only columns solved later or
    not at all.
    """
    total, listed, touched = sums.total, sums.listed, sums.touched
    entries, largest = 0, 1.0
    for k in range(start, start + count):
        entries = add_to_sums(columns[k], values[k], entries, sums)
        largest = max(largest, abs(total[columns[k]]))
    # in the order of solution: a replacement may bring in columns solved later, never earlier
    while True:
        earliest, chosen = np.int64(9223372036854775807), -1
        for k in range(entries):
            column = touched[k]
            if 0 <= solved.row[column] < earliest and total[column] != 0.0:
                earliest, chosen = solved.row[column], column
        if chosen < 0:
            break
        factor = total[chosen]
        total[chosen] = 0.0
        for k in range(solved.first[chosen], solved.first[chosen] + solved.length[chosen]):
            entries = add_to_sums(solved.column[k], factor * solved.value[k], entries, sums)
            largest = max(largest, abs(total[solved.column[k]]))
    # round-off of cancelled terms is dropped
    kept = 0
    for k in range(entries):
        column = touched[k]
        listed[column] = 0
        if solved.row[column] < 0 and abs(total[column]) > round_off * largest:
            touched[kept] = column
            kept += 1
    return kept


@entry
def eliminate(
    start: I1,
    columns: I1,
    values: F1,
    preferred: I1,
    solved: Solved,
    sums: Sums,
    progress: I1,
    round_off: float,
    nothing_left: float,
    contradiction: float,
) -> int:
    """Solve each constraint in turn for one variable; return DONE, CONTRADICTS, or FULL if `solved` must be larger.

    `progress` receives the index of the last constraint and the number of entries.
    """
    total, touched = sums.total, sums.touched
    unknowns, used = preferred.size, 0
    for row in range(start.size - 1):
        progress[0] = row
        entries = resolve(columns, values, start[row], start[row + 1] - start[row], solved, sums, round_off)
        largest = best = rest = scale = 0.0
        for k in range(start[row], start[row + 1]):
            scale = max(scale, abs(values[k]))
        for k in range(entries):
            size = abs(total[touched[k]])
            if touched[k] >= unknowns:
                rest = max(rest, size)
                continue
            largest = max(largest, size)
            if preferred[touched[k]] == 1:
                best = max(best, size)
        # nothing unknown remains: the constraint follows from others or contradicts them
        if largest <= nothing_left * scale:
            if rest > contradiction * scale:
                return CONTRADICTS
            continue
        # the largest preferred column, so that the others stay free; any column if the preferred ones are too small
        pivot, size = -1, -1.0
        anything = best < PIVOT_FRACTION_MIN * largest
        for k in range(entries):
            column = touched[k]
            if column < unknowns and (anything or preferred[column] == 1):
                here = abs(total[column])
                if here > size or (here == size and column > pivot):
                    pivot, size = column, here
        if used + entries > solved.column.size:
            return FULL
        # the column as an expression in the others
        solved.row[pivot], solved.first[pivot] = row, used
        for k in range(entries):
            column = touched[k]
            if column != pivot:
                solved.column[used], solved.value[used] = column, -total[column] / total[pivot]
                used += 1
        solved.length[pivot] = used - solved.first[pivot]
    progress[1] = used
    return DONE


@entry
def expand_rows(unknowns: int, solved: Solved, sums: Sums, start: I1, columns: I1, values: F1, round_off: float) -> int:
    """Express each unknown in variables that are not solved, as sparse rows; return DONE or FULL."""
    used = 0
    for row in range(unknowns):
        start[row] = used
        if used + 1 > columns.size:
            return FULL
        if solved.row[row] < 0:
            columns[used], values[used] = row, 1.0
            used += 1
            continue
        entries = resolve(solved.column, solved.value, solved.first[row], solved.length[row], solved, sums, round_off)
        if used + entries > columns.size:
            return FULL
        for k in range(entries):
            columns[used], values[used] = sums.touched[k], sums.total[sums.touched[k]]
            used += 1
    start[unknowns] = used
    return DONE


class Elimination:
    """Solver of linear constraints for some of the unknowns, in the order in which the constraints are imposed.

    Rows of a chain of bodies have few terms and stay short: cost and size are linear in the length of the chain.
    """

    def __init__(self, preferred: Iterable[bool], prescribed: int) -> None:
        self.preferred = np.array(list(preferred), np.int64)
        self.prescribed = prescribed
        self.nothing_left = ASSEMBLY_TOL
        self.imposed: list[tuple[Expression, str]] = []
        self.solved_at: np.ndarray = np.full(self.preferred.size + prescribed, -1, np.int64)

    def impose(self, constraint: Expression, name: str) -> None:
        """Add the equation constraint = 0; messages call it `name`."""
        self.imposed.append((constraint, name))

    def rows(self, nothing_left: float = ASSEMBLY_TOL) -> Rows:
        """Express all unknowns in free and prescribed variables, as sparse rows (starts, columns, values).

        A larger `nothing_left` also drops constraints that follow from others only up to the rounding of given numbers.
        """
        # smaller errors of a redundant constraint are those of rounded numbers; with larger ones it cannot be met
        self.nothing_left, refused = nothing_left, max(DATA_TOL, nothing_left)
        unknowns, total = self.preferred.size, self.preferred.size + self.prescribed
        start = np.cumsum([0, *(len(constraint) for constraint, _ in self.imposed)], dtype=np.int64)
        columns = np.array([column for constraint, _ in self.imposed for column in constraint], np.int64)
        values = np.array([value for constraint, _ in self.imposed for value in constraint.values()], float)
        # round-off adds up along a chain: it is 1.1e-12 after a ring of 1000 units with ten constraints each
        round_off = max(1e-12, 1e-14 * len(self.imposed))
        capacity = 64 + 8 * total + 4 * columns.size
        while True:
            self.solved_at[:] = -1
            first, length, progress = np.zeros(total, np.int64), np.zeros(total, np.int64), np.zeros(2, np.int64)
            solved = Solved(self.solved_at, first, length, np.zeros(capacity, np.int64), np.zeros(capacity))
            sums = Sums(np.zeros(total), np.zeros(total, np.int64), np.zeros(total, np.int64))
            limits = round_off, nothing_left, refused
            status = eliminate(start, columns, values, self.preferred, solved, sums, progress, *limits)
            if status == CONTRADICTS:
                constraint, name = self.imposed[row := int(progress[0])]
                raise contradiction([name, *self.causes_of([constraint], row)])
            if status == DONE:
                rows = np.zeros(unknowns + 1, np.int64), np.zeros(capacity, np.int64), np.zeros(capacity)
                if expand_rows(unknowns, solved, sums, *rows, round_off) == DONE:
                    used = int(rows[0][-1])
                    return rows[0], rows[1][:used], rows[2][:used]
            capacity *= 2

    def misses(self, rows: Rows, placed: np.ndarray) -> bool:
        """Return whether the solution is far from the placed values, although the placed values nearly meet the constraints."""
        unknowns, (start, columns, values) = self.preferred.size, rows
        solved = np.add.reduceat(np.append(values * placed[columns], 0.0), start[:-1]) * (np.diff(start) > 0)
        far = np.max(np.abs(solved - placed[:unknowns]), initial=0.0)
        return bool(far > CLOSING_DISPLACEMENT_MAX and far > CLOSING_RATIO_MAX * self.error(placed))

    def error(self, values: np.ndarray) -> float:
        """Return the largest absolute value of the imposed constraints, which should vanish, at given variables."""
        errors = (abs(sum(value * values[column] for column, value in row.items())) for row, _ in self.imposed)
        return float(max(errors, default=0.0))

    def causes_of(self, expressions: list[Expression], before: int | None = None) -> list[str]:
        """Return the names of the constraints that together determine some expressions, drives first.

        The solved constraints are independent. The unknown columns of an expression are therefore a unique combination of
        theirs; the constraints with a part in it are returned.
        """
        solved = sorted(int(row) for row in self.solved_at if row >= 0)
        chosen = [self.imposed[row] for row in solved if before is None or row < before]
        count, unknown = len(chosen), self.preferred.size
        entries = [
            (column, k, value)
            for k, (constraint, _) in enumerate(chosen)
            for column, value in constraint.items()
            if column < unknown
        ]
        table = np.array(entries, float).reshape(-1, 3)
        places = table[:, 0].astype(int), table[:, 1].astype(int)
        dense = count <= 600  # a larger sparse system is solved iteratively
        if dense:
            full = np.zeros((unknown, count))
            np.add.at(full, places, table[:, 2])
        else:
            import scipy.sparse as sp
            from scipy.sparse.linalg import lsqr  # imported here: it takes a tenth of a second

            constraints = sp.csr_array((table[:, 2], places), shape=(unknown, count))
        names: dict[str, None] = {}
        for expression in expressions:
            wanted = np.zeros(unknown)
            for column, value in expression.items():
                if column < unknown:
                    wanted[column] += value
            if dense:
                part = np.linalg.lstsq(full, wanted, rcond=None)[0]
            else:
                part = lsqr(constraints, wanted, atol=1e-13, btol=1e-13)[0]
            largest = np.max(np.abs(part), initial=0.0)
            names.update((chosen[k][1], None) for k in np.flatnonzero(np.abs(part) > 1e-8 * largest).tolist())
        return sorted(names, key=lambda name: not name.startswith(DRIVE_PREFIX))


def contradiction(names: list[str], consequence: str = "") -> AssemblyError:
    """Return the error for parts that contradict each other."""
    names = list(dict.fromkeys(names))
    drives = [name for name in names if name.startswith(DRIVE_PREFIX)]
    through = f" ({consequence})" if consequence else ""
    if len(drives) > 1:
        ties = [name for name in names if name not in drives]
        by = f", coupled by {in_words(ties)}" if ties else ""
        return AssemblyError(f"{in_words(drives)} act on one degree of freedom{by}{through}", "one drive per degree of freedom")
    allowed = "joints and drives that leave at least one way to assemble and move the mechanism"
    if len(names) == 1:
        return AssemblyError(f"{names[0]} cannot be satisfied{through}", allowed)
    return AssemblyError(f"{names[0]} contradicts {in_words(names[1:])}{through}", allowed)


def in_words(names: list[str], most: int = 6) -> str:
    """Write a list in words, cut off after `most` names; an empty text if there are none."""
    if not names:
        return ""
    if len(names) > most:
        names = [*names[:most], f"{len(names) - most} more"]
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
