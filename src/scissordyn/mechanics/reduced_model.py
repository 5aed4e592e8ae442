"""A mechanism with its linear constraints eliminated: natural coordinates as affine functions of few free ones."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.mechanics.elimination import Expression
from scissordyn.mechanics.point_map import Constraint, PointMap
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.track import Track

__all__ = ["Family", "ReducedModel", "find_families", "fixed_expression", "point_expression"]


SAME = 1e-9
"""Products of coefficients, the largest one being one, that are the same to within this belong to parallel bodies."""


COORDINATES = ("_ones", "_rows", "_directions", "families")
"""What follows from the coordinates alone."""

PLACES = ("placed", "reach", "farthest", "last_assembly")
"""What follows from the coordinates and the bodies alone."""


@dataclass(frozen=True)
class Family:
    """Bodies that keep their relative directions, turned or mirrored.

    Parameters
    ----------
    bodies : tuple of str
    maps : tuple of PointMap
        Their directions.
    free : bool
        Whether a free coordinate enters.
    """

    bodies: tuple[str, ...]
    maps: tuple[PointMap, ...]
    free: bool


@dataclass(frozen=True)
class ReducedModel:
    """The constant description of a mechanism that the kernels work on.

    Natural coordinates are the origin p of each body and, if it rotates, the unit vector d along its x axis.

    Parameters
    ----------
    mechanism : Mechanism
    free : int
        Number n of free coordinates x.
    basis : int
        Number nb of entries of b(t) = (1, cos th_1, sin th_1, ...).
    coordinates : ndarray or sparse matrix, shape (nZ, n + nb)
        T, all natural coordinates from [x; b].
    mass : ndarray or sparse matrix, shape (nZ, nZ)
        Mass matrix of the natural coordinates [kg, kg m, kg m^2].
    offsets : dict
        First natural coordinate of each body.
    size : float
        Length of the mechanism's parts [m].
    constraints : tuple of Constraint
        Unit lengths, moving guides, rods and latches, ordered for a narrow band.
    redundant : tuple of str
        Subjects of constraints that were left out because they follow from the others.
    """

    mechanism: Mechanism
    free: int
    basis: int
    coordinates: Any = field(repr=False)
    mass: Any = field(repr=False)
    offsets: dict[str, int] = field(repr=False)
    size: float
    constraints: tuple[Constraint, ...] = ()
    redundant: tuple[str, ...] = ()

    def place(self, point: BodyPoint) -> PointMap:
        """Position of a point of a body."""
        return self._map(point_expression(self.mechanism, self.offsets, point, self._ones))

    def tracked(self, track: Track) -> PointMap:
        """Position of a tracked point."""
        return self.place((track.body, track.point)) if isinstance(track.point, str) else self.at(track.body, track.point)

    def with_constraints(self, constraints: tuple[Constraint, ...], redundant: tuple[str, ...] = ()) -> ReducedModel:
        """The same with these constraints; what is known of the coordinates is taken along."""
        return self._carried(replace(self, constraints=constraints, redundant=redundant), COORDINATES)

    def with_numbers(self, mechanism: Mechanism) -> ReducedModel:
        """The same of a mechanism with other numbers, none of which enters the reduction."""
        names: tuple[str, ...] = COORDINATES + PLACES if mechanism.bodies is self.mechanism.bodies else COORDINATES
        gravity = mechanism.gravity, mechanism.gravity_direction
        if names is not COORDINATES and gravity == (self.mechanism.gravity, self.mechanism.gravity_direction):
            names += ("weight",)
        for name in names:
            getattr(self, name)  # found out here, once for all cases
        made = object.__new__(ReducedModel)  # as `replace` makes it, in a third of the time
        made.__dict__.update({name: self.__dict__[name] for name in ReducedModel.__dataclass_fields__}, mechanism=mechanism)
        return self._carried(made, names)

    def _carried(self, made: ReducedModel, names: tuple[str, ...]) -> ReducedModel:
        """Another model with what this one knows under these names."""
        made.__dict__.update({name: self.__dict__[name] for name in names if name in self.__dict__})
        return made

    @cached_property
    def placed(self) -> tuple[np.ndarray, np.ndarray]:
        """Natural coordinates and velocities of the bodies as the user placed them."""
        count = self.coordinates.shape[0]
        position, velocity = np.zeros(count), np.zeros(count)
        for body in self.mechanism.bodies:
            p = self.offsets[body.name]
            position[p : p + 2] = body.position
            velocity[p : p + 2] = body.velocity
            if body.rotates:
                cos, sin = math.cos(body.angle), math.sin(body.angle)
                position[p + 2 : p + 4] = cos, sin
                velocity[p + 2 : p + 4] = -sin * body.angular_velocity, cos * body.angular_velocity
        return position, velocity

    @cached_property
    def weight(self) -> np.ndarray:
        """Generalized forces of gravity on [x; b], shape (n + nb,)."""
        mechanism, natural = self.mechanism, np.zeros(self.coordinates.shape[0])
        gx = mechanism.gravity * math.cos(mechanism.gravity_direction)
        gy = mechanism.gravity * math.sin(mechanism.gravity_direction)
        for body in mechanism.bodies:
            p, m, (x, y) = self.offsets[body.name], body.mass, body.centre
            natural[p : p + 2] = m * gx, m * gy
            if body.rotates:
                natural[p + 2 : p + 4] = m * (x * gx + y * gy), m * (x * gy - y * gx)
        return np.asarray(self.coordinates.T @ natural)

    @cached_property
    def reach(self) -> np.ndarray:
        """How far each free coordinate moves a point of a body, at most, shape (n,)."""
        moved = np.ones(self.coordinates.shape[0])
        for body in self.mechanism.bodies:
            if body.rotates:
                moved[self.offsets[body.name] + 2 :][:2] = body.extent
        moving = abs(self.coordinates[:, : self.free])
        if isinstance(moving, np.ndarray):
            return np.asarray(np.max(moved[:, None] * moving, axis=0, initial=0.0))
        return np.asarray((moving.multiply(moved[:, None])).max(axis=0).toarray()).ravel()

    @cached_property
    def farthest(self) -> float:
        """Distance of a body's farthest point from the origin, at most [m]."""
        return max((math.hypot(*body.position) + body.extent for body in self.mechanism.bodies), default=1.0)

    @cached_property
    def last_assembly(self) -> dict[str, Any]:
        """What the last assembly was asked for and what it found, see `assemble`."""
        return {}

    def at(self, body: str, point: Point) -> PointMap:
        """Position of a point in the frame of a body, or of the ground."""
        return self._map(fixed_expression(self.mechanism, self.offsets, body, point, self._ones))

    def origin(self, body: str) -> PointMap:
        """Position of the origin of a body."""
        p = self.offsets[body]
        return self._map(({p: 1.0}, {p + 1: 1.0}))

    def direction(self, body: str) -> PointMap:
        """Direction vector of a body; nothing for the ground and for a body that does not rotate."""
        found = self._directions.get(body)
        return PointMap(np.empty(0, np.int64), np.empty((2, 0))) if found is None else found

    def frame(self, body: str) -> PointMap:
        """Direction vector of a body's x axis, constant for the ground and for a body that does not rotate."""
        if body != GROUND and self.mechanism.body(body).rotates:
            return self.direction(body)
        angle = 0.0 if body == GROUND else self.mechanism.body(body).angle
        return PointMap(np.array([self.free], np.int64), np.array([[math.cos(angle)], [math.sin(angle)]]))

    @cached_property
    def _directions(self) -> dict[str, PointMap]:
        """Direction vectors of the bodies that rotate."""
        found = {}
        for body in self.mechanism.bodies:
            if body.rotates:
                d = self.offsets[body.name] + 2
                found[body.name] = self._map(({d: 1.0}, {d + 1: 1.0}))
        return found

    @cached_property
    def families(self) -> tuple[Family, ...]:
        """The rotating bodies, by families."""
        return find_families(self._directions, self.free)

    @cached_property
    def _ones(self) -> int:
        return int(self.coordinates.shape[0])

    @cached_property
    def _rows(self) -> list[list[tuple[int, float]]]:
        """Columns and coefficients of each natural coordinate."""
        matrix = sp.csr_array(self.coordinates)
        starts, columns, values = matrix.indptr.tolist(), matrix.indices.tolist(), matrix.data.tolist()
        pairs = list(zip(columns, values, strict=True))
        return [pairs[a:b] for a, b in itertools.pairwise(starts)]

    def _map(self, pair: tuple[Expression, Expression]) -> PointMap:
        """A pair of expressions in natural coordinates as a map of [x; b]."""
        table: dict[int, list[float]] = {}
        rows, ones = self._rows, self._ones
        for axis, expression in enumerate(pair):
            for column, coefficient in expression.items():
                for key, value in ((self.free, 1.0),) if column == ones else rows[column]:
                    entry = table.get(key)
                    if entry is None:
                        entry = table[key] = [0.0, 0.0]
                    entry[axis] += coefficient * value
        columns = sorted(table)
        return PointMap(np.array(columns, np.int64), np.array([table[key] for key in columns], float).reshape(-1, 2).T.copy())


