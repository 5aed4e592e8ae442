"""Backlash of a coupling: a body with both flanks on one side, and a stop for each flank."""

from __future__ import annotations

import dataclasses
import math
from typing import Annotated, Any

from scissordyn.component.angle_stop import AngleStop
from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.errors import InputError
from scissordyn.model.body import Body
from scissordyn.model.coupling import Coordinate, Coupling, Distance, RelativeAngle
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import Meaning, Quantity, checked, documented, quantities

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

    The wheel of the output, or of the input where the output is no angle, gets a second body on its bearing, "COUPLING flanks",
    which the coupling moves in its place. Two end stops between both are the flanks; the wheel starts in the middle.

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
    bearing = _bearing(mechanism, angle)
    if wheel.inertia is None:
        raise InputError(f"backlash at body '{wheel.name}', which does not rotate", "a body with an inertia")
    second = Body(
        name=flanks,
        mass=share * wheel.mass,
        inertia=share * wheel.inertia,
        points={"centre": (0.0, 0.0)},
        position=None if bearing[0] != GROUND and mechanism.body(bearing[0]).position is None else mechanism.place(bearing),
        angle=wheel.angle,
        angular_velocity=wheel.angular_velocity,
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
        joints=(*mechanism.joints, Revolute(f"{flanks}' bearing", (flanks, "centre"), bearing)),
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


def _bearing(mechanism: Mechanism, angle: RelativeAngle) -> BodyPoint:
    """The point of the base on which the wheel turns."""
    for joint in mechanism.joints:
        for here, there in ((joint.journal, joint.bearing), (joint.bearing, joint.journal)):
            if here[0] == angle.body and there[0] == angle.base:
                return there
    raise InputError(f"backlash at body '{angle.body}', which no pin holds on '{angle.base}'", "a joint between them")
