"""Transmission angles of dyads: how well each pair of bodies transmits the force of the drive.

A dyad is a pair of bodies connected by an inner joint (an Assur group of class II). One outer joint or guide connects each of
them to a body of known motion. The transmission angle lies between the lines from the inner joint to the outer joints; for a
guide, its normal replaces the line. Forces grow as the inverse sine of the angle. At 0 the dyad is in a singular position.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scissordyn.components.place import GROUND, BodyPoint
from scissordyn.plan.plan import Plan


@dataclass(frozen=True)
class Dyad:
    """Pair of bodies with an inner joint and two outer joints, or one outer joint and a guide."""

    joint: str  # The inner joint
    inner: BodyPoint  # Body and point of the inner joint
    outer: tuple[BodyPoint, ...]  # Bodies and points of the one or two outer joints
    guide: float | None = None  # Direction of the guide that replaces the second outer joint [rad]


def dyads(plan: Plan) -> list[Dyad]:
    """Return the dyads of a mechanism, in the order in which its drives determine them."""
    placed = {GROUND}
    for drive in plan.drives:
        if _pin_to_placed(plan, drive.body, "", placed) is not None:
            placed.add(drive.body)
    slides = {guide.follower[0]: guide.direction for guide in plan.mechanism.guides if guide.body == GROUND}
    sliding = {guide.follower[0] for guide in plan.mechanism.guides if guide.aligned}
    sliding |= {name for name in slides if not plan.mechanism.body(name).rotates}
    for rod in plan.rods:  # a jack that moves a slider
        ends = {rod.start[0], rod.end[0]}
        if rod.motion is not None and GROUND in ends:
            placed |= {body for body in ends if body in slides and not plan.mechanism.body(body).rotates}
    if len(placed) == 1:
        return []
    chain: list[Dyad] = []
    while True:
        new = _next_dyad(plan, placed, slides, sliding)
        if new is None:
            return chain
        dyad, bodies = new
        chain.append(dyad)
        placed |= bodies


def _next_dyad(plan: Plan, placed: set[str], slides: dict[str, float], sliding: set[str]) -> tuple[Dyad, set[str]] | None:
    """Return the next dyad whose outer joints connect it to `placed` bodies of known motion, and the names of its bodies.

    None if there is no such dyad. `slides` gives the direction of the guide of each guided body [rad]. Bodies in `sliding`
    cannot rotate, so that any of their points moves along the guide.
    """
    for joint in plan.mechanism.joints:
        first, second = joint.bodies
        if first in placed or second in placed:
            continue
        pins = [_pin_to_placed(plan, body, joint.name, placed) for body in (first, second)]
        if pins[0] is not None and pins[1] is not None:
            return Dyad(joint.name, joint.journal, (pins[0], pins[1])), {first, second}
        for slider, pin in ((first, pins[1]), (second, pins[0])):
            if slider in slides and slider in sliding and pin is not None:
                return Dyad(joint.name, joint.journal, (pin,), slides[slider]), {first, second}
    for body, direction in slides.items():  # a body held by a pin and a guide
        follower = next(guide.follower for guide in plan.mechanism.guides if guide.follower[0] == body)
        pin = None if body in placed else _pin_to_placed(plan, body, "", placed)
        if pin is not None:
            name = next(guide.name for guide in plan.mechanism.guides if guide.follower == follower)
            return Dyad(name, follower, (pin,), direction), {body}
    return None


def _pin_to_placed(plan: Plan, body: str, but: str, placed: set[str]) -> BodyPoint | None:
    """Return the point that connects a body to a placed one by a joint other than `but`; None if there is none."""
    for joint in plan.mechanism.joints:
        if joint.name != but and body in joint.bodies:
            here, there = (joint.journal, joint.bearing) if joint.journal[0] == body else (joint.bearing, joint.journal)
            if there[0] in placed:
                return here
    return None


def transmission_angle(plan: Plan, dyad: Dyad, position: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the transmission angle of a dyad, 0 to 90 deg, shape (samples,) [rad]."""
    inner = _place(plan, dyad.inner, position, angle)
    first = inner - _place(plan, dyad.outer[0], position, angle)
    if dyad.guide is None:
        second = inner - _place(plan, dyad.outer[1], position, angle)
    else:
        second = np.broadcast_to([-math.sin(dyad.guide), math.cos(dyad.guide)], first.shape)
    across = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    return np.asarray(np.arctan2(across, np.abs(np.sum(first * second, axis=1))))


def _place(plan: Plan, reference: BodyPoint, position: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the coordinates of a point of a body at all samples, shape (samples, 2)."""
    name, point = reference
    k = [body.name for body in plan.bodies].index(name)
    body = plan.bodies[k]
    x, y = np.array(body.points[point]) - np.array(body.centre)
    cos, sin = np.cos(angle[:, k]), np.sin(angle[:, k])
    points: np.ndarray = position[:, k] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
    return points
