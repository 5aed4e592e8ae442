"""Point maps: plane vectors that are affine in the free coordinates, and quadratic constraints on them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scissordyn.component.time_function import TimeFunction

__all__ = ["Constraint", "PointMap", "combined", "joined"]


@dataclass(frozen=True)
class PointMap:
    """A plane vector that is linear in [x; b]: its columns and, for each, the coefficients of both components.

    Parameters
    ----------
    columns : ndarray of int, shape (k,)
        In increasing order.
    rows : ndarray, shape (2, k)
    """

    columns: np.ndarray
    rows: np.ndarray

    def at(self, full: np.ndarray) -> np.ndarray:
        """The vector at [x; b], shape (2,), or at many of them, shape (nt, 2)."""
        return np.asarray(full[..., self.columns] @ self.rows.T)


@dataclass(frozen=True)
class Constraint:
    """A quadratic constraint: the sum of weight |map|^2 / 2 is `value`.

    The maps have no unit and are of the order of one: those with a length are divided by `scale`.

    Parameters
    ----------
    parts : tuple of (float, PointMap)
        Weights and maps.
    value : float
        At t = 0.
    scale : float
        Length that the maps are divided by [m]; 1 for directions.
    name : str
        Of the rod or latch that the constraint represents.
    motion : TimeFunction, optional
        Distance that a rod prescribes over time [m].
    latch : bool
        Whether the constraint is active only once the latch has locked.
    subject : str
        What it keeps, for messages: bodies of unit length, a guide, a rod or a latch.
    bodies : tuple of str
        Whose motion it restricts.
    """

    parts: tuple[tuple[float, PointMap], ...]
    value: float
    scale: float = 1.0
    name: str = ""
    motion: TimeFunction | None = None
    latch: bool = False
    subject: str = ""
    bodies: tuple[str, ...] = ()

    @property
    def columns(self) -> np.ndarray:
        """Columns of all parts, one after the other."""
        return np.concatenate([point_map.columns for _, point_map in self.parts])


def joined(parts: Iterable[tuple[PointMap, int, float]], height: int = 6) -> PointMap:
    """Rows on the union of columns from parts: a map, its first row, and its sign."""
    table: dict[int, list[float]] = {}
    for point_map, first, sign in parts:
        upper, lower = point_map.rows.tolist()
        for column, a, b in zip(point_map.columns.tolist(), upper, lower, strict=True):
            entry = table.get(column)
            if entry is None:
                entry = table[column] = [0.0] * height
            entry[first] += sign * a
            entry[first + 1] += sign * b
    columns = sorted(table)
    rows = np.array([table[column] for column in columns], float).reshape(len(columns), height).T
    return PointMap(np.array(columns, np.int64), np.ascontiguousarray(rows))


def combined(*parts: tuple[PointMap, float]) -> PointMap:
    """A linear combination of maps."""
    return joined(((point_map, 0, factor) for point_map, factor in parts), 2)
