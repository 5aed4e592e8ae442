"""Arrays of scissor-like elements."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.model.body import bar, point_mass
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Gravity, GravityDirection, Mechanism
from scissordyn.units import Meaning, Quantity, Sample, checked, documented

MOST_UNITS = 10_000
"""Units of an array: the elimination of linear constraints takes time with the square of their number at least."""

UNITS_TAKE = "3000 units take half a minute, and 100000 would take a gigabyte and 8 hours at least"

Units = Annotated[int, Quantity("1", minimum=1, maximum=MOST_UNITS, because=UNITS_TAKE, help="number of units N")]
BarLength = Annotated[float, Quantity("m", above=0.0, help="length L of a bar")]
BarMass = Annotated[float, Quantity("kg", above=0.0, help="mass of a bar")]
SliderMass = Annotated[float, Quantity("kg", above=0.0, help="mass of the slider")]


def joints_of_units(
    units: int, *, pivot: str, sides: tuple[str, str] = ("upper", "lower"), closed: bool = False
) -> tuple[Revolute, ...]:
    """The joints inside and between scissor units."""
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


@documented
@checked
def scissor(
    *,
    units: Units = 2,
    bar_length: BarLength = 2.0,
    bar_mass: BarMass = 5.68,
    slider_mass: SliderMass = 5.0,
    angle: Annotated[
        float, Quantity("rad", help="th of the bars to the axis at the start, 0 to 90 deg; the array extends as it falls")
    ] = math.pi / 6,
    gravity: Gravity = 9.81,
    gravity_direction: GravityDirection = -math.pi / 2,
    driven_bar: Annotated[
        Literal["pinned", "slider"], Meaning("whether the bar pinned to the ground or the bar at the slider is driven")
    ] = "pinned",
) -> Mechanism:
    """A straight array of equal scissor units along x, pinned at the origin, with a slider on the y axis.

    Each unit is two bars pivoted at their middles; the array is N L cos th long. The driven bar is always bar 1: "pinned", it
    is pinned to the ground, and the journal of joint A is the end of bar 2; "slider", bar 2 is pinned to the ground, and the
    journal of joint A is the end of bar 1.

    Returns
    -------
    Mechanism
        Bodies "unit 1/bar 1", "unit 1/bar 2", ... and "slider"; joints "O" (ground pin), "A" (slider),
        "unit 1/pivot", ... and "unit 1/upper", "unit 1/lower" between units 1 and 2; guide "guide".
    """
    if not 0.0 < angle < 0.5 * math.pi:
        raise InputError(
            f"angle = {math.degrees(angle):g} deg, at which the array cannot be assembled",
            "an angle above 0 and below 90 deg",
            Sample("angle", math.radians(30.0), "rad"),
        )
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
    bodies.append(point_mass("slider", mass=slider_mass, position=(0.0, height)))
    supports = (
        Revolute("O", (f"unit 1/bar {pinned}", "start"), (GROUND, "origin")),
        Revolute("A", (f"unit 1/bar {coupler}", "start"), ("slider", "centre")),
    )
    return Mechanism(
        bodies=tuple(bodies),
        joints=(*supports, *joints_of_units(units, pivot="middle")),
        guides=(Guide("guide", ("slider", "centre"), direction=0.5 * math.pi),),
        ground=(("origin", (0.0, 0.0)),),
        gravity=gravity,
        gravity_direction=gravity_direction,
        input_body="unit 1/bar 1",
        output_body="slider",
    )