def find_families(directions: dict[str, PointMap], free: int) -> tuple[Family, ...]:
    """Bodies by families, from their directions as maps of so many free coordinates and the basis."""
    found: dict[tuple[bytes, ...], list[str]] = {}
    for name, direction in directions.items():
        square = direction.rows.T @ direction.rows  # the same for directions that differ by a rotation or a reflection
        scale = float(square.diagonal().max(initial=0.0)) or 1.0
        row, column = np.nonzero(np.abs(square) > 1e-12 * scale)
        values = np.round(square[row, column] / (scale * SAME)) * SAME + 0.0  # no negative zeros
        key = direction.columns[row].tobytes(), direction.columns[column].tobytes(), values.tobytes()
        found.setdefault(key, []).append(name)
    return tuple(
        Family(tuple(names), tuple(map(directions.__getitem__, names)), bool((directions[names[0]].columns < free).any()))
        for names in found.values()
    )


def point_expression(
    mechanism: Mechanism, offsets: dict[str, int], point: BodyPoint, ones: int, size: float = 1.0
) -> tuple[Expression, Expression]:
    """Both components of a point of a body in natural coordinates; see `fixed_expression`."""
    body, name = point
    named = dict(mechanism.ground) if body == GROUND else mechanism.body(body).points
    return fixed_expression(mechanism, offsets, body, named[name], ones, size)


def fixed_expression(
    mechanism: Mechanism, offsets: dict[str, int], body_name: str, point: Point, ones: int, size: float = 1.0
) -> tuple[Expression, Expression]:
    """Both components of a point in the frame of a body, or of the ground, in natural coordinates; column `ones` stands for 1.

    Lengths and origins are in units of `size`.
    """
    x, y = point[0] / size, point[1] / size
    if body_name == GROUND:
        return {ones: x}, {ones: y}
    body, p = mechanism.body(body_name), offsets[body_name]
    if not body.rotates:
        cos, sin = math.cos(body.angle), math.sin(body.angle)
        return {p: 1.0, ones: cos * x - sin * y}, {p + 1: 1.0, ones: sin * x + cos * y}
    return {p: 1.0, p + 2: x, p + 3: -y}, {p + 1: 1.0, p + 2: y, p + 3: x}
