"""Commanded mechanism: ideal joints, rigid bars, and drives instead of servos."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator
from itertools import pairwise

from scissordyn.components.actuator import Actuator
from scissordyn.components.beam import Beam
from scissordyn.components.elastic import node_inertia
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.place import GROUND, Point
from scissordyn.components.time_function import ConstantSpeed
from scissordyn.model.body import Body
from scissordyn.model.coupling import Drive
from scissordyn.model.joint import Weld
from scissordyn.model.mechanism import Mechanism

Span = tuple[str, tuple[str, Point], tuple[str, Point], float, float, float, float]
"""Name, start and end (body, position in its frame), angles of the bar to both, length, mass per length."""


def rigid(mechanism: Mechanism, least_share: float = 1e-9) -> Mechanism:
    """Return the mechanism with rigid bars of the same mass and inertia instead of flexible ones.

    `least_share`: smallest fraction of its mass that a cross-section of a rigid bar keeps: a body must have a mass.
    """
    spans = list(_spans(mechanism))
    if not spans:
        return mechanism
    bodies = {body.name: body for body in mechanism.bodies}
    left = {body.name: [body.mass, body.inertia or 0.0] for body in mechanism.bodies}
    welds = []
    for name, start, end, turned, other_turned, length, mass_per_length in spans:
        for place in (start[0], end[0]):
            left[place][0] -= 0.5 * mass_per_length * length
            left[place][1] -= node_inertia(mass_per_length, length)
        first, second = bodies[start[0]], bodies[end[0]]
        local, along = start[1], (math.cos(turned), math.sin(turned))
        middle, far = ((local[0] + part * length * along[0], local[1] + part * length * along[1]) for part in (0.5, 1.0))
        first = _with_points(first, {f"{name} middle": middle, f"{name} end": far})
        angle = first.placed_angle + turned - other_turned
        second = _with_points(dataclasses.replace(second, angle=angle), {name: end[1]})
        (x, y), (x_now, y_now) = first.place(f"{name} end"), second.place(name)
        position = (second.placed_position[0] + x - x_now, second.placed_position[1] + y - y_now)
        second = dataclasses.replace(second, position=position)
        bodies |= {first.name: first, second.name: second}
        welds.append(Weld(f"{name} end", (first.name, f"{name} end"), (second.name, name)))
        if not mass_per_length:
            continue
        bodies[name] = Body(
            name,
            mass=mass_per_length * length,
            inertia=mass_per_length * length**3 / 12.0,
            points={"middle": (0.0, 0.0)},
            position=first.place(f"{name} middle"),
            angle=first.placed_angle,
        )
        welds.append(Weld(f"{name} middle", (first.name, f"{name} middle"), (name, "middle")))
    for name in {place for _, start, end, *_ in spans for place in (start[0], end[0])}:
        body, (mass, inertia) = bodies[name], left[name]
        share = max(mass / body.mass, least_share)
        # the mass centre of a cross-section with a payload is that of both
        centre = body.centre if share == least_share else (body.centre[0] / share, body.centre[1] / share)
        square_distance = body.centre[0] ** 2 + body.centre[1] ** 2
        inertia += body.mass * square_distance - share * body.mass * (centre[0] ** 2 + centre[1] ** 2)
        inertia = max(inertia, least_share * (body.inertia or 1.0))
        bodies[name] = dataclasses.replace(body, mass=share * body.mass, centre=centre, inertia=inertia)
    others = tuple(part for part in mechanism.components if not isinstance(part, FlexibleBar | Beam))
    return dataclasses.replace(mechanism, bodies=tuple(bodies.values()), welds=(*mechanism.welds, *welds), components=others)


def commanded(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with drives instead of servos between a body and the ground; the drives turn their rotors."""
    servos = [part for part in mechanism.components if isinstance(part, Actuator) and part.base == GROUND]
    drives = {drive.body: drive for drive in mechanism.drives}
    new = {part.body: Drive(part.body, part.reference or ConstantSpeed(0.0)) for part in servos if part.body not in drives}
    if not new:
        return mechanism
    components = tuple(part for part in mechanism.components if part not in servos)
    rotors = [(part.body, part.inertia) for part in servos]
    driven = dataclasses.replace(mechanism, components=components, drives=(*mechanism.drives, *new.values()))
    return with_rotors(driven, rotors)


def with_rotors(mechanism: Mechanism, rotors: Iterable[tuple[str, float]]) -> Mechanism:
    """Return the mechanism with inertias [kg m^2] of rotors added to those of the bodies that turn with them."""
    bodies = {body.name: body for body in mechanism.bodies}
    for name, inertia in rotors:
        if inertia:
            body = bodies.get(name) or mechanism.body(name)  # an unknown name is an error
            bodies[name] = dataclasses.replace(body, inertia=(body.inertia or 0.0) + inertia)
    return dataclasses.replace(mechanism, bodies=tuple(bodies.values()))


def _spans(mechanism: Mechanism) -> Iterator[Span]:
    """Yield the spans of flexible bars between neighbouring cross-sections."""
    points = {body.name: body.points for body in mechanism.bodies}
    for part in mechanism.components:
        if isinstance(part, Beam):
            ends = [(body, points[body][point]) for body, point in (part.start, part.end)]
            yield f"{part.name}/rigid", ends[0], ends[1], 0.0, 0.0, part.length, part.mass_per_length
        elif isinstance(part, FlexibleBar):
            marks = zip(part.sections, part.places, part.angles, strict=True)
            for k, ((a, s, turned), (b, t, other)) in enumerate(pairwise(marks)):
                origin = (0.0, 0.0)
                yield f"{part.name}/rigid {k + 1}", (a, origin), (b, origin), turned, other, t - s, part.mass_per_length


def _with_points(body: Body, points: dict[str, Point]) -> Body:
    return dataclasses.replace(body, points={**body.points, **points})
