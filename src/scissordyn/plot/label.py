"""Place names in drawings, next to their objects and clear of lines and other names; in films names move with their joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scissordyn.plot.style import literal, small

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation


class Placing(NamedTuple):
    """Sizes and penalties for the placement of names next to joints and bars."""

    region: float = 440.0  # [pt] approximate longer side of the drawn region on pages and in the explorer
    letter_width: float = 5.0  # [pt]
    line_height: float = 9.0  # [pt]
    leader_min: float = 13.0  # [pt] a name of a still farther from its joint gets a leader line
    joint_margin: float = 6.5  # [pt] radius around each joint that names should leave free
    point_spacing: float = 4.0  # [pt] distance of the points that represent lines
    difference_min: float = 4.0  # [pt] by which a name should be nearer to its own joint than to any other joint
    film_instants: int = 9  # [instants] number at which the names of a film are placed
    covered_penalty: float = 1e4  # [-] penalty of a place for each name that it covers
    misleading_penalty: float = 25.0  # [-] penalty of a place at which a name seems to belong to another joint


PLACING = Placing()  # Distances by which the names of parts are placed in pictures

NAME_SPACING = np.array([6.0, 1.5])  # Smallest horizontal and vertical distance between two names of parts in a still [pt]

FILM_DISTANCES = (8.0, 12.0, 18.0, 26.0, 38.0, 54.0)  # Tried distances from a joint to the edge of its name, in films [pt]
# Tried distances from a joint to the edge of its name, in stills [pt]
STILL_DISTANCES = (7.0, 11.0, 16.0, 23.0, 32.0, 44.0, 60.0, 82.0, 112.0, 150.0)


@dataclass(frozen=True)
class Label:
    """Name and its position."""

    text: str  # Literal text without markup
    place: np.ndarray  # (2,) [m]
    color: str


def write_name(axes: Axes, label: Label, size: float, **look: Any) -> Annotation:
    """Write a name at its position, with an outline that keeps it readable over bars; return its artist."""
    from matplotlib.patheffects import withStroke

    place = float(label.place[0]), float(label.place[1])
    centred: dict[str, Any] = {"xytext": (0.0, 0.0), "textcoords": "offset points", "ha": "center", "va": "center"}
    text = axes.annotate(literal(label.text), place, **centred, fontsize=size, color=label.color, zorder=6.0, **look)
    text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    return text


def write_labels(axes: Axes, labels: Sequence[Label], *, size: float | None = None, crowded: bool = True) -> list[str]:
    """Write each name where it hides least; return the names without a free place.

    The limits and the layout of the drawing must be final. With `crowded`, names without a free place are written as well.
    """
    directions = 24  # tried at each distance
    still_weight = 0.03  # penalty of the distance to the joint, to the power 1.2
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = axes.get_figure(root=True)
    assert figure is not None
    if not labels:
        return []
    canvas = FigureCanvasAgg(figure) if not hasattr(figure.canvas, "get_renderer") else figure.canvas
    renderer, point = canvas.get_renderer(), 72.0 / figure.dpi
    region = point * axes.get_window_extent(renderer).get_points()
    anchors = point * axes.transData.transform([label.place for label in labels])
    ink = np.concatenate([sample_lines([point * line for line in _drawn_lines(axes)], PLACING.point_spacing), anchors])
    markers = point * _markers(axes)
    middles, halves, left = np.empty((0, 2)), np.empty((0, 2)), list[str]()
    for label, anchor in zip(labels, anchors, strict=True):
        text = write_name(axes, label, small() if size is None else size)
        extent = text.get_window_extent(renderer)
        half = 0.5 * (point * np.array([extent.width, extent.height]) + NAME_SPACING)
        tries, distance = candidate_places(half, STILL_DISTANCES, 2.0 * math.pi * (np.arange(directions) + 0.5) / directions)
        others = markers[np.linalg.norm(markers - anchor, axis=1) > PLACING.joint_margin]
        cost, nearer, free = _place_penalties(anchor, others, tries, half, ink, region, middles, halves)
        misleading = np.where(distance > PLACING.leader_min, _passes(tries, others - anchor), nearer)
        best = int(
            np.argmin(
                cost + still_weight * distance**1.2 + PLACING.misleading_penalty * misleading + PLACING.covered_penalty * ~free
            )
        )
        if not free[best] and not crowded:
            text.remove()
            left.append(label.text)
            continue
        middle = anchor + tries[best]
        text.set_position(tuple(tries[best]))
        middles, halves = np.vstack([middles, middle]), np.vstack([halves, half])
        leader = np.stack([anchor, np.clip(anchor, middle - half, middle + half)])
        if math.dist(*leader) > PLACING.leader_min:
            ink = np.concatenate([ink, sample_lines([leader], PLACING.point_spacing)])
            axes.plot(*axes.transData.inverted().transform(leader / point).T, color=label.color, linewidth=0.4, zorder=3.0)
    return left


def _passes(leaders: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return whether leader lines from a joint at the origin pass close to other joints."""
    nearest = np.clip(leaders @ others.T / np.sum(leaders**2, axis=1, keepdims=True), 0.0, 1.0)
    apart = np.linalg.norm(nearest[..., None] * leaders[:, None] - others, axis=2)
    return np.asarray(np.any(apart < PLACING.joint_margin + PLACING.difference_min, axis=1))


