"""Additions to a mechanism: payloads and panels, friction in pins, backlash."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable
from typing import Annotated, Any

from scissordyn.components.angle_stop import AngleStop
from scissordyn.components.lugre import PinLuGre
from scissordyn.components.pin_friction import PinFriction
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.laws.friction.bristle import BristleDamping
from scissordyn.model.body import Body
from scissordyn.model.coupling import Coordinate, Coupling, Distance, RelativeAngle
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import matching
from scissordyn.units import Meaning, Quantity, checked, documented, quantities

PAYLOAD, PANEL = "payload", "panel"
"""Names of the points at which a body carries payloads ("payload") and panels ("panel start", "panel end").

They are numbered from the second one on. Pictures draw them, and they can be tracked like any point.
"""


@documented
@checked
def with_payload(
    mechanism: Mechanism,
    place: Annotated[str | BodyPoint, Meaning('a joint (at the body of its journal), or a point as "BODY.POINT"')],
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass")],
    *,
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, help="inertia about the payload's mass centre")] = 0.0,
) -> Mechanism:
    """Return the mechanism with a payload fixed to one of its bodies, which gets a point "payload"."""
    carrier = mechanism.joint_or_point(place)
    name, point = carrier.journal if isinstance(carrier, Revolute) else _cross_section(mechanism, carrier)
    if name == GROUND:
        raise InputError(f"the place '{place}' of a payload is on the ground", "a body and one of its points")
    body = mechanism.body(name)
    local = _local(body, point)
    marked = _with_points(body, {PAYLOAD: local}, len(payload_points(body)))
    loaded = _with_mass(marked, mass, local, inertia)
    return _with_bodies(mechanism, [dataclasses.replace(loaded, payloads=(*body.payloads, mass))])


@documented
@checked
def with_panels(
    mechanism: Mechanism,
    bodies: Annotated[str | Iterable[str], Meaning("which bars, by name or pattern")],
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass of one panel")],
    *,
    start: Annotated[str, Meaning("point of the bar where the panel begins")] = "start",
    end: Annotated[str, Meaning("point of the bar where the panel ends")] = "end",
) -> Mechanism:
    """Return the mechanism with a panel on some bars, its mass spread evenly between two points of the bar.

    The bar gets points "panel start" and "panel end".
    """
    rotating = [body.name for body in mechanism.bodies if body.rotates]
    changed = []
    for name in matching("rotating body", bodies, rotating):
        body = mechanism.body(name)
        first, second = _local(body, start), _local(body, end)
        middle = 0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])
        marked = _with_points(body, {f"{PANEL} start": first, f"{PANEL} end": second}, len(panel_ends(body)))
        changed.append(_with_mass(marked, mass, middle, mass * math.dist(first, second) ** 2 / 12.0))
    return _with_bodies(mechanism, changed)


def payload_points(body: Body) -> list[str]:
    return [name for name in body.points if re.fullmatch(rf"{PAYLOAD}( \d+)?", name)]


def panel_ends(body: Body) -> list[tuple[str, str]]:
    """Return the names of the end points of a body's panels."""
    starts = [name for name in body.points if re.fullmatch(rf"{PANEL}( \d+)? start", name)]
    pairs = [(name, name.removesuffix("start") + "end") for name in starts]
    return [pair for pair in pairs if pair[1] in body.points and body.points[pair[0]] != body.points[pair[1]]]


def _with_points(body: Body, places: dict[str, Point], earlier: int) -> Body:
    """Return a body with further points; `earlier` is the count of its points with these names, from which numbers follow."""
    number = f" {earlier + 1}" if earlier else ""
    named = {re.sub(f"^({PAYLOAD}|{PANEL})", rf"\g<1>{number}", name): place for name, place in places.items()}
    return dataclasses.replace(body, points={**body.points, **named})


def _local(body: Body, point: str) -> Point:
    """Return the coordinates of a body's point; raise `InputError` if the body has no such point."""
    if point not in body.points:
        raise InputError(
            f"unknown point '{point}' of body '{body.name}'{did_you_mean(point, body.points)}",
            "one of " + ", ".join(body.points),
        )
    return body.points[point]


