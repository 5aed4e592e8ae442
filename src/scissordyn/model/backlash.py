"""Backlash of a coupling: a body with both flanks on one side, and a stop for each flank."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

from scissordyn.component.angle_stop import AngleStop
from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.errors import InputError
from scissordyn.model.body import Body
from scissordyn.model.coupling import RelativeAngle
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import Meaning, Quantity, checked, documented, quantities

_STOP = quantities(AngleStop)


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
    wheel, flanks = mechanism.body(angle.body), f"{coupling} flanks"
    bearing = _bearing(mechanism, angle)
    if wheel.inertia is None:
        raise InputError(f"backlash at body '{wheel.name}', which does not rotate", "a body with an inertia")
    second = Body(
        name=flanks,
        mass=share * wheel.mass,
        inertia=share * wheel.inertia,
        points={"centre": (0.0, 0.0)},
        position=mechanism.place(bearing),
        angle=wheel.angle,
        angular_velocity=wheel.angular_velocity,
    )
    rest = dataclasses.replace(wheel, mass=(1.0 - share) * wheel.mass, inertia=(1.0 - share) * wheel.inertia)
    stops: tuple[Any, ...] = tuple(
        AngleStop(f"{coupling} {side} flank", wheel.name, sign * 0.5 * backlash, flanks, stiffness, exponent, restitution)
        for side, sign in (("leading", 1.0), ("trailing", -1.0))
    )
    changed = dataclasses.replace(part, **{end: dataclasses.replace(angle, body=flanks)})  # type: ignore[arg-type]
    return dataclasses.replace(
        mechanism,
        bodies=(*(rest if body is wheel else body for body in mechanism.bodies), second),
        joints=(*mechanism.joints, Revolute(f"{coupling} flanks' bearing", (flanks, "centre"), bearing)),
        components=(*mechanism.components, *stops),
        couplings=tuple(changed if other is part else other for other in mechanism.couplings),
    )


def _bearing(mechanism: Mechanism, angle: RelativeAngle) -> BodyPoint:
    """The point of the base on which the wheel turns."""
    for joint in mechanism.joints:
        for here, there in ((joint.journal, joint.bearing), (joint.bearing, joint.journal)):
            if here[0] == angle.body and there[0] == angle.base:
                return there
    raise InputError(f"backlash at body '{angle.body}', which no pin holds on '{angle.base}'", "a joint between them")
