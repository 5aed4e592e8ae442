"""Where the bodies of a mechanism are, and where force elements, rods and latches act on them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.component.place import GROUND
from scissordyn.component.port.declaration import Ends
from scissordyn.mechanics.body_maps import BodyMaps
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
    acting_at = [_ends(mechanism, place) for place in ends]
    acted_on = np.array([[index.get(end[0], -1) for end in pair] for pair in acting_at], np.int64).reshape(-1, 2)
    arm = np.array([[end[1] for end in pair] for pair in acting_at], float).reshape(-1, 2, 2)
    names = [constraint.name for constraint in coordinates.constraints]
    rods = [names.index(rod.name) for rod in mechanism.rods]
    return BodyMaps(
        start=np.cumsum([0, *(place.columns.size for place in maps)], dtype=np.int64),
        column=np.concatenate([place.columns for place in maps]),
        row=np.ascontiguousarray(np.hstack([place.rows for place in maps])),
        rotation=rotation,
        sense=sense,
        offset=offset,
        body=acted_on,
        arm=arm,
        rod=np.array(rods, np.int64),
        rod_scale=np.array([coordinates.constraints[k].scale for k in rods], float),
    )


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


def _ends(mechanism: Mechanism, ends: Ends) -> list[tuple[str, tuple[float, float]]]:
    """Body and arm from its mass centre of the two points at which an element acts; no arm where only a torque acts."""

    def arm(body: str, point: str | tuple[float, float] | None) -> tuple[str, tuple[float, float]]:
        if body == GROUND or point is None:
            return body, (0.0, 0.0)
        described = mechanism.body(body)
        place = described.points[point] if isinstance(point, str) else point
        return body, (place[0] - described.centre[0], place[1] - described.centre[1])

    return [arm(*end) for end in ends]
