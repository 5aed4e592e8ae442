"""Outlines of bodies, and the region that a picture shows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.symbol import wheel_points
from scissordyn.run.answer.placement import Placement

MARGIN = 0.1  # Around a mechanism, as a fraction of its longer side
OBLIQUE = 0.1  # Gravity further from the next quarter turn is oblique [quarter turns]

SMALLEST, FREE = 3.5, 0.5
"""Least diameter of a ring around a joint [pt], and its largest as a fraction of the distance of neighbours."""

TOGETHER = 1e-3  # Joints so near to each other are in one place, as a fraction of the distance of the farthest
Corners = tuple[np.ndarray, np.ndarray]  # Lower left and upper right corner [m]


def outlines(placement: Placement) -> list[np.ndarray]:
    """The outlines of the bodies in their order, each of shape (samples, points, 2) [m]."""
    return [placement.points(body.name, outline(body)) for body in placement.mechanism.bodies]


def corners_of(placement: Placement, bodies: Sequence[np.ndarray] | None = None) -> Corners:
    """The region of a mechanism, whose outlines can be given, and of the points of the ground at all samples, with a margin."""
    fixed = placement.vectors(np.array([place for _, place in placement.mechanism.ground], float).reshape(-1, 2))
    everything = np.concatenate(
        [*(part.reshape(-1, 2) for part in bodies or outlines(placement)), fixed, wheel_points(placement)]
    )
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = MARGIN * (float(np.max(high - low)) or 1.0)
    return low - margin, high + margin


def ring_size(joints: np.ndarray, scale: float, largest: float) -> float:
    """Diameter of the rings around joints, so that bars are seen between them [pt].

    Shapes: `joints` (frames, joints, 2) [m].
    """
    apart = np.linalg.norm(joints[:, :, None] - joints[:, None], axis=-1)
    apart[apart <= TOGETHER * np.max(apart, initial=0.0)] = np.inf
    nearest = float(np.median(np.min(apart, axis=(1, 2), initial=np.inf)))
    return float(np.clip(FREE * scale * nearest, SMALLEST, largest))


def upright(mechanism: Mechanism) -> int:
    """Quarter turns, counter-clockwise, after which gravity points downwards; none without gravity or where it is oblique."""
    if mechanism.gravity == 0.0:
        return 0
    turns = (-0.5 * math.pi - mechanism.gravity_direction) / (0.5 * math.pi)
    return round(turns) % 4 if abs(turns - round(turns)) < OBLIQUE else 0


def outline(body: Body) -> np.ndarray:
    """The outline of a body in its own frame: the line between its extreme points, or the polygon around them.

    Shapes: returns (points, 2).
    """
    local = np.array([*dict.fromkeys(body.points.values())] or [body.centre], float)
    if len(local) < 3:
        return local
    apart = np.linalg.norm(local[:, None] - local[None], axis=-1)
    i, j = np.unravel_index(int(np.argmax(apart)), apart.shape)
    along = (local[j] - local[i]) / apart[i, j]
    aside = (local - local[i]) @ np.array([-along[1], along[0]])
    if np.max(np.abs(aside)) < 1e-9 * apart[i, j]:
        return local[[i, j]]
    middle = local.mean(axis=0)
    return local[np.argsort(np.arctan2(*(local - middle).T[::-1]))]
