"""The closure equations of a mechanism with ideal joints, in natural coordinates, parallelograms included.

The equations of motion use that opposite bars of a parallelogram stay parallel, which is true on one assembly branch only.
Whether another branch meets it must be asked of the equations without that assumption. They are few and small: linear
constraints are eliminated, lengths, moving guides and rods remain.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.kept import kept
from scissordyn.mechanics.elimination import Elimination, Expression
from scissordyn.mechanics.reduce import impose_all
from scissordyn.mechanics.time_function import function_at, function_rows
from scissordyn.model.mechanism import Mechanism

__all__ = ["Closure", "Inputs", "closure_of", "closure_template"]

CLOSED = 1e-13
"""Equations are met within this, in maps of the order of one."""

ROUNDINGS = 1e-15
"""Times the number of coordinates: what round-off leaves of an equation."""

MOST_STEPS = 12

NO_GRADIENT = 1e-12
"""A quadratic constraint whose maps do not vary by more than this holds whatever the free coordinates are."""

PARALLELOGRAM = "the parallelogram of"
"""How the names of the constraints begin that parallelograms add (mechanics/reduce.py)."""

ALIKE = 1e-7
"""Quadratic constraints, each with a gradient of the order of one, are dependent below this (mechanics/redundancy.py)."""


class Inputs:
    """The prescribed angles and distances of a mechanism over time.

    Parameters
    ----------
    mechanism : Mechanism
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.bodies = [drive.body for drive in mechanism.drives]
        timed = [(rod.name, rod.motion) for rod in mechanism.rods if rod.motion is not None]
        self.rods = [name for name, _ in timed]
        self._rows = [function_rows(drive.motion, mechanism.body(drive.body).angle) for drive in mechanism.drives]
        self._rows += [function_rows(motion, 0.0) for _, motion in timed]
        self._table = np.empty(0), np.empty((0, self.count))

    @property
    def count(self) -> int:
        """Number of inputs."""
        return len(self._rows)

    def at(self, time: float) -> np.ndarray:
        """Angles of the driven bodies [rad], then lengths of the timed rods [m]."""
        found, value = np.empty(self.count), np.zeros(4)
        for k, rows in enumerate(self._rows):
            function_at(time, rows, value)
            found[k] = value[0]
        return found

    def over(self, times: np.ndarray) -> np.ndarray:
        """The same at many instants, shape (times, inputs); those asked for last are known."""
        if not np.array_equal(times, self._table[0]):
            found, value = np.empty((times.size, self.count)), np.zeros(4)
            for k, rows in enumerate(self._rows):
                for i, time in enumerate(times.tolist()):
                    function_at(time, rows, value)
                    found[i, k] = value[0]
            self._table = times, found
        return self._table[1]


@dataclass(frozen=True)
class _Part:
    """One term of a quadratic constraint: weight |M z + m|^2 / 2."""

    weight: float
    rows: np.ndarray
    constant: np.ndarray


class _EveryBranch(Elimination):
    """Linear constraints without those that hold on one branch of the assembly only."""

    def impose(self, constraint: Expression, name: str) -> None:
        """Make `constraint` vanish unless it is the parallelism of a parallelogram."""
        if not name.startswith(PARALLELOGRAM):
            self.imposed.append((constraint, name))


