"""Names in drawings: beside what they name, on top of little, and not on one another; in films they move with their joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.plot.style import literal, small

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

REGION = 440.0  # Longer side of the region as pages and the explorer draw it, about [pt]
LETTER, LINE, ROUND = 5.0, 9.0, 2.0  # Width of a letter, height of a line, and room around a name [pt]
APART = np.array([6.0, 1.5])  # Least distance of two names of a still beside and above each other [pt]

NEAR, DIRECTIONS = (8.0, 12.0, 18.0, 26.0, 38.0, 54.0), 16
FAR, MORE_DIRECTIONS = (7.0, 11.0, 16.0, 23.0, 32.0, 44.0, 60.0, 82.0, 112.0, 150.0), 24
"""Distances of the edge of a name from what it names [pt], and directions that are tried at each: in films, and in stills."""

LOOKS = 9  # So many instants are looked at where a film is shown at once
LEADER = 13.0  # Names of a still further away than this have a line to what they name [pt]
RING = 6.5  # Radius that a name keeps free about each joint [pt]
STEP = 4.0  # Lines are looked at in points so far apart [pt]
CLEAR = 4.0  # A name is so much nearer to its own joint than to others, and its leader passes others so far away [pt]

HIDDEN, COVERED, CROSSED, TOUCHED, MISLED, BEYOND = 3.0, 1e4, 40.0, 12.0, 25.0, 0.4
"""What a hidden point of a line, a name on another one, a leader across another name, a name on a joint, what seems to be the
name of another joint, and a point beyond the region weigh."""

MOVING, STILL = 0.5, 0.03  # What a point of distance weighs in films, and to the power of 1.2 in stills

JUMP = 3.0  # What another place than before weighs, times the number of instants: so much less must be hidden by it in the mean


@dataclass(frozen=True)
class Label:
    """A name and where it belongs."""

    text: str  # Shown letter by letter; it is no markup
    place: np.ndarray  # (2,) [m]
    color: str


def annotated(axes: Axes, label: Label, size: float, **look: Any) -> Annotation:
    """A name that is readable over bars, so far at its place."""
    from matplotlib.patheffects import withStroke

    place = float(label.place[0]), float(label.place[1])
    centred: dict[str, Any] = {"xytext": (0.0, 0.0), "textcoords": "offset points", "ha": "center", "va": "center"}
    text = axes.annotate(literal(label.text), place, **centred, fontsize=size, color=label.color, zorder=6.0, **look)
    text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    return text


def write_labels(axes: Axes, labels: Sequence[Label], *, size: float | None = None, crowded: bool = True) -> list[str]:
    """Write names into a drawing whose limits are final, each where it hides least; returns those without a free place.

    `crowded`: whether these are written, too.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = axes.get_figure(root=True)
    assert figure is not None
    if not labels:
        return []
    canvas = FigureCanvasAgg(figure) if not hasattr(figure.canvas, "get_renderer") else figure.canvas
    figure.draw_without_rendering()  # applies the layout and the equal scales of the axes
    renderer, point = canvas.get_renderer(), 72.0 / figure.dpi
    region = point * axes.get_window_extent(renderer).get_points()
    anchors = point * axes.transData.transform([label.place for label in labels])
    ink = np.concatenate([sampled([point * line for line in _drawn(axes)], STEP), anchors])
    markers = point * _markers(axes)
    middles, halves, left = np.empty((0, 2)), np.empty((0, 2)), list[str]()
    for label, anchor in zip(labels, anchors, strict=True):
        text = annotated(axes, label, small() if size is None else size)
        extent = text.get_window_extent(renderer)
        half = 0.5 * (point * np.array([extent.width, extent.height]) + APART)
        tries, distance = around(half, FAR, 2.0 * math.pi * (np.arange(MORE_DIRECTIONS) + 0.5) / MORE_DIRECTIONS)
        others = markers[np.linalg.norm(markers - anchor, axis=1) > RING]
        cost, nearer, free = _weighed(anchor, others, tries, half, ink, region, middles, halves)
        misleading = np.where(distance > LEADER, _passes(tries, others - anchor), nearer)
        best = int(np.argmin(cost + STILL * distance**1.2 + MISLED * misleading + COVERED * ~free))
        if not free[best] and not crowded:
            text.remove()
            left.append(label.text)
            continue
        middle = anchor + tries[best]
        text.set_position(tuple(tries[best]))
        middles, halves = np.vstack([middles, middle]), np.vstack([halves, half])
        leader = np.stack([anchor, np.clip(anchor, middle - half, middle + half)])
        if math.dist(*leader) > LEADER:
            ink = np.concatenate([ink, sampled([leader], STEP)])
            axes.plot(*axes.transData.inverted().transform(leader / point).T, color=label.color, linewidth=0.4, zorder=3.0)
    return left


