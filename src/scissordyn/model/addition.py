"""What is added to a mechanism: payloads and panels, friction in pins, backlash."""

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
"""Names of the points that say where a body carries what: "payload", and "panel start" and "panel end", numbered from the
second one on. Pictures draw them, and they can be tracked as any point."""


@documented
@checked
def with_payload(
    mechanism: Mechanism,
    place: Annotated[str | BodyPoint, Meaning('a joint (at the body of its journal), or a point as "BODY.POINT"')],
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass")],
    *,
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, help="about the payload's own mass centre")] = 0.0,
) -> Mechanism:
    """The same mechanism with a payload fixed to one of its bodies, which gets a point "payload" there.

    Returns
    -------
    Mechanism
    """
    carrier = mechanism.joint_or_point(place)
    name, point = carrier.journal if isinstance(carrier, Revolute) else _cross_section(mechanism, carrier)
    if name == GROUND:
        raise InputError(f"a payload on the ground at '{place}'", "a body and one of its points")
    body = mechanism.body(name)
    local = _local(body, point)
    marked = _marked(body, {PAYLOAD: local}, len(payload_points(body)))
    return _exchanged(mechanism, [_loaded(marked, mass, local, inertia)])


@documented
@checked
def with_panels(
    mechanism: Mechanism,
    bodies: Annotated[str | Iterable[str], Meaning("which bars, by name or pattern")],
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass of one panel")],
    *,
    start: Annotated[str, Meaning("a point of the bar, where the panel begins")] = "start",
    end: Annotated[str, Meaning("a point of the bar, where the panel ends")] = "end",
) -> Mechanism:
    """The same mechanism with a panel on each of some bars, its mass spread evenly between two points of the bar.

    The bar gets points "panel start" and "panel end" there.

    Returns
    -------
    Mechanism
    """
    rotating = [body.name for body in mechanism.bodies if body.rotates]
    changed = []
    for name in matching("rotating body", bodies, rotating):
        body = mechanism.body(name)
        first, second = _local(body, start), _local(body, end)
        middle = 0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])
        marked = _marked(body, {f"{PANEL} start": first, f"{PANEL} end": second}, len(panel_ends(body)))
        changed.append(_loaded(marked, mass, middle, mass * math.dist(first, second) ** 2 / 12.0))
    return _exchanged(mechanism, changed)


def payload_points(body: Body) -> list[str]:
    """Names of the points at which a body carries payloads."""
    return [name for name in body.points if re.fullmatch(rf"{PAYLOAD}( \d+)?", name)]


def panel_ends(body: Body) -> list[tuple[str, str]]:
    """Names of the points between which a body carries panels."""
    starts = [name for name in body.points if re.fullmatch(rf"{PANEL}( \d+)? start", name)]
    pairs = [(name, name.removesuffix("start") + "end") for name in starts]
    return [pair for pair in pairs if pair[1] in body.points and body.points[pair[0]] != body.points[pair[1]]]


def _marked(body: Body, places: dict[str, Point], earlier: int) -> Body:
    """A body with further points, numbered if there are such points already."""
    number = f" {earlier + 1}" if earlier else ""
    named = {re.sub(f"^({PAYLOAD}|{PANEL})", rf"\g<1>{number}", name): place for name, place in places.items()}
    return dataclasses.replace(body, points={**body.points, **named})


def _local(body: Body, point: str) -> Point:
    if point not in body.points:
        raise InputError(
            f"point '{point}' of body '{body.name}'{did_you_mean(point, body.points)}", "one of " + ", ".join(body.points)
        )
    return body.points[point]


def _loaded(body: Body, mass: float, place: Point, inertia: float) -> Body:
    """A body with a further mass fixed to it; inertias about the common mass centre (Steiner)."""
    total = body.mass + mass
    centre = tuple((body.mass * before + mass * new) / total for before, new in zip(body.centre, place, strict=True))
    if body.inertia is not None:
        apart = math.dist(body.centre, place)
        inertia += body.inertia + body.mass * mass / total * apart**2
    return dataclasses.replace(
        body, mass=total, inertia=None if body.inertia is None else inertia, centre=(centre[0], centre[1])
    )


def _exchanged(mechanism: Mechanism, changed: Iterable[Body]) -> Mechanism:
    new = {body.name: body for body in changed}
    return dataclasses.replace(mechanism, bodies=tuple(new.get(body.name, body) for body in mechanism.bodies))


_PIN = quantities(PinFriction)


