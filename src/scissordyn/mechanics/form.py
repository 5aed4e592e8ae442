"""Plane vectors linear in [x; b], quadratic conditions on them, and the layout that holds both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from scissordyn.mechanics.elimination import Expression
from scissordyn.model.body import GROUND, Point
from scissordyn.model.drive import TimeFunction
from scissordyn.model.joint import BodyPoint
from scissordyn.model.mechanism import Mechanism

__all__ = ["Condition", "Form", "Layout", "combine", "join_forms", "placed", "point_expression"]


@dataclass(frozen=True)
class Form:
    """A plane vector that is linear in [x; b]: its columns and, for each, the coefficients of both components.

    Parameters
    ----------
    columns : ndarray of int, shape (k,)
    rows : ndarray, shape (2, k)
    """

    columns: np.ndarray
    rows: np.ndarray


@dataclass(frozen=True)
class Condition:
    """A quadratic condition: the sum of weight |form|^2 / 2 is `level`.

    Parameters
    ----------
    parts : tuple of (float, Form)
        Weights and forms.
    level : float
        At t = 0.
    name : str
        Of the link or latch that the condition stands for.
    motion : TimeFunction, optional
        Course of the length sqrt(2 level) of a link over time.
    latch : bool
        Whether the condition holds only once the latch has locked.
    subject : str
        What it keeps, for messages: bodies of unit length, a guide, a link or a latch.
    bodies : tuple of str
        Whose motion it restricts.
    """

    parts: tuple[tuple[float, Form], ...]
    level: float
    name: str = ""
    motion: TimeFunction | None = None
    latch: bool = False
    subject: str = ""
    bodies: tuple[str, ...] = ()

    @property
    def columns(self) -> np.ndarray:
        """Columns of all parts, one after the other."""
        return np.concatenate([form.columns for _, form in self.parts])


def join_forms(parts: list[tuple[Form, int, float]]) -> Form:
    """Six rows on the union of columns from parts: a form, its first row among the six, and its sign."""
    columns = np.unique(np.concatenate([form.columns for form, _, _ in parts]))
    rows = np.zeros((6, columns.size))
    for form, first, sign in parts:
        rows[first : first + 2, np.searchsorted(columns, form.columns)] += sign * form.rows
    return Form(columns, rows)


def combine(parts: list[tuple[Form, float]]) -> Form:
    """A linear combination of forms."""
    columns = np.unique(np.concatenate([form.columns for form, _ in parts]))
    rows = np.zeros((2, columns.size))
    for form, factor in parts:
        rows[:, np.searchsorted(columns, form.columns)] += factor * form.rows
    return Form(columns, rows)


@dataclass(frozen=True)
class Layout:
    """The constant description of a mechanism that the kernels work on.

    Parameters
    ----------
    mechanism : Mechanism
    free : int
        Number n of free coordinates x.
    basis : int
        Number nb of entries of b(t).
    coordinates : sparse matrix, shape (nZ, n + nb)
        T, all natural coordinates from [x; b].
    mass : sparse matrix, shape (nZ, nZ)
        Mass matrix of the natural coordinates [kg, kg m, kg m^2].
    offsets : dict
        First natural coordinate of each body.
    weight : ndarray, shape (nZ,)
        Generalized force of gravity.
    conditions : tuple of Condition
        Unit lengths and moving guides, ordered for a narrow band.
    redundant : tuple of str
        Subjects of conditions that were left out because they follow from the others.
    """

    mechanism: Mechanism
    free: int
    basis: int
    coordinates: sp.csr_array
    mass: sp.csr_array
    offsets: dict[str, int]
    weight: np.ndarray
    conditions: tuple[Condition, ...]
    redundant: tuple[str, ...] = ()

    def place(self, point: BodyPoint) -> Form:
        """Position of a body's point."""
        return self._form(point_expression(self.mechanism, self.offsets, point, self._ones))

    def at(self, body: str, point: Point) -> Form:
        """Position of a point in the frame of a body, or of the ground."""
        return self._form(fixed_expression(self.mechanism, self.offsets, body, point, self._ones))

    def origin(self, body: str) -> Form:
        """Position of a body's origin."""
        p = self.offsets[body]
        return self._form(({p: 1.0}, {p + 1: 1.0}))

    def direction(self, body: str) -> Form:
        """Direction vector of a body; zero for one that does not rotate."""
        if body == GROUND or not self.mechanism.body(body).rotates:
            return Form(np.empty(0, np.int64), np.empty((2, 0)))
        d = self.offsets[body] + 2
        return self._form(({d: 1.0}, {d + 1: 1.0}))

    @property
    def fixed_direction(self) -> Form:
        """The x axis of the ground."""
        return Form(np.array([self.free], np.int64), np.array([[1.0], [0.0]]))

    @property
    def _ones(self) -> int:
        return int(self.coordinates.shape[0])

    def _form(self, pair: tuple[Expression, Expression]) -> Form:
        """A pair of expressions in natural coordinates as a form in [x; b]."""
        starts, indices, data = self.coordinates.indptr, self.coordinates.indices, self.coordinates.data
        dense: list[Expression] = []
        for expression in pair:
            row: Expression = {}
            for column, coefficient in expression.items():
                if column == self._ones:
                    row[self.free] = row.get(self.free, 0.0) + coefficient
                    continue
                for where in range(starts[column], starts[column + 1]):
                    key = int(indices[where])
                    row[key] = row.get(key, 0.0) + coefficient * float(data[where])
            dense.append(row)
        columns = sorted(set(dense[0]) | set(dense[1]))
        rows = np.array([[row.get(column, 0.0) for column in columns] for row in dense], float).reshape(2, len(columns))
        return Form(np.array(columns, np.int64), rows)


def point_expression(
    mechanism: Mechanism, offsets: dict[str, int], point: BodyPoint, ones: int
) -> tuple[Expression, Expression]:
    """Both components of a body's point in natural coordinates; column `ones` stands for 1."""
    body, name = point
    named = dict(mechanism.ground) if body == GROUND else mechanism.body(body).points
    return fixed_expression(mechanism, offsets, body, named[name], ones)


def fixed_expression(
    mechanism: Mechanism, offsets: dict[str, int], body_name: str, point: Point, ones: int
) -> tuple[Expression, Expression]:
    """Both components of a point in the frame of a body, or of the ground, in natural coordinates."""
    x, y = point
    if body_name == GROUND:
        return {ones: x}, {ones: y}
    body, p = mechanism.body(body_name), offsets[body_name]
    if not body.rotates:
        cos, sin = math.cos(body.angle), math.sin(body.angle)
        return {p: 1.0, ones: cos * x - sin * y}, {p + 1: 1.0, ones: sin * x + cos * y}
    return {p: 1.0, p + 2: x, p + 3: -y}, {p + 1: 1.0, p + 2: y, p + 3: x}


def placed(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Natural coordinates and velocities of the bodies as the user placed them."""
    position, velocity = np.zeros(layout.mass.shape[0]), np.zeros(layout.mass.shape[0])
    for body in layout.mechanism.bodies:
        p = layout.offsets[body.name]
        position[p : p + 2] = body.position
        velocity[p : p + 2] = body.velocity
        if body.rotates:
            cos, sin = math.cos(body.angle), math.sin(body.angle)
            position[p + 2 : p + 4] = cos, sin
            velocity[p + 2 : p + 4] = -sin * body.angular_velocity, cos * body.angular_velocity
    return position, velocity
