"""Where the bodies of a mechanism are, and where force elements, rods and latches act on them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.component.place import GROUND, Point
from scissordyn.mechanics.body_maps import ANGLE, DISTANCE, SLIDE, BodyMaps
from scissordyn.model.coupling import Coordinate, Distance, RelativeAngle
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting
from scissordyn.plan.coordinates import Coordinates, PointMap, joined


def body_maps(mechanism: Mechanism, coordinates: Coordinates) -> BodyMaps:
    index = {body.name: k for k, body in enumerate(mechanism.bodies)}
    maps = [
        joined([(coordinates.at(body.name, body.centre), 0, 1.0), (coordinates.frame(body.name), 2, 1.0)], 4)
        for body in mechanism.bodies
    ]
    rotation, sense, offset = np.full(len(maps), -1, np.int64), np.ones(len(maps)), np.zeros(len(maps))
    for k, family in enumerate(coordinates.families):
        first = mechanism.body(family.bodies[0]).placed_angle
        for name, direction in zip(family.bodies, family.maps, strict=True):
            b = index[name]
            rotation[b] = k
            sense[b], offset[b] = _turned(family.maps[0], direction, first, mechanism.body(name).placed_angle)
    for b, body in enumerate(mechanism.bodies):
        if rotation[b] < 0:
            offset[b] = body.placed_angle
    parts: tuple[Any, ...] = (*acting(mechanism), *mechanism.rods)
    ends = [contact.ends for contact in mechanism.contacts] + [part.declaration.port.ends(part) for part in parts]
    arms = [[arm_of(mechanism, *end) if end[0] in index else (0.0, 0.0) for end in pair] for pair in ends]
    names = [constraint.name for constraint in coordinates.constraints]
    rods = [names.index(rod.name) for rod in mechanism.rods]
    couplings = [  # couplings of ideal joints may follow from these, and are no constraints then
        (names.index(part.name), factor, *_acts(mechanism, coordinate))
        for part in mechanism.coupling_parts
        if part.name in names
        for factor, coordinate in part.terms
    ]
    return BodyMaps(
        start=np.cumsum([0, *(place.columns.size for place in maps)], dtype=np.int64),
        column=np.concatenate([place.columns for place in maps]),
        row=np.ascontiguousarray(np.hstack([place.rows for place in maps])),
        rotation=rotation,
        sense=sense,
        offset=offset,
        body=np.array([[index.get(body, -1) for body, _ in pair] for pair in ends], np.int64).reshape(-1, 2),
        arm=np.array(arms, float).reshape(-1, 2, 2),
        rod=np.array(rods, np.int64),
        rod_scale=np.array([coordinates.constraints[k].scale for k in rods], float),
        coupling=np.array(
            [[k, kind, *(index.get(body, -1) for body in pair)] for k, _, kind, pair, _ in couplings], np.int64
        ).reshape(-1, 4),
        coupling_factor=np.array([-factor / coordinates.constraints[k].scale for k, factor, *_ in couplings], float),
        coupling_arm=np.array([arms for *_, arms in couplings], float).reshape(-1, 2, 2),
    )


def _acts(mechanism: Mechanism, coordinate: Coordinate) -> tuple[int, tuple[str, str], tuple[Point, Point]]:
    """Kind of a coordinate, its body and base, and where forces act on both: see `BodyMaps.coupling_arm`."""
    if isinstance(coordinate, RelativeAngle):
        return ANGLE, coordinate.bodies, ((0.0, 0.0), (0.0, 0.0))
    if isinstance(coordinate, Distance):
        return DISTANCE, coordinate.bodies, (arm_of(mechanism, *coordinate.end), arm_of(mechanism, *coordinate.start))
    along = math.cos(coordinate.direction), math.sin(coordinate.direction)
    return SLIDE, coordinate.bodies, (arm_of(mechanism, *coordinate.point), along)


def arm_of(mechanism: Mechanism, body: str, point: str | Point | None) -> Point:
    """A point of a body from its mass centre, in the body's frame [m]; of the ground, whose points are in the fixed frame.

    No arm where only a torque acts.
    """
    if point is None:
        return 0.0, 0.0
    if body == GROUND:
        return dict(mechanism.ground)[point] if isinstance(point, str) else point
    described = mechanism.body(body)
    x, y = described.points[point] if isinstance(point, str) else point
    return x - described.centre[0], y - described.centre[1]


def _turned(first: PointMap, other: PointMap, first_angle: float, other_angle: float) -> tuple[float, float]:
    """Sense and offset of the angle of a direction against that of another, which it is a rotation or a reflection of."""
    square = first.rows @ first.rows.T
    if np.linalg.det(square) <= 1e-12 * np.trace(square) ** 2:  # a constant direction
        return 1.0, other_angle - first_angle
    matrix = other.rows @ first.rows.T @ np.linalg.inv(square)
    sense = 1.0 if np.linalg.det(matrix) > 0.0 else -1.0
    offset = math.atan2(matrix[1, 0], matrix[0, 0])
    turns = round((other_angle - sense * first_angle - offset) / (2.0 * math.pi))
    return sense, offset + 2.0 * math.pi * turns
