"""Quadratic constraints of a mechanism: unit lengths, moving guides, rods and latches."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.mechanics.time_function import function_start
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Constraint, Coordinates, PointMap, combined
from scissordyn.plan.elimination import Elimination, Expression, contradiction, in_words
from scissordyn.plan.ordering import members, reverse_cuthill_mckee
from scissordyn.tolerance import ASSEMBLY_TOL, DATA_TOL


def _is_free(coordinates: Coordinates, point_map: PointMap) -> bool:
    """Return whether a map depends on a free coordinate."""
    return bool(np.any(point_map.columns < coordinates.free))


def quadratic_constraints(
    mechanism: Mechanism, coordinates: Coordinates, elimination: Elimination | None = None
) -> list[Constraint]:
    """Return the constraints of unit lengths, moving guides, rods and latches."""
    return [
        *_lengths(coordinates, elimination),
        *_moving_guides(mechanism, coordinates),
        *_rods(mechanism, coordinates),
        *_latches(mechanism, coordinates),
    ]


def order_constraints(unknowns: int, constraints: list[Constraint]) -> tuple[Constraint, ...]:
    """Order constraints so that those with common free coordinates are close."""
    if len(constraints) < 3:
        return tuple(constraints)
    free = [np.unique(constraint.columns[constraint.columns < unknowns]).tolist() for constraint in constraints]
    sharing = [others.tolist() for others in members(map(np.array, free), unknowns)]
    # among equal ones first those that share the last columns; another order changes the last digits of runs
    near = [list(dict.fromkeys(k for column in columns for k in sharing[column]))[::-1] for columns in free]
    return tuple(constraints[index] for index in reverse_cuthill_mckee(near).tolist())


def _lengths(coordinates: Coordinates, elimination: Elimination | None) -> list[Constraint]:
    """Return one constraint of unit length per family of parallel bars."""
    constraints = []
    for family in coordinates.families:
        first = family.maps[0]
        if family.bodies[0] in coordinates.natural.tangents:  # its length varies with the strain
            continue
        if not family.free:
            for name, direction in zip(family.bodies, family.maps, strict=True):
                length = _known_length(coordinates, direction)
                if not abs(length - 1.0) <= DATA_TOL:  # also true for NaN
                    raise _wrong_length(coordinates, elimination, name, length)
            continue
        size = float(np.max(np.sum(first.rows * first.rows, axis=0)))
        for name, direction in zip(family.bodies[1:], family.maps[1:], strict=True):
            length = math.sqrt(float(np.max(np.sum(direction.rows * direction.rows, axis=0))) / size)
            if abs(length - 1.0) > DATA_TOL:
                raise _wrong_length(coordinates, elimination, name, length, family.bodies[0])
        constraints.append(Constraint(((1.0, first),), 0.5, subject=_name_family(family.bodies), bodies=family.bodies))
    return constraints


def _name_family(names: tuple[str, ...]) -> str:
    """Return the names of at most three parallel bodies, a family, for an error message."""
    quoted = [f"'{name}'" for name in names]
    return ("body " if len(names) == 1 else "bodies ") + in_words(quoted, 3)


def _known_length(coordinates: Coordinates, direction: PointMap) -> float:
    """Return the length of a direction that depends on b(t) only; NaN if it varies with the drives.

    |d|^2 = b^T Q b is constant for all angles th_i if Q does not couple 1 with the drives or two drives, and is a multiple of
    the identity for each drive. It is then the sum of these multiples.
    """
    basis = direction.columns - coordinates.free
    full = np.zeros((coordinates.basis, coordinates.basis))
    full[np.ix_(basis, basis)] = direction.rows.T @ direction.rows
    total = full[0, 0]
    expected = np.zeros_like(full)
    expected[0, 0] = total
    for first in range(1, coordinates.basis, 2):
        part = 0.5 * (full[first, first] + full[first + 1, first + 1])
        expected[first, first] = expected[first + 1, first + 1] = part
        total += part
    varies = np.max(np.abs(full - expected)) > DATA_TOL
    return math.nan if varies else math.sqrt(max(float(total), 0.0))


def _wrong_length(
    coordinates: Coordinates, elimination: Elimination | None, body: str, length: float, twin: str = ""
) -> InputError:
    """Return the error for a body whose unit direction vector would not have length 1; `twin` is a parallel body."""
    assert elimination is not None
    d = coordinates.natural.offsets[body] + 2
    relation: list[Expression] = [{d: 1.0}, {d + 1: 1.0}]
    if twin:
        matrix = coordinates.direction(body).rows @ np.linalg.pinv(coordinates.direction(twin).rows)
        e = coordinates.natural.offsets[twin] + 2
        relation = [{d + axis: 1.0, e: -float(matrix[axis, 0]), e + 1: -float(matrix[axis, 1])} for axis in (0, 1)]
    change = (
        "would have to change its length" if math.isnan(length) else f"would have to be {length:.6g} times as long as it is"
    )
    return contradiction(elimination.causes_of(relation), f"body '{body}' {change}")


def _moving_guides(mechanism: Mechanism, coordinates: Coordinates) -> list[Constraint]:
    """Return the constraints of guides on moving bodies.

    With w from the body's origin to the follower, in units of the mechanism's size, and g the unit vector across the line,
    w . g is constant.
    """
    constraints = []
    for guide in mechanism.ideal_guides:
        if guide.body == GROUND:
            continue
        across = -math.sin(guide.direction), math.cos(guide.direction)
        g = coordinates.direction(guide.body).turned(*across)
        unit = 1.0 / coordinates.size
        w = combined((coordinates.place(guide.follower), unit), (coordinates.origin(guide.body), -unit))
        value = (across[0] * guide.through[0] + across[1] * guide.through[1]) * unit
        subject = f"guide '{guide.name}' of bodies '{guide.follower[0]}' and '{guide.body}'"
        parts = product(w, g)
        if any(_is_free(coordinates, part) for _, part in parts):
            bodies = guide.follower[0], guide.body
            constraints.append(Constraint(parts, value, scale=coordinates.size, subject=subject, bodies=bodies))
            continue
        raise InputError(f"{subject} connects bodies that cannot move relative to each other", "a mechanism without this guide")
    return constraints


def product(w: PointMap, g: PointMap) -> tuple[tuple[float, PointMap], ...]:
    """Return the scalar product w . g as weighted squares of w + g and w - g."""
    return (0.5, combined((w, 1.0), (g, 1.0))), (-0.5, combined((w, 1.0), (g, -1.0)))


def _rods(mechanism: Mechanism, coordinates: Coordinates) -> list[Constraint]:
    """Return the constraints of rods: |end - start|^2 / 2 is constant or prescribed, in units of the initial length."""
    constraints = []
    for rod in mechanism.rods:
        length = function_start(rod.motion) if rod.motion else rod.length
        if length is None:
            length = math.dist(mechanism.place(rod.start), mechanism.place(rod.end))
        if not length > ASSEMBLY_TOL * coordinates.size:  # round-off leaves coincident points a small distance apart
            raise InputError(
                f"rod '{rod.name}' has the initial length {length:g} m",
                "points at different positions; a joint holds two points together",
            )
        unit = 1.0 / length
        span = combined((coordinates.place(rod.end), unit), (coordinates.place(rod.start), -unit))
        if not _is_free(coordinates, span):
            raise InputError(
                f"rod '{rod.name}' connects points that cannot move relative to each other", "a mechanism without this rod"
            )
        constraints.append(
            Constraint(
                ((1.0, span),),
                0.5,
                scale=length,
                name=rod.name,
                motion=rod.motion,
                subject=f"rod '{rod.name}'",
                bodies=(rod.start[0], rod.end[0]),
            )
        )
    return constraints


def _latches(mechanism: Mechanism, coordinates: Coordinates) -> list[Constraint]:
    """Return the constraints w . g = 0 of latches: w is the body's direction rotated by -angle, g the base's normal."""
    constraints = []
    for latch in mechanism.latches:
        w = coordinates.direction(latch.body).turned(math.cos(latch.angle), -math.sin(latch.angle))
        parts = product(w, coordinates.frame(latch.base).turned(0.0, 1.0))
        if not any(_is_free(coordinates, part) for _, part in parts):
            raise InputError(f"latch '{latch.name}' connects bodies with a prescribed angle", "bodies that can turn freely")
        constraints.append(
            Constraint(
                parts, 0.0, name=latch.name, latch=True, subject=f"latch '{latch.name}'", bodies=(latch.body, latch.base)
            )
        )
    return constraints