def _with_mass(body: Body, mass: float, place: Point, inertia: float) -> Body:
    """Return a body with a further mass fixed to it; inertias are about the common mass centre (Steiner)."""
    total = body.mass + mass
    centre = tuple((body.mass * before + mass * new) / total for before, new in zip(body.centre, place, strict=True))
    if body.inertia is not None:
        distance = math.dist(body.centre, place)
        inertia += body.inertia + body.mass * mass / total * distance**2
    return dataclasses.replace(
        body, mass=total, inertia=None if body.inertia is None else inertia, centre=(centre[0], centre[1])
    )


def _with_bodies(mechanism: Mechanism, changed: Iterable[Body]) -> Mechanism:
    new = {body.name: body for body in changed}
    return dataclasses.replace(mechanism, bodies=tuple(new.get(body.name, body) for body in mechanism.bodies))


_PIN_QUANTITIES = quantities(PinFriction)  # Units and bounds of the parameters of friction in pin joints, by name


@documented
@checked
def with_joint_friction(
    mechanism: Mechanism,
    joints: Annotated[
        str | Iterable[str], Meaning('names of ideal pins, "all", "pivots", "ends", or patterns as ``"unit 3/*"``', '"pivots"')
    ] = "all",
    *,
    radius: Annotated[float, _PIN_QUANTITIES["radius"]],
    kinetic: Annotated[float, _PIN_QUANTITIES["kinetic"]],
    static: Annotated[float, _PIN_QUANTITIES["static"]] = 0.0,
    stribeck_speed: Annotated[float, _PIN_QUANTITIES["stribeck_speed"]] = 0.01,
    transition: Annotated[float, _PIN_QUANTITIES["transition"]] = 1e-3,
    bristle_stiffness: Annotated[
        float, Quantity("1/m", minimum=0.0, maximum=1e9, help="sigma_0 of LuGre's bristles; 0: none, friction is smooth")
    ] = 0.0,
    bristle_damping: BristleDamping = 316.0,
) -> Mechanism:
    """Return the mechanism with a `PinFriction` or `PinLuGre` in some ideal pins, named after their joints.

    Friction with that name, from an earlier call, is replaced. Friction with another name in the same pin is an error. A pin
    between bodies that do not rotate gets no friction.
    """
    chosen = {joint.name: joint for joint in mechanism.ideal_joints}
    chosen = {name: chosen[name] for name in matching("ideal joint", joints, list(chosen))}
    before = [part for part in mechanism.components if isinstance(part, PinFriction | PinLuGre)]
    replaced = [part for part in before if part.name in chosen]
    pairs = {frozenset((part.body, part.base)): part for part in before if part not in replaced}
    added = []
    for name, joint in chosen.items():
        other = pairs.get(frozenset(joint.bodies))
        if other is not None:
            raise InputError(f"pin '{name}' already has friction '{other.name}'", "one of them")
        body, base = _rotating_body(mechanism, joint)
        if not body:
            continue
        common = name, body, radius, kinetic, base, static, stribeck_speed
        added.append(
            PinLuGre(*common, bristle_stiffness, bristle_damping) if bristle_stiffness else PinFriction(*common, transition)
        )
    return mechanism.with_parts({"components": (*(part for part in mechanism.components if part not in replaced), *added)})


def _rotating_body(mechanism: Mechanism, joint: Revolute) -> tuple[str, str]:
    """Return a rotating body of a joint and the other body; empty names if neither rotates."""
    for body, base in (joint.bodies, joint.bodies[::-1]):
        if body != GROUND and mechanism.body(body).rotates:
            return body, base
    return "", ""


_STOP_QUANTITIES = quantities(AngleStop)  # Units and bounds of the parameters of angular end stops, by name

FLANKS_SUFFIX = " flanks"  # Last word of the name of the body with the flanks of a coupling with backlash


