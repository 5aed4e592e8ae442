"""Classical linkages."""

from __future__ import annotations

import dataclasses
import math
from typing import Annotated, Literal

from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError
from scissordyn.model.body import Body, bar, point_mass
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parts import Gravity, GravityDirection
from scissordyn.model.scissor import UNITS_MAX, SliderMass
from scissordyn.units import Meaning, Quantity, checked, documented


@checked
def common_pin(name: str, pin: BodyPoint, *others: BodyPoint) -> tuple[Revolute, ...]:
    """Return the joints of several bars on one pin, which is fixed in the first bar.

    Parameters
    ----------
    name : str
        Name of the joint; with more than two bars a number is appended: "name 1", "name 2", ...
    pin : (str, str)
        Body and point that carry the pin, the journal of each joint.
    *others : (str, str)
        Bodies and points that carry the bearings.

    Returns
    -------
    tuple of Revolute
        One joint for each of the other bars, so that each can have its own clearance.
    """
    if not others:
        raise InputError(f"pin '{name}' carries one bar", "two or more bars")
    if len(others) == 1:
        return (Revolute(name, pin, others[0]),)
    return tuple(Revolute(f"{name} {number}", pin, other) for number, other in enumerate(others, start=1))


@documented
@checked
def slider_crank(
    *,
    crank: Annotated[float, Quantity("m", above=0.0, help="length r of the crank")] = 0.05,
    rod: Annotated[float, Quantity("m", above=0.0, help="length l of the rod")] = 0.12,
    offset: Annotated[float, Quantity("m", help="height of the slider's line")] = 0.0,
    crank_mass: Annotated[float, Quantity("kg", above=0.0, help="mass of the crank")] = 0.3,
    crank_inertia: Annotated[
        float | None, Quantity("kg m^2", above=0.0, help="inertia about its middle; by default that of a uniform bar")
    ] = None,
    rod_mass: Annotated[float, Quantity("kg", above=0.0, help="mass of the rod")] = 0.21,
    rod_inertia: Annotated[float | None, Quantity("kg m^2", above=0.0, help="inertia about its middle")] = 2.5e-4,
    slider_mass: SliderMass = 0.14,
    slider_inertia: Annotated[
        float | None, Quantity("kg m^2", above=0.0, help="inertia about its pin, for a clearance guide")
    ] = None,
    angle: Annotated[float, Quantity("rad", help="direction a of the crank at the start")] = 0.0,
    gravity: Gravity = 0.0,
    gravity_direction: GravityDirection = -math.pi / 2,
) -> Mechanism:
    """Return a slider-crank: a crank about the origin, a rod, and a slider along x, r sin a + l sin b = offset.

    The defaults are those of comparisons of clearance joint laws by Flores and co-workers. At a prescribed speed the mass of
    the crank influences only the torque. Mass centres of crank and rod are in their middles, that of the slider is on its pin.
    With an inertia the slider is a block: an ideal guide keeps it aligned, and it can tilt in a clearance guide. Without an
    inertia the slider does not rotate.

    Returns
    -------
    Mechanism
        Bodies "crank", "rod", "slider"; joints "ground pin", "crank pin", "slider pin" (journal on the rod); guide "guide".
    """
    rise = offset - crank * math.sin(angle)
    if not abs(rise) < rod:
        raise InputError(
            f"crank at {math.degrees(angle):g} deg: the rod of {rod:g} m does not reach the slider's line",
            f"a rod longer than {abs(rise):g} m, or another angle",
        )
    pin = crank * math.cos(angle), crank * math.sin(angle)
    lean = math.asin(rise / rod)
    slider = point_mass("slider", mass=slider_mass, position=(pin[0] + rod * math.cos(lean), offset))
    return Mechanism(
        bodies=(
            bar("crank", length=crank, mass=crank_mass, inertia=crank_inertia, angle=angle),
            bar("rod", length=rod, mass=rod_mass, inertia=rod_inertia, position=pin, angle=lean),
            dataclasses.replace(slider, inertia=slider_inertia),
        ),
        joints=(
            Revolute("ground pin", ("crank", "start"), (GROUND, "origin")),
            Revolute("crank pin", ("crank", "end"), ("rod", "start")),
            Revolute("slider pin", ("rod", "end"), ("slider", "centre")),
        ),
        guides=(Guide("guide", ("slider", "centre"), through=(0.0, offset), aligned=slider_inertia is not None),),
        ground=(("origin", (0.0, 0.0)),),
        gravity=gravity,
        gravity_direction=gravity_direction,
        input_body="crank",
        output_body="slider",
    )


