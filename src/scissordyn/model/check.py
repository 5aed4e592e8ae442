"""Whether the parts of a mechanism fit together (names, points, joints that can move), and are of similar size."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from scissordyn.component.actuator import Actuator
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.declaration import Component
from scissordyn.component.flexible_bar import FlexibleBar
from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.body import check_place
from scissordyn.model.coupling import CoordinateDrive, Coupling, RelativeAngle, Slide
from scissordyn.model.joint import Revolute

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism


DIMENSIONS = ("time", "body", "joint", "axis", "drive", "contact", "event")
"""Dimensions of every run, which are no sections of components."""

SAME_PLACE = 1e-9  # Points of one body nearer to each other than this fraction of the mechanism's size are one point


def check_parts(mechanism: Mechanism) -> None:
    """Raise `InputError` for the first part of a mechanism with an unknown reference or an impossible value."""
    _check_names(mechanism)
    for name, place in mechanism.ground:
        check_place(f"point '{name}' of the ground", place)
    points = _points(mechanism)
    rotating = {GROUND, *(body.name for body in mechanism.bodies if body.rotates)}
    for joint in mechanism.joints:
        _check_point(points, f"joint '{joint.name}'", joint.journal)
        _check_point(points, f"joint '{joint.name}'", joint.bearing)
    for guide in mechanism.guides:
        _check_point(points, f"guide '{guide.name}'", guide.follower)
        _check_rotates(points, rotating, f"guide '{guide.name}'", guide.body)
        if guide.aligned:
            _check_rotates(points, rotating - {GROUND}, f"guide '{guide.name}'", guide.follower[0])
    for weld in mechanism.welds:
        _check_point(points, f"weld '{weld.name}'", weld.start)
        _check_point(points, f"weld '{weld.name}'", weld.end)
    components: tuple[Any, ...] = (*mechanism.components, *mechanism.rods, *mechanism.latches)
    for component in components:
        _check_component(points, rotating, component)
    _check_sections(components)
    _check_moments(mechanism, points)
    for drive in mechanism.drives:
        _check_rotates(points, rotating - {GROUND}, "the drive", drive.body)
    for part in mechanism.coupling_parts:
        _check_coordinates(points, rotating, part)
    _check_tracks(mechanism, points)
    for what, name in (("input body", mechanism.input_body), ("output body", mechanism.output_body)):
        if name:
            _check_body({body: part for body, part in points.items() if body != GROUND}, what, name)
    if mechanism.clearance_joints:
        _check_movable(mechanism, points)


def _check_moments(mechanism: Mechanism, points: Mapping[str, Mapping[str, Point]]) -> None:
    """Raise `InputError` for a body without inertia whose joints act beside its mass centre, unless a guide keeps its angle."""
    guided = {guide.follower[0] for guide in mechanism.guides}
    fixed = {body.name: body for body in mechanism.bodies if not body.rotates and body.name not in guided}
    if not fixed:
        return
    places = [(f"joint '{joint.name}'", end) for joint in mechanism.joints for end in (joint.journal, joint.bearing)]
    places += [(f"weld '{weld.name}'", end) for weld in mechanism.welds for end in (weld.start, weld.end)]
    parts: tuple[Any, ...] = (*mechanism.components, *mechanism.rods)
    for part in parts:
        declared = part.declaration
        places += [(f"{declared.label} '{part.name}'", getattr(part, field)) for field in declared.port.points]
    for label, (name, point) in places:
        if name not in fixed:
            continue
        apart = math.dist(points[name][point], fixed[name].centre)
        if apart > SAME_PLACE * mechanism.size:
            raise InputError(
                f"{label} holds body '{name}', which has no inertia and therefore does not rotate, at its point '{point}', "
                f"{apart:.4g} m from its mass centre",
                "an inertia, a point mass held at its mass centre only, or a block whose guide keeps its angle",
                f"inertia of body '{name}', for instance {fixed[name].mass * apart**2:.3g} kg m^2",
            )


def _check_coordinates(points: Mapping[str, Mapping[str, Point]], rotating: set[str], part: Coupling | CoordinateDrive) -> None:
    label = f"{'coupling' if isinstance(part, Coupling) else 'drive'} '{part.name}'"
    for _, coordinate in part.terms:
        if isinstance(coordinate, RelativeAngle):
            for body in coordinate.bodies:
                _check_rotates(points, rotating, label, body)
        elif isinstance(coordinate, Slide):
            _check_point(points, label, coordinate.point)
            _check_rotates(points, rotating, label, coordinate.base)
        else:
            _check_point(points, label, coordinate.start)
            _check_point(points, label, coordinate.end)


def _check_tracks(mechanism: Mechanism, points: Mapping[str, Mapping[str, Point]]) -> None:
    for track in mechanism.tracks:
        label = f"tracked point '{track.name}'"
        if isinstance(track.point, str):
            _check_point(points, label, (track.body, track.point))
        else:
            _check_body({body: part for body, part in points.items() if body != GROUND}, label, track.body)
            check_place(label, track.point)


def _check_component(points: Mapping[str, Mapping[str, Point]], rotating: set[str], component: Component) -> None:
    declared = component.declaration
    label = f"{declared.label} '{component.name}'"
    for field in declared.port.points:
        _check_point(points, label, getattr(component, field))
    for place, field in enumerate(declared.port.turning):
        if place and "reaction" in component.declaration.context:  # the other body of a pin may be one that keeps its angle
            _check_body(points, label, getattr(component, field))
            continue
        _check_rotates(points, rotating if place else rotating - {GROUND}, label, getattr(component, field))
    if isinstance(component, FlexibleBar):
        for name in component.sections:
            _check_rotates(points, rotating - {GROUND}, label, name)
    if isinstance(component, Actuator):
        for reference in filter(None, (component.sensor, component.sensor_origin)):
            _check_point(points, label, reference)


def _check_sections(components: tuple[Any, ...]) -> None:
    """Raise `InputError` for two classes of components whose variables in a run would have the same names."""
    owner: dict[str, type] = dict(COMPONENTS)
    for component in components:
        section, kind = component.declaration.section, type(component)
        if section in DIMENSIONS or owner.setdefault(section, kind) is not kind:
            raise InputError(
                f"{component.declaration.label} '{component.name}' of a class '{kind.__name__}' with the section '{section}', "
                "which is taken",
                "a section of its own",
                f'@component(section="my_{section}", ...)',
            )


def _points(mechanism: Mechanism) -> dict[str, Mapping[str, Point]]:
    """The points of the ground and of each body, in its own frame."""
    return {GROUND: dict(mechanism.ground), **{body.name: body.points for body in mechanism.bodies}}


def _check_names(mechanism: Mechanism) -> None:
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
            raise InputError(f"{what} '{name}' given {times} times", "each name once")
        for name in names:
            if name.endswith("\0"):  # an array of text drops it, and the result has another name
                raise InputError(f"{what} '{name}'", "a name that does not end in a NUL character")
            if any("\ud800" <= character <= "\udfff" for character in name):  # no file and no index of pandas can hold it
                raise InputError(f"{what} '{name}'", "a name that can be written as UTF-8, without half a surrogate pair")


def _check_body(points: Mapping[str, Mapping[str, Point]], label: str, name: str) -> None:
    if name not in points:
        raise InputError(f"{label} refers to body '{name}'{did_you_mean(name, points)}", "one of " + ", ".join(points))


def _check_point(points: Mapping[str, Mapping[str, Point]], label: str, reference: BodyPoint) -> None:
    body, point = reference
    _check_body(points, label, body)
    if point not in points[body]:
        raise InputError(
            f"{label} refers to point '{point}' of body '{body}'{did_you_mean(point, points[body])}",
            "one of " + (", ".join(points[body]) or "none"),
        )


def _check_rotates(points: Mapping[str, Mapping[str, Point]], rotating: set[str], label: str, body: str) -> None:
    _check_body(points, label, body)
    if body not in rotating:
        raise InputError(f"{label} needs the angle of body '{body}', which does not rotate", "a body with an inertia")


def _check_movable(mechanism: Mechanism, points: Mapping[str, Mapping[str, Point]]) -> None:
    """Raise `InputError` for a clearance joint inside one rigid body or beside an ideal joint at the same points."""
    rigid, near = _rigid_groups(mechanism), SAME_PLACE * mechanism.size
    ideal: dict[frozenset[str], list[Revolute]] = {}
    for joint in mechanism.ideal_joints:
        ideal.setdefault(frozenset(joint.bodies), []).append(joint)
    for joint in mechanism.clearance_joints:
        first, second = joint.bodies
        if rigid.get(first, first) == rigid.get(second, second):
            raise InputError(
                f"clearance joint '{joint.name}' between bodies '{first}' and '{second}', which welds make one rigid body",
                "clearance joints between bodies that can move against each other",
            )
        for beside in ideal.get(frozenset(joint.bodies), []):
            here, there = dict((joint.journal, joint.bearing)), dict((beside.journal, beside.bearing))
            if all(math.dist(points[body][here[body]], points[body][there[body]]) < near for body in joint.bodies):
                raise InputError(
                    f"clearance joint '{joint.name}' cannot move: the ideal joint '{beside.name}' holds the same points of "
                    f"bodies '{first}' and '{second}' together",
                    "one of the two joints",
                )


def _rigid_groups(mechanism: Mechanism) -> dict[str, str]:
    """For each welded body, or the ground, the representative of its group."""
    group: dict[str, str] = {}
    for weld in mechanism.welds:
        (first, _), (second, _) = weld.start, weld.end
        kept, merged = group.setdefault(first, first), group.setdefault(second, second)
        group = {name: kept if chosen == merged else chosen for name, chosen in group.items()}
    return group


LARGEST_CLEARANCE = 0.1
LARGEST_RADIUS = 2.0
LONGEST_BEARING = 10.0
LARGEST_GYRATION = 10.0
"""Clearance, radius of a journal, length of a bearing, radius of gyration: as parts of the mechanism's size."""

