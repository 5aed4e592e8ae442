"""Positions of bodies and attachments, and the balances of force and moment of each body.

The unknowns of the balances are the reactions of ideal joints, guides and drives.
"""

from __future__ import annotations

import math
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.mechanics.balance import Balance
from scissordyn.mechanics.body_maps import ANGLE, DISTANCE, LINE, RACK, SLIDE, BodyMaps
from scissordyn.model.coupling import Coordinate, Distance, RelativeAngle
from scissordyn.model.joint import Guide
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting
from scissordyn.plan.coordinates import Coordinates, PointMap, joined, stacked
from scissordyn.plan.linear_constraints import body_inertia
from scissordyn.plan.ordering import narrow, reach
from scissordyn.plan.transmission import LineAngle, SeparatingForce, Thrust, separating_force_of

Action = tuple[str, tuple[float, float, float], BodyPoint, str]
"""Effect of a unit reaction on a body: body, (force x, force y, torque), point of action, body whose frame is used."""


def body_maps(mechanism: Mechanism, coordinates: Coordinates) -> BodyMaps:
    """Return the maps of the bodies and where components, rods and couplings act on them."""
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
            sense[b], offset[b] = _sense_and_offset(family.maps[0], direction, first, mechanism.body(name).placed_angle)
    for b, body in enumerate(mechanism.bodies):
        if rotation[b] < 0:
            offset[b] = body.placed_angle
    parts: tuple[Any, ...] = (*acting(mechanism), *mechanism.rods)
    ends = [contact.ends for contact in mechanism.contacts] + [part.declaration.port.ends(part) for part in parts]
    arms = [[arm_of(mechanism, *end) if end[0] in index else (0.0, 0.0) for end in pair] for pair in ends]
    names = [constraint.name for constraint in coordinates.constraints]
    rods = [names.index(rod.name) for rod in mechanism.rods]
    couplings = [  # couplings of ideal joints may follow from these and are then not constraints
        (names.index(part.name), factor, *_acts(mechanism, coordinate))
        for part in mechanism.coupling_parts
        if part.name in names
        for factor, coordinate in coordinates.constraints[names.index(part.name)].acting
    ]
    pressures = [
        (names.index(part.name), pressure)
        for part in mechanism.couplings
        if part.name in names and not coordinates.constraints[names.index(part.name)].moving
        if (pressure := separating_force_of(mechanism, part)) is not None
    ]
    return BodyMaps(
        **stacked(maps, 4),
        rotation=rotation,
        sense=sense,
        offset=offset,
        body=np.array([[index.get(body, -1) for body, _ in pair] for pair in ends], np.int64).reshape(-1, 2),
        arm=np.array(arms, float).reshape(-1, 2, 2),
        rod=np.array(rods, np.int64),
        rod_scale=np.array([coordinates.constraints[k].scale for k in rods], float),
        coupling=np.array(
            [[k, kind, *(index.get(body, -1) for body in bodies)] for k, _, kind, bodies, _ in couplings], np.int64
        ).reshape(-1, 5),
        coupling_factor=np.array([-factor / coordinates.constraints[k].scale for k, factor, *_ in couplings], float),
        coupling_arm=np.array([arms for *_, arms in couplings], float).reshape(-1, 2, 2),
        pressure=np.array(
            [
                [k, pressure.kind, *(index.get(body, -1) for body, _ in (pressure.first, pressure.second))]
                for k, pressure in pressures
            ],
            np.int64,
        ).reshape(-1, 4),
        pressure_factor=np.array([part.per_force / coordinates.constraints[k].scale for k, part in pressures], float),
        pressure_number=np.array([part.numbers for _, part in pressures], float).reshape(-1, 2),
        pressure_arm=np.array([_separating_arms(mechanism, part) for _, part in pressures], float).reshape(-1, 2, 2),
    )


def _acts(
    mechanism: Mechanism, coordinate: Coordinate | LineAngle | Thrust
) -> tuple[int, tuple[str, str, str], tuple[Point, Point]]:
    """Return the kind of a coordinate, its body, base and reaction body, and the arms (`BodyMaps.coupling_arm`)."""
    body, base = coordinate.bodies
    if isinstance(coordinate, RelativeAngle):
        return ANGLE, (body, base, base), ((0.0, 0.0), (0.0, 0.0))
    if isinstance(coordinate, Distance | LineAngle):
        kind = DISTANCE if isinstance(coordinate, Distance) else LINE
        return kind, (body, base, base), (arm_of(mechanism, *coordinate.end), arm_of(mechanism, *coordinate.start))
    along = math.cos(coordinate.direction), math.sin(coordinate.direction)
    back = coordinate.bearing[0] if isinstance(coordinate, Thrust) else base
    return SLIDE, (body, base, back), (arm_of(mechanism, *coordinate.point), along)


def _separating_arms(mechanism: Mechanism, part: SeparatingForce) -> tuple[Point, Point]:
    """Return the arms of a separating force: to both wheel centres, or to the pinion's centre and the normal of its rack."""
    first = arm_of(mechanism, *part.first)
    return first, part.normal if part.kind == RACK else arm_of(mechanism, *part.second)


def arm_of(mechanism: Mechanism, body: str, point: str | Point | None) -> Point:
    """Return a point relative to the mass centre of its body, in the body's frame [m]; (0, 0) for no point.

    Points of the ground are in the fixed frame.
    """
    if point is None:
        return 0.0, 0.0
    if body == GROUND:
        return dict(mechanism.ground)[point] if isinstance(point, str) else point
    described = mechanism.body(body)
    x, y = described.points[point] if isinstance(point, str) else point
    return x - described.centre[0], y - described.centre[1]


