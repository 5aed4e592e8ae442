"""Names in a drawing: beside what they name, on top of nothing, and not on one another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patheffects import withStroke

from scissordyn.plot.label_place import around, sampled
from scissordyn.plot.style import literal, small

DISTANCES = (7.0, 11.0, 16.0, 23.0, 32.0, 44.0, 60.0, 82.0, 112.0, 150.0)
"""Of a name from what it names, the nearest one first [pt]."""

DIRECTIONS = 24  # So many directions are tried at each distance
LEADER = 13.0  # Names further away than this have a line to what they name [pt]
APART = np.array([6.0, 1.5])  # Least distance of two names beside and above each other [pt]
INK = 3.0  # Lines are looked at in points so far apart [pt]

HIDDEN, FAR, CROSSED, TOUCHED, MISLED = 4.0, 0.06, 4.0, 30.0, 60.0
"""What a hidden point of a line, a point of distance, a leader across a name, a name on a joint, and what seems to be the name
of another joint weigh."""

CLEAR = 4.0
"""A name without a leader is so much nearer to its own joint than to others, and a leader passes others so far away [pt]."""

BLOCKED = 1e4  # What a place on another name or beyond the frame weighs: more than everything else together


@dataclass(frozen=True)
class Label:
    """A name and where it belongs."""

    text: str  # Shown letter by letter; it is no markup
    place: np.ndarray  # (2,) [m]
    color: str


def write_labels(axes: Axes, labels: Sequence[Label], *, size: float | None = None, crowded: bool = True) -> list[str]:
    """Write names into a drawing whose limits are final, each where it hides least."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    if not labels:
        return []
    canvas = FigureCanvasAgg(figure) if not hasattr(figure.canvas, "get_renderer") else figure.canvas
    figure.draw_without_rendering()  # applies the layout and the equal scales of the axes
    renderer = canvas.get_renderer()
    dot = figure.dpi / 72.0
    frame = axes.get_window_extent(renderer)
    low, high = np.array([frame.x0, frame.y0]), np.array([frame.x1, frame.y1])
    anchors = np.array([axes.transData.transform(label.place) for label in labels]).reshape(-1, 2)
    ink = np.concatenate([sampled(_drawn(axes), INK * dot), anchors])
    rings = _rings(axes, dot)
    boxes: list[np.ndarray] = []
    leaders: list[np.ndarray] = []
    left: list[str] = []
    for label, anchor in zip(labels, anchors, strict=True):
        text = axes.annotate(
            literal(label.text),
            (float(label.place[0]), float(label.place[1])),
            xytext=(0.0, 0.0),
            textcoords="offset points",
            fontsize=small() if size is None else size,
            color=label.color,
            ha="center",
            va="center",
            zorder=6.0,
        )
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
        extent = text.get_window_extent(renderer)
        half = 0.5 * np.array([extent.width, extent.height]) + 0.5 * APART * dot
        centre, free = _best(anchor, half, dot, (low, high), ink, rings, boxes, leaders)
        if not free and not crowded:
            text.remove()
            left.append(label.text)
            continue
        boxes.append(np.stack([centre - half, centre + half]))
        text.set_position(tuple((centre - anchor) / dot))
        near = np.clip(anchor, centre - half, centre + half)
        if math.dist(near, anchor) > LEADER * dot:
            leaders.append(sampled([np.stack([anchor, near])], INK * dot))
            ends = axes.transData.inverted().transform(np.stack([anchor, near]))
            axes.plot(*ends.T, color=label.color, linewidth=0.4, zorder=3.0)
    return left


def _best(
    anchor: np.ndarray,
    half: np.ndarray,
    dot: float,
    frame: tuple[np.ndarray, np.ndarray],
    ink: np.ndarray,
    rings: np.ndarray,
    boxes: list[np.ndarray],
    leaders: list[np.ndarray],
) -> tuple[np.ndarray, bool]:
    """The centre of the best place for a name of a size, and whether it is free."""
    turns = 2.0 * math.pi * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    reach, _ = around(half, [dot * far for far in DISTANCES], turns)
    distance = np.repeat(DISTANCES, DIRECTIONS)
    centre = anchor + reach
    first, last = centre - half, centre + half
    beyond = np.maximum(frame[0] - first, 0.0) + np.maximum(last - frame[1], 0.0)
    free = np.all(beyond == 0.0, axis=1)
    cost = FAR * distance**1.2 + np.sum(beyond, axis=1)
    for box in boxes:
        shared = np.prod(np.clip(np.minimum(last, box[1]) - np.maximum(first, box[0]), 0.0, None), axis=1)
        free &= shared == 0.0
        cost = cost + shared / dot
        # a leader that would run through another name
        for fraction in (0.25, 0.5, 0.75):
            point = anchor + fraction * reach
            cost = cost + CROSSED * (np.all((point > box[0]) & (point < box[1]), axis=1) & (distance > LEADER))
    for x, y, radius in rings:
        near = np.clip((x, y), first + 0.5 * APART * dot, last - 0.5 * APART * dot)
        cost = cost + TOUCHED * (np.linalg.norm(near - (x, y), axis=1) < radius)
        away = np.array([x, y]) - anchor
        if math.hypot(*away) > radius:
            along = np.clip(reach @ away / np.sum(reach**2, axis=1), 0.0, 1.0)[:, None] * reach
            passed = np.linalg.norm(along - away, axis=1) < radius + CLEAR * dot
            nearer = np.linalg.norm(near - (x, y), axis=1) < (distance + CLEAR) * dot
            cost = cost + MISLED * np.where(distance > LEADER, passed, nearer)
    everything = np.concatenate([ink, *leaders])
    for k in np.flatnonzero(free) if free.any() else range(len(centre)):
        cost[k] += HIDDEN * float(np.sum(np.all((everything > first[k]) & (everything < last[k]), axis=1)))
    best = int(np.argmin(cost + BLOCKED * ~free))
    return np.asarray(centre[best]), bool(free[best])


def _drawn(axes: Axes) -> list[np.ndarray]:
    """The lines and outlines in a drawing, in dots."""
    paths = [line.get_transform().transform_path(line.get_path()) for line in axes.lines]
    paths += [patch.get_transform().transform_path(patch.get_path()) for patch in axes.patches]
    polygons = [np.asarray(points) for path in paths for points in path.to_polygons(closed_only=False)]
    return [points[np.all(np.isfinite(points), axis=1)] for points in polygons if len(points)]


def _rings(axes: Axes, dot: float) -> np.ndarray:
    """Centres and radii of the joints in a drawing, shape (joints, 3), in dots."""
    rings = [np.empty((0, 3))]
    for line in axes.lines:
        if line.get_marker() not in (None, "", " ", "None", "none"):
            centres = line.get_transform().transform(np.column_stack([line.get_xdata(), line.get_ydata()]))
            radius = (0.5 * line.get_markersize() + line.get_markeredgewidth()) * dot
            rings.append(np.column_stack([centres, np.full(len(centres), radius)]))
    return np.concatenate(rings)
