"""What drawings of linkages have in common: pins, bars, blocks that slide, and the mechanism that they describe."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from scissordyn.components.force import Force
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.time_function import TimeFunction
from scissordyn.errors import InputError
from scissordyn.model.body import Body, Track, point_mass
from scissordyn.model.coupling import Drive
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.linkage import common_pin
from scissordyn.model.mechanism import Mechanism

UNITS = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
"""Units of length of drawings and tables [m]."""

LINEAR_DENSITY = 1.0  # Mass of a drawn bar whose mass nobody gave [kg/m]


class Imported(NamedTuple):
    """A mechanism that was read from the file or the link of another program.

    Parameters
    ----------
    mechanism : Mechanism
    notes : tuple of str
        What was not understood and left out, and what the source does not say and was assumed; one line each.
    """

    mechanism: Mechanism
    notes: tuple[str, ...]


@dataclass(frozen=True)
class DrawnBar:
    """A rigid bar or plate between pins."""

    name: str
    pins: tuple[str, ...]  # Two or more
    mass: float  # [kg]
    inertia: float  # About the mass centre [kg m^2]
    centre: Point  # Mass centre, in the plane of the drawing [m]


@dataclass(frozen=True)
class Block:
    """A block that slides along a line and does not rotate by itself, or a bar that slides there with one of its pins."""

    name: str
    pin: str  # The pin that it carries
    direction: float  # Of the line through the pin, in the plane of the drawing [rad]
    mass: float = 0.0  # Of the block [kg]
    carrier: str = GROUND  # The bar that carries the line, or the ground
    follower: str = ""  # The bar that slides there itself, without a block
    aligned: bool = False  # Whether that bar keeps its angle against the line


@dataclass(frozen=True)
class Load:
    """A constant force on a bar, in the plane of the drawing."""

    name: str
    bar: str
    place: Point
    force: Point
    follows: bool


@dataclass(frozen=True)
class Drawing:
    """Pins, bars and blocks in a plane."""

    pins: Mapping[str, Point]  # Places [m]
    fixed: tuple[str, ...]  # The pins on the ground
    bars: tuple[DrawnBar, ...]
    blocks: tuple[Block, ...] = ()
    drives: Mapping[str, TimeFunction] = field(default_factory=dict)  # Prescribed angles of bars
    loads: tuple[Load, ...] = ()
    gravity: float = 0.0  # Along -y [m/s^2]


def plain_name(name: str, taken: Iterable[str]) -> str:
    """A name that a case file can address: without dots and slashes, and unlike those that are taken."""
    name_so_far = "".join("_" if letter in "./*" else letter for letter in name.strip()) or "part"
    if name_so_far == GROUND:
        name_so_far = f"{name_so_far} part"
    used, plain, number = set(taken), name_so_far, 1
    while name_so_far in used:
        number += 1
        name_so_far = f"{plain} {number}"
    return name_so_far


def uniform(name: str, pins: tuple[str, ...], places: Mapping[str, Point], density: float) -> DrawnBar:
    """A bar with the mass of thin rods from its first pin to the others, or around a plate of three and more pins."""
    corners = [places[pin] for pin in pins]
    sides = list(zip(corners, corners[1:] + corners[:1], strict=True))[: 1 if len(corners) == 2 else None]
    lengths = [math.dist(a, b) for a, b in sides]
    total = sum(lengths)
    if not total > 0.0:
        raise InputError(f"bar '{name}' without length", "pins at different places")
    middles = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a, b in sides]
    centre = tuple(sum(part * middle[k] for part, middle in zip(lengths, middles, strict=True)) / total for k in (0, 1))
    inertia = sum(
        density * part * (part**2 / 12.0 + math.dist(middle, centre) ** 2)
        for part, middle in zip(lengths, middles, strict=True)
    )
    return DrawnBar(name, pins, density * total, inertia, (centre[0], centre[1]))


def assembled(drawing: Drawing) -> Mechanism:
    """The mechanism of a drawing."""
    bodies = {bar.name: _body(bar, drawing.pins) for bar in drawing.bars}
    blocks = [block for block in drawing.blocks if not block.follower]
    for block in blocks:
        bodies[block.name] = point_mass(block.name, mass=block.mass, position=drawing.pins[block.pin])
    bars = {bar.name for bar in drawing.bars}
    joints: list[Revolute] = []
    tracks: list[Track] = []
    for pin in drawing.pins:
        on = _on(pin, drawing)
        if len(on) > 1:
            joints += common_pin(pin, on[0], *on[1:])
        elif on and on[0][0] in bars and drawing.pins[pin] not in [load.place for load in drawing.loads]:
            tracks.append(Track(pin, *on[0]))
    inputs = [bar for bar in drawing.drives if bar in bodies]
    return Mechanism(
        bodies=tuple(bodies.values()),
        joints=tuple(joints),
        guides=tuple(_guide(block, drawing, bodies) for block in drawing.blocks),
        drives=tuple(Drive(bar, function) for bar, function in drawing.drives.items()),
        components=tuple(_force(load, bodies[load.bar]) for load in drawing.loads),
        ground=tuple((pin, drawing.pins[pin]) for pin in drawing.fixed),
        gravity=drawing.gravity,
        input_body=inputs[0] if inputs else drawing.bars[0].name if drawing.bars else "",
        output_body=blocks[0].name if blocks else "",
        tracks=tuple(tracks),
    )


def with_point_mass(bar: DrawnBar, place: Point, mass: float) -> DrawnBar:
    """The bar with a point mass fixed to it."""
    total = bar.mass + mass
    centre = (bar.mass * bar.centre[0] + mass * place[0]) / total, (bar.mass * bar.centre[1] + mass * place[1]) / total
    inertia = bar.inertia + bar.mass * math.dist(bar.centre, centre) ** 2 + mass * math.dist(place, centre) ** 2
    return replace(bar, mass=total, inertia=inertia, centre=centre)


def _on(pin: str, drawing: Drawing) -> list[BodyPoint]:
    """The bodies on a pin and their points: bars, then blocks, then the ground."""
    on = [(bar.name, pin) for bar in drawing.bars if pin in bar.pins]
    on += [(block.name, "centre") for block in drawing.blocks if block.pin == pin and not block.follower]
    return on + ([(GROUND, pin)] if pin in drawing.fixed else [])


def _body(bar: DrawnBar, places: Mapping[str, Point]) -> Body:
    origin, other = places[bar.pins[0]], places[bar.pins[1]]
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


def _guide(block: Block, drawing: Drawing, bodies: Mapping[str, Body]) -> Guide:
    through, direction = drawing.pins[block.pin], block.direction
    if block.carrier != GROUND:
        carrier = bodies[block.carrier]
        through, direction = _turned(through, carrier.placed_position, -carrier.placed_angle), direction - carrier.placed_angle
    follower = (block.follower, block.pin) if block.follower else (block.name, "centre")
    return Guide(f"guide of {block.name}", follower, through, direction, block.carrier, block.aligned)


def _force(load: Load, body: Body) -> Any:
    """The force on a named point of its body; one with the place of a pin acts there."""
    at = _turned(load.place, body.placed_position, -body.placed_angle)
    near = min(body.points, key=lambda point: math.dist(body.points[point], at))
    if math.dist(body.points[near], at) > 1e-9 * max(1.0, body.extent):
        raise InputError(f"force '{load.name}' beside the points of '{load.bar}'", "a force on one of its points")
    force = _turned(load.force, (0.0, 0.0), -body.placed_angle) if load.follows else load.force
    return Force(load.name, (load.bar, near), force, follows=load.follows)