@documented
@checked
def with_backlash(
    mechanism: Mechanism,
    coupling: Annotated[str, Meaning("name of the coupling")],
    backlash: Annotated[float, Quantity("rad", above=0.0, help="angle that the wheel can turn between both flanks")],
    *,
    stiffness: Annotated[float, _STOP_QUANTITIES["stiffness"]] = 1e6,
    exponent: Annotated[float, _STOP_QUANTITIES["exponent"]] = 1.5,
    restitution: Annotated[float, _STOP_QUANTITIES["restitution"]] = 0.5,
    share: Annotated[
        float, Quantity("1", above=0.0, maximum=0.5, help="fraction of the wheel's mass and inertia that the flanks have")
    ] = 0.01,
) -> Mechanism:
    """Return the mechanism with backlash in a coupling: a dead zone between two flanks, each with a contact law.

    The output's wheel, or the input's wheel if the output is not an angle, carries a second body "COUPLING flanks". The
    coupling moves this body instead of the wheel. Two end stops between them are the flanks; the wheel starts in the middle.
    The wheel starts with its given speed, the flanks with the speed of the other side of the coupling.
    """
    named = {part.name: part for part in mechanism.couplings}
    if coupling not in named:
        raise InputError(f"no coupling '{coupling}'", "one of " + (", ".join(named) or "none"))
    part = named[coupling]
    if part.further:
        raise InputError(f"backlash in coupling '{coupling}', which has further inputs", "a coupling of two coordinates")
    end = next((end for end in ("output", "input") if isinstance(getattr(part, end), RelativeAngle)), None)
    angle = getattr(part, end) if end else None
    if not isinstance(angle, RelativeAngle) or angle.body == GROUND:
        raise InputError(f"backlash in coupling '{coupling}', which has no wheel", "the angle of a body as its output or input")
    wheel, flanks = _wheel_in_mesh(mechanism, part, angle), coupling + FLANKS_SUFFIX
    centre = _pivot(mechanism, angle)
    point = getattr(part.transmission, f"{end}_centre", "") or "centre"
    if wheel.inertia is None:
        raise InputError(f"backlash at body '{wheel.name}', which does not rotate", "a body with an inertia")
    second = Body(
        name=flanks,
        mass=share * wheel.mass,
        inertia=share * wheel.inertia,
        points={point: (0.0, 0.0)},
        position=None if wheel.position is None else mechanism.place(centre),
        angle=wheel.angle,
    )
    rest = dataclasses.replace(wheel, mass=(1.0 - share) * wheel.mass, inertia=(1.0 - share) * wheel.inertia)
    stops: tuple[Any, ...] = tuple(
        AngleStop(side, wheel.name, sign * 0.5 * backlash, flanks, stiffness, exponent, restitution)
        for side, sign in zip(_flanks(coupling), (1.0, -1.0), strict=True)
    )
    changed = dataclasses.replace(part, **{end: dataclasses.replace(angle, body=flanks)})  # type: ignore[arg-type]
    return dataclasses.replace(
        mechanism,
        bodies=(*(rest if body.name == wheel.name else body for body in mechanism.bodies), second),
        joints=(*mechanism.joints, Revolute(f"{flanks}' bearing", (flanks, point), centre)),
        components=(*mechanism.components, *stops),
        couplings=tuple(changed if other is part else other for other in mechanism.couplings),
    )


