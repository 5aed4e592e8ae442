"""Where names stand beside joints that move: at each time a place that hides little, and rarely another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

REGION = 440.0  # Longer side of the region as pages and the explorer draw it, about [pt]
LETTER, LINE, ROUND = 5.0, 9.0, 2.0  # Width of a letter, height of a line, and room around a name [pt]
DISTANCES = (8.0, 12.0, 18.0, 26.0, 38.0, 54.0)  # Of the edge of a name from the middle of its joint [pt]

DIRECTIONS = 16

LOOKS = 9  # So many instants are looked at where a film is shown at once
RING = 6.5  # Radius that a name keeps free about each joint [pt]
STEP = 4.0  # Lines are looked at in points so far apart [pt]

HIDDEN, COVERED, CROSSED, TOUCHED, MISLED, BEYOND, FAR = 3.0, 1e4, 40.0, 12.0, 25.0, 0.4, 0.5
"""What a hidden point of a line, a name on another one, a leader across another name, a name on a joint, one about as near to
another joint as to its own, a point beyond the region, and a point of distance weigh."""

JUMP = 3.0  # What another place than before weighs, times the number of instants: so much less must be hidden by it in the mean
CLEAR = 4.0  # A name is so much nearer to its own joint than to others [pt]


def asides(
    names: Sequence[str],
    joints: np.ndarray,
    lines: Sequence[np.ndarray],
    others: np.ndarray,
    region: tuple[np.ndarray, np.ndarray],
    *,
    longer: float = REGION,
    looks: int = LOOKS,
    alone: bool = False,
) -> np.ndarray:
    """Where the middles of names are, relative to their joints, at instants that are equally spread over a film.

    `alone`: whether one name is shown at a time.

    Shapes: `joints` (frames, names, 2) [m], `lines` (frames, points, 2) [m], `others` (frames, joints, 2) [m]; returns
    (instants, names, 2) [pt].
    """
    chosen = np.linspace(0, len(joints) - 1, min(looks, len(joints))).round().astype(int)
    scale = longer / float(np.max(region[1] - region[0]))
    places = scale * np.concatenate([joints, others], axis=1)[chosen]
    ink = [sampled([scale * line[min(look, len(line) - 1)] for line in lines], STEP) for look in chosen]
    edges = scale * np.stack(region)
    chosen_places = np.empty((len(chosen), len(names), 2))
    halves = np.array([(0.5 * LETTER * len(name) + ROUND, 0.5 * LINE + ROUND) for name in names]).reshape(-1, 2)
    for k, half in enumerate(halves):
        tries, distance = _tried(*half.tolist())
        cost = FAR * np.tile(distance, (len(chosen), 1))
        for here, points, before, paid in zip(places, ink, chosen_places, cost, strict=True):
            paid += _hidden(here, k, tries, half, points, edges)
            if k and not alone:
                paid += _covered(here, k, tries, half, before, halves)
        chosen_places[:, k] = tries[_calmest(cost, JUMP * len(chosen))]
    return chosen_places


def around(half: np.ndarray, distances: Sequence[float], turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middles of a box of half a width and height that touches circles about the origin from outside, and their radii."""
    ray = np.round(np.stack([np.cos(turns), np.sin(turns)], axis=1), 12)
    tries = [far * ray + np.sign(ray) * half * np.minimum(1.0, 1.5 * np.abs(ray)) for far in distances]
    return np.concatenate(tries), np.repeat(distances, len(turns))


@lru_cache(256)
def _tried(wide: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles of a name of half a width and height that are tried, and how far its edge is from the middle of the joint."""
    return around(np.array([wide, high]), DISTANCES, 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS)


def _hidden(here: np.ndarray, k: int, tries: np.ndarray, half: np.ndarray, ink: np.ndarray, region: np.ndarray) -> np.ndarray:
    """What names hide of lines and joints at one instant, and how far they leave the region."""
    low, high = here[k] + tries - half, here[k] + tries + half
    reach = np.max(np.abs(tries), axis=0) + half
    ink = ink[np.all(np.abs(ink - here[k]) < reach, axis=1)]
    others = np.delete(here, k, axis=0)
    others = others[np.all(np.abs(others - here[k]) < reach + DISTANCES[-1] + CLEAR, axis=1)]
    here = np.concatenate([here[[k]], others])
    away = np.hypot(*(np.maximum(np.maximum(low[:, [d]] - here[:, d], here[:, d] - high[:, [d]]), 0.0) for d in (0, 1)))
    misled = np.any(away[:, 1:] < away[:, :1] + CLEAR, axis=1)
    outside = np.sum(np.maximum(region[0] - low, 0.0) + np.maximum(high - region[1], 0.0), axis=1)
    hidden = HIDDEN * _inside(ink, low, high).sum(axis=1) + TOUCHED * (away < RING).sum(axis=1)
    return np.asarray(hidden + MISLED * misled + BEYOND * outside)


def _covered(
    here: np.ndarray, k: int, tries: np.ndarray, half: np.ndarray, found: np.ndarray, halves: np.ndarray
) -> np.ndarray:
    """What names that are placed already have of another one, or of the line to its joint, upon them at one instant."""
    apart = (here[k] - here[:k] - found[:k])[:, None]
    on = np.all(np.abs(apart + tries) < half + halves[:k, None], axis=2)
    crossed = np.any([np.all(np.abs(apart + part * tries) < halves[:k, None], axis=2) for part in (0.25, 0.5, 0.75)], axis=0)
    return np.asarray(COVERED * on.sum(axis=0) + CROSSED * crossed.sum(axis=0))


def _calmest(cost: np.ndarray, jump: float) -> np.ndarray:
    """The places, instant by instant, with the least sum of their costs and of those of jumps from one to another."""
    total, came = cost[0].copy(), np.empty(cost.shape, int)
    for look in range(1, len(cost)):
        best = int(np.argmin(total))
        came[look] = np.where(total <= total[best] + jump, np.arange(len(total)), best)
        total = np.minimum(total, total[best] + jump) + cost[look]
    path = [int(np.argmin(total))]
    for look in range(len(cost) - 1, 0, -1):
        path.append(int(came[look, path[-1]]))
    return np.array(path[::-1])


def _inside(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which points are in which boxes; coordinate by coordinate, which costs a third of a reduction over them."""
    within: np.ndarray = np.ones((len(low), len(points)), bool)
    for axis in range(2):
        at = np.ascontiguousarray(points[:, axis])
        within &= (at > low[:, None, axis]) & (at < high[:, None, axis])
    return within


def sampled(lines: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Points along lines, about so far apart."""
    start = np.concatenate([np.empty((0, 2)), *(line[:-1] for line in lines)])
    along = np.concatenate([start[:0], *(line[1:] for line in lines)]) - start
    count = np.maximum(1, (np.hypot(*along.T) / step).astype(int))
    segment = np.repeat(np.arange(len(start)), count)
    part = (np.arange(segment.size) - np.repeat(np.cumsum(count) - count, count)) / count[segment]
    return np.concatenate([start[segment] + part[:, None] * along[segment], *(line[-1:] for line in lines)])
