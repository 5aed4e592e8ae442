"""Payloads and panels on bodies."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable
from typing import Annotated

from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.bending import cross_section
from scissordyn.model.body import Body
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.pattern import matching
from scissordyn.units import Meaning, Quantity, checked, documented

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
    name, point = carrier.journal if isinstance(carrier, Revolute) else cross_section(mechanism, carrier)
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
