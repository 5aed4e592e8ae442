"""Constraints and their gradients as functions of free coordinates and drive directions, for all uses but time steps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from scissordyn.mechanics.constraint_part import ANGLE, HALF_SQUARE, LENGTH
from scissordyn.plan.coordinates import Constraint, Coordinates, PointMap
from scissordyn.tolerance import ASSEMBLY_TOL

DENSE_ENTRIES_MAX = 250_000  # Largest number of entries of a matrix of constraint gradients that is stored in full, not sparse


class Gradients:
    """Constraints, and vectors that an assembly holds, with their gradients by the free coordinates x."""

    def __init__(self, free: int, basis: int, constraints: Sequence[Constraint], held: Sequence[PointMap] = ()) -> None:
        self.free, self.count = free, len(constraints)
        parts = [(k, weight, part) for k, constraint in enumerate(constraints) for weight, part in constraint.parts]
        self.owner = np.array([k for k, _, _ in parts], int)
        self.weight = np.array([weight for _, weight, _ in parts], float)
        self.value = np.array([constraint.value for constraint in constraints], float)
        self.timed = np.array([constraint.motion is not None for constraint in constraints], bool)
        self.subjects = [constraint.subject for constraint in constraints]
        self.linear = np.array([constraint.linear for constraint in constraints], bool)
        kinds = [kind for constraint in constraints for kind in constraint.kinds or (HALF_SQUARE,) * len(constraint.parts)]
        self.turns = np.array([kind == ANGLE for kind in kinds], bool)
        self.lengths = np.array([kind == LENGTH for kind in kinds], bool)
        self.has_other_kinds = bool(np.any(self.turns | self.lengths))
        self.reference = np.array([angle for constraint in constraints for _, angle in constraint.turning], float)
        width = free + basis
        dense = 2 * max(len(parts), len(held)) * width <= DENSE_ENTRIES_MAX
        self.maps = matrix_of([part for _, _, part in parts], width, dense)
        self.held = matrix_of(held, width, dense)
        moving = self.maps[:, : self.free]
        square = moving * moving if isinstance(moving, np.ndarray) else moving.multiply(moving)
        self.size = np.sqrt(np.asarray(square.sum(axis=1))).reshape(-1, 2)

    def residual(self, full: np.ndarray) -> np.ndarray:
        """Return the residuals of the constraints; `full` has the free coordinates, then the direction vectors of drives."""
        d = np.asarray(self.maps @ full).reshape(-1, 2)
        parts = 0.5 * np.sum(d * d, axis=1)
        if self.has_other_kinds:
            parts[self.lengths] = np.hypot(*d[self.lengths].T)
            beyond = np.arctan2(d[self.turns, 1], d[self.turns, 0]) - self.reference
            parts[self.turns] = self.reference + beyond - math.tau * np.floor(beyond / math.tau + 0.5)
        values: np.ndarray = np.bincount(self.owner, self.weight * parts, self.count) - self.value
        return values

    def count_turns(self, references: np.ndarray) -> None:
        """Choose the branch of measured angles: each lies within half a turn of its reference, the last of `references`."""
        self.reference = references[references.size - self.reference.size :].copy()

    def slopes(self, d: np.ndarray) -> np.ndarray:
        """Return the derivative of each part by its map, at maps of shape (parts, 2); for half squares the maps themselves."""
        if not self.has_other_kinds:
            return d
        s, square = d.copy(), np.sum(d * d, axis=1)[:, None]
        s[self.lengths] = d[self.lengths] / np.sqrt(square[self.lengths])
        s[self.turns] = np.stack([-d[self.turns, 1], d[self.turns, 0]], axis=1) / square[self.turns]
        return s

    def rounding(self, full: np.ndarray) -> np.ndarray:
        """Return the round-off of each constraint at the coordinates `full`, then that of each held vector."""
        size = np.finfo(float).eps * np.abs(full)
        moved = np.asarray(abs(self.maps) @ size).reshape(-1, 2)
        d = np.abs(self.slopes(np.asarray(self.maps @ full).reshape(-1, 2)))
        constraints = np.bincount(self.owner, np.abs(self.weight) * np.sum(d * moved, axis=1), self.count)
        return np.concatenate([constraints, np.asarray(abs(self.held) @ size)])

    def jacobian(self, full: np.ndarray) -> Any:
        """Return the gradients of the constraints at and by the coordinates `full`, then the held maps, as a matrix."""
        d = self.weight[:, None] * self.slopes(np.asarray(self.maps @ full).reshape(-1, 2))
        if isinstance(self.maps, np.ndarray):
            rows = np.zeros((self.count, self.maps.shape[1]))
            np.add.at(rows, self.owner, np.sum(d[:, :, None] * self.maps.reshape(*d.shape, self.maps.shape[1]), axis=1))
            return np.vstack([rows, self.held])
        import scipy.sparse as sp  # imported here: only long arrays have sparse matrices

        parts = np.arange(self.owner.size)
        places = np.repeat(self.owner, 2), np.stack([2 * parts, 2 * parts + 1], 1).ravel()
        pairing = sp.csr_array((d.ravel(), places), shape=(self.count, 2 * parts.size))
        return sp.csr_array(sp.vstack([pairing @ self.maps, self.held]))

    def scale(self, full: np.ndarray) -> np.ndarray:
        """Return the largest possible length of each constraint's gradient by the free coordinates, at `full`."""
        d = self.slopes(np.asarray(self.maps @ full).reshape(-1, 2))
        # a rod that shrinks to zero loses its gradient: its initial length counts
        size = np.maximum(np.hypot(*d.T), np.where(self.linear, 0.0, np.sqrt(2.0 * np.abs(self.value)))[self.owner])
        return np.bincount(self.owner, np.abs(self.weight) * size * np.hypot(*self.size.T), self.count)

    def unit(self, full: np.ndarray) -> Any:
        """Return the gradients of the constraints by x, divided by their largest possible length."""
        scale = self.scale(full)
        inverse = 1.0 / np.where(scale > 0.0, scale, 1.0)
        rows = self.jacobian(full)[: self.count, : self.free]
        if isinstance(rows, np.ndarray):
            return inverse[:, None] * rows
        import scipy.sparse as sp

        return sp.csr_array(sp.diags_array(inverse) @ rows)


