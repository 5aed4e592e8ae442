"""Parallelograms of ideal joints: opposite bars keep their relative direction, one more linear constraint."""

from __future__ import annotations

import math
from itertools import combinations

from scissordyn.component.place import GROUND, Point
from scissordyn.model.mechanism import Mechanism

__all__ = ["parallel_bodies"]

CLOSURE = 1e-6
"""Sides count as equal and parallel within this fraction of their length."""


def parallel_bodies(mechanism: Mechanism) -> list[tuple[str, str, float]]:
    """Pairs of rotating bodies, or the ground and one, that a parallelogram of four ideal joints keeps parallel.

    A parallelogram could leave this assembly branch only by folding flat; the branch of the start is kept.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    list of (str, str, float)
        The two bodies, the ground first if it is one of them, and the angle of the second against the first [rad].
    """
    local: dict[str, dict[str, Point]] = {}
    for joint in mechanism.ideal_joints:
        for body, point in (joint.journal, joint.bearing):
            if body == GROUND:
                local.setdefault(body, {})[joint.name] = mechanism.place((body, point))
            elif mechanism.body(body).rotates:
                local.setdefault(body, {})[joint.name] = mechanism.body(body).points[point]
    neighbours: dict[str, list[tuple[str, str]]] = {}
    for joint in mechanism.ideal_joints:
        a, b = joint.bodies
        if a in local and b in local:
            neighbours.setdefault(a, []).append((b, joint.name))
            neighbours.setdefault(b, []).append((a, joint.name))
    found = {}
    for body, around in neighbours.items():
        for (left, to_left), (right, to_right) in combinations(around, 2):
            if left == right:
                continue
            for far, left_to_far in neighbours[left]:
                for right_far, right_to_far in neighbours[right]:
                    if far != right_far or far == body or (far, body) in found or (body, far) in found:
                        continue
                    near_side = _side(mechanism, local, body, to_left, to_right)
                    far_side = _side(mechanism, local, far, left_to_far, right_to_far)
                    length = math.hypot(*near_side)
                    if length > 0.0 and math.dist(near_side, far_side) < CLOSURE * length:
                        one, other = (far, body) if far == GROUND else (body, far)
                        found[one, other] = _angle(mechanism, other) - _angle(mechanism, one)
    return [(one, other, turn) for (one, other), turn in found.items()]


def _side(mechanism: Mechanism, local: dict[str, dict[str, Point]], body: str, start: str, end: str) -> Point:
    """The vector on a body from one joint to another, where the body is placed at the start."""
    (ax, ay), (bx, by) = local[body][start], local[body][end]
    cos, sin = math.cos(_angle(mechanism, body)), math.sin(_angle(mechanism, body))
    return cos * (bx - ax) - sin * (by - ay), sin * (bx - ax) + cos * (by - ay)


def _angle(mechanism: Mechanism, body: str) -> float:
    return 0.0 if body == GROUND else mechanism.body(body).angle
