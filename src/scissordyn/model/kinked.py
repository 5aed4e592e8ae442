"""Kinked bars as straight legs that are welded to each other."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import NamedTuple

from scissordyn.component.place import Point
from scissordyn.model.body import Body
from scissordyn.model.connection import Weld

UNIFORM = 1e-6  # Largest relative difference of mass centre and inertia from those of uniform legs


class Legs(NamedTuple):
    """A kinked bar in parts."""

    # Straight uniform bars, of which the one on the x axis has the name and the frame of the kinked bar
    bodies: tuple[Body, ...]
    welds: tuple[Weld, ...]  # Between consecutive ones
    where: dict[str, str]  # Which of them has each point of the kinked bar


def legs_of(body: Body) -> Legs | None:
    """The straight legs of a kinked bar, whose points follow each other from one end to the other."""
    groups = _groups(body)
    if body.inertia is None or len(groups) < 2 or not _is_uniform(body):
        return None
    placed = [[body.points[name] for name in names] for names in groups]
    straight = next((k for k, line in enumerate(placed) if _is_on_axis(line)), None)
    if straight is None:
        return None
    per_length = body.mass / _line_length(body)
    names = [body.name if k == straight else f"{body.name}/leg {k + 1}" for k in range(len(groups))]
    bodies = [
        _leg(body, name, dict(zip(points, line, strict=True)), per_length, k == straight)
        for k, (name, points, line) in enumerate(zip(names, groups, placed, strict=True))
    ]
    welds = [
        Weld(f"{body.name}/kink {k + 1}", (names[k], groups[k][-1]), (names[k + 1], groups[k + 1][0]))
        for k in range(len(groups) - 1)
    ]
    where: dict[str, str] = {}
    for name, points in zip(names, groups, strict=True):
        where = {**dict.fromkeys(points, name), **where}  # a kink is a point of the leg before it
    return Legs(tuple(bodies), tuple(welds), where)


def _groups(body: Body) -> list[list[str]]:
    """The names of the points of each leg; those at kinks are in two."""
    points = list(body.points.items())
    if len(points) < 3 or any(math.dist(first, second) == 0.0 for (_, first), (_, second) in itertools.pairwise(points)):
        return []
    groups = [[points[0][0], points[1][0]]]
    for (_, before), (name, here), (following, after) in zip(points, points[1:], points[2:], strict=False):
        if abs(_turn(before, here, after)) <= UNIFORM:
            groups[-1].append(following)
        else:
            groups.append([name, following])
    return groups


def _turn(before: Point, here: Point, after: Point) -> float:
    """Angle by which a line turns at a point [rad]."""
    (ax, ay), (bx, by) = (here[0] - before[0], here[1] - before[1]), (after[0] - here[0], after[1] - here[1])
    return math.atan2(ax * by - ay * bx, ax * bx + ay * by)


def _is_on_axis(line: list[Point]) -> bool:
    return all(y == 0.0 for _, y in line) and line[-1][0] > line[0][0]


def _is_uniform(body: Body) -> bool:
    """Whether mass centre and inertia are those of a line of uniform mass through the points."""
    assert body.inertia is not None
    total, parts = _line_length(body), list(itertools.pairwise(body.points.values()))
    share = [math.dist(first, second) / total for first, second in parts]
    middles = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a, b in parts]
    centre = tuple(sum(part * middle[axis] for part, middle in zip(share, middles, strict=True)) for axis in (0, 1))
    pairs = zip(share, middles, strict=True)
    inertia = body.mass * sum(part * ((part * total) ** 2 / 12.0 + math.dist(middle, centre) ** 2) for part, middle in pairs)
    return math.dist(body.centre, centre) <= UNIFORM * total and abs(body.inertia - inertia) <= UNIFORM * inertia


def _line_length(body: Body) -> float:
    """Of the line through the points of a body, in their order [m]."""
    return sum(math.dist(first, second) for first, second in itertools.pairwise(body.points.values()))


def _leg(body: Body, name: str, points: dict[str, Point], per_length: float, own: bool) -> Body:
    """A leg as a bar: in the frame of the kinked bar, or in one that begins with it and is along it."""
    places = list(points.values())
    (x, y), length = places[0], math.dist(places[0], places[-1])
    turned = 0.0 if own else math.atan2(places[-1][1] - y, places[-1][0] - x)
    if own:
        along = {key: place[0] for key, place in points.items()}
        x = y = 0.0
    else:
        along = {key: math.dist(places[0], place) for key, place in points.items()}
    cos, sin = math.cos(body.placed_angle), math.sin(body.placed_angle)
    dx, dy = cos * x - sin * y, sin * x + cos * y
    first, last = min(along.values()), max(along.values())
    mass, (ox, oy) = per_length * length, body.placed_position
    return replace(
        body,
        name=name,
        mass=mass,
        inertia=mass * length**2 / 12.0,
        points={key: (at, 0.0) for key, at in along.items()},
        centre=(0.5 * (first + last), 0.0),
        position=(ox + dx, oy + dy),
        angle=body.placed_angle + turned,
        velocity=body.velocity_at((dx, dy)),
    )
