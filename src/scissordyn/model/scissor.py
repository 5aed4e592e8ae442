"""Arrays of scissor-like elements: straight, upright, curved, and closed to a ring."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Annotated, Literal

from scissordyn.components.place import GROUND, Point
from scissordyn.errors import InputError
from scissordyn.model.body import Body, bar, point_mass, uniform_legs
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parts import Gravity, GravityDirection
from scissordyn.units import Meaning, Quantity, Sample, checked, documented

UNITS_MAX = 10_000
"""Largest number of units in a structure; the time to eliminate constraints grows at least quadratically."""


Units = Annotated[int, Quantity("1", minimum=1, maximum=UNITS_MAX, help="number of units N")]
BarLength = Annotated[float, Quantity("m", above=0.0, help="length L of a bar")]
BarMass = Annotated[float, Quantity("kg", above=0.0, help="mass of a bar")]
SliderMass = Annotated[float, Quantity("kg", above=0.0, help="mass of the slider")]


def joints_of_units(
    units: int, *, pivot: str, sides: tuple[str, str] = ("upper", "lower"), closed: bool = False
) -> tuple[Revolute, ...]:
    """Return the joints inside and between scissor units."""
    joints = []
    for unit in range(1, units + 1):
        joints.append(Revolute(f"unit {unit}/pivot", (f"unit {unit}/bar 1", pivot), (f"unit {unit}/bar 2", pivot)))
        if unit == units and not closed:
            continue
        following = unit % units + 1
        for side, here, there in zip(sides, (1, 2), (2, 1), strict=True):
            ends = (f"unit {unit}/bar {here}", "end"), (f"unit {following}/bar {there}", "start")
            joints.append(Revolute(f"unit {unit}/{side}", *ends))
    return tuple(joints)


def _with_slider(
    bars: Iterable[Body],
    joints: Iterable[Revolute],
    slider: Body,
    gravity: float,
    gravity_direction: float,
    *,
    direction: float = 0.5 * math.pi,
    pinned: int = 1,
) -> Mechanism:
    """Return an array: one bar of its first unit is pinned at the origin, the other at a slider on a line through it."""
    return Mechanism(
        bodies=(*bars, slider),
        joints=(
            Revolute("O", (f"unit 1/bar {pinned}", "start"), (GROUND, "origin")),
            Revolute("A", (f"unit 1/bar {3 - pinned}", "start"), ("slider", "centre")),
            *joints,
        ),
        guides=(Guide("guide", ("slider", "centre"), direction=direction),),
        ground=(("origin", (0.0, 0.0)),),
        gravity=gravity,
        gravity_direction=gravity_direction,
        input_body="unit 1/bar 1",
        output_body="slider",
    )


@documented
@checked
def scissor(
    *,
    units: Units = 2,
    bar_length: BarLength = 2.0,
    bar_mass: BarMass = 5.68,
    slider_mass: SliderMass = 5.0,
    angle: Annotated[
        float, Quantity("rad", help="initial angle th of the bars to the axis, 0 to 90 deg; the array extends as it falls")
    ] = math.pi / 6,
    gravity: Gravity = 9.81,
    gravity_direction: GravityDirection = -math.pi / 2,
    driven_bar: Annotated[
        Literal["pinned", "slider"], Meaning("which bar is driven: the one pinned to the ground or the one at the slider")
    ] = "pinned",
) -> Mechanism:
    """Return a straight array of equal scissor units along x, pinned at the origin, with a slider on the y axis.

    Each unit is two bars pivoted at their middles; the length of the array is N L cos th. Bar 1 is always the driven bar. With
    "pinned" it is pinned to the ground, and the journal of joint A is the end of bar 2. With "slider" bar 2 is pinned to the
    ground, and the journal of joint A is the end of bar 1.

    Returns
    -------
    Mechanism
        Bodies "unit 1/bar 1", "unit 1/bar 2", ... and "slider"; joints "O" (ground pin), "A" (slider),
        "unit 1/pivot", ... and "unit 1/upper", "unit 1/lower" between units 1 and 2; guide "guide".
    """
    _check_opening(0.5 * bar_length, 0.5 * bar_length, 0.0, angle)
    pinned, coupler = (1, 2) if driven_bar == "pinned" else (2, 1)
    lean = {1: angle, 2: -angle}
    height = bar_length * math.sin(angle) * (1.0 if driven_bar == "pinned" else -1.0)
    width = bar_length * math.cos(angle)

    bodies = []
    for unit in range(1, units + 1):
        starts = {pinned: ((unit - 1) * width, 0.0), coupler: ((unit - 1) * width, height)}
        for number in (1, 2):
            name = f"unit {unit}/bar {number}"
            bodies.append(bar(name, length=bar_length, mass=bar_mass, position=starts[number], angle=lean[number]))
    slider = point_mass("slider", mass=slider_mass, position=(0.0, height))
    joints = joints_of_units(units, pivot="middle")
    return _with_slider(bodies, joints, slider, gravity, gravity_direction, pinned=pinned)


@documented
@checked
def angulated_bar(
    name: str,
    *,
    first: Annotated[float, Quantity("m", above=0.0, help="length from the start to the pivot")],
    second: Annotated[float, Quantity("m", above=0.0, help="length from the pivot to the end")],
    kink: Annotated[float, Quantity("rad", help="angle from the direction of the first leg to that of the second")] = 0.0,
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass of both legs, in proportion to their lengths")],
    position: Annotated[Point, Meaning("position of its start [m]")] = (0.0, 0.0),
    angle: Annotated[float, Quantity("rad", help="direction of the first leg")] = 0.0,
) -> Body:
    """Return a uniform bar of two straight legs that meet at a pivot; without a kink it is straight.

    Returns
    -------
    Body
        A body with points "start", "pivot" and "end".
    """
    end = first + second * math.cos(kink), second * math.sin(kink)
    centre, inertia = uniform_legs(mass, (first, second), ((0.5 * first, 0.0), (0.5 * (first + end[0]), 0.5 * end[1])))
    return Body(
        name=name,
        mass=mass,
        inertia=inertia,
        points={"start": (0.0, 0.0), "pivot": (first, 0.0), "end": end},
        centre=centre,
        position=position,
        angle=angle,
    )


Inclination = Annotated[
    float,
    Quantity("rad", help="mean inclination th of the bars to the circumference; the array extends as it falls"),
]


@documented
@checked
def polar_scissor(
    *,
    units: Units = 4,
    inner: Annotated[float, Quantity("m", above=0.0, help="inner leg a of a bar, from pivot to inner end")] = 0.8,
    outer: Annotated[float, Quantity("m", above=0.0, help="outer leg b of a bar, from pivot to outer end")] = 1.2,
    kink: Annotated[float, Quantity("rad", help="angle k between the two legs of a bar, 0 for straight bars")] = 0.0,
    bar_mass: BarMass = 5.0,
    slider_mass: SliderMass = 5.0,
    angle: Inclination = math.pi / 4,
    gravity: Gravity = 9.81,
    gravity_direction: GravityDirection = -math.pi / 2,
) -> Mechanism:
    """Return a curved array: the bars of a unit cross outside their middles, or are kinked there.

    The first unit starts on the y axis, with its inner end pinned at the origin and a slider at its outer end. The legs inside
    and outside the pivot are a and b, the mean inclination of the bars to the circumference is th, the kink is k. A unit spans
    the angle g, and the inner and outer ends lie on circles of radii R_i and R_o:

        tan(g/2) = (b cos(th - k/2) - a cos(th + k/2)) / (b sin(th - k/2) + a sin(th + k/2))
        R_i = a cos(th + k/2) / sin(g/2),    R_o = b cos(th - k/2) / sin(g/2)

    Straight bars give tan(g/2) = (b - a)/(b + a) cot th: the curvature, downwards if b > a, changes during deployment. Equal
    legs give g = k: the radius changes and the angle does not (Hoberman 1990, US patent 4942700).

    Returns
    -------
    Mechanism
        Bodies "unit 1/bar 1" (from the inner to the outer circle), "unit 1/bar 2" (from the outer to the inner one), ...
        with points "start", "pivot", "end", and "slider"; joints "O" (ground pin), "A" (slider), "unit 1/pivot", ... and
        "unit 1/upper" (outer), "unit 1/lower" (inner) between units 1 and 2; guide "guide".
    """
    _check_opening(inner, outer, kink, angle)
    bars = _curved_bars(units, inner, outer, kink, bar_mass, angle, (0.0, 0.0))
    height = math.hypot(*_opening(inner, outer, kink, angle))
    slider = point_mass("slider", mass=slider_mass, position=(0.0, height))
    return _with_slider(bars, joints_of_units(units, pivot="pivot"), slider, gravity, gravity_direction)


@documented
@checked
def hoberman_ring(
    *,
    units: Annotated[int, Quantity("1", minimum=3, maximum=UNITS_MAX, help="number of units")] = 12,
    leg: Annotated[float, Quantity("m", above=0.0, help="leg p, from the pivot of a bar to each of its ends")] = 0.5,
    bar_mass: BarMass = 1.0,
    angle: Inclination = math.pi / 4,
    gravity: Gravity = 0.0,
    gravity_direction: GravityDirection = -math.pi / 2,
) -> Mechanism:
    """Return a closed ring of angulated units, each spanning k = 2 pi/N, with one degree of freedom.

    With p the leg and th the mean inclination of the bars to the circumference, pivots, inner and outer ends lie on
    circles about the origin (You and Pellegrino 1997, Foldable bar structures):

        R = p cos th / sin(k/2),    R_i = p cos(th + k/2) / sin(k/2),    R_o = p cos(th - k/2) / sin(k/2)

    Returns
    -------
    Mechanism
        Bodies "unit 1/bar 1", "unit 1/bar 2", ..., clockwise from the top, with points "start", "pivot", "end"; joints
        "unit 1/pivot", ..., "unit 1/upper" (outer) and "unit 1/lower" (inner) between units 1 and 2, ... and between units N
        and 1; guides "guide 1", "guide 2", "guide 3", which keep three of the pivots on rays from the origin.
    """
    kink = 2.0 * math.pi / units
    _check_opening(leg, leg, kink, angle)
    inside = leg * math.cos(angle + 0.5 * kink) / math.sin(0.5 * kink)
    guided = (1, 1 + units // 3, 1 + 2 * units // 3)
    return Mechanism(
        bodies=_curved_bars(units, leg, leg, kink, bar_mass, angle, (0.0, inside)),
        joints=joints_of_units(units, pivot="pivot", closed=True),
        guides=tuple(
            Guide(f"guide {number}", (f"unit {unit}/bar 1", "pivot"), direction=0.5 * math.pi - (unit - 0.5) * kink)
            for number, unit in enumerate(guided, start=1)
        ),
        gravity=gravity,
        gravity_direction=gravity_direction,
        input_body="unit 1/bar 1",
    )


@documented
@checked
def mast(
    *,
    units: Units = 4,
    bar_length: BarLength = 1.0,
    bar_mass: BarMass = 2.0,
    slider_mass: SliderMass = 1.0,
    platform_mass: Annotated[float | None, Quantity("kg", above=0.0, help="mass of a platform on top, or no platform")] = None,
    angle: Annotated[
        float,
        Quantity("rad", help="initial angle th of the bars to the base, 0 to 90 deg; the mast extends as it grows"),
    ] = math.pi / 6,
    gravity: Gravity = 9.81,
    gravity_direction: GravityDirection = -math.pi / 2,
) -> Mechanism:
    """Return an array on a base along x that extends along y to the height N L sin th, with or without a platform.

    The platform is uniform and as long as a bar. It is pinned to the left end of the last unit and rests on its right end.

    Returns
    -------
    Mechanism
        Bodies "unit 1/bar 1" (rising to the right), "unit 1/bar 2" (rising to the left), ..., "slider" and "platform";
        joints "O" (ground pin at the origin), "A" (slider on the base), "unit 1/pivot", ..., "unit 1/right", "unit 1/left"
        between units 1 and 2, and "platform pin"; guides "guide" and "platform guide".
    """
    _check_opening(0.5 * bar_length, 0.5 * bar_length, 0.0, angle)
    width, storey = bar_length * math.cos(angle), bar_length * math.sin(angle)
    bodies: list[Body] = []
    for unit in range(1, units + 1):
        level = (unit - 1) * storey
        for number, start, lean in ((1, 0.0, angle), (2, width, math.pi - angle)):
            name = f"unit {unit}/bar {number}"
            bodies.append(bar(name, length=bar_length, mass=bar_mass, position=(start, level), angle=lean))
    joints = joints_of_units(units, pivot="middle", sides=("right", "left"))
    slider = point_mass("slider", mass=slider_mass, position=(width, 0.0))
    bare = _with_slider(bodies, joints, slider, gravity, gravity_direction, direction=0.0)
    if platform_mass is None:
        return bare
    platform = bar("platform", length=bar_length, mass=platform_mass, position=(0.0, units * storey))
    return dataclasses.replace(
        bare,
        bodies=(*bare.bodies, platform),
        joints=(*bare.joints, Revolute("platform pin", (f"unit {units}/bar 2", "end"), ("platform", "start"))),
        guides=(*bare.guides, Guide("platform guide", (f"unit {units}/bar 1", "end"), body="platform")),
    )


def _opening(inner: float, outer: float, kink: float, angle: float) -> Point:
    """Return the vector from the inner to the outer end of a unit, along and across the circumference [m]."""
    along = outer * math.cos(angle - 0.5 * kink) - inner * math.cos(angle + 0.5 * kink)
    return along, outer * math.sin(angle - 0.5 * kink) + inner * math.sin(angle + 0.5 * kink)


def _curved_bars(
    units: int, inner: float, outer: float, kink: float, mass: float, angle: float, start: Point
) -> tuple[Body, ...]:
    """Return the bars of units in clockwise order; the first has its inner end at `start` on the y axis."""
    bodies: list[Body] = []
    (x, y), (along, across) = start, _opening(inner, outer, kink, angle)
    span = 2.0 * math.atan2(along, across)
    for unit in range(1, units + 1):
        tangent = -(unit - 0.5) * span
        steep, flat = tangent + angle + 0.5 * kink, tangent - angle + 0.5 * kink
        pivot = x + inner * math.cos(steep), y + inner * math.sin(steep)
        high = pivot[0] - outer * math.cos(flat), pivot[1] - outer * math.sin(flat)
        # at the pivot, bar 1 has its inner leg first, bar 2 its outer leg; both bend clockwise
        for number, first, second, place, lean in ((1, inner, outer, (x, y), steep), (2, outer, inner, high, flat)):
            name = f"unit {unit}/bar {number}"
            bodies.append(angulated_bar(name, first=first, second=second, kink=-kink, mass=mass, position=place, angle=lean))
        x, y = pivot[0] + inner * math.cos(flat - kink), pivot[1] + inner * math.sin(flat - kink)
    return tuple(bodies)


def _check_opening(inner: float, outer: float, kink: float, angle: float) -> None:
    """Raise `InputError` unless the ends of a unit are apart, both across the array and along it."""
    _, across = _opening(inner, outer, kink, angle)
    flattest = min(math.cos(angle - 0.5 * kink), math.cos(angle + 0.5 * kink))
    if not (0.0 < angle < 0.5 * math.pi and across > 0.0 and flattest > 0.0):
        raise InputError(
            f"angle = {math.degrees(angle):g} deg: the array cannot be assembled",
            f"an angle above 0 and below {math.degrees(0.5 * math.pi - 0.5 * abs(kink)):g} deg",
            Sample("angle", math.radians(30.0), "rad"),
        )