def matrix_of(maps: Sequence[PointMap], width: int, dense: bool | None = None) -> Any:
    """Return the matrix with the rows of some maps: full if `dense`, else sparse; by default full up to a limit of its size."""
    if not maps or (2 * len(maps) * width <= DENSE_ENTRIES_MAX if dense is None else dense):
        full = np.zeros((2 * len(maps), width))
        for k, vector in enumerate(maps):
            full[2 * k : 2 * k + 2, vector.columns] = vector.rows
        return full
    rows = np.concatenate([np.repeat([2 * k, 2 * k + 1], vector.columns.size) for k, vector in enumerate(maps)])
    columns = np.concatenate([np.tile(vector.columns, 2) for vector in maps])
    values = np.concatenate([vector.rows.ravel() for vector in maps])
    import scipy.sparse as sp

    return sp.csr_array((values, (rows, columns)), shape=(2 * len(maps), width))


def least_change(jacobian: Any, residual: np.ndarray, smallest: float = ASSEMBLY_TOL) -> np.ndarray:
    """Return the smallest correction that removes one or several residuals to first order, also for redundant equations.

    Full matrices ignore singular values below the fraction `smallest` of the largest.
    """
    if not residual.size or not np.any(residual):
        return np.zeros((jacobian.shape[1], *residual.shape[1:]))
    if jacobian.shape[0] <= 400:  # larger systems are solved iteratively
        full = jacobian if isinstance(jacobian, np.ndarray) else jacobian.toarray()
        return np.asarray(np.linalg.lstsq(full, residual, rcond=smallest)[0])
    from scipy.sparse.linalg import lsqr  # imported here: it takes a tenth of a second

    if residual.ndim > 1:
        return np.stack([least_change(jacobian, column) for column in residual.T], axis=1)
    return np.asarray(lsqr(jacobian, residual, atol=1e-15, btol=1e-15, iter_lim=20 * jacobian.shape[0])[0])


def guesses(coordinates: Coordinates, b: np.ndarray, first: np.ndarray) -> Iterator[np.ndarray]:
    """Yield free coordinates from which an assembly may start: the first guess, then bodies rotated at random, ever farther.

    Newton's method cannot leave the line on which bodies are placed, although an assembly may exist away from it.
    """
    yield first
    natural, random = np.asarray(coordinates.matrix @ np.append(first, b)), np.random.default_rng(0)
    bodies = [p + 2 for name, p in coordinates.natural.offsets.items() if coordinates.natural.rotates(name)]
    for size in (0.01, 0.1, 0.3, 1.0, 2.0):  # standard deviations of the angles [rad]
        for _ in range(6):
            moved = natural.copy()
            for d, angle in zip(bodies, size * random.standard_normal(len(bodies)), strict=True):
                (x, y), cos, sin = natural[d : d + 2], np.cos(angle), np.sin(angle)
                moved[d : d + 2] = cos * x - sin * y, sin * x + cos * y
            yield coordinates.nearest(b, moved)