def _sense_and_offset(first: PointMap, other: PointMap, first_angle: float, other_angle: float) -> tuple[float, float]:
    """Return the sense s (1 or -1) and the offset c [rad] of two directions whose angles obey other = s first + c."""
    square = first.rows @ first.rows.T
    if np.linalg.det(square) <= 1e-12 * np.trace(square) ** 2:  # a constant direction
        return 1.0, other_angle - first_angle
    matrix = other.rows @ first.rows.T @ np.linalg.inv(square)
    sense = 1.0 if np.linalg.det(matrix) > 0.0 else -1.0
    offset = math.atan2(matrix[1, 0], matrix[0, 0])
    turns = round((other_angle - sense * first_angle - offset) / (2.0 * math.pi))
    return sense, offset + 2.0 * math.pi * turns


def balance(mechanism: Mechanism, earlier: Balance | None = None) -> Balance:
    """Return the tables of the balances of force and moment; `known` are those of a mechanism with other inertias only."""
    mass = np.array([body.mass for body in mechanism.bodies], float)
    inertia = np.array([body_inertia(mechanism, body) if body.rotates else 0.0 for body in mechanism.bodies], float)
    if earlier is not None:
        return earlier._replace(mass=mass, inertia=inertia)
    index = {body.name: k for k, body in enumerate(mechanism.bodies)}
    sizes = [math.hypot(*point) for body in mechanism.bodies for point in body.points.values()]
    length = max([size for size in sizes if size > 0.0], default=1.0)
    kinds = _unknowns(mechanism, length)
    bodies_with_moment = {guide.follower[0] for guide in guides_with_moment(mechanism)}
    first = list(accumulate(map(len, kinds), initial=0))
    entries: dict[str, list[tuple[int, tuple[float, float, float], Point, int, int]]] = {name: [] for name in index}
    for unknown, actions in enumerate(actions for kind in kinds for actions in kind):
        for body, direction, anchor, frame in actions:
            if body != GROUND:
                arm = arm_of(mechanism, *anchor)
                entries[body].append((unknown, direction, arm, index[anchor[0]], index.get(frame, -1)))
    listed = [entry for rows in entries.values() for entry in rows]
    near, order = narrow([np.array([unknown for unknown, *_ in rows], int) for rows in entries.values()], first[-1])
    order = order if first[-1] > 6 else np.arange(first[-1])  # the order of a few unknowns does not matter
    return Balance(
        start=np.cumsum([0, *map(len, entries.values())], dtype=np.int64),
        unknown=np.array([order[unknown] for unknown, *_ in listed], np.int64),
        direction=np.array([direction for _, direction, *_ in listed]).reshape(-1, 3),
        arm=np.array([arm for _, _, arm, *_ in listed]).reshape(-1, 2),
        anchor=np.array([anchor for *_, anchor, _ in listed], np.int64),
        frame=np.array([frame for *_, frame in listed], np.int64),
        mass=mass,
        inertia=inertia,
        moments=np.array([body.rotates or body.name in bodies_with_moment for body in mechanism.bodies], np.int64),
        length=length,
        order=order,
        band=reach(near, order),
        **dict(zip(("joints", "welds", "guides", "guide_moments", "drives"), pairwise(first), strict=True)),
    )


def guides_with_moment(mechanism: Mechanism) -> tuple[Guide, ...]:
    """Return the ideal guides that transmit a moment: aligned guides, and the first guide of each body without inertia.

    A guide keeps the angle of a body without inertia. The first of several guides of such a body carries the whole moment.
    """
    chosen, guided_bodies = list[Guide](), set[str]()
    for guide in mechanism.ideal_guides:
        follower = mechanism.body(guide.follower[0])
        if guide.aligned or (not follower.rotates and follower.name not in guided_bodies):
            chosen.append(guide)
            guided_bodies.add(follower.name)
    return tuple(chosen)


def _unknowns(mechanism: Mechanism, length: float) -> list[list[list[Action]]]:
    """Return the effects of each unknown reaction on bodies: of joints, welds, guides, moments of guides, and drives.

    Moments are in units of `length`.
    """

    def forces(start: BodyPoint, end: BodyPoint) -> list[list[Action]]:
        """Return the effects on both bodies of a unit force along x, and of one along y, between two coincident points."""
        sides = (start, 1.0), (end, -1.0)
        return [[(at[0], (sign * x, sign * y, 0.0), at, GROUND) for at, sign in sides] for x, y in ((1.0, 0.0), (0.0, 1.0))]

    joints = [force for joint in mechanism.ideal_joints for force in forces(joint.journal, joint.bearing)]
    welds: list[list[Action]] = []
    for weld in mechanism.welds:
        torque = [(at[0], (0.0, 0.0, sign * length), at, GROUND) for at, sign in ((weld.start, 1.0), (weld.end, -1.0))]
        welds += [*forces(weld.start, weld.end), torque]
    guides, moments = list[list[Action]](), list[list[Action]]()
    for guide in mechanism.ideal_guides:
        x, y, follower, at = -math.sin(guide.direction), math.cos(guide.direction), guide.follower[0], guide.follower
        guides.append([(follower, (x, y, 0.0), at, guide.body), (guide.body, (-x, -y, 0.0), at, guide.body)])
    for guide in guides_with_moment(mechanism):
        follower, at = guide.follower[0], guide.follower
        moments.append([(follower, (0.0, 0.0, length), at, GROUND), (guide.body, (0.0, 0.0, -length), at, GROUND)])
    drives: list[list[Action]] = []
    for drive in mechanism.drives:
        anchor = drive.body, next(iter(mechanism.body(drive.body).points))
        drives.append([(drive.body, (0.0, 0.0, length), anchor, GROUND)])
    return [joints, welds, guides, moments, drives]
