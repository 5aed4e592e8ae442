"""Checks of a mechanism: names, points and movable joints, and magnitudes of similar size."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from operator import itemgetter
from typing import Any, NamedTuple

from scissordyn.components.actuator import Actuator
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.declaration import Component
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.guide_friction import GuideFriction
from scissordyn.components.lugre import GuideLuGre, PinLuGre
from scissordyn.components.pin_friction import PinFriction
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.body import check_place
from scissordyn.model.coupling import CoordinateDrive, Coupling, RelativeAngle, Slide
from scissordyn.model.disjoint_sets import DisjointSets
from scissordyn.model.joint import Revolute
from scissordyn.model.parts import Parts
from scissordyn.tolerance import ASSEMBLY_TOL

RUN_DIMENSIONS = ("time", "body", "joint", "weld", "axis", "drive", "contact", "event")
"""Dimensions of every run's Dataset; no class of components may have one of them as its section name."""


def check_parts(mechanism: Parts) -> None:
    """Raise `InputError` for the first part of a mechanism with an unknown reference or an impossible value."""
    _check_names(mechanism)
    for name, place in mechanism.ground:
        check_place(f"point '{name}' of the ground", place)
    bodies = _Bodies(mechanism)
    for joint in mechanism.joints:
        bodies.check_points(f"joint '{joint.name}'", joint.journal, joint.bearing)
    for guide in mechanism.guides:
        label = f"guide '{guide.name}'"
        bodies.check_points(label, guide.follower)
        bodies.check_rotates(label, guide.body)
        if guide.aligned:
            bodies.check_rotates(label, guide.follower[0], ground=False)
    for weld in mechanism.welds:
        bodies.check_points(f"weld '{weld.name}'", weld.start, weld.end)
    components: tuple[Any, ...] = (*mechanism.components, *mechanism.rods, *mechanism.latches)
    for component in components:
        _check_component(bodies, component)
    _check_section_names(components)
    _check_friction(mechanism.components)
    _check_moments(mechanism, bodies.points)
    for drive in mechanism.drives:
        bodies.check_rotates("the drive", drive.body, ground=False)
    for part in mechanism.coupling_parts:
        _check_coordinates(bodies, part)
    for track in mechanism.tracks:
        label = f"tracked point '{track.name}'"
        if isinstance(track.point, str):
            bodies.check_points(label, (track.body, track.point))
        else:
            bodies.check_body(label, track.body, ground=False)
            check_place(label, track.point)
    for what, name in (("input body", mechanism.input_body), ("output body", mechanism.output_body)):
        if name:
            bodies.check_body(what, name, ground=False)
    if mechanism.clearance_joints:
        _check_movable(mechanism, bodies.points)


class _Bodies:
    """Ground and bodies that parts refer to; an unknown reference raises `InputError`."""

    def __init__(self, mechanism: Parts) -> None:
        self.points: dict[str, Mapping[str, Point]] = {GROUND: dict(mechanism.ground)}
        self.points |= {body.name: body.points for body in mechanism.bodies}
        self.rotating = {GROUND, *(body.name for body in mechanism.bodies if body.rotates)}

    def check_body(self, label: str, name: str, *, ground: bool = True) -> None:
        """Raise `InputError` for an unknown body."""
        if name not in self.points or (name == GROUND and not ground):
            names = [body for body in self.points if ground or body != GROUND]
            raise InputError(f"{label} refers to body '{name}'{did_you_mean(name, names)}", "one of " + ", ".join(names))

    def check_points(self, label: str, *references: BodyPoint) -> None:
        """Raise `InputError` for an unknown body or point."""
        for body, point in references:
            self.check_body(label, body)
            if point not in self.points[body]:
                raise InputError(
                    f"{label} refers to point '{point}' of body '{body}'{did_you_mean(point, self.points[body])}",
                    "one of " + (", ".join(self.points[body]) or "none"),
                )

    def check_rotates(self, label: str, body: str, *, ground: bool = True) -> None:
        """Raise `InputError` for a body that does not rotate."""
        self.check_body(label, body)
        if body not in self.rotating or (body == GROUND and not ground):
            raise InputError(f"{label} needs the angle of body '{body}', which does not rotate", "a body with an inertia")


