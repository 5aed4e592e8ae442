"""Linear constraints on coordinates, eliminated once before the run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from scissordyn.errors import InputError
from scissordyn.kernel import F1, I1, entry, kernel

DRIVE = "the drive of"  # How the names of the drives' constraints begin
DENSE = 600  # Up to so many constraints a full matrix finds out whose they are; it is needed for a message only
Expression = dict[int, float]  # A linear combination: coefficient by column
ROUND_OFF = 1e-12  # Coefficients below this fraction of the largest one in the elimination of a row came from cancellation

ROUND_OFF_PER_ROW = 1e-14
"""Likewise, times the number of constraints: along a chain the roundings of all its angles add up (1.1e-12 after a ring of 1000
units with ten constraints each)."""

CONTRADICTION = 1e-7
"""A constraint that holds within this, as a fraction of its largest coefficient, is redundant; beyond it, it cannot be met."""

NOTHING_LEFT = 1e-9
"""A constraint follows from those before it if what is left of it is below this fraction of its largest coefficient.

Points nearer than this fraction of the mechanism's size are one point."""

SMALL_PIVOT = 1e-3
"""Columns that are preferred give way to others if their coefficients are smaller than this fraction of the largest."""

JUMPED = 0.02, 30.0
"""What contradicts by the rounding of numbers is met exactly only far away: by more than the first of these, in coordinates of
the order of one, and than so many times the error of the bodies as placed."""

Rows = tuple[np.ndarray, np.ndarray, np.ndarray]


class Solved(NamedTuple):
    """Columns that are solved for, as expressions in others."""

    row: I1  # (columns,) Constraint that a column is solved by, -1 where it is free
    first: I1  # (columns,) First entry of its expression
    length: I1  # (columns,) Number of entries
    column: I1  # (room,) Of each entry
    value: F1  # (room,)


class Sums(NamedTuple):
    """A row as it is summed up."""

    total: F1  # (columns,) Coefficient of each column
    listed: I1  # (columns,) Whether a column is among those that are touched
    touched: I1  # (columns,) Columns with an entry


DONE, CONTRADICTS, FULL = -1, -2, -3


def add(*terms: Expression) -> Expression:
    total: Expression = {}
    for term in terms:
        for column, coefficient in term.items():
            total[column] = total.get(column, 0.0) + coefficient
    return total


def scaled(factor: float, expression: Expression) -> Expression:
    return {column: factor * coefficient for column, coefficient in expression.items()}


@kernel
def add_to_sums(column, value, entries, sums):
    """Add a coefficient to a row that has so many entries; returns how many it has then."""
    if sums.listed[column] == 0:
        sums.listed[column] = 1
        sums.touched[entries] = column
        sums.total[column] = 0.0
        entries += 1
    sums.total[column] += value
    return entries


