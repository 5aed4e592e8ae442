"""The coordinates of a mechanism with its linear constraints eliminated: natural ones as affine functions of few free ones."""

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

SAME = 1e-9  # Products of coefficients, the largest one being one, that are the same to within this belong to parallel bodies


@dataclass(frozen=True)
class PointMap:
    """A plane vector that is linear in [x; b]: its columns and, for each, the coefficients of both components."""

    columns: np.ndarray  # (k,) In increasing order
    rows: np.ndarray  # (2, k)

    def at(self, full: np.ndarray) -> np.ndarray:
        """The vector at [x; b], shape (2,), or at many of them, shape (nt, 2)."""
        return np.asarray(full[..., self.columns] @ self.rows.T)

    def turned(self, cos: float, sin: float) -> PointMap:
        """The vector, turned by an angle."""
        return PointMap(self.columns, np.array([[cos, -sin], [sin, cos]]) @ self.rows)


@dataclass(frozen=True)
class Constraint:
    """A constraint: the sum of weight |map|^2 / 2, or of weight times another function of the map, is `value`.

    The maps have no unit and are of the order of one: those with a length are divided by `scale`. Of a coupling the weights
    and the value are divided by it.
    """

    parts: tuple[tuple[float, PointMap], ...]  # Weights and maps
    value: float  # At t = 0
    scale: float = 1.0  # Length that the maps are divided by [m]; 1 for directions
    name: str = ""  # Of the rod, latch or coupling that the constraint represents
    motion: TimeFunction | None = None  # Distance that a rod prescribes over time [m], or coordinate of a drive
    start: float = 0.0  # Where a motion starts of which only the speed is given
    kinds: tuple[int, ...] = ()  # What the parts are, see `mechanics.constraint_part`; half squares by default
    turning: tuple[tuple[str, float], ...] = ()  # Bodies whose angles parts are, and where their turns are counted from [rad]
    latch: bool = False  # Whether the constraint is active only once the latch has locked
    subject: str = ""  # What it keeps, for messages: bodies of unit length, a guide, a rod or a latch
    bodies: tuple[str, ...] = ()  # Whose motion it restricts
    # Of a coupling factors and coordinates on which its force acts, and whether these are its parts, as wheels can move against
    # its base: see `plan.transmission`
    acting: tuple[tuple[float, Any], ...] = ()
    moving: bool = False

    @property
    def linear(self) -> bool:
        """Whether its value is its time function, and not half the square of that."""
        return bool(self.kinds)

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


def stacked(maps: Sequence[PointMap], height: int, name: str = "") -> dict[str, np.ndarray]:
    """Starts, columns and rows of some maps, one after the other, as fields that a name begins."""
    starts = np.array(list(itertools.accumulate((vector.columns.size for vector in maps), initial=0)), np.int64)
    columns = np.concatenate([np.zeros(0, np.int64), *(vector.columns for vector in maps)])
    rows = np.ascontiguousarray(np.hstack([np.zeros((height, 0)), *(vector.rows for vector in maps)]))
    return {f"{name}start": starts, f"{name}column": columns, f"{name}row": rows}


@dataclass(frozen=True)
class Natural:
    """The natural coordinates of some bodies: the origin p of each and, if it rotates, the unit vector d along its x axis.

    Every point of a body is p + x d + y J d, linear in both. Of a cross-section of a bar that bends, unless it is clamped, the
    tangent of the bar stands for d, which has unit length but for the strain.
    """

    bodies: dict[str, Body]
    ground: dict[str, Point]  # Named points of the fixed frame [m]
    offsets: dict[str, int]  # First coordinate of each body
    total: int  # Their number; as a column it stands for 1
    axes: tuple[Axis, ...] = ()  # The bars that bend; the amplitudes of their modes come last
    # Of the cross-sections without a direction of their own, the bar and their number on it
    tangents: Mapping[str, tuple[Axis, int]] = field(default_factory=dict)

    def angle(self, body: str) -> float:
        """Angle at which a body, or the ground, is placed [rad]."""
        return 0.0 if body == GROUND else self.bodies[body].placed_angle

    def rotates(self, body: str) -> bool:
        """Whether it is a body with a direction among the coordinates."""
        return body != GROUND and self.bodies[body].rotates and body not in self.tangents

    def direction(self, body: str) -> tuple[Expression, Expression]:
        """The vector along the x axis of a body that turns."""
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
        """Angle of a body at natural coordinates, from -pi to pi [rad]; as placed for one that does not rotate."""
        if not self.bodies[body].rotates:
            return self.bodies[body].placed_angle
        x, y = (sum(value * float(natural[column]) for column, value in row.items()) for row in self.direction(body))
        return math.atan2(y, x)

    def fixed(self, body: str, point: str | Point, size: float = 1.0) -> tuple[Expression, Expression]:
        """Both components of a point, by its name or in the frame of a body or of the ground; lengths in units of `size`."""
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
        """Natural coordinates and velocities of the bodies as the user placed them."""
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
        """Write the amplitudes of modes with which bars are bent by forces at their cross-sections alone, or straight.

        Slopes that are no directions of bodies are those of the lines between the ends.
        """
        for axis in self.axes:
            for p in axis.slopes:
                first_end, last_end = (int(axis.first[k]) for k in (0, len(axis.bar.sections) - 1))
                position[p : p + 2] = (
                    position[last_end : last_end + 2] - position[first_end : first_end + 2]
                ) / axis.bar.length
            amplitudes = axis.in_static_deflection(position)
            for q, p in zip(amplitudes, axis.first[axis.shapes.held :].tolist(), strict=True):
                position[p : p + 2] = q

    def uniform(self, vector: np.ndarray) -> np.ndarray:
        """Natural coordinates of all bodies moved by a vector."""
        position = np.zeros(self.total)
        for p in self.offsets.values():
            position[p : p + 2] = vector
        self.deflect_statically(position)
        return position