def _check_moments(mechanism: Parts, points: Mapping[str, Mapping[str, Point]]) -> None:
    """Raise `InputError` for a body without inertia that is held off its mass centre, unless a guide keeps its angle."""
    guided = {guide.follower[0] for guide in mechanism.guides}
    fixed = {body.name: body for body in mechanism.bodies if not body.rotates and body.name not in guided}
    if not fixed:
        return
    for weld in mechanism.welds:
        for (carried, _), (carrier, _) in ((weld.start, weld.end), (weld.end, weld.start)):
            if carried in fixed and carrier != GROUND and mechanism.body(carrier).rotates:
                raise InputError(
                    f"weld '{weld.name}' fixes body '{carrier}' to body '{carried}', which has no inertia to bear the moment",
                    f"an inertia of '{carried}', or a joint instead of the weld",
                )
    places = [(f"joint '{joint.name}'", end) for joint in mechanism.joints for end in (joint.journal, joint.bearing)]
    places += [(f"weld '{weld.name}'", end) for weld in mechanism.welds for end in (weld.start, weld.end)]
    parts: tuple[Any, ...] = (*mechanism.components, *mechanism.rods)
    for part in parts:
        declared = part.declaration
        places += [(f"{declared.label} '{part.name}'", getattr(part, field)) for field in declared.port.points]
    for label, (name, point) in places:
        if name not in fixed:
            continue
        distance = math.dist(points[name][point], fixed[name].centre)
        if distance > ASSEMBLY_TOL * mechanism.size:
            raise InputError(
                f"{label} holds body '{name}', which has no inertia and therefore does not rotate, at its point '{point}', "
                f"{distance:.4g} m from its mass centre",
                "an inertia, a point mass held at its mass centre only, or a block whose guide keeps its angle",
                f"inertia of body '{name}', for instance {fixed[name].mass * distance**2:.3g} kg m^2",
            )


def _check_coordinates(bodies: _Bodies, part: Coupling | CoordinateDrive) -> None:
    """Raise `InputError` for unknown bodies or points in the coordinates of a coupling or drive."""
    label = f"{'coupling' if isinstance(part, Coupling) else 'drive'} '{part.name}'"
    for _, coordinate in part.terms:
        if isinstance(coordinate, RelativeAngle):
            for body in coordinate.bodies:
                bodies.check_rotates(label, body)
        elif isinstance(coordinate, Slide):
            bodies.check_points(label, coordinate.point)
            bodies.check_rotates(label, coordinate.base)
        else:
            bodies.check_points(label, coordinate.start, coordinate.end)


def _check_component(bodies: _Bodies, component: Component) -> None:
    """Raise `InputError` for unknown bodies or points of a component."""
    declared = component.declaration
    label = f"{declared.label} '{component.name}'"
    bodies.check_points(label, *(getattr(component, field) for field in declared.port.points))
    for place, field in enumerate(declared.port.turning):
        if place and "reaction" in declared.context:  # the other body of a pin may be one that keeps its angle
            bodies.check_body(label, getattr(component, field))
        else:
            bodies.check_rotates(label, getattr(component, field), ground=place > 0)
    if isinstance(component, FlexibleBar):
        for name in component.sections:
            bodies.check_rotates(label, name, ground=False)
    if isinstance(component, Actuator):
        bodies.check_points(label, *filter(None, (component.sensor, component.sensor_origin)))


def _check_section_names(components: tuple[Any, ...]) -> None:
    """Raise `InputError` if two classes of components would give variables of a run the same names."""
    owner: dict[str, type] = dict(COMPONENTS)
    for component in components:
        section, kind = component.declaration.section, type(component)
        if section in RUN_DIMENSIONS or owner.setdefault(section, kind) is not kind:
            raise InputError(
                f"{component.declaration.label} '{component.name}': its class '{kind.__name__}' has the section '{section}', "
                "which is already used",
                "a section with another name",
                f'@component(section="my_{section}", ...)',
            )


def _check_friction(components: tuple[Any, ...]) -> None:
    """Raise `InputError` for two frictions in one ideal pin or guide: their sum is the friction of neither."""
    pins: dict[frozenset[str], str] = {}
    guides = defaultdict[tuple[str, BodyPoint], list[Any]](list)
    for part in components:
        if isinstance(part, PinFriction | PinLuGre):
            place, other = "pin", pins.setdefault(frozenset((part.body, part.base)), part.name)
        elif isinstance(part, GuideFriction | GuideLuGre):
            same = guides[part.start[0], part.end]
            same.append(part)
            turned = [each for each in same if abs(math.remainder(each.direction - part.direction, math.pi)) < ASSEMBLY_TOL]
            place, other = "guide", turned[0].name
        else:
            continue
        if other != part.name:
            what = f"{part.declaration.label} '{part.name}' acts in the same {place} as '{other}'"
            raise InputError(what, f"one friction in each {place}")