@kernel
def resolve(columns, values, start, count, solved, sums, round_off):
    """Write a row in columns that are not solved for into `sums`; returns how many entries of its `touched` it has.

    A column that is solved for is replaced by its expression, the first solved first: expressions hold only columns that were
    solved for later, or never.
    """
    total, listed, touched = sums.total, sums.listed, sums.touched
    entries, largest = 0, 1.0
    for k in range(start, start + count):
        entries = add_to_sums(columns[k], values[k], entries, sums)
        largest = max(largest, abs(total[columns[k]]))
    # in the order of solution: what replaces a column may bring in columns solved for later, never earlier
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
    # what is left of cancellation is no entry
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
    """Solve constraints for columns, one after the other; returns DONE, CONTRADICTS or FULL.

    `progress` gets the constraint at which it ended, and how many entries of expressions there are.
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
        # nothing unknown is left: the constraint follows from others, or contradicts them
        if largest <= nothing_left * scale:
            if rest > contradiction * scale:
                return CONTRADICTS
            continue
        # the largest of the preferred columns, so that the others stay free; any if those are too small
        pivot, size = -1, -1.0
        anything = best < SMALL_PIVOT * largest
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
    """Write each unknown column in columns that are not solved for, as sparse rows; returns DONE or FULL."""
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
    """Solves linear constraints for some of the unknown columns, in the order in which they are imposed.

    A chain of bodies gives rows with a handful of terms, and they stay so: cost and result are linear in the chain's length.
    """

    def __init__(self, preferred: Iterable[bool], prescribed: int) -> None:
        self.preferred = np.array(list(preferred), np.int64)
        self.prescribed = prescribed
        self.nothing_left = NOTHING_LEFT
        self.imposed: list[tuple[Expression, str]] = []
        self.solved_at: np.ndarray = np.full(self.preferred.size + prescribed, -1, np.int64)

    def impose(self, constraint: Expression, name: str) -> None:
        """Make `constraint` vanish; `name` is whose it is, for messages."""
        self.imposed.append((constraint, name))

    def rows(self, nothing_left: float = NOTHING_LEFT) -> Rows:
        """All unknown columns in those that stay free and the prescribed ones: sparse rows (starts, columns, values).

        With a larger `nothing_left` what few digits leave of constraints that follow from others is no constraint.
        """
        self.nothing_left, refused = nothing_left, max(CONTRADICTION, nothing_left)
        unknowns, total = self.preferred.size, self.preferred.size + self.prescribed
        start = np.cumsum([0, *(len(constraint) for constraint, _ in self.imposed)], dtype=np.int64)
        columns = np.array([column for constraint, _ in self.imposed for column in constraint], np.int64)
        values = np.array([value for constraint, _ in self.imposed for value in constraint.values()], float)
        round_off = max(ROUND_OFF, ROUND_OFF_PER_ROW * len(self.imposed))
        room = 64 + 8 * total + 4 * columns.size
        while True:
            self.solved_at[:] = -1
            first, length, progress = np.zeros(total, np.int64), np.zeros(total, np.int64), np.zeros(2, np.int64)
            solved = Solved(self.solved_at, first, length, np.zeros(room, np.int64), np.zeros(room))
            sums = Sums(np.zeros(total), np.zeros(total, np.int64), np.zeros(total, np.int64))
            limits = round_off, nothing_left, refused
            status = eliminate(start, columns, values, self.preferred, solved, sums, progress, *limits)
            if status == CONTRADICTS:
                constraint, name = self.imposed[row := int(progress[0])]
                raise contradiction([name, *self.behind([constraint], row)])
            if status == DONE:
                rows = np.zeros(unknowns + 1, np.int64), np.zeros(room, np.int64), np.zeros(room)
                if expand_rows(unknowns, solved, sums, *rows, round_off) == DONE:
                    used = int(rows[0][-1])
                    return rows[0], rows[1][:used], rows[2][:used]
            room *= 2

    def misses(self, rows: Rows, placed: np.ndarray) -> bool:
        """Whether values that nearly meet the constraints are far from those that follow from the free ones among them."""
        unknowns, (start, columns, values) = self.preferred.size, rows
        solved = np.add.reduceat(np.append(values * placed[columns], 0.0), start[:-1]) * (np.diff(start) > 0)
        far = np.max(np.abs(solved - placed[:unknowns]), initial=0.0)
        return bool(far > JUMPED[0] and far > JUMPED[1] * self.error(placed))

    def error(self, values: np.ndarray) -> float:
        """The largest error of a constraint at values of all columns."""
        errors = (abs(sum(value * values[column] for column, value in row.items())) for row, _ in self.imposed)
        return float(max(errors, default=0.0))

    def behind(self, expressions: list[Expression], before: int | None = None) -> list[str]:
        """Whose constraints together determine some expressions, drives first.

        The unknown columns of an expression are a combination of those of the constraints that were solved, which are
        independent: the combination is unique, and the constraints with a part in it are the answer.
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
        if count <= DENSE:
            full = np.zeros((unknown, count))
            np.add.at(full, places, table[:, 2])
        else:
            import scipy.sparse as sp
            from scipy.sparse.linalg import lsqr  # takes a tenth of a second to import

            constraints = sp.csr_array((table[:, 2], places), shape=(unknown, count))
        names: dict[str, None] = {}
        for expression in expressions:
            wanted = np.zeros(unknown)
            for column, value in expression.items():
                if column < unknown:
                    wanted[column] += value
            if count <= DENSE:
                part = np.linalg.lstsq(full, wanted, rcond=None)[0]
            else:
                part = lsqr(constraints, wanted, atol=1e-13, btol=1e-13)[0]
            largest = np.max(np.abs(part), initial=0.0)
            names.update((chosen[k][1], None) for k in np.flatnonzero(np.abs(part) > 1e-8 * largest).tolist())
        return sorted(names, key=lambda name: not name.startswith(DRIVE))


def contradiction(names: list[str], consequence: str = "") -> InputError:
    """The error for parts that cannot hold together."""
    names = list(dict.fromkeys(names))
    drives = [name for name in names if name.startswith(DRIVE)]
    through = f" ({consequence})" if consequence else ""
    if len(drives) > 1:
        ties = [name for name in names if name not in drives]
        by = f", tied to each other by {in_words(ties)}" if ties else ""
        return InputError(f"{in_words(drives)} act on one freedom{by}{through}", "one drive for each freedom")
    allowed = "joints and drives that leave at least one way to assemble and move the mechanism"
    if len(names) == 1:
        return InputError(f"{names[0]} cannot be met{through}", allowed)
    return InputError(f"{names[0]} contradicts {in_words(names[1:])}{through}", allowed)


def in_words(names: list[str], most: int = 6) -> str:
    """Write a list in words, cut off after `most` names; an empty text if there are none."""
    if not names:
        return ""
    if len(names) > most:
        names = [*names[:most], f"{len(names) - most} more"]
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