@documented
@checked
def with_joint_friction(
    mechanism: Mechanism,
    joints: Annotated[
        str | Iterable[str], Meaning('names of ideal pins, "all", "pivots", "ends", or patterns as ``"unit 3/*"``', '"pivots"')
    ] = "all",
    *,
    radius: Annotated[float, _PIN["radius"]],
    kinetic: Annotated[float, _PIN["kinetic"]],
    static: Annotated[float, _PIN["static"]] = 0.0,
    stribeck_speed: Annotated[float, _PIN["stribeck_speed"]] = 0.01,
    transition: Annotated[float, _PIN["transition"]] = 1e-3,
    bristle_stiffness: Annotated[
        float, Quantity("1/m", minimum=0.0, maximum=1e9, help="sigma_0 of LuGre's bristles; 0: none, friction is smooth")
    ] = 0.0,
    bristle_damping: BristleDamping = 316.0,
) -> Mechanism:
    """The same mechanism with friction in some ideal pins: a `PinFriction` or `PinLuGre` for each, with the name of its joint.

    Friction of that name, of a call before, is replaced; friction of another name in the same pin is an error. A pin between
    bodies that do not rotate has none.

    Returns
    -------
    Mechanism
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
            raise InputError(f"friction in pin '{name}', which has '{other.name}' already", "one of both")
        body, base = _rotating(mechanism, joint)
        if not body:
            continue
        common = name, body, radius, kinetic, base, static, stribeck_speed
        added.append(
            PinLuGre(*common, bristle_stiffness, bristle_damping) if bristle_stiffness else PinFriction(*common, transition)
        )
    return mechanism.with_parts({"components": (*(part for part in mechanism.components if part not in replaced), *added)})


def _rotating(mechanism: Mechanism, joint: Revolute) -> tuple[str, str]:
    """A body of a joint that rotates, and the other one; no body where neither does."""
    for body, base in (joint.bodies, joint.bodies[::-1]):
        if body != GROUND and mechanism.body(body).rotates:
            return body, base
    return "", ""


_STOP = quantities(AngleStop)

FLANKS = " flanks"  # What the name of the body with the flanks has behind that of its coupling


@documented
@checked
def with_backlash(
    mechanism: Mechanism,
    coupling: Annotated[str, Meaning("name of the coupling")],
    backlash: Annotated[float, Quantity("rad", above=0.0, help="angle that the wheel can turn between both flanks")],
    *,
    stiffness: Annotated[float, _STOP["stiffness"]] = 1e6,
    exponent: Annotated[float, _STOP["exponent"]] = 1.5,
    restitution: Annotated[float, _STOP["restitution"]] = 0.5,
    share: Annotated[
        float, Quantity("1", above=0.0, maximum=0.5, help="of the wheel's mass and inertia that the flanks have")
    ] = 0.01,
) -> Mechanism:
    """The same mechanism with backlash in a coupling: contact of either flank by a law, and a dead zone between.

    The wheel of the output, or of the input where the output is no angle, carries a second body, "COUPLING flanks", which the
    coupling moves in its place. Two end stops between both are the flanks; the wheel starts in the middle. Both start with the
    speeds that are given: the wheel with its own, the flanks with that of the other side of the coupling.

    Returns
    -------
    Mechanism
    """
    named = {part.name: part for part in mechanism.couplings}
    if coupling not in named:
        raise InputError(f"coupling '{coupling}'", "one of " + (", ".join(named) or "none"))
    part = named[coupling]
    end = next((end for end in ("output", "input") if isinstance(getattr(part, end), RelativeAngle)), None)
    angle = getattr(part, end) if end else None
    if not isinstance(angle, RelativeAngle) or angle.body == GROUND:
        raise InputError(f"backlash in coupling '{coupling}' without a wheel", "an angle of a body as its output or input")
    wheel, flanks = _in_mesh(mechanism, part, angle), coupling + FLANKS
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


def closed(mechanism: Mechanism) -> tuple[Mechanism, dict[str, dict[str, float]]]:
    """The mechanism before `with_backlash` and its numbers by couplings; as it is where they do not give it again."""
    before, numbers = mechanism, dict[str, dict[str, float]]()
    for part in reversed(mechanism.couplings):
        stops: list[Any] = [other for other in before.components if other.name in _flanks(part.name)]
        end = next((end for end in ("output", "input") if part.name + FLANKS in getattr(part, end).bodies), None)
        if len(stops) != 2 or end is None or not all(isinstance(stop, AngleStop) for stop in stops):
            continue
        wheel, flanks = before.body(stops[0].body), before.body(part.name + FLANKS)
        mass, share = _typed(wheel.mass + flanks.mass), _typed(flanks.mass / (wheel.mass + flanks.mass))
        whole = dataclasses.replace(wheel, mass=mass, inertia=_typed((flanks.inertia or 0.0) / share))
        ends = {end: dataclasses.replace(getattr(part, end), body=wheel.name)}
        before = before.with_parts(
            {
                "bodies": tuple(whole if body is wheel else body for body in before.bodies if body is not flanks),
                "joints": tuple(joint for joint in before.joints if part.name + FLANKS not in joint.bodies),
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
    except InputError:  # the parts have been changed since
        return mechanism, {}
    return (before, numbers) if repr(again) == repr(mechanism) else (mechanism, {})


def _in_mesh(mechanism: Mechanism, part: Coupling, angle: RelativeAngle) -> Body:
    """The wheel, turned to where the offset of the coupling has its flanks at the start."""
    wheel = mechanism.body(angle.body)
    if part.offset is None or wheel.inertia is None:
        return wheel
    output, input = (_start(mechanism, coordinate) for coordinate in (part.output, part.input))
    further = part.ratio * input + part.offset - output
    turn = further if angle is part.output else -further / part.ratio
    return dataclasses.replace(wheel, angle=wheel.placed_angle + turn) if turn else wheel


def _start(mechanism: Mechanism, coordinate: Coordinate) -> float:
    """A coordinate as the bodies are placed [rad or m]."""
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


def _typed(number: float) -> float:
    """A number as it was typed, without what sums and quotients round."""
    return float(f"{number:.12g}")


def _pivot(mechanism: Mechanism, angle: RelativeAngle) -> BodyPoint:
    """The point of the wheel at its bearing on the base."""
    for joint in mechanism.joints:
        for here, there in ((joint.journal, joint.bearing), (joint.bearing, joint.journal)):
            if here[0] == angle.body and there[0] == angle.base:
                return here
    raise InputError(f"backlash at body '{angle.body}', which no pin holds on '{angle.base}'", "a joint between them")


def _cross_section(mechanism: Mechanism, place: BodyPoint) -> BodyPoint:
    """A point of a bar as a point of the cross-section that carries it, if the bar bends; else as it is."""
    name, point = place
    for body in mechanism.bodies:
        if point in body.points and (body.name == name or body.name.startswith(f"{name}/")):
            return body.name, point
    return place