def _check_names(mechanism: Parts) -> None:
    """Raise `InputError` for a name that is given twice or cannot be written to a file."""
    connections = [
        part.name for parts in (mechanism.welds, mechanism.rods, mechanism.latches, mechanism.coupling_parts) for part in parts
    ]
    for what, names in (
        ("body", [body.name for body in mechanism.bodies]),
        ("joint or coupling" if mechanism.coupling_parts else "joint", [*mechanism.joint_names, *connections]),
        ("component", [component.name for component in mechanism.components]),
        ("ground point", [name for name, _ in mechanism.ground]),
        ("driven body", [drive.body for drive in mechanism.drives]),
        ("tracked point", [track.name for track in mechanism.tracks]),
    ):
        name, times = Counter(names).most_common(1)[0] if names else ("", 0)
        if times > 1:
            raise InputError(f"{what} '{name}' is given {times} times", "each name once")
        for name in names:
            if name.endswith("\0"):  # numpy drops it at the end of a text, and the result would have another name
                raise InputError(f"{what} '{name}'", "a name that does not end in a NUL character")
            if any("\ud800" <= character <= "\udfff" for character in name):  # files and pandas cannot store it
                raise InputError(f"{what} '{name}'", "a name that can be written as UTF-8, without half a surrogate pair")


def _check_movable(mechanism: Parts, points: Mapping[str, Mapping[str, Point]]) -> None:
    """Raise `InputError` for a clearance joint within one rigid body, or with an ideal joint at the same points."""
    rigid, near = DisjointSets(), ASSEMBLY_TOL * mechanism.size
    for weld in mechanism.welds:
        rigid.join(weld.start[0], weld.end[0])
    ideal: dict[frozenset[str], list[Revolute]] = {}
    for joint in mechanism.ideal_joints:
        ideal.setdefault(frozenset(joint.bodies), []).append(joint)
    for joint in mechanism.clearance_joints:
        first, second = joint.bodies
        if rigid.find(first) == rigid.find(second):
            raise InputError(
                f"clearance joint '{joint.name}' cannot move: welds make bodies '{first}' and '{second}' one rigid body",
                "clearance joints between bodies that can move relative to each other",
            )
        for ideal_joint in ideal.get(frozenset(joint.bodies), []):
            ends, ideal_ends = dict((joint.journal, joint.bearing)), dict((ideal_joint.journal, ideal_joint.bearing))
            if all(math.dist(points[body][ends[body]], points[body][ideal_ends[body]]) < near for body in joint.bodies):
                raise InputError(
                    f"clearance joint '{joint.name}' cannot move: the ideal joint '{ideal_joint.name}' holds the same points "
                    f"of bodies '{first}' and '{second}' together",
                    "one of the two joints",
                )


def motionless(mechanism: Parts) -> list[str]:
    """Return a warning if nothing moves a mechanism: no drive, component, rod or gravity, and no velocity at the start."""
    moved = (mechanism.drives, mechanism.coordinate_drives, mechanism.components, mechanism.rods, mechanism.gravity)
    if any(moved) or any(body.angular_velocity or any(body.velocity or ()) for body in mechanism.bodies):
        return []
    return ["nothing moves the mechanism: it starts at rest, without a drive, components or gravity"]


def loose_bodies(mechanism: Parts) -> list[str]:
    """Return a warning for each body or group of bodies that nothing connects to the rest of a mechanism or to the ground.

    If all bodies of a mechanism are connected to each other, it may be free as a whole: there is no warning.
    """
    names = [body.name for body in mechanism.bodies]
    connected = [
        *(joint.bodies for joint in mechanism.joints),
        *((guide.follower[0], guide.body) for guide in mechanism.guides),
        *((weld.start[0], weld.end[0]) for weld in mechanism.welds),
        *(coordinate.bodies for coupling in mechanism.couplings for _, coordinate in coupling.terms),
        *(drive.coordinate.bodies for drive in mechanism.coordinate_drives),
        *(_bodies_in(component, {*names}) for component in (*mechanism.components, *mechanism.rods)),
    ]
    sets = DisjointSets()
    for first, *others in connected:
        for other in others:
            sets.join(first, other)
    group = {name: sets.find(name) for name in (*names, GROUND)}
    sizes = Counter(group.values())
    main = group[GROUND] if sizes[group[GROUND]] > 1 else max(sizes, key=lambda key: (sizes[key], key != group[GROUND]))
    loose = defaultdict[str, list[str]](list)
    for body in mechanism.bodies:
        if group[body.name] != main:
            loose[group[body.name]].append(body.name)
    alone = [
        f"body '{bodies[0]}' is connected to nothing else: it moves alone" for bodies in loose.values() if len(bodies) == 1
    ]
    return alone + [
        f"bodies {', '.join(map(repr, bodies))} are connected to each other, but to nothing else"
        for bodies in loose.values()
        if len(bodies) > 1
    ]