HEAVIEST, LARGEST = 1e6, 1e6  # Mass and extent of a body, over those of the lightest and the smallest one
LARGEST_ROTOR = 1e6  # Inertia of a rotor, over that of the whole mass at the distance of the mechanism's size

ADVICE = "; check its unit"


def proportion_warnings(mechanism: Mechanism) -> list[str]:
    """A warning for each number that is far beyond those of the rest of a mechanism."""
    return [*_of_contacts(mechanism), *_of_bodies(mechanism), *_of_rotors(mechanism)]


def _of_contacts(mechanism: Mechanism) -> Iterator[str]:
    size, warned = mechanism.size, set[str]()
    for contact in mechanism.contacts:
        assert contact.clearance is not None
        surfaces, name = contact.clearance.surfaces, getattr(contact, "guide", contact.name)
        radius = "corner radius" if surfaces.plane else "journal radius"
        for what, value, most in (
            ("clearance", contact.clearance.clearance, LARGEST_CLEARANCE),
            (radius, surfaces.journal_radius, LARGEST_RADIUS),
            ("bearing length", surfaces.length, LONGEST_BEARING),
        ):
            text = f"joint '{name}' has a {what} of {value:.4g} m, {value / size:.2g} times the size of the mechanism{ADVICE}"
            if value > most * size and text not in warned:  # a guide has four contact points
                warned.add(text)
                yield text


