"""Linear conditions on coordinates, eliminated once before the run."""

from __future__ import annotations

from collections.abc import Iterable

from scissordyn.errors import InputError

__all__ = ["Elimination", "Expression", "add", "scaled"]

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
                raise InputError(
                    f"{name} contradicts the other joints and drives: the mechanism is over-constrained",
                    "joints and drives that leave at least one way to assemble and move it",
                )
            return False
        chosen = [column for column in unknown if self.preferred[column]]
        largest = max(abs(rest[column]) for column in unknown)
        if not chosen or max(abs(rest[column]) for column in chosen) < 1e-3 * largest:
            chosen = unknown
        pivot = max(chosen, key=lambda column: (abs(rest[column]), column))
        coefficient = rest.pop(pivot)
        self.solved[pivot] = {column: -value / coefficient for column, value in rest.items()}
        return True