def _bodies_in(component: object, names: set[str]) -> tuple[str, ...]:
    """Return the names of bodies, and of the ground, that occur in the fields of a component; the ground if there are none."""

    def texts(value: object) -> Iterator[str]:
        if isinstance(value, str):
            yield value
        elif isinstance(value, tuple):
            for part in value:
                yield from texts(part)

    fields = [getattr(component, field.name) for field in dataclasses.fields(component) if field.name != "name"]  # type: ignore[arg-type]
    return tuple(text for value in fields for text in texts(value) if text in names or text == GROUND) or (GROUND,)


class BodyProportions(NamedTuple):
    """Size and mass of a mechanism, and the warnings about proportions of its bodies."""

    size: float  # [m]
    mass: float  # [kg]
    warnings: list[str]


def proportion_warnings(mechanism: Parts, bodies: BodyProportions | None = None) -> list[str]:
    """Return a warning for each quantity that is far larger than quantities of its kind in the rest of a mechanism.

    `bodies` are the proportions of the bodies if they are known.
    """
    size, mass, body_warnings = body_proportions(mechanism) if bodies is None else bodies
    named, contacts, rotors = "the size of the mechanism", list[str](), list[str]()
    for contact in mechanism.contacts:
        assert contact.clearance is not None
        surfaces, has = contact.clearance.surfaces, f"joint '{getattr(contact, 'guide', contact.name)}' has a"
        radius = "corner radius" if surfaces.plane else "journal radius"
        contacts += _too_large(f"{has} clearance", contact.clearance.clearance, "m", size, 0.1, named)
        contacts += _too_large(f"{has} {radius}", surfaces.journal_radius, "m", size, 2.0, named)
        contacts += _too_large(f"{has} bearing length", surfaces.length, "m", size, 10.0, named)
    for component in mechanism.components:
        inertia = getattr(component, "inertia", None)
        if isinstance(inertia, float):
            has = f"{component.declaration.label} '{component.name}' has a rotor"
            rotors += _too_large(has, inertia, "kg m^2", mass * size**2, 1e6, "the mass of the mechanism at its size")
    return list(dict.fromkeys([*contacts, *body_warnings, *rotors]))  # a guide has four contact points


def body_proportions(mechanism: Parts) -> BodyProportions:
    """Return the proportions of the bodies of a mechanism."""
    size, bodies, warnings = mechanism.size, mechanism.bodies, list[str]()
    for body in bodies:
        has, gyration = f"body '{body.name}' has a radius of gyration", math.sqrt((body.inertia or 0.0) / body.mass)
        warnings += _too_large(has, gyration, "m", size, 10.0, "the size of the mechanism")
    extents = [
        (max(math.dist(body.centre, point) for point in body.points.values()), body.name) for body in bodies if body.points
    ]
    for what, unit, values, most in (
        ("mass", "kg", [(body.mass, body.name) for body in bodies], 1e6),
        ("length", "m", [(extent, name) for extent, name in extents if extent > 0.0], 1e6),
    ):
        if values:
            (high, name), (low, other) = max(values, key=itemgetter(0)), min(values, key=itemgetter(0))
            warnings += _too_large(f"body '{name}' has a {what}", high, unit, low, most, f"that of body '{other}'")
    return BodyProportions(size, sum(body.mass for body in bodies), warnings)


def _too_large(what: str, value: float, unit: str, standard: float, most: float, named: str) -> list[str]:
    """Return a warning about a value above `most` times a standard, which is `named`."""
    if not value > most * standard:
        return []
    return [f"{what} of {value:.4g} {unit}, {value / standard:.2g} times {named}; check its unit"]