def _drawn_lines(axes: Axes) -> list[np.ndarray]:
    """Return the lines and outlines in a drawing [dots]."""
    # lines that have markers only are not visible
    artists: list[Any] = [*(line for line in axes.lines if line.get_linestyle() != "None"), *axes.patches]
    paths = [artist.get_transform().transform_path(artist.get_path()) for artist in artists]
    polygons = [np.asarray(points) for path in paths for points in path.to_polygons(closed_only=False)]
    return [points[np.all(np.isfinite(points), axis=1)] for points in polygons if len(points)]


def _markers(axes: Axes) -> np.ndarray:
    """Return the positions of the markers in a drawing, which represent joints, shape (joints, 2) [pixels]."""
    marked = [line for line in axes.lines if line.get_marker() not in (None, "", " ", "None", "none")]
    return np.concatenate([np.empty((0, 2)), *(line.get_transform().transform(line.get_xydata()) for line in marked)])


def name_offsets(
    names: Sequence[str],
    joints: np.ndarray,
    lines: Sequence[np.ndarray],
    others: np.ndarray,
    region: tuple[np.ndarray, np.ndarray],
    *,
    longer: float = PLACING.region,
    instants: int = PLACING.film_instants,
) -> np.ndarray:
    """Return the offsets of names from their joints at instants that are equally spaced over a film.

    Each place hides little, and changes of place are rare.

    Shapes: `joints` (frames, names, 2) [m], `lines` (frames, points, 2) [m], `others` (frames, joints, 2) [m]; returns
    (instants, names, 2) [pt].
    """
    jump = 3.0  # penalty of a name's change of place, per instant
    moving_weight = 0.5  # penalty of the distance to the joint [1/pt]
    free_margin = 2.0  # around each name [pt]
    chosen = np.linspace(0, len(joints) - 1, min(instants, len(joints))).round().astype(int)
    scale = longer / float(np.max(region[1] - region[0]))
    places = scale * np.concatenate([joints, others], axis=1)[chosen]
    ink = [sample_lines([scale * line[min(look, len(line) - 1)] for line in lines], PLACING.point_spacing) for look in chosen]
    edges = scale * np.stack(region)
    chosen_places = np.empty((len(chosen), len(names), 2))
    halves = np.array(
        [(0.5 * PLACING.letter_width * len(name) + free_margin, 0.5 * PLACING.line_height + free_margin) for name in names]
    ).reshape(-1, 2)
    for k, half in enumerate(halves):
        tries, distance = _film_candidates(*half.tolist())
        cost = np.empty((len(chosen), len(tries)))
        for look, (here, points) in enumerate(zip(places, ink, strict=True)):
            middles = here[:k] + chosen_places[look, :k]
            apart = np.delete(here, k, axis=0)
            hidden, nearer, _ = _place_penalties(here[k], apart, tries, half, points, edges, middles, halves[:k])
            cost[look] = moving_weight * distance + hidden + PLACING.misleading_penalty * nearer
        chosen_places[:, k] = tries[_steadiest_places(cost, jump * len(chosen))]
    return chosen_places