def without_backlash(mechanism: Mechanism) -> tuple[Mechanism, dict[str, dict[str, float]]]:
    """Return the mechanism before `with_backlash`, and the arguments of that call for each coupling with backlash.

    If the parts have been changed since then, return the mechanism itself and no arguments.
    """
    before, numbers = mechanism, dict[str, dict[str, float]]()
    for part in reversed(mechanism.couplings):
        stops: list[Any] = [other for other in before.components if other.name in _flanks(part.name)]
        end = next((end for end in ("output", "input") if part.name + FLANKS_SUFFIX in getattr(part, end).bodies), None)
        if len(stops) != 2 or end is None or not all(isinstance(stop, AngleStop) for stop in stops):
            continue
        wheel, flanks = before.body(stops[0].body), before.body(part.name + FLANKS_SUFFIX)
        mass, share = _rounded(wheel.mass + flanks.mass), _rounded(flanks.mass / (wheel.mass + flanks.mass))
        whole = dataclasses.replace(wheel, mass=mass, inertia=_rounded((flanks.inertia or 0.0) / share))
        ends = {end: dataclasses.replace(getattr(part, end), body=wheel.name)}
        before = before.with_parts(
            {
                "bodies": tuple(whole if body is wheel else body for body in before.bodies if body is not flanks),
                "joints": tuple(joint for joint in before.joints if part.name + FLANKS_SUFFIX not in joint.bodies),
                "components": tuple(other for other in before.components if other not in stops),
                "couplings": tuple(dataclasses.replace(part, **ends) if other is part else other for other in before.couplings),
            },
            check=False,
        )
        numbers[part.name] = {"backlash": 2.0 * stops[0].angle, "share": share}
        numbers[part.name] |= {name: getattr(stops[0], name) for name in ("stiffness", "exponent", "restitution")}
    again = before
    try:
        for part in before.couplings:
            again = with_backlash(again, part.name, **numbers[part.name]) if part.name in numbers else again
    except InputError:  # the parts have been changed after `with_backlash`
        return mechanism, {}
    return (before, numbers) if repr(again) == repr(mechanism) else (mechanism, {})


def _wheel_in_mesh(mechanism: Mechanism, part: Coupling, angle: RelativeAngle) -> Body:
    """Return a wheel turned to the angle at which the coupling's relation holds: midway between both flanks."""
    wheel = mechanism.body(angle.body)
    if part.offset is None or wheel.inertia is None:
        return wheel
    output, input = (_placed_value(mechanism, coordinate) for coordinate in (part.output, part.input))
    further = part.ratio * input + part.offset - output
    turn = further if angle is part.output else -further / part.ratio
    return dataclasses.replace(wheel, angle=wheel.placed_angle + turn) if turn else wheel


def _placed_value(mechanism: Mechanism, coordinate: Coordinate) -> float:
    """Return the value of a coordinate for the placed bodies [rad or m]."""
    if isinstance(coordinate, Distance):
        return math.dist(mechanism.place(coordinate.start), mechanism.place(coordinate.end))
    base = None if coordinate.base == GROUND else mechanism.body(coordinate.base)
    turned = 0.0 if base is None else base.placed_angle
    if isinstance(coordinate, RelativeAngle):
        return (0.0 if coordinate.body == GROUND else mechanism.body(coordinate.body).placed_angle) - turned
    (x, y), origin = mechanism.place(coordinate.point), base.placed_position if base else (0.0, 0.0)
    x, y = x - origin[0], y - origin[1]
    return x * math.cos(turned + coordinate.direction) + y * math.sin(turned + coordinate.direction)


def _flanks(coupling: str) -> tuple[str, str]:
    return f"{coupling} leading flank", f"{coupling} trailing flank"


def _rounded(number: float) -> float:
    """Return a number rounded to twelve digits, which removes the round-off of sums and quotients."""
    return float(f"{number:.12g}")


def _pivot(mechanism: Mechanism, angle: RelativeAngle) -> BodyPoint:
    """Return the point of a wheel at its bearing on the base."""
    for joint in mechanism.joints:
        for here, there in ((joint.journal, joint.bearing), (joint.bearing, joint.journal)):
            if here[0] == angle.body and there[0] == angle.base:
                return here
    raise InputError(f"backlash at body '{angle.body}', which no pin holds on '{angle.base}'", "a joint between them")


def _cross_section(mechanism: Mechanism, place: BodyPoint) -> BodyPoint:
    """Return a point of a flexible bar as a point of its cross-section; any other point unchanged."""
    name, point = place
    for body in mechanism.bodies:
        if point in body.points and (body.name == name or body.name.startswith(f"{name}/")):
            return body.name, point
    return place
