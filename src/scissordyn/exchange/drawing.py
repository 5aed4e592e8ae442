"""Drawn linkage of pins, bars and sliding blocks, and conversion to a mechanism."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from scissordyn.components.force import Force
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.time_function import TimeFunction
from scissordyn.errors import InputError, printable
from scissordyn.model.body import Body, Track, check_place, point_mass, uniform_legs
from scissordyn.model.coupling import Drive
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.linkage import common_pin
from scissordyn.model.mechanism import Mechanism

UNITS = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
"""Length in metres of each length unit of drawings and tables, by name."""

LINEAR_DENSITY = 1.0  # Default mass per length of a drawn bar [kg/m]


class Imported(NamedTuple):
    """Mechanism read from a file or link of another program.

    Parameters
    ----------
    mechanism : Mechanism
    notes : tuple of str
        One line for each part that was left out, and for each value that was assumed.
    """

    mechanism: Mechanism
    notes: tuple[str, ...]


def with_printable_notes(mechanism: Mechanism, notes: Iterable[str]) -> Imported:
    """Return the mechanism and its notes, with control characters of the notes escaped."""
    return Imported(mechanism, tuple(map(printable, notes)))


@dataclass(frozen=True)
class DrawnBar:
    """Rigid bar or plate that is joined to others at its pins."""

    name: str
    pins: tuple[str, ...]  # Names of one or more pins; the first two define the direction of the bar
    mass: float  # [kg]
    inertia: float  # Moment of inertia about the mass centre [kg m^2]
    centre: Point  # Mass centre, in the plane of the drawing [m]


@dataclass(frozen=True)
class Block:
    """Block that slides along a line without rotating, or bar with a pin that slides along a line."""

    name: str
    pin: str  # Name of the sliding pin
    direction: float | None  # Direction of the line through the pin in the plane of the drawing [rad]; None without a line
    mass: float = 0.0  # Mass of the block [kg]
    carrier: str = GROUND  # Bar that carries the line, or the ground
    follower: str = ""  # Bar that slides without a block; "" for a block
    aligned: bool = False  # True if the follower keeps its angle to the line
    guide: str = ""  # Name of the guide; "guide of NAME" if empty


@dataclass(frozen=True)
class Load:
    """Constant force on a bar, in the plane of the drawing."""

    name: str
    bar: str
    place: Point  # Point of action [m]
    force: Point  # [N]
    follows: bool  # True if the force turns with the bar


class Pair(NamedTuple):
    """Joint of two bodies on a pin, which states the body with the journal and the body with the bearing."""

    name: str
    pin: str
    journal: str
    bearing: str


@dataclass(frozen=True)
class Drawing:
    """Linkage as drawn in a plane: pins, bars, blocks, drives and loads."""

    pins: Mapping[str, Point]  # Positions [m]
    fixed: tuple[str, ...]  # Pins on the ground
    bars: tuple[DrawnBar, ...]
    blocks: tuple[Block, ...] = ()
    drives: Mapping[str, TimeFunction] = field(default_factory=dict)  # Prescribed angles of bars
    loads: tuple[Load, ...] = ()
    gravity: float = 0.0  # Gravity along -y [m/s^2]
    pairs: tuple[Pair, ...] = ()  # Joints with known journal and bearing


def plain_name(name: str, taken: Iterable[str]) -> str:
    """Return a unique name that a case file can refer to: without dots, slashes and asterisks, and not in `taken`."""
    name_so_far = "".join("_" if letter in "./*" else letter for letter in name.strip()) or "part"
    if name_so_far == GROUND:
        name_so_far = f"{name_so_far} part"
    used, plain, number = set(taken), name_so_far, 1
    while name_so_far in used:
        number += 1
        name_so_far = f"{plain} {number}"
    return name_so_far


def uniform(
    name: str, pins: tuple[str, ...], places: Mapping[str, Point], density: float, sides: Collection[tuple[str, str]] = ()
) -> DrawnBar:
    """Return a bar with the mass of uniform rods along its sides, by default along the shortest lines between its pins.

    `places` are the positions of the pins [m], `density` the mass per length [kg/m].
    """
    for pin in pins:
        check_place(f"pin '{pin}' in m", places[pin])
    legs = [(places[a], places[b]) for a, b in sides or shortest_tree(pins, places)]
    lengths = [math.dist(a, b) for a, b in legs]
    mass = density * sum(lengths)
    if not mass > 0.0:
        raise InputError(f"bar '{name}' has no length", "pins at different places")
    middles = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a, b in legs]
    centre, inertia = uniform_legs(mass, lengths, middles)
    return DrawnBar(name, pins, mass, inertia, centre)


def shortest_tree(pins: Iterable[str], places: Mapping[str, Point]) -> list[tuple[str, str]]:
    """Return the pairs of pins of the shortest lines that connect all pins (Prim's algorithm).

    The result does not depend on the order of the pins. For pins on one line these are the segments of that line.
    """
    names = sorted(set(pins), key=lambda pin: (places[pin], pin))
    xy = np.array([places[pin] for pin in names], float)
    nearest, gap = np.zeros(len(names), int), np.hypot(*(xy - xy[0]).T)
    gap[0] = math.inf
    lines = []
    for _ in names[1:]:
        new = int(np.argmin(gap))
        lines.append((names[nearest[new]], names[new]))
        further = np.hypot(*(xy - xy[new]).T)
        closer = further < gap
        closer &= np.isfinite(gap)
        nearest[closer], gap[closer] = new, further[closer]
        gap[new] = math.inf
    return lines


def mechanism_of_drawing(drawing: Drawing) -> Mechanism:
    """Convert a drawing to a mechanism; pins on no body are left out."""
    bodies = {bar.name: _body(bar, drawing.pins) for bar in drawing.bars}
    blocks = [block for block in drawing.blocks if not block.follower]
    for block in blocks:
        bodies[block.name] = point_mass(block.name, mass=block.mass, position=drawing.pins[block.pin])
    points_on_pin, bars = _bodies_on_pins(drawing), {bar.name for bar in drawing.bars}
    loaded = {load.place for load in drawing.loads}
    joints: list[Revolute] = []
    tracks: list[Track] = []
    paired = {pair.pin for pair in drawing.pairs}
    for name, pin, journal, bearing in drawing.pairs:
        points = dict(points_on_pin[pin])
        joints.append(Revolute(name, (journal, points[journal]), (bearing, points[bearing])))
    for pin, place in drawing.pins.items():
        if pin in paired:
            continue
        if len(points_on_pin[pin]) > 1:
            joints += common_pin(pin, *points_on_pin[pin])
        elif points_on_pin[pin] and points_on_pin[pin][0][0] in bars and place not in loaded:
            tracks.append(Track(pin, *points_on_pin[pin][0]))
    inputs = [bar for bar in drawing.drives if bar in bodies]
    return Mechanism(
        bodies=tuple(bodies.values()),
        joints=tuple(joints),
        guides=tuple(
            _guide(block, block.direction, drawing, bodies) for block in drawing.blocks if block.direction is not None
        ),
        drives=tuple(Drive(bar, function) for bar, function in drawing.drives.items()),
        components=tuple(_force(load, bodies[load.bar]) for load in drawing.loads),
        ground=tuple((pin, drawing.pins[pin]) for pin in drawing.fixed if len(points_on_pin[pin]) > 1),
        gravity=drawing.gravity,
        input_body=inputs[0] if inputs else drawing.bars[0].name if drawing.bars else "",
        output_body=blocks[0].name if blocks else "",
        tracks=tuple(tracks),
    )


def with_point_mass(bar: DrawnBar, place: Point, mass: float) -> DrawnBar:
    """Return the bar with a point mass fixed to it."""
    total = bar.mass + mass
    centre = (bar.mass * bar.centre[0] + mass * place[0]) / total, (bar.mass * bar.centre[1] + mass * place[1]) / total
    inertia = bar.inertia + bar.mass * math.dist(bar.centre, centre) ** 2 + mass * math.dist(place, centre) ** 2
    return replace(bar, mass=total, inertia=inertia, centre=centre)


def _bodies_on_pins(drawing: Drawing) -> dict[str, list[BodyPoint]]:
    """Return the points of bodies at each pin, by pin name: bars first, then blocks, then the ground."""
    points_on_pin: dict[str, list[BodyPoint]] = {pin: [] for pin in drawing.pins}
    for bar in drawing.bars:
        for pin in dict.fromkeys(bar.pins):
            points_on_pin[pin].append((bar.name, pin))
    for pin, name in dict.fromkeys((block.pin, block.name) for block in drawing.blocks if not block.follower):
        points_on_pin[pin].append((name, "centre"))  # once, also for a block on two lines
    for pin in drawing.fixed:
        points_on_pin[pin].append((GROUND, pin))
    return points_on_pin


def _body(bar: DrawnBar, places: Mapping[str, Point]) -> Body:
    origin, other = places[bar.pins[0]], places[bar.pins[:2][-1]]
    angle = math.atan2(other[1] - origin[1], other[0] - origin[0])
    return Body(
        bar.name,
        bar.mass,
        bar.inertia,
        points={pin: _turned(places[pin], origin, -angle) for pin in bar.pins},
        centre=_turned(bar.centre, origin, -angle),
        position=origin,
        angle=angle,
    )


def _turned(place: Point, origin: Point, angle: float) -> Point:
    x, y, cos, sin = place[0] - origin[0], place[1] - origin[1], math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


def _guide(block: Block, direction: float, drawing: Drawing, bodies: Mapping[str, Body]) -> Guide:
    through = drawing.pins[block.pin]
    if block.carrier != GROUND:
        carrier = bodies[block.carrier]
        through, direction = _turned(through, carrier.placed_position, -carrier.placed_angle), direction - carrier.placed_angle
    follower = (block.follower, block.pin) if block.follower else (block.name, "centre")
    return Guide(block.guide or f"guide of {block.name}", follower, through, direction, block.carrier, block.aligned)


def _force(load: Load, body: Body) -> Any:
    """Return the force component for a load, which acts on a named point of its body."""
    at = _turned(load.place, body.placed_position, -body.placed_angle)
    near = min(body.points, key=lambda point: math.dist(body.points[point], at))
    if math.dist(body.points[near], at) > 1e-9 * max(1.0, body.extent):
        raise InputError(f"force '{load.name}' does not act on a point of '{load.bar}'", "a force on a point of the bar")
    force = _turned(load.force, (0.0, 0.0), -body.placed_angle) if load.follows else load.force
    return Force(load.name, (load.bar, near), force, follows=load.follows)
