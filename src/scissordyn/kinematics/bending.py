"""Flexible bars: replace a rigid bar by rotating cross-sections and the flexible bar or beam elements between them.

A kinked bar consists of straight legs. Each leg is bent like a straight bar, and welds connect them.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from scissordyn.components.beam import Beam
from scissordyn.components.edge_contact import EdgeContact
from scissordyn.components.elastic import EXPANSION, Across, Damping, Warmer, node_inertia
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.lugre import PinLuGre
from scissordyn.components.pin_friction import PinFriction
from scissordyn.components.place import Point
from scissordyn.components.time_function import OverTime, TimeFunction
from scissordyn.errors import InputError
from scissordyn.kinematics.assembly import assembled_places
from scissordyn.model.body import Body, uniform_inertia, uniform_legs
from scissordyn.model.coupling import Coupling, Teeth
from scissordyn.model.joint import Weld
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import matching
from scissordyn.model.section import Section, StructuralMaterial, read_material, read_section
from scissordyn.tolerance import DATA_TOL
from scissordyn.units import Meaning, Quantity, checked, documented


class Legs(NamedTuple):
    """Straight legs of a kinked bar."""

    # Straight uniform bars; the one on the x axis keeps the name and the frame of the kinked bar
    bodies: tuple[Body, ...]
    welds: tuple[Weld, ...]  # Welds between consecutive legs
    where: dict[str, str]  # Leg that carries each point of the kinked bar, by the point's name


def legs_of(body: Body) -> Legs | None:
    """Return the straight legs of a kinked bar whose points follow each other from end to end; None for other bodies."""
    groups = _groups(body)
    if len(groups) < 2 or not _is_uniform(body, list(body.points.values())):
        return None
    placed = [[body.points[name] for name in names] for names in groups]
    on_axis = [all(y == 0.0 for _, y in line) and line[-1][0] > line[0][0] for line in placed]
    straight = on_axis.index(True) if any(on_axis) else None
    if straight is None:
        return None
    per_length = body.mass / sum(itertools.starmap(math.dist, itertools.pairwise(body.points.values())))
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
    """Return the names of the points on each straight leg of a kinked bar; a kink belongs to two legs."""
    points = list(body.points.items())
    if len(points) < 3 or any(math.dist(first, second) == 0.0 for (_, first), (_, second) in itertools.pairwise(points)):
        return []
    groups = [[points[0][0], points[1][0]]]
    for (_, before), (name, here), (following, after) in zip(points, points[1:], points[2:], strict=False):
        if abs(_turn_angle(before, here, after)) <= DATA_TOL:
            groups[-1].append(following)
        else:
            groups.append([name, following])
    return groups


def _turn_angle(before: Point, here: Point, after: Point) -> float:
    """Return the angle by which a line turns at a point [rad]."""
    (ax, ay), (bx, by) = (here[0] - before[0], here[1] - before[1]), (after[0] - here[0], after[1] - here[1])
    return math.atan2(ax * by - ay * bx, ax * bx + ay * by)


def _is_uniform(body: Body, line: Sequence[Point]) -> bool:
    """Return whether a body has the mass centre and inertia of a uniform line through some points."""
    lengths = list(itertools.starmap(math.dist, itertools.pairwise(line)))
    middles = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a, b in itertools.pairwise(line)]
    centre, inertia = uniform_legs(body.mass, lengths, middles)
    return (
        body.inertia is not None
        and math.dist(body.centre, centre) <= DATA_TOL * sum(lengths)
        and abs(body.inertia - inertia) <= DATA_TOL * inertia
    )


def _leg(body: Body, name: str, points: dict[str, Point], per_length: float, keep_frame: bool) -> Body:
    """Return one straight leg of a kinked bar as a uniform bar with its own name, points and mass.

    `points` are in the frame of the kinked bar `body`, `per_length` is the mass per length [kg/m]. With `keep_frame`, the leg
    keeps the frame of the kinked bar, whose x axis it lies on; otherwise its x axis runs from its first point to its last.
    """
    (x, y), *_, last = points.values()
    length = math.dist((x, y), last)
    start = (0.0, 0.0) if keep_frame else (x, y)
    places = {key: place[0] if keep_frame else math.dist(start, place) for key, place in points.items()}
    offset, mass = body.turned(start), per_length * length
    return dataclasses.replace(
        body,
        name=name,
        mass=mass,
        inertia=uniform_inertia(length, mass),
        points={key: (place, 0.0) for key, place in places.items()},
        centre=(0.5 * (min(places.values()) + max(places.values())), 0.0),
        position=(body.placed_position[0] + offset[0], body.placed_position[1] + offset[1]),
        angle=body.placed_angle + (0.0 if keep_frame else math.atan2(last[1] - y, last[0] - x)),
        velocity=body.velocity_at(offset),
    )


MassKind = Annotated[Literal["given", "section"], Meaning("whether a bar keeps its given mass or takes that of its section")]

# Unit, bounds and help text of the parameter `bending_stiffness` of `with_bending`
BENDING_STIFFNESS_QUANTITY = Quantity("N m^2", above=0.0, maximum=1e18, help="EI, instead of section and material")
# Unit, bounds and help text of the parameter `axial_stiffness` of `with_bending`
AXIAL_STIFFNESS_QUANTITY = Quantity("N", above=0.0, maximum=1e18, help="EA, instead of section and material")
# Bounds and help text of the parameter `elements` of `with_bending`
ELEMENTS_QUANTITY = Quantity("1", minimum=1, maximum=64, help="beam elements along a bar, instead of modes")
NODE = "node"  # Name of the point of a cross-section at which the rigid bar has no named point
PARTS_OF_BODIES: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    *(("joints", "joint", ()), ("guides", "guide", ()), ("welds", "weld", ()), ("rods", "rod", ())),
    ("latches", "latch", ("body", "base")),
)
"""Kinds of parts that refer to bodies: field of `Mechanism`, name in messages, their fields that may name a flexible bar."""


@documented
@checked
def with_bending(
    mechanism: Mechanism,
    bodies: Annotated[str | Iterable[str], Meaning("which bars, by name or pattern")] = "all",
    *,
    section: Annotated[str | Section | None, Meaning("tube, box, solid, angle or strip with its dimensions")] = None,
    material: Annotated[str | StructuralMaterial | None, Meaning("steel, aluminium or titanium")] = None,
    bending_stiffness: Annotated[float | None, BENDING_STIFFNESS_QUANTITY] = None,
    axial_stiffness: Annotated[float | None, AXIAL_STIFFNESS_QUANTITY] = None,
    modes: Annotated[int | Literal["auto"], Meaning("bending modes of a bar, its points held", "6")] = "auto",
    elements: Annotated[int | None, ELEMENTS_QUANTITY] = None,
    mass: MassKind = "given",
    damping: Damping = 0.0,
    thermal_expansion: Annotated[float | None, EXPANSION] = None,
    temperature_rise: Warmer = 0.0,
    temperature_difference: Across = 0.0,
    time_function: Annotated[TimeFunction | None, OverTime("1", "a factor of temperatures over time")] = None,
) -> Mechanism:
    """Return the mechanism with flexible bars instead of rigid ones.

    A bar becomes cross-sections: bodies that rotate, one at each of its points. The cross-section at the origin of the bar's
    frame keeps the bar's name. The others are "BAR/1", "BAR/2", ... from the first point to the last. A `FlexibleBar`
    "BAR/beam" connects them, or, with `elements`, beam elements "BAR/beam 1", ... and further cross-sections. A kinked bar is
    first split into straight legs, welded to each other. The leg on its x axis keeps its name; others are "BAR/leg 2", ...

    Parts attached to a point of the bar are attached to the cross-section at that point. Drives, motors and forces that depend
    on the bar's angle act on the cross-section that has its name.

    "all" means all bars whose mass is distributed uniformly along the line through their points, straight or kinked. The depth
    of a section lies in the plane. Modes are computed with the bar's points held; "auto" takes those up to the frequency of
    contacts. Each span between two points has a whole number of elements. A bar that keeps its given mass must agree with its
    section and material within 5 %. Stress is E (strain + tau strain rate); at the angular frequency w the damping ratio is
    tau w/2. The time function multiplies both temperatures.

    Raises
    ------
    InputError
        If a bar is not uniform or too short for beam theory, if its mass differs from that of section and material,
        or if something is attached to it that a flexible bar cannot carry.
    """
    numbers = _stiffness(section, material, bending_stiffness, axial_stiffness)
    numbers |= {"temperature_rise": temperature_rise, "temperature_difference": temperature_difference, "damping": damping}
    numbers |= {} if thermal_expansion is None else {"thermal_expansion": thermal_expansion}
    _check_heat(numbers)
    per_length = numbers.pop("mass_per_length", None)
    if mass == "section" and per_length is None:
        raise InputError('mass = "section" without a section and a material', "both of them", 'mass = "given"')
    if elements is not None and modes != "auto":
        raise InputError("both modes and elements are given", "one of them", "modes = 6")
    names = _names_of_bars(mechanism, bodies)
    mechanism = _assembled(mechanism, names)
    for body in [_with_angular_velocity(mechanism, mechanism.body(name)) for name in names]:
        legs = legs_of(body)
        mechanism = _split(mechanism, body, legs) if legs else mechanism
        for part in legs.bodies if legs else (body,):
            part = part if per_length is None or mass == "given" else _with_section_mass(part, per_length)
            numbers["mass_per_length"] = _mass_per_length(part, per_length, numbers.get("depth", 0.0))
            mechanism = _with_flexible_bar(
                mechanism, part, elements, None if modes == "auto" else modes, numbers, time_function
            )
    return mechanism


def _names_of_bars(mechanism: Mechanism, bodies: str | Iterable[str]) -> tuple[str, ...]:
    if bodies != "all":
        return tuple(matching("body", bodies, [body.name for body in mechanism.bodies]))
    names = tuple(body.name for body in mechanism.bodies if _is_bar(body) or legs_of(body))
    if not names:
        raise InputError("the mechanism has no uniform bar", "bars with at least two points")
    return names


def _assembled(mechanism: Mechanism, names: Iterable[str]) -> Mechanism:
    """Return the mechanism with the assembled positions of its bodies if a bar that is to bend has no position of its own."""
    if not any(None in (body.position, body.angle) for body in map(mechanism.body, names)):
        return mechanism
    where = assembled_places(mechanism)

    def at(body: Body) -> Body:
        position, angle = where.get(body.name, (body.placed_position, body.placed_angle))
        apart = math.dist(position, body.placed_position) + mechanism.size * abs(angle - body.placed_angle)
        if apart <= 1e-9 * mechanism.size:  # a bar with free placement stays at the origin
            return body
        body = dataclasses.replace(body, position=position) if body.position is None else body
        return dataclasses.replace(body, angle=angle) if body.angle is None else body

    return mechanism.with_parts({"bodies": tuple(map(at, mechanism.bodies))}, check=False)


def _with_angular_velocity(mechanism: Mechanism, body: Body) -> Body:
    """Return the bar; an unconnected bar with a given velocity gets the angular velocity 0 if none is given."""
    tied = {drive.body for drive in mechanism.drives}
    tied.update(name for joint in mechanism.ideal_joints for name in joint.bodies)
    tied.update(end[0] for weld in mechanism.welds for end in (weld.start, weld.end))
    tied.update(name for guide in mechanism.ideal_guides for name in (guide.follower[0], guide.body))
    if body.velocity is None or body.angular_velocity is not None or body.name in tied:
        return body
    return dataclasses.replace(body, angular_velocity=0.0)


def _split(mechanism: Mechanism, body: Body, legs: Legs) -> Mechanism:
    """Return the mechanism with a kinked bar replaced by its legs."""
    mechanism_split = _move_attachments(mechanism, body, legs.where, list(legs.bodies), [])
    return mechanism_split.with_parts({"welds": (*mechanism_split.welds, *legs.welds)})


def _stiffness(section: Any, material: Any, bending: float | None, axial: float | None) -> dict[str, float]:
    """Return the parameters of a flexible bar that section and material, or EI and EA, determine."""
    if section is not None and material is not None and bending is None and axial is None:
        shape, made_of = read_section(section), read_material(material)
        return {
            "axial_stiffness": made_of.youngs_modulus * shape.area,
            "bending_stiffness": made_of.youngs_modulus * shape.second_moment,
            "mass_per_length": made_of.density * shape.area,
            "depth": shape.depth,
            "youngs_modulus": made_of.youngs_modulus,
            "yield_strength": made_of.yield_strength,
            "thermal_expansion": made_of.thermal_expansion,
        }
    if section is None and material is None and bending is not None and axial is not None:
        return {"axial_stiffness": axial, "bending_stiffness": bending}
    values = {"section": section, "material": material, "bending_stiffness": bending, "axial_stiffness": axial}
    named = [name for name, value in values.items() if value is not None]
    raise InputError(
        f"a flexible bar with {' and '.join(named) or 'no stiffness'}",
        "section and material, or bending_stiffness (EI) and axial_stiffness (EA)",
        'section = "tube 60x60x1.5 mm", material = "steel"',
    )


def _check_heat(numbers: Mapping[str, float]) -> None:
    """Raise `InputError` for temperatures that cannot have an effect."""
    rise, difference = numbers["temperature_rise"], numbers["temperature_difference"]
    if (rise or difference) and not numbers.get("thermal_expansion"):
        raise InputError(
            "temperatures are given without a thermal_expansion",
            "a material that has one, or the coefficient",
            'thermal_expansion = "12e-6 1/K"',
        )
    if difference and "depth" not in numbers:
        raise InputError("a temperature difference across bars without a section", "a section, which has a depth")


def _is_bar(body: Body) -> bool:
    line = sorted(set(body.points.values()))
    return len(line) > 1 and all(y == 0.0 for _, y in line) and _is_uniform(body, line)


def _with_section_mass(body: Body, per_length: float) -> Body:
    """Return a bar with the mass of its section and material."""
    if not _is_bar(body):
        return body  # `_mass_per_length` raises the error
    length = float(np.ptp([x for x, _ in body.points.values()]))
    mass = per_length * length
    return dataclasses.replace(body, mass=mass, inertia=uniform_inertia(length, mass))


def _mass_per_length(
    body: Body, wanted: float | None, depth: float, slenderness: float = 5.0, tolerance: float = 0.05
) -> float:
    """Return the mass per length of a bar [kg/m]; raise `InputError` if it is not uniform, too short or of another mass.

    `slenderness`: smallest length over depth of a bar; shear, which beam theory neglects, deflects shorter ones.

    `tolerance`: largest relative difference between a bar's given mass and that of its section and material.
    """
    if not _is_bar(body):
        raise InputError(
            f"body '{body.name}' cannot bend: it is not a uniform bar",
            "a straight bar with its points on its x axis, or a kinked one with its points in order and one leg on its x axis, "
            "each with uniform mass; add payloads after bending",
        )
    length = max(x for x, _ in body.points.values()) - min(x for x, _ in body.points.values())
    if depth and length < slenderness * depth:
        raise InputError(
            f"bar '{body.name}' is too short for beam theory: length {length:g} m, depth of the section {depth:g} m",
            f"a bar of at least {slenderness * depth:g} m, or a rigid one",
        )
    mass_per_length = body.mass / length
    if wanted is not None and abs(wanted - mass_per_length) > tolerance * wanted:
        raise InputError(
            f"bar '{body.name}' has a mass of {body.mass:g} kg; its section and material give {wanted * length:.4g} kg",
            f"masses that differ by at most {tolerance:.0%}",
            f'bar_mass = "{wanted * length:.4g} kg", or mass = "section"',
        )
    return mass_per_length


def _with_flexible_bar(
    mechanism: Mechanism,
    body: Body,
    elements: int | None,
    modes: int | None,
    numbers: Mapping[str, Any],
    time_function: TimeFunction | None,
) -> Mechanism:
    """Return the mechanism with a uniform bar replaced by cross-sections and a flexible bar or beam elements."""
    named: dict[float, list[str]] = {}
    for point, (x, _) in body.points.items():
        named.setdefault(x, []).append(point)
    places = sorted(named)
    length = places[-1] - places[0]
    marks = [places[0]]
    for first, second in itertools.pairwise(places):
        count = max(1, math.ceil((elements or 0) * (second - first) / length - 1e-9))
        marks += [first + (second - first) * k / count for k in range(1, count)] + [second]
    origin = min(range(len(marks)), key=lambda k: abs(marks[k]))
    label = [body.name if k == origin else f"{body.name}/{k}" for k in range(len(marks))]
    nodes, where = _sections(body, marks, label, named, numbers["mass_per_length"])
    more = {**numbers, "time_function": time_function}
    if elements is None:
        beams: list[Any] = [FlexibleBar(f"{body.name}/beam", tuple(label), tuple(marks), modes=modes, **more)]
    else:
        ends = [(node.name, next(iter(node.points))) for node in nodes]
        beams = [
            Beam(f"{body.name}/beam {k + 1}", ends[k], ends[k + 1], length=marks[k + 1] - marks[k], **more)
            for k in range(len(marks) - 1)
        ]
    return _move_attachments(mechanism, body, where, nodes, beams)


def _sections(
    body: Body, marks: list[float], label: list[str], named: dict[float, list[str]], mass_per_length: float
) -> tuple[list[Body], dict[str, str]]:
    """Return the cross-sections of a bar, and the name of the cross-section that carries each point of the bar.

    `marks` are the positions of the cross-sections along the bar [m], `label` their names, `named` the names of the points at
    each mark.
    """
    spans = [second - first for first, second in itertools.pairwise(marks)]
    half = [0.5 * mass_per_length * span for span in spans]
    turned = [node_inertia(mass_per_length, span) for span in spans]
    ox, oy = body.placed_position
    nodes, where = [], dict[str, str]()
    for k, mark in enumerate(marks):
        points = named.get(mark, [NODE])
        where |= dict.fromkeys(points, label[k]) if mark in named else {}
        dx, dy = body.turned((mark, 0.0))
        nodes.append(
            Body(
                name=label[k],
                mass=sum(half[max(0, k - 1) : k + 1]),
                inertia=sum(turned[max(0, k - 1) : k + 1]),
                points=dict.fromkeys(points, (0.0, 0.0)),
                position=(ox + dx, oy + dy),
                angle=body.placed_angle,
                velocity=body.velocity_at((dx, dy)),
                angular_velocity=body.angular_velocity,
            )
        )
    return nodes, where


def _move_attachments(
    mechanism: Mechanism, body: Body, where: dict[str, str], nodes: list[Body], beams: list[Any]
) -> Mechanism:
    """Return the mechanism with all parts attached to a bar moved to its cross-sections."""
    name = body.name

    def refused(what: str) -> InputError:
        return InputError(f"{what} acts on flexible bar '{name}'", "a rigid bar, or a part that acts at one of its points")

    def moved(reference: Any) -> Any:
        return (where[reference[1]], reference[1]) if reference[0] == name else reference

    def exchanged(part: Any, what: str, free: tuple[str, ...] = ()) -> Any:
        changes: dict[str, Any] = {}
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            if isinstance(value, tuple) and len(value) == 2 and value[0] == name and value[1] in where:
                changes[field.name] = moved(value)
            elif value == name and field.name != "name" and field.name not in free:
                raise refused(what)
        return dataclasses.replace(part, **changes) if changes else part

    for guide in mechanism.guides:
        if guide.body == name:
            raise InputError(
                f"guide '{guide.name}' is fixed to flexible bar '{name}'",
                "a roller that runs along it, two for a block that keeps its direction; or a rigid bar",
                f'Roller("{guide.name}", {guide.follower}, rail="{name}")',
            )
    for part in mechanism.components:
        if isinstance(part, EdgeContact) and part.start[0] == name and part.length != 0.0:
            raise refused(f"the straight edge of component '{part.name}'")
    pins = {frozenset(joint.bodies): joint for joint in mechanism.joints}

    def at_pin(part: Any) -> Any:
        """Return friction in a pin moved to the cross-section that carries the pin."""
        pair = {part.body, part.base} if isinstance(part, PinFriction | PinLuGre) else set()
        pin = pins.get(frozenset(pair)) if name in pair else None
        if pin is None:
            return part
        point = pin.journal[1] if pin.journal[0] == name else pin.bearing[1]
        return dataclasses.replace(part, **{"body" if part.body == name else "base": where[point]})

    def free_ends(part: Coupling) -> tuple[str, ...]:
        # teeth exert their force between the wheels, wherever the bodies that carry them bend
        return ("body", "base") if isinstance(part.transmission, Teeth) else ("body",)

    components = [
        exchanged(at_pin(part), f"component '{part.name}'", (*part.declaration.port.turning, "rail"))
        for part in mechanism.components
    ]
    tracks = []
    for track in mechanism.tracks:
        if track.body == name and track.point not in where:
            raise refused(f"tracked point '{track.name}'")
        tracks.append(dataclasses.replace(track, body=where[track.point]) if track.body == name else track)  # type: ignore[index]
    at = [other.name for other in mechanism.bodies].index(name)
    return mechanism.with_parts(
        {
            "bodies": (*mechanism.bodies[:at], *nodes, *mechanism.bodies[at + 1 :]),
            **{
                field: tuple(exchanged(part, f"{what} '{part.name}'", free) for part in getattr(mechanism, field))
                for field, what, free in PARTS_OF_BODIES
            },
            "couplings": tuple(
                dataclasses.replace(
                    part,
                    **{
                        end: exchanged(getattr(part, end), f"coupling '{part.name}'", free_ends(part))
                        for end in ("output", "input")
                    },
                )
                for part in mechanism.couplings
            ),
            "coordinate_drives": tuple(
                dataclasses.replace(part, coordinate=exchanged(part.coordinate, f"drive '{part.name}'", ("body",)))
                for part in mechanism.coordinate_drives
            ),
            "components": (*components, *beams),
            "tracks": tuple(tracks),
        }
    )
