"""Reduced coordinates: natural coordinates as affine functions of few free ones, after elimination of linear constraints."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.port import AXIS
from scissordyn.components.time_function import TimeFunction
from scissordyn.model.body import Body, Track
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.elimination import Expression, add, scaled
from scissordyn.plan.flexible import Axis, axes_of, clamped_bodies


@dataclass(frozen=True)
class PointMap:
    """Plane vector, linear in free coordinates and drive directions: indices of those it depends on, and coefficients."""

    columns: np.ndarray  # (k,) In increasing order
    rows: np.ndarray  # (2, k)

    def at(self, full: np.ndarray) -> np.ndarray:
        """Return the vector at the coordinates `full`, shape (2,), or at many of them, shape (nt, 2)."""
        return np.asarray(full[..., self.columns] @ self.rows.T)

    def turned(self, cos: float, sin: float) -> PointMap:
        """Return the vector rotated by an angle."""
        return PointMap(self.columns, np.array([[cos, -sin], [sin, cos]]) @ self.rows)


@dataclass(frozen=True)
class Constraint:
    """Constraint: the sum over its parts of weight |map|^2 / 2, or of weight times another function of the map, is `value`.

    The maps are dimensionless and of the order of one; those with a length are divided by `scale`. For a coupling, the weights
    and the value are divided by it.
    """

    parts: tuple[tuple[float, PointMap], ...]  # Weights and maps
    value: float  # Value at t = 0
    scale: float = 1.0  # Length that the maps are divided by [m]; 1 for directions
    name: str = ""  # Name of the rod, latch or coupling
    motion: TimeFunction | None = None  # Length of a rod over time [m], or coordinate of a drive
    start: float = 0.0  # Initial value of a motion given only by its speed
    kinds: tuple[int, ...] = ()  # Kinds of the parts, see `mechanics.constraint_part`; half squares by default
    # Bodies whose angles are parts, and the angles from which turns are counted [rad]
    turning: tuple[tuple[str, float], ...] = ()
    latch: bool = False  # True if the constraint acts only once the latch has locked
    subject: str = ""  # Subject for messages: bodies of unit length, a guide, a rod or a latch
    bodies: tuple[str, ...] = ()  # Bodies whose motion it restricts
    # Factors and coordinates on which the force of a coupling acts (`plan.transmission`)
    acting: tuple[tuple[float, Any], ...] = ()
    # True if the parts are the coordinates in `acting`, because the centres of wheels can move relative to the base
    moving: bool = False

    @property
    def linear(self) -> bool:
        """True if the value is the time function itself, not half its square."""
        return bool(self.kinds)

    @property
    def columns(self) -> np.ndarray:
        """Indices of the coordinates on which the maps of the parts depend, part after part."""
        return np.concatenate([point_map.columns for _, point_map in self.parts])


def joined(parts: Iterable[tuple[PointMap, int, float]], height: int = 6) -> PointMap:
    """Return one map with `height` rows: the sum of parts (map of two rows, row at which it begins, factor)."""
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
    """Return a linear combination of maps."""
    return joined(((point_map, 0, factor) for point_map, factor in parts), 2)


def stacked(maps: Sequence[PointMap], height: int, name: str = "") -> dict[str, np.ndarray]:
    """Concatenate maps; return where each starts, and all columns and rows, as arrays by field name, beginning with `name`."""
    starts = np.array(list(itertools.accumulate((vector.columns.size for vector in maps), initial=0)), np.int64)
    columns = np.concatenate([np.zeros(0, np.int64), *(vector.columns for vector in maps)])
    rows = np.ascontiguousarray(np.hstack([np.zeros((height, 0)), *(vector.rows for vector in maps)]))
    return {f"{name}start": starts, f"{name}column": columns, f"{name}row": rows}


@dataclass(frozen=True)
class Natural:
    """Natural coordinates of some bodies: the origin p and, if the body rotates, the unit vector d along its x axis.

    Every point of a body is p + x d + y J d, linear in both. For a cross-section of a flexible bar that is not clamped, the
    tangent of the bar replaces d. Its length is one plus the strain.
    """

    bodies: dict[str, Body]
    ground: dict[str, Point]  # Named points of the fixed frame [m]
    offsets: dict[str, int]  # First coordinate of each body
    total: int  # Number of coordinates; as a column index it means the constant 1
    axes: tuple[Axis, ...] = ()  # Flexible bars; the amplitudes of their modes come last
    # Bar and index of each cross-section without a direction of its own
    tangents: Mapping[str, tuple[Axis, int]] = field(default_factory=dict)

    def angle(self, body: str) -> float:
        """Return the angle at which a body, or the ground, is placed [rad]."""
        return 0.0 if body == GROUND else self.bodies[body].placed_angle

    def rotates(self, body: str) -> bool:
        """Return whether a body has a direction among the coordinates."""
        return body != GROUND and self.bodies[body].rotates and body not in self.tangents

    def direction(self, body: str) -> tuple[Expression, Expression]:
        """Return the vector along the x axis of a rotating body."""
        if body not in self.tangents:
            d = self.offsets[body] + 2
            return {d: 1.0}, {d + 1: 1.0}
        axis, k = self.tangents[body]
        slope, angle = axis.shapes.at(np.array([axis.shapes.places[k]]), 1)[0], axis.bar.angles[k]
        x, y = axis.expression(slope)
        if angle == 0.0:
            return x, y
        cos, sin = math.cos(angle), math.sin(angle)
        return add(scaled(cos, x), scaled(sin, y)), add(scaled(-sin, x), scaled(cos, y))

    def angle_of(self, body: str, natural: np.ndarray) -> float:
        """Return the angle of a body, from -pi to pi [rad]; the placed angle if it does not rotate."""
        if not self.bodies[body].rotates:
            return self.bodies[body].placed_angle
        x, y = (sum(value * float(natural[column]) for column, value in row.items()) for row in self.direction(body))
        return math.atan2(y, x)

    def point_expressions(self, body: str, point: str | Point, size: float = 1.0) -> tuple[Expression, Expression]:
        """Return both components of a point (name, or position in the frame of a body or the ground), in units of `size`."""
        if isinstance(point, str):
            point = (self.ground if body == GROUND else self.bodies[body].points)[point]
        x, y = point[0] / size, point[1] / size
        if body == GROUND:
            return {self.total: x}, {self.total: y}
        p, placed = self.offsets[body], self.bodies[body]
        if body in self.tangents:
            if point == (0.0, 0.0):
                return {p: 1.0}, {p + 1: 1.0}
            dx, dy = self.direction(body)
            along = add({p: 1.0}, add(scaled(x, dx), scaled(-y, dy)))
            return along, add({p + 1: 1.0}, add(scaled(y, dx), scaled(x, dy)))
        if not placed.rotates:
            cos, sin = math.cos(placed.placed_angle), math.sin(placed.placed_angle)
            return {p: 1.0, self.total: cos * x - sin * y}, {p + 1: 1.0, self.total: sin * x + cos * y}
        return {p: 1.0, p + 2: x, p + 3: -y}, {p + 1: 1.0, p + 2: y, p + 3: x}

    def placed(self) -> tuple[np.ndarray, np.ndarray]:
        """Return natural coordinates and velocities of the bodies as placed."""
        position, velocity = np.zeros(self.total), np.zeros(self.total)
        for name, body in self.bodies.items():
            p = self.offsets[name]
            position[p : p + 2] = body.placed_position
            velocity[p : p + 2] = body.velocity or (0.0, 0.0)
            if self.rotates(name):
                cos, sin, speed = math.cos(body.placed_angle), math.sin(body.placed_angle), body.angular_velocity or 0.0
                position[p + 2 : p + 4] = cos, sin
                velocity[p + 2 : p + 4] = -sin * speed, cos * speed
        self.deflect_statically(position)
        self.deflect_statically(velocity)
        return position, velocity

    def deflect_statically(self, position: np.ndarray) -> None:
        """Set the amplitudes of modes to the static deflection of bars loaded at their cross-sections only.

        Slopes that are not directions of bodies are set to those of the lines between the ends.
        """
        for axis in self.axes:
            for p in axis.slopes:
                first_end, last_end = (int(axis.first[k]) for k in (0, len(axis.bar.sections) - 1))
                position[p : p + 2] = (
                    position[last_end : last_end + 2] - position[first_end : first_end + 2]
                ) / axis.bar.length
            amplitudes = axis.static_amplitudes(position)
            for q, p in zip(amplitudes, axis.first[axis.shapes.interface_count :].tolist(), strict=True):
                position[p : p + 2] = q

    def translation(self, vector: np.ndarray) -> np.ndarray:
        """Return the change of all natural coordinates if the whole mechanism is displaced by a vector."""
        position = np.zeros(self.total)
        for p in self.offsets.values():
            position[p : p + 2] = vector
        self.deflect_statically(position)
        return position


def natural_coordinates(mechanism: Mechanism) -> Natural:
    """Return the natural coordinates of a mechanism: the index of the first one of each body, and the flexible bars."""
    bodies, ground = {body.name: body for body in mechanism.bodies}, dict(mechanism.ground)
    bent = {name for part in mechanism.components if part.declaration.port is AXIS for name in part.sections}  # type: ignore[attr-defined]
    clamped = clamped_bodies(mechanism) if bent else frozenset()
    offsets, total = {}, 0
    for body in mechanism.bodies:
        offsets[body.name] = total
        total += 4 if body.rotates and (body.name not in bent or body.name in clamped) else 2
    if not bent:
        return Natural(bodies, ground, offsets, total)
    axes, total = axes_of(mechanism, offsets, clamped, total)
    tangents = {name: (axis, k) for axis in axes for k, name in enumerate(axis.bar.sections) if name not in clamped}
    return Natural(bodies, ground, offsets, total, axes, tangents)


@dataclass(frozen=True)
class Family:
    """Rotating bodies whose angles differ by constants or are mirrored, such as parallel bars, so that one angle gives all."""

    bodies: tuple[str, ...]
    maps: tuple[PointMap, ...]  # Direction vectors of the bodies
    free: bool  # True if a direction depends on a free coordinate


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Natural coordinates as T [x; b(t)], with T constant and b = (1, cos th_1, sin th_1, ...) the prescribed directions."""

    natural: Natural = field(repr=False)
    free: int  # Number n of free coordinates x
    basis: int  # Number nb of entries of b(t)
    matrix: Any = field(repr=False)  # (nZ, n + nb) T
    mass: Any = field(repr=False)  # (nZ, nZ) Mass matrix of the natural coordinates [kg, kg m, kg m^2]
    size: float  # Size of the mechanism [m]
    constraints: tuple[Constraint, ...] = ()  # Unit lengths, moving guides, rods and latches, ordered for a small bandwidth
    redundant: tuple[str, ...] = ()  # Subjects of constraints dropped because they follow from others
    miss: float = 0.0  # Largest relative error of a dropped constraint, from rounded lengths

    def with_constraints(
        self, constraints: tuple[Constraint, ...], redundant: tuple[str, ...] = (), miss: float = 0.0
    ) -> Coordinates:
        """Return a copy with other constraints that keeps the cached maps."""
        changed = replace(self, constraints=constraints, redundant=redundant, miss=miss)
        fields = Coordinates.__dataclass_fields__
        changed.__dict__.update({name: value for name, value in self.__dict__.items() if name not in fields})
        return changed

    @property
    def mobility(self) -> int:
        """Number of degrees of freedom with drives, couplings and open latches."""
        return self.free - sum(not constraint.latch for constraint in self.constraints)

    def place(self, point: BodyPoint) -> PointMap:
        return self.at(*point)

    def tracked(self, track: Track) -> PointMap:
        return self.at(track.body, track.point)

    @cached_property
    def placed(self) -> tuple[np.ndarray, np.ndarray]:
        """Natural coordinates and velocities of the bodies as placed."""
        return self.natural.placed()

    def nearest(self, b: np.ndarray, natural: np.ndarray) -> np.ndarray:
        """Return free coordinates (or rates) nearest to natural coordinates (or velocities) in the norm of kinetic energy."""
        moving, driven = self._columns
        return np.asarray(moving @ (self.mass @ (natural - driven @ b)))

    @cached_property
    def _columns(self) -> tuple[Any, Any]:
        """Transposed columns of the matrix for free coordinates, and its columns for drive directions."""
        return self.matrix[:, : self.free].T, self.matrix[:, self.free :]

    @cached_property
    def reach(self) -> np.ndarray:
        """Largest displacement of any point of a body per unit of each free coordinate, shape (n,)."""
        moved = np.ones(self.matrix.shape[0])
        for name, body in self.natural.bodies.items():
            if self.natural.rotates(name):
                moved[self.natural.offsets[name] + 2 :][:2] = body.extent
        moving = abs(self.matrix[:, : self.free])
        if isinstance(moving, np.ndarray):
            return np.asarray(np.max(moved[:, None] * moving, axis=0, initial=0.0))
        return np.asarray((moving.multiply(moved[:, None])).max(axis=0).toarray()).ravel()

    @cached_property
    def farthest(self) -> float:
        """Upper bound on the distance of a body's point from the origin [m]."""
        return max((math.hypot(*body.placed_position) + body.extent for body in self.natural.bodies.values()), default=1.0)

    def at(self, body: str, point: str | Point) -> PointMap:
        """Return the position of a point, given by name or in the frame of a body or the ground."""
        return self._map(self.natural.point_expressions(body, point))

    def vector(self, x: Expression, y: Expression) -> PointMap:
        """Return the map of a vector whose components are given in natural coordinates."""
        return self._map((x, y))

    def origin(self, body: str) -> PointMap:
        p = self.natural.offsets[body]
        return self._map(({p: 1.0}, {p + 1: 1.0}))

    def direction(self, body: str) -> PointMap:
        """Return the direction vector of a body; an empty map for the ground or a body that does not rotate."""
        vector = self._directions.get(body)
        return PointMap(np.empty(0, np.int64), np.empty((2, 0))) if vector is None else vector

    def frame(self, body: str) -> PointMap:
        """Return the direction vector of a body's x axis; constant for the ground or a body that does not rotate."""
        if self.natural.rotates(body) or body in self.natural.tangents:
            return self.direction(body)
        angle = self.natural.angle(body)
        return PointMap(np.array([self.free], np.int64), np.array([[math.cos(angle)], [math.sin(angle)]]))

    @cached_property
    def _directions(self) -> dict[str, PointMap]:
        """Direction vectors of the bodies that rotate."""
        vectors = {}
        for name, body in self.natural.bodies.items():
            if body.rotates:
                vectors[name] = self._map(self.natural.direction(name))
        return vectors

    @cached_property
    def families(self) -> tuple[Family, ...]:
        """Rotating bodies, grouped by families."""
        return find_families(self._directions, self.free)

    @cached_property
    def _rows(self) -> list[list[tuple[int, float]]]:
        """Columns and coefficients of each natural coordinate."""
        if isinstance(self.matrix, np.ndarray):
            return [[(column, value) for column, value in enumerate(row) if value] for row in self.matrix.tolist()]
        pairs = list(zip(self.matrix.indices.tolist(), self.matrix.data.tolist(), strict=True))
        return [pairs[a:b] for a, b in itertools.pairwise(self.matrix.indptr.tolist())]

    def _map(self, pair: tuple[Expression, Expression]) -> PointMap:
        """Return a vector, given by expressions in natural coordinates, as a map of free coordinates and drive directions."""
        table: dict[int, list[float]] = {}
        rows, ones = self._rows, self.natural.total
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
    """Group the bodies whose directions differ only by a constant rotation or a reflection, into families.

    The first `free` coordinates are free, the others are drive directions.
    """
    families: dict[tuple[bytes, ...], list[str]] = {}
    for name, direction in directions.items():
        square = direction.rows.T @ direction.rows  # equal for directions that differ by a rotation or a reflection
        scale = float(square.diagonal().max(initial=0.0)) or 1.0
        row, column = np.nonzero(np.abs(square) > 1e-12 * scale)
        rounded = 1e-9  # relative to the largest product
        values = np.round(square[row, column] / (scale * rounded)) * rounded + 0.0  # no negative zeros
        key = direction.columns[row].tobytes(), direction.columns[column].tobytes(), values.tobytes()
        families.setdefault(key, []).append(name)
    return tuple(
        Family(tuple(names), tuple(map(directions.__getitem__, names)), bool((directions[names[0]].columns < free).any()))
        for names in families.values()
    )