@kept
def _eliminated(mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve the linear constraints: joints, guides on the ground, welds, constant angles between bodies, drives.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    stays : ndarray of int, shape (n,)
        Which of z are y.
    free : ndarray, shape (nZ, n)
        N.
    known : ndarray, shape (nZ, 1 + 2 drives)
        P.
    """
    first: dict[str, int] = {}
    preferred: list[bool] = []
    for body in mechanism.bodies:
        first[body.name] = len(preferred)
        preferred += [True, True, False, False] if body.rotates else [True, True]
    total, basis = len(preferred), 1 + 2 * len(mechanism.drives)
    elimination = _EveryBranch(preferred, basis)
    impose_all(mechanism.ideal(), first, total, mechanism.size, elimination)
    start, columns, values = elimination.rows()
    expressed = sp.csr_array((values, columns, start), shape=(total, total + basis)).toarray()
    stays = np.flatnonzero(elimination.solved_at[:total] < 0)
    return stays, expressed[:, stays], expressed[:, total:]


class Closure:
    """The closure equations of a mechanism with ideal joints.

    Natural coordinates z are the origin of each body in units of the mechanism's size and, if it rotates, its direction vector.
    Linear constraints give z = N y + P (1, cos th_1, sin th_1, ...); quadratic ones remain for y.

    Parameters
    ----------
    mechanism : Mechanism
        Its clearances are ignored.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.size, self.inputs = mechanism, mechanism.size, Inputs(mechanism)
        self.first: dict[str, int] = {}
        total = 0
        for body in mechanism.bodies:
            self.first[body.name] = total
            total += 4 if body.rotates else 2
        self.total = total
        self.rotating = [body.name for body in mechanism.bodies if body.rotates]
        self.directions = np.array([self.first[name] + 2 for name in self.rotating], int)
        self.stays, self.free, self.known = _eliminated(mechanism)
        self._quadratic()

    def of_same_parts(self, mechanism: Mechanism) -> Closure:
        """The closure equations of a mechanism that differs from this one's only in clearances and in motions of drives.

        Which constraints are chosen is found anew for each.
        """
        found = copy.copy(self)
        found.mechanism, found.inputs = mechanism, Inputs(mechanism)
        return found

    def _point(self, reference: BodyPoint) -> _Part:
        """A point of a body or of the ground as rows of z, in units of the size."""
        body, name = reference
        rows, unit = np.zeros((2, self.total)), 1.0 / self.size
        if body == GROUND:
            return _Part(1.0, rows, np.array(dict(self.mechanism.ground)[name], float) * unit)
        x, y = self.mechanism.body(body).points[name]
        return self._fixed(body, x * unit, y * unit)

    def _fixed(self, body: str, x: float, y: float) -> _Part:
        """A point in the frame of a body as rows of z, coordinates in units of the size."""
        rows, p = np.zeros((2, self.total)), self.first[body]
        rows[0, p] = rows[1, p + 1] = 1.0
        if self.mechanism.body(body).rotates:
            rows[0, p + 2] = rows[1, p + 3] = x
            rows[0, p + 3], rows[1, p + 2] = -y, y
            return _Part(1.0, rows, np.zeros(2))
        angle = self.mechanism.body(body).angle
        cos, sin = math.cos(angle), math.sin(angle)
        return _Part(1.0, rows, np.array([cos * x - sin * y, sin * x + cos * y]))

    def _frame(self, body: str) -> _Part:
        """The direction of a body's x axis."""
        rows = np.zeros((2, self.total))
        if body != GROUND and self.mechanism.body(body).rotates:
            d = self.first[body] + 2
            rows[0, d] = rows[1, d + 1] = 1.0
            return _Part(1.0, rows, np.zeros(2))
        angle = 0.0 if body == GROUND else self.mechanism.body(body).angle
        return _Part(1.0, rows, np.array([math.cos(angle), math.sin(angle)]))

    def _quadratic(self) -> None:
        """The quadratic constraints: lengths, guides on moving bodies, rods."""
        mechanism = self.mechanism
        parts: list[_Part] = []
        owner: list[int] = []
        self.value: list[float] = []
        self.timed: list[tuple[int, int, float]] = []
        driven = set(self.inputs.bodies)

        def add(value: float, *terms: _Part) -> None:
            parts.extend(terms)
            owner.extend([len(self.value)] * len(terms))
            self.value.append(value)

        for name in self.rotating:
            if name not in driven:
                add(0.5, self._frame(name))
        for guide in mechanism.guides:
            if guide.body == GROUND:
                continue
            across, frame = _turn(guide.direction + 0.5 * math.pi), self._frame(guide.body)
            here, base = self._point(guide.follower), self._fixed(guide.body, 0.0, 0.0)
            w, g = (here.rows - base.rows, here.constant - base.constant), (across @ frame.rows, across @ frame.constant)
            level = (across[:, 0] @ np.array(guide.through)) / self.size
            plus, minus = (_Part(0.5 * s, w[0] + s * g[0], w[1] + s * g[1]) for s in (1.0, -1.0))
            add(float(level), plus, minus)
        for rod in mechanism.rods:
            length = rod.length or math.dist(mechanism.place(rod.start), mechanism.place(rod.end))
            if rod.motion is not None:
                length = float(self.inputs.at(0.0)[len(self.inputs.bodies) + self.inputs.rods.index(rod.name)])
                self.timed.append((len(self.value), len(self.inputs.bodies) + len(self.timed), length))
            one, other, unit = self._point(rod.start), self._point(rod.end), self.size / length
            add(0.5, _Part(1.0, unit * (other.rows - one.rows), unit * (other.constant - one.constant)))
        rows = np.stack([part.rows for part in parts]) if parts else np.zeros((0, 2, self.total))
        moving = rows @ self.free
        size = np.sqrt(np.sum(moving * moving, axis=(1, 2)))
        self.weight = np.array([part.weight for part in parts])
        self.begin = np.unique(np.array(owner, int), return_index=True)[1]
        """First part of each constraint."""
        scale = self._sum(np.abs(self.weight) * size, 0)
        self.scale = np.where(scale > NO_GRADIENT, scale, 1.0)
        """Length that the gradient of each constraint can have."""
        self.moving, self.rows = moving, rows
        self.constant = np.stack([part.constant for part in parts]) if parts else np.zeros((0, 2))
        self.chosen = np.flatnonzero(scale > NO_GRADIENT)
        """Constraints that are asked; `choose` leaves those out that follow from others."""

    def basis(self, inputs: np.ndarray) -> np.ndarray:
        """(1, cos th_1, sin th_1, ...)."""
        angles = inputs[: len(self.inputs.bodies)]
        return np.concatenate([[1.0], np.stack([np.cos(angles), np.sin(angles)], axis=1).ravel()])

    def maps(self, z: np.ndarray) -> np.ndarray:
        """The maps of the quadratic constraints at one z or many, shape (..., parts, 2)."""
        found: np.ndarray = np.tensordot(z, self.rows, axes=(-1, 2)) + self.constant
        return found

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Gradients of the chosen constraints by y at one z or many, each divided by how long it can be, (..., m, n)."""
        directions = self.weight[:, None] * self.maps(z)
        parts = directions[..., 0, None] * self.moving[:, 0] + directions[..., 1, None] * self.moving[:, 1]
        return np.asarray(self._sum(parts, -2)[..., self.chosen, :] / self.scale[self.chosen, None])

    def residual(self, z: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """Errors of the chosen constraints at z."""
        return np.asarray(self.left_of(z) - self.values_at(inputs))

    def left_of(self, z: np.ndarray) -> np.ndarray:
        """Left sides of the chosen constraints at z."""
        maps = self.maps(z)
        return np.asarray((self._sum(0.5 * self.weight * np.sum(maps * maps, axis=-1), 0) / self.scale)[self.chosen])

    def values_at(self, inputs: np.ndarray) -> np.ndarray:
        """What the left sides of the chosen constraints have to be."""
        value = np.array(self.value)
        for k, which, unit in self.timed:
            value[k] = 0.5 * (inputs[which] / unit) ** 2
        return np.asarray((value / self.scale)[self.chosen])

    def known_at(self, inputs: np.ndarray) -> np.ndarray:
        """The part of z that the inputs determine."""
        return np.asarray(self.known @ self.basis(inputs))

    def product(self, z: np.ndarray, change: np.ndarray) -> np.ndarray:
        """First derivative of the left sides at z in the direction of a change of z."""
        return np.asarray(
            (self._sum(self.weight * np.sum(self.maps(z) * (self.rows @ change), axis=-1), 0) / self.scale)[self.chosen]
        )

    def form(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Second derivative of the left sides in the directions of two changes of z."""
        parts = self.weight * np.sum((self.rows @ one) * (self.rows @ other), axis=-1)
        return np.asarray((self._sum(parts, 0) / self.scale)[self.chosen])

    def _sum(self, parts: np.ndarray, axis: int) -> np.ndarray:
        """Sums over the parts of each constraint."""
        if self.begin.size == self.weight.size:
            return parts
        return np.asarray(np.add.reduceat(parts, self.begin, axis=axis))

    def close(self, guess: np.ndarray, inputs: np.ndarray, most_steps: int = MOST_STEPS) -> np.ndarray | None:
        """The natural coordinates near a guess at which the mechanism is closed; None if there are none.

        Parameters
        ----------
        guess : ndarray, shape (nZ,)
        inputs : ndarray
        most_steps : int
            Of Newton's method.

        Returns
        -------
        ndarray, shape (nZ,), or None
        """
        known = self.known_at(inputs)
        z: np.ndarray = known + self.free @ guess[self.stays]
        allowed = CLOSED + ROUNDINGS * self.total * float(np.max(np.abs(z), initial=1.0)) ** 2
        for _ in range(most_steps):
            residual = self.residual(z, inputs)
            worst = np.max(np.abs(residual), initial=0.0)
            if worst < allowed:
                return z
            if not worst < 1e3:
                return None
            z = z - self.free @ _least_change(self.jacobian(z), residual)
        return None

    def placed(self) -> np.ndarray:
        """Natural coordinates of the bodies as they are placed."""
        z = np.zeros(self.total)
        for body in self.mechanism.bodies:
            p = self.first[body.name]
            z[p : p + 2] = np.array(body.position) / self.size
            if body.rotates:
                z[p + 2 : p + 4] = math.cos(body.angle), math.sin(body.angle)
        return z

    def of_motion(self, position: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Natural coordinates from mass centres (samples, bodies, 2) [m] and angles (samples, bodies) [rad]."""
        z = np.empty((len(angle), self.total))
        cosines, sines = np.cos(angle), np.sin(angle)  # of a body that does not rotate: of the angle that it is placed at
        for k, body in enumerate(self.mechanism.bodies):
            p, (x, y) = self.first[body.name], body.centre
            cos, sin = cosines[:, k], sines[:, k]
            z[:, p] = (position[:, k, 0] - cos * x + sin * y) / self.size
            z[:, p + 1] = (position[:, k, 1] - sin * x - cos * y) / self.size
            if body.rotates:
                z[:, p + 2], z[:, p + 3] = cos, sin
        return z

    def choose(self, z: np.ndarray) -> None:
        """Leave out the constraints that follow from the others at a position that is nothing special."""
        unit = self.jacobian(z)
        kept: list[int] = []
        basis = np.zeros(unit.shape)
        for k, row in enumerate(unit):
            found = basis[: len(kept)]
            rest = row - found.T @ (found @ row)
            rest -= found.T @ (found @ rest)
            size = float(np.linalg.norm(rest))
            if size > ALIKE:
                basis[len(kept)] = rest / size
                kept.append(k)
        self.chosen = self.chosen[kept]

    @property
    def mobility(self) -> int:
        """Degrees of freedom that are left when the inputs are given."""
        return int(self.free.shape[1] - self.chosen.size)


def _least_change(rows: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """The smallest correction that removes a residual to first order."""
    if rows.shape[0] == rows.shape[1]:
        try:
            return np.asarray(np.linalg.solve(rows, residual))
        except np.linalg.LinAlgError:  # exactly singular
            pass
    return np.asarray(np.linalg.lstsq(rows, residual, rcond=1e-12)[0])


def _turn(angle: float) -> np.ndarray:
    """The matrix of a rotation."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


@kept
def closure_template(mechanism: Mechanism) -> Closure:
    """The closure equations of a mechanism, to be copied; see `closure_of`."""
    return Closure(mechanism)


def closure_of(mechanism: Mechanism) -> Closure:
    """The closure equations of a mechanism, of which is kept what does not depend on clearances and drives.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    Closure
        Not shared: its constraints can be chosen.
    """
    return closure_template(mechanism).of_same_parts(mechanism)
