"""Where names stand beside joints that move: for each a place that hides little during the whole film."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

__all__ = ["REGION", "aside"]

REGION = 440.0
"""Longer side of the drawn region for which places are chosen; films, pages and the explorer draw it about as large [pt]."""

LETTER, LINE, ROUND = 5.0, 9.0, 2.0
"""Width of a letter, height of a line, and room around a name [pt]."""

DISTANCES = (8.0, 12.0, 18.0, 26.0)
"""Of the edge of a name from the middle of its joint [pt]."""

DIRECTIONS = 16

LOOKS = 9
"""So many frames are looked at."""

RING = 6.5
"""Radius that a name keeps free about each joint [pt]."""

STEP = 4.0
"""Lines are looked at in points so far apart [pt]."""

HIDDEN, COVERED, TOUCHED, MISLED, BEYOND, FAR = 1.0, 60.0, 12.0, 25.0, 0.4, 0.5
"""What a hidden point of a line, a name on another one, on a joint, and about as near to another joint as to its own, a point
beyond the region, and a point of distance weigh."""

CLEAR = 4.0
"""A name is so much nearer to its own joint than to others [pt]."""


def aside(
    names: Sequence[str],
    joints: np.ndarray,
    lines: Sequence[np.ndarray],
    others: np.ndarray,
    region: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Where the middles of names are, relative to their joints, the same in all frames.

    Parameters
    ----------
    names : sequence of str
        The most important ones first.
    joints : ndarray, shape (frames, names, 2)
        Their joints [m].
    lines : sequence of ndarray, shape (frames, points, 2)
        What is drawn; what does not move may have one frame [m].
    others : ndarray, shape (frames, joints, 2)
        Joints without a name [m].
    region : (ndarray, ndarray)
        Lower left and upper right corner of what is drawn [m].

    Returns
    -------
    ndarray, shape (names, 2)
        For a longer side of `REGION` [pt].
    """
    looks = np.unique(np.linspace(0, len(joints) - 1, LOOKS).round().astype(int))
    scale = REGION / float(np.max(region[1] - region[0]))
    places = scale * np.concatenate([joints, others], axis=1)[looks]
    nothing = np.empty((0, 2))
    ink = [np.concatenate([nothing, *(_sampled(scale * line[min(look, len(line) - 1)]) for line in lines)]) for look in looks]
    turn = 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ray = np.round(np.stack([np.cos(turn), np.sin(turn)], axis=1), 12)
    distance = np.repeat(DISTANCES, DIRECTIONS)
    found: list[np.ndarray] = []
    halves: list[np.ndarray] = []
    for k, name in enumerate(names):
        half = 0.5 * np.array([LETTER * len(name), LINE]) + ROUND
        # the box touches the circle about the joint from outside
        tries = np.concatenate([far * ray + np.sign(ray) * half * np.minimum(1.0, 1.5 * np.abs(ray)) for far in DISTANCES])
        cost = FAR * len(looks) * distance
        for here, points in zip(places, ink, strict=True):
            low, high = here[k] + tries - half, here[k] + tries + half
            within = _inside(points, low, high)
            away = np.linalg.norm(np.clip(here, low[:, None], high[:, None]) - here, axis=2)
            cost += HIDDEN * within.sum(axis=1) + TOUCHED * (away < RING).sum(axis=1)
            cost += MISLED * np.any(np.delete(away, k, axis=1) < away[:, [k]] + CLEAR, axis=1)
            outside = np.maximum(scale * region[0] - low, 0.0) + np.maximum(high - scale * region[1], 0.0)
            cost += BEYOND * outside.sum(axis=1)
            for one, (middle, other) in enumerate(zip(found, halves, strict=True)):
                apart = np.abs(here[k] + tries - (here[one] + middle)) - half - other
                cost += COVERED * np.all(apart < 0.0, axis=1)
        found.append(tries[int(np.argmin(cost))])
        halves.append(half)
    return np.array(found).reshape(-1, 2)


def _inside(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which points are in which boxes; coordinate by coordinate, which costs a third of a reduction over them."""
    within: np.ndarray = np.ones((len(low), len(points)), bool)
    for axis in range(2):
        at = np.ascontiguousarray(points[:, axis])
        within &= (at > low[:, None, axis]) & (at < high[:, None, axis])
    return within


def _sampled(line: np.ndarray) -> np.ndarray:
    """Points along a line, so far apart that no name stands between two of them."""
    parts = [line[-1:]]
    for start, end in itertools.pairwise(line):
        count = max(1, int(math.dist(start, end) / STEP))
        parts.append(start + np.arange(count)[:, None] / count * (end - start))
    return np.concatenate(parts)
