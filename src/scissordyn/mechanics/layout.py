"""From a mechanism to constant matrices: natural coordinates with all linear joints eliminated.

Each body is its origin p and, if it rotates, the unit vector d along its x axis; every point of it is p + x d + y J d,
linear in both. Pins, guides and prescribed directions are linear conditions, and so is the parallelism of opposite bars in a
parallelogram of ideal joints. What is left: coordinates = T [x; b(t)], with T constant, x the free coordinates scaled so
that their mass matrix is the identity, b = (1, cos th_1, sin th_1, ...) the prescribed directions, and quadratic
conditions: |d|^2 = 1 per family of parallel bars, and one for each guide on a moving body, massless link and latch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from scissordyn.errors import InputError
from scissordyn.mechanics.elimination import Elimination, Expression, add, scaled
from scissordyn.mechanics.motion import course_start
from scissordyn.mechanics.parallelogram import parallel_bodies
from scissordyn.model.body import GROUND, Body, Point
from scissordyn.model.connection import Weld
from scissordyn.model.drive import Motion
from scissordyn.model.element import Actuator, Motor
from scissordyn.model.joint import BodyPoint
from scissordyn.model.mechanism import Mechanism

__all__ = ["Condition", "Form", "Layout", "join_forms", "lay_out", "turning_inertia"]


SMALL = 200
"""Up to so many natural coordinates full matrices are quicker to handle than sparse ones."""


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
    motion : Motion, optional
        Course of the length sqrt(2 level) of a link over time.
    latch : bool
        Whether the condition holds only once the latch has locked.
    """

    parts: tuple[tuple[float, Form], ...]
    level: float
    name: str = ""
    motion: Motion | None = None
    latch: bool = False

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
    """

    mechanism: Mechanism
    free: int
    basis: int
    coordinates: sp.csr_array
    mass: sp.csr_array
    offsets: dict[str, int]
    weight: np.ndarray
    conditions: tuple[Condition, ...]

    def place(self, point: BodyPoint) -> Form:
        """Position of a body's point."""
        return self._form(_point(self.mechanism, self.offsets, point, self._ones))

    def at(self, body: str, point: Point) -> Form:
        """Position of a point in the frame of a body, or of the ground."""
        return self._form(_fixed_to(self.mechanism, self.offsets, body, point, self._ones))

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


def lay_out(mechanism: Mechanism) -> Layout:
    """Eliminate all linear conditions of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    Layout

    Raises
    ------
    InputError
        If the joints and drives contradict each other.
    """
    offsets, total = {}, 0
    preferred: list[bool] = []
    for body in mechanism.bodies:
        offsets[body.name] = total
        # origins are eliminated before directions: lengths then stay short expressions
        preferred += [True, True, False, False] if body.rotates else [True, True]
        total = len(preferred)
    elimination = Elimination(preferred)
    _impose(mechanism, offsets, total, elimination)

    free = [column for column in range(total) if column not in elimination.solved]
    basis = 1 + 2 * len(mechanism.drives)
    position = {column: index for index, column in enumerate(free)}
    position.update({total + index: len(free) + index for index in range(basis)})
    entries = [
        (row, position[column], value)
        for row in range(total)
        for column, value in (elimination.resolve({row: 1.0}) if row in elimination.solved else {row: 1.0}).items()
    ]
    rows, columns, values = (np.array(part) for part in zip(*entries, strict=True))
    coordinates = sp.csr_array((values, (rows, columns)), shape=(total, len(free) + basis))
    mass, weight = _mass(mechanism, offsets, total), _weight(mechanism, offsets, total)
    coordinates = _normalize(coordinates, mass, len(free))
    bare = Layout(mechanism, len(free), basis, coordinates, mass, offsets, weight, ())
    return Layout(mechanism, len(free), basis, coordinates, mass, offsets, weight, _conditions(bare))


