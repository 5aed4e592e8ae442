"""Linear conditions on coordinates, eliminated once before the run."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import lsqr

from scissordyn.errors import InputError

__all__ = ["DRIVE", "Elimination", "Expression", "add", "contradiction", "in_words", "scaled"]

DRIVE = "the drive of"
"""How the names of drives' conditions begin."""

DENSE = 600
"""Up to so many conditions a full matrix finds out whose they are; it is needed for a message only."""

Expression = dict[int, float]
"""A linear combination: coefficient by column."""

ROUND_OFF = 1e-12
"""Coefficients below this fraction of the largest one came from cancellation."""

CONTRADICTION = 1e-7
"""A condition that holds within this (lengths are of order one) is redundant; beyond it, it cannot be met."""


def add(*terms: Expression) -> Expression:
    """The sum of some expressions."""
    total: Expression = {}
    for term in terms:
        for column, coefficient in term.items():
            total[column] = total.get(column, 0.0) + coefficient
    return total


def scaled(factor: float, expression: Expression) -> Expression:
    """A multiple of an expression."""
    return {column: factor * coefficient for column, coefficient in expression.items()}


class Elimination:
    """Solves linear conditions for some of the unknown columns, one condition at a time.

    A chain of bodies gives rows with a handful of terms, and they stay so: cost and result are linear in the chain's length.

    Parameters
    ----------
    preferred : sequence of bool
        For each unknown column, whether it is solved for before the others. Columns beyond are known functions of time.
    """

    def __init__(self, preferred: Iterable[bool]) -> None:
        self.preferred = tuple(preferred)
        self.solved: dict[int, Expression] = {}
        self.imposed: list[tuple[Expression, str]] = []

    def resolve(self, expression: Expression) -> Expression:
        """The expression in the columns that are still free."""
        result: Expression = {}
        for column, coefficient in expression.items():
            if column in self.solved:
                inner = self.resolve(self.solved[column])
                self.solved[column] = inner
                for deeper, factor in inner.items():
                    result[deeper] = result.get(deeper, 0.0) + coefficient * factor
            else:
                result[column] = result.get(column, 0.0) + coefficient
        largest = max(map(abs, result.values()), default=0.0)
        return {column: value for column, value in result.items() if abs(value) > ROUND_OFF * max(largest, 1.0)}

    def impose(self, condition: Expression, name: str) -> bool:
        """Make `condition` vanish.

        Parameters
        ----------
        condition : Expression
        name : str
            Whose condition it is, for the message.

        Returns
        -------
        bool
            False if it followed from the earlier ones.

        Raises
        ------
        InputError
            If it contradicts the earlier ones.
        """
        rest = self.resolve(condition)
        unknown = [column for column in rest if column < len(self.preferred)]
        if not unknown:
            if max(map(abs, rest.values()), default=0.0) > CONTRADICTION:
                raise contradiction([name, *self.behind([condition])])
            return False
        chosen = [column for column in unknown if self.preferred[column]]
        largest = max(abs(rest[column]) for column in unknown)
        if not chosen or max(abs(rest[column]) for column in chosen) < 1e-3 * largest:
            chosen = unknown
        pivot = max(chosen, key=lambda column: (abs(rest[column]), column))
        coefficient = rest.pop(pivot)
        self.solved[pivot] = {column: -value / coefficient for column, value in rest.items()}
        self.imposed.append((condition, name))
        return True

    def behind(self, expressions: list[Expression]) -> list[str]:
        """Whose conditions together determine some expressions, drives first.

        The unknown columns of an expression are a combination of those of the imposed conditions, which are independent: the
        combination is unique, and the conditions with a share in it are the answer.
        """
        count, unknown = len(self.imposed), len(self.preferred)
        entries = [
            (column, k, value)
            for k, (condition, _) in enumerate(self.imposed)
            for column, value in condition.items()
            if column < unknown
        ]
        table = np.array(entries, float).reshape(-1, 3)
        places = table[:, 0].astype(int), table[:, 1].astype(int)
        conditions = sp.csr_array((table[:, 2], places), shape=(unknown, count))
        names: dict[str, None] = {}
        for expression in expressions:
            wanted = np.zeros(unknown)
            for column, value in expression.items():
                if column < unknown:
                    wanted[column] += value
            if count <= DENSE:
                share = np.linalg.lstsq(conditions.toarray(), wanted, rcond=None)[0]
            else:
                share = lsqr(conditions, wanted, atol=1e-13, btol=1e-13)[0]
            largest = np.max(np.abs(share), initial=0.0)
            names.update((self.imposed[k][1], None) for k in np.flatnonzero(np.abs(share) > 1e-8 * largest).tolist())
        return sorted(names, key=lambda name: not name.startswith(DRIVE))


def contradiction(names: list[str], consequence: str = "") -> InputError:
    """The error for parts that cannot hold together.

    Parameters
    ----------
    names : list of str
        Whose conditions they are.
    consequence : str
        What they would do to a body.
    """
    names = list(dict.fromkeys(names))
    drives = [name for name in names if name.startswith(DRIVE)]
    through = f" ({consequence})" if consequence else ""
    if len(drives) > 1:
        held = [name for name in names if name not in drives]
        by = f", tied to each other by {in_words(held)}" if held else ""
        return InputError(f"{in_words(drives)} act on one freedom{by}{through}", "one drive for each freedom")
    allowed = "joints and drives that leave at least one way to assemble and move the mechanism"
    if len(names) == 1:
        return InputError(f"{names[0]} cannot be met{through}", allowed)
    return InputError(f"{names[0]} contradicts {in_words(names[1:])}{through}", allowed)


def in_words(names: list[str], most: int = 6) -> str:
    """A list in words, cut off after some names."""
    if len(names) > most:
        names = [*names[:most], f"{len(names) - most} more"]
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
