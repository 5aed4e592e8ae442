"""Measured curves over time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scissordyn.errors import InputError


@dataclass(frozen=True)
class Measured:
    """An unbroken record of one or several quantities.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Increasing [s].
    headings : tuple of str
        Quantities as the columns of `file.export.time_table` are called, without units: "angle of arm".
    values : ndarray, shape (n, quantities)
        In SI units.
    units : tuple of str
        SI units of the quantities.
    name : str
        Where it is from, for messages.
    """

    time: np.ndarray
    headings: tuple[str, ...]
    values: np.ndarray
    units: tuple[str, ...]
    name: str = "data"

    def __post_init__(self) -> None:
        if self.time.size < 2:
            raise InputError(f"'{self.name}': {self.time.size} instants", "at least two")
        if self.values.shape != (self.time.size, len(self.headings)) or len(self.units) != len(self.headings):
            raise InputError(f"'{self.name}': values of shape {self.values.shape}", "one row an instant, one column a quantity")
        if not (np.isfinite(self.time).all() and np.isfinite(self.values).all()):
            raise InputError(f"'{self.name}': a value that is not a finite number", "finite numbers")
        backwards = np.flatnonzero(np.diff(self.time) <= 0.0)
        if backwards.size:
            k = int(backwards[0]) + 1
            raise InputError(
                f"'{self.name}': the time does not increase from {self.time[k - 1]:.9g} s to {self.time[k]:.9g} s",
                "increasing instants",
            )

    def column(self, heading: str) -> np.ndarray:
        """The values of one quantity, shape (n,)."""
        return np.asarray(self.values[:, self.headings.index(heading)])

    def rows(self, first: int, last: int) -> Measured:
        """The instants from one to before another, with their times as they are."""
        part = slice(first, last)
        return Measured(self.time[part], self.headings, self.values[part], self.units, self.name)

    def every(self, step: int) -> Measured:
        """Every so many-th instant."""
        return Measured(self.time[::step], self.headings, self.values[::step], self.units, self.name)

    def segments(self, duration: float) -> list[Measured]:
        """Parts of equal numbers of instants, each of about a duration [s]; each of at least two instants."""
        parts = max(1, round((self.time[-1] - self.time[0]) / duration))
        cuts = np.linspace(0, self.time.size, min(parts, self.time.size // 2) + 1).round().astype(int)
        return [self.rows(a, b) for a, b in pairwise(cuts.tolist())]
