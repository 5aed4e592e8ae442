"""Closure equations of a mechanism with ideal joints, in natural coordinates, including its parallelograms.

Linear constraints are eliminated; those of lengths, moving guides, rods and couplings remain (`plan.branches`).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from scissordyn.components.cam import Cam
from scissordyn.components.place import GROUND
from scissordyn.components.time_function import Tabulated
from scissordyn.errors import InputError
from scissordyn.interpolation import periodic_spline, quintic_spline
from scissordyn.mechanics.constraint_part import ANGLE, HALF_SQUARE, LENGTH, part_curvature
from scissordyn.mechanics.time_function import function_at, function_over, function_rows
from scissordyn.plan.linear_constraints import origins
from scissordyn.plan.plan import Plan
from scissordyn.tolerance import ASSEMBLY_TOL, CONSTRAINT_TOL
from scissordyn.warning import RunWarning, warning


def check_tables(plan: Plan, until: float) -> None:
    """Raise `InputError` for a tabulated time function that does not cover 0 to `until` [s]."""
    for name, function in _tables(plan):
        if not function.times[0] <= 0.0 <= until <= function.times[-1]:
            raise InputError(
                f"{name} is tabulated from {function.times[0]:g} s to {function.times[-1]:g} s; "
                f"the run goes from 0 s to {until:g} s",
                "a table that covers the run",
            )


def table_warnings(plan: Plan, overshoot_max: float = 0.1) -> list[RunWarning]:
    """Warn of tabulated time functions and cam profiles whose spline leaves the values of two neighbouring pairs.

    `overshoot_max`: [range of all values] a sine with five pairs in each period overshoots by less.
    """
    tables = [(name, (function.times, function.values), False) for name, function in _tables(plan)]
    for part in (part for part in plan.components if isinstance(part, Cam)):
        angles, radii = zip(*part.profile, strict=True)
        tables.append((f"cam '{part.name}'", (angles, radii), True))
    warnings = list[RunWarning]()
    for name, table, periodic in tables:
        share, at = _overshoot(*table, periodic=periodic)
        if share > overshoot_max:
            place = f"{math.degrees(at):.4g} deg" if periodic else f"t = {at:.6g} s"
            warnings.append(warning("table overshoots", table=name, share=share, place=place))
    return warnings


@lru_cache(maxsize=64)
def _overshoot(places: tuple[float, ...], values: tuple[float, ...], *, periodic: bool) -> tuple[float, float]:
    """Return how far the spline of a table leaves the values of two neighbouring pairs [range of all values], and where.

    The last tables are kept, as the cases of a batch have the same ones.
    """
    at, value = np.array(places), np.array(values)
    between = at[:-1, None] + np.diff(at)[:, None] * np.linspace(0.0, 1.0, 10)[1:-1]
    curve = periodic_spline(at, value)(between) if periodic else quintic_spline(places, values)(between)
    ends = np.sort([value[:-1], value[1:]], axis=0)[..., None]
    overshoot = np.maximum(curve - ends[1], ends[0] - curve)
    worst, whole = int(np.argmax(overshoot)), float(np.ptp(value))
    return float(overshoot.flat[worst]) / whole if whole > 0.0 else 0.0, float(between.flat[worst])


def _tables(plan: Plan) -> Iterator[tuple[str, Tabulated]]:
    """Yield the tabulated time functions of drives, rods and components, each with its description."""
    functions: list[tuple[str, Any]] = [*plan.motions]
    for component in plan.components:
        fields = (getattr(component, field.name) for field in dataclasses.fields(component))  # type: ignore[arg-type]
        functions += [(f"a time function of '{component.name}'", value) for value in fields]
    yield from ((name, function) for name, function in functions if isinstance(function, Tabulated))


class Inputs:
    """Prescribed angles, lengths and other coordinates of a mechanism as functions of time."""

    def __init__(self, plan: Plan) -> None:
        self.bodies = [drive.body for drive in plan.drives]
        timed = [(rod.name, "m", rod.motion, 0.0) for rod in plan.rods if rod.motion is not None]
        start = {constraint.name: constraint.start for constraint in plan.coordinates.constraints if constraint.linear}
        timed += [
            (drive.name, drive.coordinate.unit, drive.motion, start[drive.name]) for drive in plan.mechanism.coordinate_drives
        ]
        self.timed = [name for name, *_ in timed]  # Names of rods with a motion, then of coordinate drives
        self.units = ["rad"] * len(self.bodies) + [unit for _, unit, _, _ in timed]
        self._rows = [function_rows(drive.motion, plan.mechanism.body(drive.body).placed_angle) for drive in plan.drives]
        self._rows += [function_rows(motion, first) for _, _, motion, first in timed]
        self._table = np.empty(0), np.empty((0, self.count))

    @property
    def count(self) -> int:
        return len(self._rows)

    def at(self, time: float) -> np.ndarray:
        """Return the inputs at a time: angles of driven bodies [rad], lengths of rods with a motion [m], driven coordinates."""
        values, value = np.empty(self.count), np.zeros(4)
        for k, rows in enumerate(self._rows):
            function_at(time, rows, value)
            values[k] = value[0]
        return values

    def over(self, times: np.ndarray) -> np.ndarray:
        """Return the inputs at many instants, shape (times, inputs); the last table is kept."""
        if not np.array_equal(times, self._table[0]):
            values, table = np.zeros((times.size, 4)), np.empty((times.size, self.count))
            for k, rows in enumerate(self._rows):
                function_over(np.array(times, float), rows, values)
                table[:, k] = values[:, 0]
            self._table = times, table
        return self._table[1]


class Closure:
    """Closure equations of a mechanism with ideal joints.

    The natural coordinates z are the origin of each body, in units of the mechanism's size, and its direction vector if it
    rotates. Linear constraints give z = N y + P (1, cos th_1, sin th_1, ...). Quadratic constraints and couplings determine y.
    The last entries of z count the turns of angles in couplings; they are not unknowns.
    """

    def __init__(self, plan: Plan) -> None:
        tables = plan.branches
        self.plan, self.size, self.inputs = plan, plan.coordinates.size, Inputs(plan)
        turning = [pair for constraint in tables.constraints for pair in constraint.turning]
        self.turning, self.placed_turns = [body for body, _ in turning], np.array([angle for _, angle in turning], float)
        self.first, self.total, self.natural = tables.natural.offsets, tables.natural.total + len(turning), tables.natural
        self.directions = np.array([self.first[body.name] + 2 for body in plan.bodies if self.natural.rotates(body.name)], int)
        self.origins = np.pad(origins(tables.natural), (0, len(turning)))
        kinds = [kind for entry in tables.constraints for kind in entry.kinds or (HALF_SQUARE,) * len(entry.parts)]
        self.turns, self.lengths = (np.array([kind == wanted for kind in kinds], bool) for wanted in (ANGLE, LENGTH))
        more = len(turning)
        self.stays, self.free, self.prescribed = (
            tables.stays,
            *(np.pad(part, ((0, more), (0, 0))) for part in (tables.free, tables.prescribed)),
        )
        self.rows, self.constant, self.weight = np.pad(tables.rows, ((0, 0), (0, 0), (0, more))), tables.constant, tables.weight
        self.moving, self.begin, self.scale = tables.moving, tables.begin, tables.scale
        self.value = np.array([constraint.value for constraint in tables.constraints])
        timed = [k for k, constraint in enumerate(tables.constraints) if constraint.motion is not None]
        self.timed = [(k, len(plan.drives) + i, tables.constraints[k]) for i, k in enumerate(timed)]
        self.chosen = tables.varies
        """Indices of the constraints in use; `choose` drops those that follow from others."""

    def basis(self, inputs: np.ndarray) -> np.ndarray:
        """Return (1, cos th_1, sin th_1, ...) for one set of inputs or many."""
        angles = inputs[..., : len(self.inputs.bodies)]
        pairs = np.stack([np.cos(angles), np.sin(angles)], axis=-1).reshape(*angles.shape[:-1], 2 * angles.shape[-1])
        return np.concatenate([np.ones((*angles.shape[:-1], 1)), pairs], axis=-1)

    def maps(self, z: np.ndarray) -> np.ndarray:
        """Return the vectors of the quadratic constraints at one z or many, shape (..., parts, 2)."""
        vectors: np.ndarray = np.tensordot(z, self.rows, axes=(-1, 2)) + self.constant
        return vectors

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Return the scaled gradients by y of the constraints in use at one z or many, shape (..., m, n)."""
        directions = self.weight[:, None] * self._slopes(self.maps(z))
        parts = directions[..., 0, None] * self.moving[:, 0] + directions[..., 1, None] * self.moving[:, 1]
        return np.asarray(self._sum(parts, -2)[..., self.chosen, :] / self.scale[self.chosen, None])

    def residual(self, z: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """Return the scaled residuals of the constraints in use."""
        return np.asarray(self.left_sides(z) - self.right_sides(inputs))

    def left_sides(self, z: np.ndarray) -> np.ndarray:
        """Return the left sides of the closure equations in use, which depend on z only, at one z or many."""
        maps = self.maps(z)
        parts = 0.5 * self.weight * np.sum(maps * maps, axis=-1)
        if self._has_other_kinds:
            parts[..., self.lengths] = self.weight[self.lengths] * np.hypot(*np.moveaxis(maps[..., self.lengths, :], -1, 0))
            parts[..., self.turns] = self.weight[self.turns] * self._angles(z, maps)
        return np.asarray((self._sum(parts, -1) / self.scale)[..., self.chosen])

    @property
    def _has_other_kinds(self) -> bool:
        """True if some constraint has an angle or a length in it, and not only half of a squared vector."""
        return bool(np.any(self.turns | self.lengths))

    def _angles(self, z: np.ndarray, maps: np.ndarray) -> np.ndarray:
        """Return the angles of couplings, each in the full turn in which it is nearest to its last value, stored in z."""
        last, (x, y) = z[..., self.natural.total :], np.moveaxis(maps[..., self.turns, :], -1, 0)
        beyond = np.arctan2(y, x) - last
        return np.asarray(last + beyond - math.tau * np.floor(beyond / math.tau + 0.5))

    def _slopes(self, maps: np.ndarray) -> np.ndarray:
        """Return the gradient of each part of a constraint by its vector: of half its square, its length or its angle."""
        if not self._has_other_kinds:
            return maps
        slopes, square = maps.copy(), np.sum(maps * maps, axis=-1)[..., None]
        lengths, turns = self.lengths, self.turns
        slopes[..., lengths, :] = maps[..., lengths, :] / np.sqrt(square[..., lengths, :])
        slopes[..., turns, :] = np.stack([-maps[..., turns, 1], maps[..., turns, 0]], axis=-1) / square[..., turns, :]
        return slopes

    def join_unknowns(self, driven: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return z with the part that the inputs determine and with the unknowns and turns of a nearby z."""
        z: np.ndarray = driven + near[..., self.stays] @ self.free.T
        if self.turning:
            z[..., self.natural.total :] = near[..., self.natural.total :]
        return z

    def _count_turns(self, z: np.ndarray) -> np.ndarray:
        """Update the turns in z from its angles and return z."""
        if self.turning:
            z[..., self.natural.total :] = self._angles(z, self.maps(z))
        return z

    def right_sides(self, inputs: np.ndarray) -> np.ndarray:
        """Return the right sides of the closure equations in use, which the inputs determine, for one set of inputs or many."""
        value = np.tile(self.value, (*inputs.shape[:-1], 1))
        for k, which, constraint in self.timed:
            ratio = inputs[..., which] / constraint.scale
            value[..., k] = ratio if constraint.linear else 0.5 * ratio**2
        return np.asarray((value / self.scale)[..., self.chosen])

    def driven_part(self, inputs: np.ndarray) -> np.ndarray:
        """Return the part of z that the inputs determine, for one set of inputs or many."""
        return np.asarray(self.basis(inputs) @ self.prescribed.T)

    def derivative(self, z: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the derivative of `left_sides` at z in the direction of a change of z."""
        return np.asarray(
            (self._sum(self.weight * np.sum(self._slopes(self.maps(z)) * (self.rows @ change), axis=-1), 0) / self.scale)[
                self.chosen
            ]
        )

    def second_derivative(self, z: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the second derivative of `left_sides` at z in the directions of two changes of z, `first` and `second`."""
        curvature = self.rows @ first
        if self._has_other_kinds:
            for p, d in enumerate(self.maps(z)):
                kind = ANGLE if self.turns[p] else LENGTH if self.lengths[p] else HALF_SQUARE
                curvature[p] = part_curvature(kind, *d, *curvature[p])
        parts = self.weight * np.sum(curvature * (self.rows @ second), axis=-1)
        return np.asarray((self._sum(parts, 0) / self.scale)[self.chosen])

    def _sum(self, parts: np.ndarray, axis: int) -> np.ndarray:
        if self.begin.size == self.weight.size:
            return parts
        return np.asarray(np.add.reduceat(parts, self.begin, axis=axis))

    def close(self, guess: np.ndarray, inputs: np.ndarray, most_steps: int = 12) -> np.ndarray | None:
        """Close the mechanism near a guess (nZ,) by Newton's method; return None if it does not converge."""
        z = self.join_unknowns(self.driven_part(inputs), guess)
        allowed = CONSTRAINT_TOL + 1e-15 * self.total * float(np.max(np.abs(z), initial=1.0)) ** 2  # tolerance plus round-off
        for _ in range(most_steps):
            residual = self.residual(z, inputs)
            worst = np.max(np.abs(residual), initial=0.0)
            if worst < allowed:
                return self._count_turns(z)
            if not worst < 1e3:
                return None
            z = z - self.free @ _least_change(self.jacobian(z), residual)
        return None

    def close_all(self, guess: np.ndarray, inputs: np.ndarray, most_steps: int = 12) -> np.ndarray | None:
        """Close the mechanism near many guesses; return shape (samples, nZ), or None if one fails.

        The number of constraints in use must equal the number of unknowns.
        """
        z = self.join_unknowns(self.driven_part(inputs), guess)
        for _ in range(most_steps):
            residual = self.residual(z, inputs)
            worst = float(np.max(np.abs(residual), initial=0.0))
            if worst < ASSEMBLY_TOL:
                return self._count_turns(z)
            if not worst < 1e3:
                return None
            try:
                z = z - np.linalg.solve(self.jacobian(z), residual[..., None])[..., 0] @ self.free.T
            except np.linalg.LinAlgError:  # exactly singular
                return None
        return None

    def placed(self) -> np.ndarray:
        """Return the natural coordinates of the bodies as placed."""
        z = np.append(self.plan.coordinates.natural.placed()[0], self.placed_turns)
        z[self.origins] /= self.size
        return z

    def coordinates_of_motion(self, position: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Return natural coordinates from mass centres (samples, bodies, 2) [m] and angles (samples, bodies) [rad].

        Flexible bars take the shape of their static deflection under forces at the cross-sections.
        """
        z = np.zeros((len(angle), self.total))
        cosines, sines = np.cos(angle), np.sin(angle)  # bodies that do not rotate keep their placed angle
        for k, body in enumerate(self.plan.bodies):
            p, (x, y) = self.first[body.name], body.centre
            cos, sin = cosines[:, k], sines[:, k]
            z[:, p] = position[:, k, 0] - cos * x + sin * y
            z[:, p + 1] = position[:, k, 1] - sin * x - cos * y
            if self.natural.rotates(body.name):
                z[:, p + 2], z[:, p + 3] = cos, sin
        if self.natural.axes:
            for row in z:
                self.natural.deflect_statically(row[: self.natural.total])
        z[:, self.origins] /= self.size
        index = {body.name: k for k, body in enumerate(self.plan.bodies)}
        for k, (name, first) in enumerate(zip(self.turning, self.placed_turns, strict=True)):
            if name == GROUND:
                z[:, self.natural.total + k] = first
                continue
            placed = self.plan.mechanism.body(name).placed_angle
            apart = math.tau * round((first - placed) / math.tau)  # the motion may begin some turns away
            z[:, self.natural.total + k] = angle[:, index[name]] + apart
        return self._count_turns(z)

    def choose(self, z: np.ndarray) -> None:
        """Drop the constraints that follow from others at a generic (not singular) position z."""
        unit = self.jacobian(z)
        kept: list[int] = []
        basis = np.zeros(unit.shape)
        for k, row in enumerate(unit):
            pivots = basis[: len(kept)]
            rest = row - pivots.T @ (pivots @ row)
            rest -= pivots.T @ (pivots @ rest)
            size = float(np.linalg.norm(rest))
            if size > 1e-7:  # gradients are of the order of one; smaller remainders are round-off (plan/redundancy.py)
                basis[len(kept)] = rest / size
                kept.append(k)
        self.chosen = self.chosen[kept]

    @property
    def mobility(self) -> int:
        """Degrees of freedom that remain when the inputs are given."""
        return int(self.free.shape[1] - self.chosen.size)


def _least_change(rows: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Return the smallest correction that removes a residual to first order."""
    if rows.shape[0] == rows.shape[1]:
        try:
            return np.asarray(np.linalg.solve(rows, residual))
        except np.linalg.LinAlgError:  # exactly singular
            pass
    return np.asarray(np.linalg.lstsq(rows, residual, rcond=1e-12)[0])