def _of_bodies(mechanism: Mechanism) -> Iterator[str]:
    bodies = mechanism.bodies
    for body in bodies:
        gyration = math.sqrt((body.inertia or 0.0) / body.mass)
        if gyration > LARGEST_GYRATION * mechanism.size:
            yield (
                f"body '{body.name}' has a radius of gyration of {gyration:.4g} m, {gyration / mechanism.size:.2g} times the "
                f"size of the mechanism{ADVICE}"
            )
    masses = {body.name: body.mass for body in bodies}
    extents = {
        body.name: max(math.dist(body.centre, point) for point in body.points.values()) for body in bodies if body.points
    }
    for what, unit, values, most in (
        ("a mass", "kg", masses, HEAVIEST),
        ("a length", "m", {name: extent for name, extent in extents.items() if extent > 0.0}, LARGEST),
    ):
        if values:
            high, low = max(values, key=values.__getitem__), min(values, key=values.__getitem__)
            if values[high] > most * values[low]:
                yield (
                    f"body '{high}' has {what} of {values[high]:.4g} {unit}, {values[high] / values[low]:.2g} times that of "
                    f"body '{low}'{ADVICE}"
                )


def _of_rotors(mechanism: Mechanism) -> Iterator[str]:
    whole = sum(body.mass for body in mechanism.bodies) * mechanism.size**2
    for component in mechanism.components:
        inertia = getattr(component, "inertia", None)
        if isinstance(inertia, float) and inertia > LARGEST_ROTOR * whole:
            yield (
                f"{component.declaration.label} '{component.name}' has a rotor of {inertia:.4g} kg m^2, {inertia / whole:.2g} "
                f"times the mass of the mechanism at its size{ADVICE}"
            )