def _impose(mechanism: Mechanism, offsets: dict[str, int], ones: int, elimination: Elimination) -> None:
    for index, drive in enumerate(mechanism.drives):
        d = offsets[drive.body] + 2
        for axis in (0, 1):
            elimination.impose({d + axis: 1.0, ones + 1 + 2 * index + axis: -1.0}, f"the drive of body '{drive.body}'")
    for one, other, turn in parallel_bodies(mechanism):
        name = f"the parallelogram of bodies '{one}' and '{other}'"
        _impose_turn(offsets, ones, elimination, one, other, turn, name)
    for weld in mechanism.welds:
        _impose_weld(mechanism, offsets, ones, elimination, weld)
    for joint in mechanism.ideal:
        here = _point(mechanism, offsets, joint.journal, ones)
        there = _point(mechanism, offsets, joint.bearing, ones)
        for axis in (0, 1):
            elimination.impose(add(here[axis], scaled(-1.0, there[axis])), f"joint '{joint.name}'")
    for guide in mechanism.guides:
        if guide.clearance is not None:
            continue
        if guide.aligned:
            follower = mechanism.body(guide.follower[0])
            base = 0.0 if guide.body == GROUND else mechanism.body(guide.body).angle
            _impose_turn(offsets, ones, elimination, guide.body, follower.name, follower.angle - base, f"guide '{guide.name}'")
        if guide.body != GROUND:
            continue
        x, y = _point(mechanism, offsets, guide.follower, ones)
        across = -math.sin(guide.direction), math.cos(guide.direction)
        level = across[0] * guide.through[0] + across[1] * guide.through[1]
        elimination.impose(add(scaled(across[0], x), scaled(across[1], y), {ones: -level}), f"guide '{guide.name}'")


def _impose_weld(mechanism: Mechanism, offsets: dict[str, int], ones: int, elimination: Elimination, weld: Weld) -> None:
    name = f"weld '{weld.name}'"
    here, there = (_point(mechanism, offsets, point, ones) for point in (weld.start, weld.end))
    turning = [body for body, _ in (weld.start, weld.end) if body != GROUND and mechanism.body(body).rotates]
    angles = {body: mechanism.body(body).angle for body in turning}
    if len(turning) == 2:
        first, second = turning
        _impose_turn(offsets, ones, elimination, first, second, angles[second] - angles[first], name)
    elif turning:
        _impose_turn(offsets, ones, elimination, GROUND, turning[0], angles[turning[0]], name)
    for axis in (0, 1):
        elimination.impose(add(here[axis], scaled(-1.0, there[axis])), name)


def _impose_turn(
    offsets: dict[str, int], ones: int, elimination: Elimination, one: str, other: str, turn: float, name: str
) -> None:
    """Keep the direction of a body at a constant angle from that of another, or of the ground."""
    b, cos, sin = offsets[other] + 2, math.cos(turn), math.sin(turn)
    if one == GROUND:
        elimination.impose({b: 1.0, ones: -cos}, name)
        elimination.impose({b + 1: 1.0, ones: -sin}, name)
        return
    a = offsets[one] + 2
    elimination.impose({b: 1.0, a: -cos, a + 1: sin}, name)
    elimination.impose({b + 1: 1.0, a: -sin, a + 1: -cos}, name)


def turning_inertia(mechanism: Mechanism, body: Body) -> float:
    """Moment of inertia of a body about its mass centre with the rotors of its motors and actuators [kg m^2]."""
    motors = (element for element in mechanism.elements if isinstance(element, Motor | Actuator))
    rotors = (motor.inertia for motor in motors if motor.body == body.name)
    return (body.inertia or 0.0) + sum(rotors)


def _point(mechanism: Mechanism, offsets: dict[str, int], point: BodyPoint, ones: int) -> tuple[Expression, Expression]:
    body, name = point
    named = dict(mechanism.ground) if body == GROUND else mechanism.body(body).points
    return _fixed_to(mechanism, offsets, body, named[name], ones)