def natural_coordinates(mechanism: Mechanism) -> Natural:
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
    """Bodies that keep their relative directions, turned or mirrored."""

    bodies: tuple[str, ...]
    maps: tuple[PointMap, ...]  # Their directions
    free: bool  # Whether a free coordinate enters


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Natural coordinates as T [x; b(t)], with T constant and b = (1, cos th_1, sin th_1, ...) the prescribed directions."""

    natural: Natural = field(repr=False)
    free: int  # Number n of free coordinates x
    basis: int  # Number nb of entries of b(t)
    matrix: Any = field(repr=False)  # (nZ, n + nb) T
    mass: Any = field(repr=False)  # (nZ, nZ) Mass matrix of the natural coordinates [kg, kg m, kg m^2]
    size: float  # Length of the mechanism's parts [m]
    constraints: tuple[Constraint, ...] = ()  # Unit lengths, moving guides, rods and latches, ordered for a narrow band
    redundant: tuple[str, ...] = ()  # Subjects of constraints that were left out because they follow from the others
    miss: float = 0.0  # By how much these do not follow, as a fraction of what they keep: the rounding of lengths

    def with_constraints(
        self, constraints: tuple[Constraint, ...], redundant: tuple[str, ...] = (), miss: float = 0.0
    ) -> Coordinates:
        """The same with these constraints; what is known of the coordinates is taken along."""
        changed = replace(self, constraints=constraints, redundant=redundant, miss=miss)
        fields = Coordinates.__dataclass_fields__
        changed.__dict__.update({name: value for name, value in self.__dict__.items() if name not in fields})
        return changed

    def place(self, point: BodyPoint) -> PointMap:
        """Position of a point of a body."""
        return self.at(*point)

    def tracked(self, track: Track) -> PointMap:
        return self.at(track.body, track.point)

    @cached_property
    def placed(self) -> tuple[np.ndarray, np.ndarray]:
        """Natural coordinates and velocities of the bodies as the user placed them."""
        return self.natural.placed()

    def nearest(self, b: np.ndarray, natural: np.ndarray) -> np.ndarray:
        """Free coordinates (or their rates) nearest, in the sense of kinetic energy, to natural coordinates (or velocities)."""
        moving, driven = self.matrix[:, : self.free], self.matrix[:, self.free :]
        return np.asarray(moving.T @ (self.mass @ (natural - driven @ b)))

    @cached_property
    def reach(self) -> np.ndarray:
        """How far each free coordinate moves a point of a body, at most, shape (n,)."""
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
        """Distance of a body's farthest point from the origin, at most [m]."""
        return max((math.hypot(*body.placed_position) + body.extent for body in self.natural.bodies.values()), default=1.0)

    def at(self, body: str, point: str | Point) -> PointMap:
        """Position of a point, by its name or in the frame of a body or of the ground."""
        return self._map(self.natural.fixed(body, point))

    def vector(self, x: Expression, y: Expression) -> PointMap:
        """A vector whose components are given in natural coordinates."""
        return self._map((x, y))

    def origin(self, body: str) -> PointMap:
        """Position of the origin of a body."""
        p = self.natural.offsets[body]
        return self._map(({p: 1.0}, {p + 1: 1.0}))

    def direction(self, body: str) -> PointMap:
        """Direction vector of a body; nothing for the ground and for a body that does not rotate."""
        vector = self._directions.get(body)
        return PointMap(np.empty(0, np.int64), np.empty((2, 0))) if vector is None else vector

    def frame(self, body: str) -> PointMap:
        """Direction vector of a body's x axis, constant for the ground and for a body that does not rotate."""
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
        """The rotating bodies, by families."""
        return find_families(self._directions, self.free)

    @cached_property
    def _rows(self) -> list[list[tuple[int, float]]]:
        """Columns and coefficients of each natural coordinate."""
        if isinstance(self.matrix, np.ndarray):
            return [[(column, value) for column, value in enumerate(row) if value] for row in self.matrix.tolist()]
        pairs = list(zip(self.matrix.indices.tolist(), self.matrix.data.tolist(), strict=True))
        return [pairs[a:b] for a, b in itertools.pairwise(self.matrix.indptr.tolist())]

    def _map(self, pair: tuple[Expression, Expression]) -> PointMap:
        """A pair of expressions in natural coordinates as a map of [x; b]."""
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
    """Bodies by families, from their directions as maps of so many free coordinates and the basis."""
    families: dict[tuple[bytes, ...], list[str]] = {}
    for name, direction in directions.items():
        square = direction.rows.T @ direction.rows  # the same for directions that differ by a rotation or a reflection
        scale = float(square.diagonal().max(initial=0.0)) or 1.0
        row, column = np.nonzero(np.abs(square) > 1e-12 * scale)
        values = np.round(square[row, column] / (scale * SAME)) * SAME + 0.0  # no negative zeros
        key = direction.columns[row].tobytes(), direction.columns[column].tobytes(), values.tobytes()
        families.setdefault(key, []).append(name)
    return tuple(
        Family(tuple(names), tuple(map(directions.__getitem__, names)), bool((directions[names[0]].columns < free).any()))
        for names in families.values()
    )
