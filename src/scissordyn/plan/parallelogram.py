"""Parallelograms of ideal joints: opposite bars keep their relative direction, one more linear constraint.

Eliminating that constraint is an optimisation. It is as accurate as opposite sides are equal.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

from scissordyn.components.place import GROUND, Point
from scissordyn.model.mechanism import Mechanism
from scissordyn.tolerance import CONVERGENCE_TOL, DATA_TOL

Angles = Mapping[str, float]  # Angle of each rotating body [rad]


class Side(NamedTuple):
    """Side of a quadrilateral of joints: the vector between two joints of a body, in its frame, and its round-off [m]."""

    body: str
    vector: Point
    rounding: float

    @property
    def length(self) -> float:
        """Length of the side [m]."""
        return math.hypot(*self.vector)

    def equals(self, other: Side, allowed: float) -> bool:
        """Return whether another side of the quadrilateral is equally long, within round-off and `allowed` [m]."""
        return abs(self.length - other.length) <= allowed + self.rounding + other.rounding

    def at(self, angles: Angles) -> Point:
        """Return the vector between both joints in the fixed frame."""
        angle, (x, y) = 0.0 if self.body == GROUND else angles[self.body], self.vector
        return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


class Quadrilateral(NamedTuple):
    """Ring of four bodies with equal opposite sides: `far` is opposite to `near`, `right` to `left`."""

    near: Side
    far: Side
    left: Side
    right: Side

    def gap(self, angles: Angles) -> float:
        """Return the closing error of the ring as a fraction of its length."""
        near, far, left, right = (side.at(angles) for side in self)
        x, y = (near[k] + right[k] - left[k] - far[k] for k in (0, 1))
        return math.hypot(x, y) / (self.near.length + self.left.length)

    def is_parallel(self, angles: Angles) -> bool:
        """Return whether the quadrilateral is a parallelogram, not crossed; a flat one counts as a parallelogram."""
        near, far, left, right = (side.at(angles) for side in self)
        length = self.near.length
        diagonal, other = [near[k] + right[k] for k in (0, 1)], [left[k] - near[k] for k in (0, 1)]
        crossed = abs(diagonal[0] * other[1] - diagonal[1] * other[0]) / (length + self.left.length)
        return math.dist(near, far) <= max(crossed, DATA_TOL * length)


def parallel_bodies(mechanism: Mechanism, assemble: Callable[[], Angles | None]) -> list[tuple[str, str, float]]:
    """Return pairs of rotating bodies, or the ground and a body, that a parallelogram of ideal joints keeps parallel.

    A parallelogram can leave its assembly branch only by folding flat; the branch of the start is kept.
    """
    placed = {body.name: body.placed_angle for body in mechanism.bodies}
    candidates = list(_quadrilaterals(mechanism))
    angles: Angles = placed
    if any(candidate.gap(placed) > DATA_TOL for candidate in candidates):
        angles = assemble() or placed
    pairs: dict[tuple[str, str], float] = {}
    for candidate in candidates:
        near, far = candidate.near, candidate.far
        if (far.body, near.body) in pairs or (near.body, far.body) in pairs or not candidate.is_parallel(angles):
            continue
        first, second = (far, near) if far.body == GROUND else (near, far)
        (ax, ay), (bx, by) = first.at(placed), second.at(placed)
        between = math.atan2(bx * ay - by * ax, ax * bx + ay * by)  # 0 up to round-off if the bodies are placed parallel
        turn = _angle(placed, second.body) - _angle(placed, first.body)
        pairs[first.body, second.body] = turn + (between if abs(between) > CONVERGENCE_TOL else 0.0)
    return [(first, second, turn) for (first, second), turn in pairs.items()]


def _angle(angles: Angles, body: str) -> float:
    return 0.0 if body == GROUND else angles[body]


def _quadrilaterals(mechanism: Mechanism) -> Iterator[Quadrilateral]:
    """Yield rings of four rotating bodies, or the ground and three, with equal opposite sides."""
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

    def side(body: str, start: str, end: str) -> Side:
        (ax, ay), (bx, by) = local[body][start], local[body][end]
        return Side(body, (bx - ax, by - ay), 2.0 * sys.float_info.epsilon * max(map(abs, (ax, ay, bx, by))))

    # the elimination tolerates a hundred times as much: its factors and many parallelograms in a row amplify the error
    allowed = CONVERGENCE_TOL * mechanism.size
    for body, around in neighbours.items():
        for (left, to_left), (right, to_right) in combinations(around, 2):
            if left == right:
                continue
            near = side(body, to_left, to_right)
            for far, left_to_far in neighbours[left]:
                if far == body:
                    continue
                for right_far, right_to_far in neighbours[right]:
                    if far != right_far:
                        continue
                    ring = Quadrilateral(
                        near,
                        side(far, left_to_far, right_to_far),
                        side(left, to_left, left_to_far),
                        side(right, to_right, right_to_far),
                    )
                    if near.length > 0.0 and near.equals(ring.far, allowed) and ring.left.equals(ring.right, allowed):
                        yield ring