def _fixed_to(
    mechanism: Mechanism, offsets: dict[str, int], body_name: str, point: Point, ones: int
) -> tuple[Expression, Expression]:
    x, y = point
    if body_name == GROUND:
        return {ones: x}, {ones: y}
    body, p = mechanism.body(body_name), offsets[body_name]
    if not body.rotates:
        cos, sin = math.cos(body.angle), math.sin(body.angle)
        return {p: 1.0, ones: cos * x - sin * y}, {p + 1: 1.0, ones: sin * x + cos * y}
    return {p: 1.0, p + 2: x, p + 3: -y}, {p + 1: 1.0, p + 2: y, p + 3: x}


def _mass(mechanism: Mechanism, offsets: dict[str, int], total: int) -> sp.csr_array:
    rows, columns, values = [], [], []

    def enter(row: int, column: int, value: float) -> None:
        rows.append(row)
        columns.append(column)
        values.append(value)

    for body in mechanism.bodies:
        p, m, (x, y) = offsets[body.name], body.mass, body.centre
        enter(p, p, m)
        enter(p + 1, p + 1, m)
        if body.inertia is None:
            continue
        about_origin = turning_inertia(mechanism, body) + m * (x * x + y * y)
        enter(p + 2, p + 2, about_origin)
        enter(p + 3, p + 3, about_origin)
        for row, column, value in ((p, p + 2, m * x), (p, p + 3, -m * y), (p + 1, p + 2, m * y), (p + 1, p + 3, m * x)):
            enter(row, column, value)
            enter(column, row, value)
    return sp.csr_array((values, (rows, columns)), shape=(total, total))


def _weight(mechanism: Mechanism, offsets: dict[str, int], total: int) -> np.ndarray:
    weight = np.zeros(total)
    gx = mechanism.gravity * math.cos(mechanism.gravity_direction)
    gy = mechanism.gravity * math.sin(mechanism.gravity_direction)
    for body in mechanism.bodies:
        p, m, (x, y) = offsets[body.name], body.mass, body.centre
        weight[p : p + 2] = m * gx, m * gy
        if body.rotates:
            weight[p + 2 : p + 4] = m * (x * gx + y * gy), m * (x * gy - y * gx)
    return weight


def _normalize(coordinates: sp.csr_array, mass: sp.csr_array, free: int) -> sp.csr_array:
    """Scale and mix the free coordinates, block by block, so that their mass matrix is the identity."""
    if coordinates.shape[0] <= SMALL:
        dense = coordinates.toarray()
        moving = dense[:, :free]
        lower = np.linalg.cholesky(moving.T @ mass.toarray() @ moving)
        dense[:, :free] = moving @ np.linalg.inv(lower).T
        return sp.csr_array(dense)
    reduced = sp.csr_array(coordinates[:, :free].T @ mass @ coordinates[:, :free])
    count, label = connected_components(reduced, directed=False)
    order = np.argsort(label, kind="stable")
    sizes = np.bincount(label, minlength=count)
    blocks, first = [], 0
    for size in sizes.tolist():
        members = order[first : first + size]
        lower = np.linalg.cholesky(reduced[members][:, members].toarray())
        blocks.append(np.linalg.inv(lower).T)
        first += size
    back = np.argsort(order)
    mixing = sp.csr_array(sp.block_diag(blocks, format="csr"))[back][:, back]
    mixed = coordinates[:, :free] @ mixing
    result = sp.csr_array(sp.hstack([mixed, coordinates[:, free:]]))
    result.eliminate_zeros()
    result.sort_indices()
    return result


def _conditions(layout: Layout) -> tuple[Condition, ...]:
    """The quadratic conditions, ordered so that those that share coordinates are near."""
    found = [*_lengths(layout), *_moving_guides(layout), *_links(layout), *_latches(layout)]
    if len(found) < 3:
        return tuple(found)
    rows = np.repeat(np.arange(len(found)), [condition.columns.size for condition in found])
    columns = np.concatenate([condition.columns for condition in found])
    free = columns < layout.free
    incidence = sp.csr_array((np.ones(int(np.sum(free))), (rows[free], columns[free])), shape=(len(found), layout.free))
    graph = sp.csr_array(incidence @ incidence.T)
    return tuple(found[index] for index in reverse_cuthill_mckee(graph, symmetric_mode=True))