@documented
@checked
def four_bar(
    *,
    ground: Annotated[float, Quantity("m", above=0.0, help="distance of the ground pins")] = 0.20,
    crank: Annotated[float, Quantity("m", above=0.0, help="length of the crank")] = 0.08,
    coupler: Annotated[float, Quantity("m", above=0.0, help="length of the coupler")] = 0.18,
    rocker: Annotated[float, Quantity("m", above=0.0, help="length of the rocker")] = 0.15,
    crank_mass: Annotated[float, Quantity("kg", above=0.0, help="mass of the crank")] = 0.08,
    coupler_mass: Annotated[float, Quantity("kg", above=0.0, help="mass of the coupler")] = 0.18,
    rocker_mass: Annotated[float, Quantity("kg", above=0.0, help="mass of the rocker")] = 0.15,
    coupler_point: Annotated[
        Point, Quantity("m", help='position of the point "coupler.point", along the coupler and to its left')
    ] = (0.09, 0.06),
    angle: Annotated[float, Quantity("rad", help="direction of the crank at the start")] = math.pi / 3,
    branch: Annotated[Literal["open", "crossed"], Meaning("side of the diagonal on which the rocker pin starts")] = "open",
    gravity: Gravity = 9.81,
    gravity_direction: GravityDirection = -math.pi / 2,
) -> Mechanism:
    """Return a planar four-bar linkage of uniform bars; the ground pins are the origin and (ground, 0).

    The defaults make a crank-rocker: by Grashof's criterion the crank rotates fully, since 0.08 + 0.20 < 0.18 + 0.15. Other
    lengths are allowed if they can be assembled at the start. On the "open" branch the rocker pin starts to the left of the
    line from the crank pin to the rocker's ground pin.

    Returns
    -------
    Mechanism
        Bodies "crank", "coupler", "rocker"; joints "crank ground pin", "crank pin", "rocker pin", "rocker ground pin".
    """
    pin = crank * math.cos(angle), crank * math.sin(angle)
    diagonal = math.dist(pin, (ground, 0.0))
    if not abs(coupler - rocker) < diagonal < coupler + rocker:
        raise InputError(
            f"crank at {math.degrees(angle):g} deg: its pin is {diagonal:g} m from the rocker's ground pin",
            f"a distance between {abs(coupler - rocker):g} m and {coupler + rocker:g} m that coupler and rocker can close",
        )
    # law of cosines for the angle between diagonal and coupler
    opening = math.acos((coupler**2 + diagonal**2 - rocker**2) / (2.0 * coupler * diagonal))
    lean = math.atan2(-pin[1], ground - pin[0]) + (opening if branch == "open" else -opening)
    end = pin[0] + coupler * math.cos(lean), pin[1] + coupler * math.sin(lean)
    middle = bar("coupler", length=coupler, mass=coupler_mass, position=pin, angle=lean)
    return Mechanism(
        bodies=(
            bar("crank", length=crank, mass=crank_mass, angle=angle),
            dataclasses.replace(middle, points={**middle.points, "point": coupler_point}),
            bar("rocker", length=rocker, mass=rocker_mass, position=(ground, 0.0), angle=math.atan2(end[1], end[0] - ground)),
        ),
        joints=(
            Revolute("crank ground pin", ("crank", "start"), (GROUND, "crank")),
            Revolute("crank pin", ("crank", "end"), ("coupler", "start")),
            Revolute("rocker pin", ("coupler", "end"), ("rocker", "end")),
            Revolute("rocker ground pin", ("rocker", "start"), (GROUND, "rocker")),
        ),
        ground=(("crank", (0.0, 0.0)), ("rocker", (ground, 0.0))),
        gravity=gravity,
        gravity_direction=gravity_direction,
        input_body="crank",
        output_body="rocker",
    )


@documented
@checked
def n_four_bar(
    units: Annotated[int, Quantity("1", minimum=1, maximum=UNITS_MAX, help="number of parallelograms N")] = 2,
    *,
    length: Annotated[float, Quantity("m", above=0.0, help="length L of every bar")] = 1.0,
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass of every bar")] = 1.0,
    speed: Annotated[float, Quantity("m/s", help="initial speed of the first upper pin along x")] = 1.0,
    gravity: Gravity = 9.81,
) -> Mechanism:
    """Return N parallelograms side by side, benchmark A02 of IFToMM's library of multibody problems.

    N + 1 upright cranks stand on ground pins A0, A1, ... at a distance L along x; N couplers join their upper ends B0, B1, ...
    All bars are equal and uniform. The linkage moves like a pendulum, ((N+1)/3 + N) L th'' = -((N+1)/2 + N) g cos th. All its
    bars are aligned twice per revolution.

    Returns
    -------
    Mechanism
        Bodies "crank 0", ..., "crank N" and "coupler 1", ..., "coupler N"; joints "A0", "A1", ... on the ground, "B0" and
        "BN" between crank and coupler, and "B1 1", "B1 2", ... where two couplers share the pin of a crank.
    """
    bodies: list[Body] = []
    joints: list[Revolute] = []
    for k in range(units + 1):
        crank = bar(f"crank {k}", length=length, mass=mass, position=(k * length, 0.0), angle=0.5 * math.pi)
        bodies.append(dataclasses.replace(crank, angular_velocity=-speed / length))
        joints.append(Revolute(f"A{k}", (f"crank {k}", "start"), (GROUND, f"A{k}")))
    for k in range(1, units + 1):
        coupler = bar(f"coupler {k}", length=length, mass=mass, position=((k - 1) * length, length))
        bodies.append(dataclasses.replace(coupler, velocity=(speed, 0.0)))
    for k in range(units + 1):
        left = [(f"coupler {k}", "end")] if k > 0 else []
        right = [(f"coupler {k + 1}", "start")] if k < units else []
        joints += common_pin(f"B{k}", (f"crank {k}", "end"), *left, *right)
    return Mechanism(
        bodies=tuple(bodies),
        joints=tuple(joints),
        ground=tuple((f"A{k}", (k * length, 0.0)) for k in range(units + 1)),
        gravity=gravity,
        input_body="crank 0",
        output_body="crank 0",
    )