def candidate_places(half: np.ndarray, distances: Sequence[float], turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the centres of boxes that touch circles about the origin from outside, and the radii of these circles.

    `half` is half the width and height of the box.
    """
    ray = np.round(np.stack([np.cos(turns), np.sin(turns)], axis=1), 12)
    tries = [far * ray + np.sign(ray) * half * np.minimum(1.0, 1.5 * np.abs(ray)) for far in distances]
    return np.concatenate(tries), np.repeat(distances, len(turns))


@lru_cache(256)
def _film_candidates(wide: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the candidate centres of a name, and their distances from the joint to the name's edge."""
    directions = 16  # tried at each distance
    return candidate_places(np.array([wide, high]), FILM_DISTANCES, 2.0 * math.pi * np.arange(directions) / directions)


def _place_penalties(
    joint: np.ndarray,
    others: np.ndarray,
    tries: np.ndarray,
    half: np.ndarray,
    ink: np.ndarray,
    region: np.ndarray,
    middles: np.ndarray,
    halves: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return three arrays over the candidate places of a name: penalty, misleading, free.

    A place is misleading if another joint is about as near to the name as its own joint.

    Shapes: `others` (joints, 2), `tries` (tries, 2), `ink` (points, 2), `middles, halves` (names, 2) of the placed names
    [pt].
    """
    beyond_region = 0.4  # penalty of each point outside the region [1/pt]
    touched_joint = 12.0  # penalty of each joint under a name
    crossed_name = 40.0  # penalty of each name that the leader crosses
    hidden_point = 3.0  # penalty of each hidden point of a line
    low, high = joint + tries - half, joint + tries + half
    reach = np.max(np.abs(tries), axis=0) + half
    ink = _near(ink, joint, reach)
    others = _near(others, joint, reach + FILM_DISTANCES[-1] + PLACING.difference_min)
    # arrays over joints or points, then places: sums over the first axis are faster
    joints = np.concatenate([joint[None], others])
    dx, dy = (np.maximum(np.maximum(low[:, d] - at, at - high[:, d]), 0.0) for d, at in enumerate(joints.T[:, :, None]))
    away = np.sqrt(dx * dx + dy * dy)  # np.hypot takes six times as long
    nearer = np.any(away[1:] < away[0] + PLACING.difference_min, axis=0)
    beyond = np.maximum(region[0] - low, 0.0) + np.maximum(high - region[1], 0.0)
    outside = beyond[:, 0] + beyond[:, 1]
    on = crossed = np.zeros(len(tries), int)
    if len(middles):
        apart = (joint - middles)[:, None]
        on = np.all(np.abs(apart + tries) < half + halves[:, None], axis=2).sum(axis=0)
        leader = [np.all(np.abs(apart + part * tries) < halves[:, None], axis=2) for part in (0.25, 0.5, 0.75)]
        crossed = np.any(leader, axis=0).sum(axis=0)
    hidden = hidden_point * _inside(ink, low, high).sum(axis=0) + touched_joint * (away < PLACING.joint_margin).sum(axis=0)
    cost = hidden + beyond_region * outside + PLACING.covered_penalty * on + crossed_name * crossed
    return np.asarray(cost), np.asarray(nearer), np.asarray((outside == 0.0) & (on == 0))


def _steadiest_places(cost: np.ndarray, jump: float) -> np.ndarray:
    """Return the sequence of places with the smallest sum of penalties, including those of jumps between places."""
    total, came = cost[0].copy(), np.empty(cost.shape, int)
    for look in range(1, len(cost)):
        best = int(np.argmin(total))
        came[look] = np.where(total <= total[best] + jump, np.arange(len(total)), best)
        total = np.minimum(total, total[best] + jump) + cost[look]
    path = [int(np.argmin(total))]
    for look in range(len(cost) - 1, 0, -1):
        path.append(int(came[look, path[-1]]))
    return np.array(path[::-1])


def _near(points: np.ndarray, middle: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return the points in a box about its middle, shape (near points, 2)."""
    x, y = reach[:, None] > np.abs(points - middle).T
    return np.asarray(points[x & y])


def _inside(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return which points are in which boxes, shape (points, boxes)."""
    sides = zip(points.T[:, :, None], np.ascontiguousarray(low.T), np.ascontiguousarray(high.T), strict=True)
    x, y = ((at > least) & (at < most) for at, least, most in sides)
    return np.asarray(x & y)


def sample_lines(lines: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Return points along lines, at a spacing of about `step`."""
    start = np.concatenate([np.empty((0, 2)), *(line[:-1] for line in lines)])
    along = np.concatenate([start[:0], *(line[1:] for line in lines)]) - start
    count = np.maximum(1, (np.hypot(*along.T) / step).astype(int))
    segment = np.repeat(np.arange(len(start)), count)
    part = (np.arange(segment.size) - np.repeat(np.cumsum(count) - count, count)) / count[segment]
    return np.concatenate([start[segment] + part[:, None] * along[segment], *(line[-1:] for line in lines)])