def _lengths(layout: Layout) -> list[Condition]:
    """One condition of unit length per family of parallel bars."""
    families: dict[tuple[tuple[int, int, float], ...], Form] = {}
    for body in layout.mechanism.bodies:
        if not body.rotates:
            continue
        form = layout.direction(body.name)
        if not np.any(form.columns < layout.free):
            continue
        square = form.rows.T @ form.rows  # the same for directions that differ by a rotation
        scale = np.max(np.abs(square))
        key = tuple(
            (int(a), int(b), round(float(square[i, j] / scale), 9))
            for i, a in enumerate(form.columns)
            for j, b in enumerate(form.columns)
            if abs(square[i, j]) > 1e-12 * scale
        )
        families.setdefault(key, form)
    return [Condition(((1.0, form),), 0.5) for form in families.values()]


def _moving_guides(layout: Layout) -> list[Condition]:
    """Followers on lines that moving bodies carry.

    With w from the body's origin to the follower and g the unit vector across the line, w . g is constant.
    """
    found = []
    for guide in layout.mechanism.guides:
        if guide.body == GROUND or guide.clearance is not None:
            continue
        across = -math.sin(guide.direction), math.cos(guide.direction)
        turned = layout.direction(guide.body)
        g = Form(turned.columns, np.array([[across[0], -across[1]], [across[1], across[0]]]) @ turned.rows)
        w = _combine([(layout.place(guide.follower), 1.0), (layout.origin(guide.body), -1.0)])
        level = across[0] * guide.through[0] + across[1] * guide.through[1]
        found.append(Condition(_product(w, g), level))
    return found


def _product(w: Form, g: Form) -> tuple[tuple[float, Form], ...]:
    """The scalar product w . g as weighted squares of w + g and w - g."""
    return (0.5, _combine([(w, 1.0), (g, 1.0)])), (-0.5, _combine([(w, 1.0), (g, -1.0)]))


def _links(layout: Layout) -> list[Condition]:
    """Massless links: |end - start|^2 / 2 is constant, or follows a course."""
    mechanism, found = layout.mechanism, []
    for link in mechanism.links:
        form = _combine([(layout.place(link.end), 1.0), (layout.place(link.start), -1.0)])
        if not np.any(form.columns < layout.free):
            raise InputError(f"link '{link.name}' between points that cannot move against each other", "leave it out")
        length = course_start(link.motion) if link.motion else link.length
        if length is None:
            length = math.dist(mechanism.place(link.start), mechanism.place(link.end))
        if not length > 0.0:
            raise InputError(f"link '{link.name}' starts with length {length:g} m", "a positive length")
        found.append(Condition(((1.0, form),), 0.5 * length * length, link.name, link.motion))
    return found


def _latches(layout: Layout) -> list[Condition]:
    """Latches: with w the body's direction turned back by the angle and g the base's turned left, w . g = 0."""
    found = []
    for latch in layout.mechanism.latches:
        cos, sin = math.cos(latch.angle), math.sin(latch.angle)
        body = layout.direction(latch.body)
        base = layout.fixed_direction if latch.base == GROUND else layout.direction(latch.base)
        w = Form(body.columns, np.array([[cos, sin], [-sin, cos]]) @ body.rows)
        parts = _product(w, Form(base.columns, np.array([[0.0, -1.0], [1.0, 0.0]]) @ base.rows))
        if not any(np.any(form.columns < layout.free) for _, form in parts):
            raise InputError(f"latch '{latch.name}' between bodies whose angle is prescribed", "bodies that can turn freely")
        found.append(Condition(parts, 0.0, latch.name, latch=True))
    return found


def _combine(parts: list[tuple[Form, float]]) -> Form:
    """A linear combination of forms."""
    columns = np.unique(np.concatenate([form.columns for form, _ in parts]))
    rows = np.zeros((2, columns.size))
    for form, factor in parts:
        rows[:, np.searchsorted(columns, form.columns)] += factor * form.rows
    return Form(columns, rows)
