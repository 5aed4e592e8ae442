"""Where the bodies of a mechanism are, and where force elements, rods and latches act on them."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.component.port import ACTUATOR, HINGE, LINE, POINT, TRAVEL
from scissordyn.mechanics.outputs import BodyMaps
from scissordyn.model.guide_clearance import ContactPoint
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting
from scissordyn.plan.coordinates import Coordinates, PointMap, joined

__all__ = ["body_maps"]


def body_maps(mechanism: Mechanism, coordinates: Coordinates) -> BodyMaps:
    """Maps of the bodies of a mechanism."""
    index = {body.name: k for k, body in enumerate(mechanism.bodies)}
    maps = [
        joined([(coordinates.at(body.name, body.centre), 0, 1.0), (coordinates.frame(body.name), 2, 1.0)], 4)
        for body in mechanism.bodies
    ]
    rotation, sense, offset = np.full(len(maps), -1, np.int64), np.ones(len(maps)), np.zeros(len(maps))
    for k, family in enumerate(coordinates.families):
        first = mechanism.body(family.bodies[0]).angle
        for name, direction in zip(family.bodies, family.maps, strict=True):
            b = index[name]
            rotation[b] = k
            sense[b], offset[b] = _turned(family.maps[0], direction, first, mechanism.body(name).angle)
    for b, body in enumerate(mechanism.bodies):
        if rotation[b] < 0:
            offset[b] = body.angle
    ends = [_ends(mechanism, part) for part in (*mechanism.contacts, *acting(mechanism), *mechanism.rods)]
    acted_on = np.array([[index.get(end[0], -1) for end in pair] for pair in ends], np.int64).reshape(-1, 2)
    arm = np.array([[end[1] for end in pair] for pair in ends], float).reshape(-1, 2, 2)
    names = [constraint.name for constraint in coordinates.constraints]
    rods = [names.index(rod.name) for rod in mechanism.rods]
    return BodyMaps(
        start=np.cumsum([0, *(each.columns.size for each in maps)], dtype=np.int64),
        column=np.concatenate([each.columns for each in maps]),
        row=np.ascontiguousarray(np.hstack([each.rows for each in maps])),
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


def _ends(mechanism: Mechanism, part: object) -> tuple[tuple[str, tuple[float, float]], tuple[str, tuple[float, float]]]:
    """Body and arm from its mass centre of the two points at which a part acts."""

    def at(point: BodyPoint) -> tuple[str, tuple[float, float]]:
        body, name = point
        return arm(body, (0.0, 0.0) if body == GROUND else mechanism.body(body).points[name])

    def arm(body: str, place: tuple[float, float]) -> tuple[str, tuple[float, float]]:
        x, y = (0.0, 0.0) if body == GROUND else mechanism.body(body).centre
        return body, (place[0] - x, place[1] - y)

    if isinstance(part, ContactPoint):
        return arm(part.follower, part.centre), arm(part.body, part.through)
    declared = getattr(part, "declaration", None)
    if declared is None:
        return at(part.journal), at(part.bearing)  # type: ignore[attr-defined]
    if declared.port in (POINT, TRAVEL):
        return at(part.point), (GROUND, (0.0, 0.0))  # type: ignore[attr-defined]
    if declared.port in (HINGE, ACTUATOR):
        nowhere = (0.0, 0.0)
        return (part.body, nowhere), (part.base, nowhere)  # type: ignore[attr-defined]
    assert declared.port is LINE or declared.port.points == ("start", "end")
    return at(part.end), at(part.start)  # type: ignore[attr-defined]