def _passes(leaders: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether lines from a joint at the origin come near to others."""
    nearest = np.clip(leaders @ others.T / np.sum(leaders**2, axis=1, keepdims=True), 0.0, 1.0)
    apart = np.linalg.norm(nearest[..., None] * leaders[:, None] - others, axis=2)
    return np.asarray(np.any(apart < RING + CLEAR, axis=1))


def _drawn(axes: Axes) -> list[np.ndarray]:
    """The lines and outlines in a drawing, in dots."""
    # what would connect markers is not seen
    artists: list[Any] = [*(line for line in axes.lines if line.get_linestyle() != "None"), *axes.patches]
    paths = [artist.get_transform().transform_path(artist.get_path()) for artist in artists]
    polygons = [np.asarray(points) for path in paths for points in path.to_polygons(closed_only=False)]
    return [points[np.all(np.isfinite(points), axis=1)] for points in polygons if len(points)]


def _markers(axes: Axes) -> np.ndarray:
    """The joints in a drawing, shape (joints, 2), in dots."""
    marked = [line for line in axes.lines if line.get_marker() not in (None, "", " ", "None", "none")]
    return np.concatenate([np.empty((0, 2)), *(line.get_transform().transform(line.get_xydata()) for line in marked)])


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

    At each time a place that hides little, and rarely another one than before. `alone`: whether one name is shown at a time.

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
        cost = np.empty((len(chosen), len(tries)))
        before = slice(0 if alone else k)
        for look, (here, points) in enumerate(zip(places, ink, strict=True)):
            middles = here[before] + chosen_places[look, before]
            apart = np.delete(here, k, axis=0)
            hidden, nearer, _ = _weighed(here[k], apart, tries, half, points, edges, middles, halves[before])
            cost[look] = MOVING * distance + hidden + MISLED * nearer
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
    return around(np.array([wide, high]), NEAR, 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS)


def _weighed(
    joint: np.ndarray,
    others: np.ndarray,
    tries: np.ndarray,
    half: np.ndarray,
    ink: np.ndarray,
    region: np.ndarray,
    middles: np.ndarray,
    halves: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What a name of a joint hides and covers at each place; whether another joint is about as near, and whether it is free.

    Shapes: `others` (joints, 2), `tries` (tries, 2), `ink` (points, 2), `middles, halves` (names, 2) of the names before [pt].
    """
    low, high = joint + tries - half, joint + tries + half
    reach = np.max(np.abs(tries), axis=0) + half
    ink = ink[np.all(np.abs(ink - joint) < reach, axis=1)]
    others = others[np.all(np.abs(others - joint) < reach + NEAR[-1] + CLEAR, axis=1)]
    joints = np.concatenate([joint[None], others])
    away = np.hypot(*(np.maximum(np.maximum(low[:, [d]] - joints[:, d], joints[:, d] - high[:, [d]]), 0.0) for d in (0, 1)))
    nearer = np.any(away[:, 1:] < away[:, :1] + CLEAR, axis=1)
    outside = np.sum(np.maximum(region[0] - low, 0.0) + np.maximum(high - region[1], 0.0), axis=1)
    apart = (joint - middles)[:, None]
    on = np.all(np.abs(apart + tries) < half + halves[:, None], axis=2).sum(axis=0)
    leader = [np.all(np.abs(apart + part * tries) < halves[:, None], axis=2) for part in (0.25, 0.5, 0.75)]
    crossed = np.any(leader, axis=0).sum(axis=0)
    hidden = HIDDEN * _inside(ink, low, high).sum(axis=1) + TOUCHED * (away < RING).sum(axis=1)
    cost = hidden + BEYOND * outside + COVERED * on + CROSSED * crossed
    return np.asarray(cost), np.asarray(nearer), np.asarray((outside == 0.0) & (on == 0))


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
