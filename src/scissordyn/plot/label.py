"""Names beside what they name, where they hide least."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from scissordyn.plot.place import Corners
from scissordyn.plot.style import SMALL, literal

__all__ = ["Label", "points_per_metre", "write_labels"]

WIDTH, HEIGHT = 0.56, 1.15
"""Average width of a letter and height of a line, in letter sizes."""

STEP = 3.0
"""Lines are looked at in points this far apart [pt]."""

DIRECTIONS = ((1.0, 0.6), (-1.0, 0.6), (1.0, -0.6), (-1.0, -0.6), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0))
DISTANCES = (7.0, 13.0, 20.0, 28.0)
"""Where a name may be, seen from what it names [pt]."""

LEADER = 16.0
"""A name farther away than this [pt] has a thin line to what it names."""


@dataclass(frozen=True)
class Label:
    """A name and where it belongs.

    Parameters
    ----------
    text : str
    place : ndarray, shape (2,)
        [m]
    color : str
    """

    text: str
    place: np.ndarray
    color: str


def points_per_metre(axes: Axes, corners: Corners) -> float:
    """About the scale [pt/m] at which a region is drawn with equal scales, before the figure is laid out."""
    figure, box = axes.get_figure(root=True), axes.get_position()
    assert figure is not None
    panel = 72.0 * np.array([figure.get_figwidth() * box.width, figure.get_figheight() * box.height])
    return float(np.min(panel / (corners[1] - corners[0])))


def write_labels(axes: Axes, labels: Sequence[Label], corners: Corners, lines: Sequence[np.ndarray]) -> None:
    """Write names, each where it covers fewest lines and no other name.

    Parameters
    ----------
    axes : Axes
    labels : sequence of Label
    corners : (ndarray, ndarray)
        The visible region [m].
    lines : sequence of ndarray, each of shape (points, 2)
        What is drawn [m].
    """
    low, high = corners
    scale = points_per_metre(axes, corners)
    frame = scale * (high - low)
    drawn = [_sampled(scale * (line - low)) for line in lines]
    ink = np.concatenate([*drawn, *(scale * (label.place[None] - low) for label in labels)])
    taken: list[np.ndarray] = []
    for label in labels:
        anchor = scale * (label.place - low)
        extent = np.array([WIDTH * SMALL * len(label.text), HEIGHT * SMALL])
        best, least = (np.zeros(2), np.zeros((2, 2))), np.inf
        for distance in DISTANCES:
            for direction in DIRECTIONS:
                offset = distance * np.array(direction)
                first = anchor + offset + 0.5 * (np.sign(direction) - 1.0) * extent
                candidate = np.stack([first, first + extent])
                cost = _cost(candidate, ink, taken, frame) + 0.1 * distance
                if cost < least:
                    best, least = (offset, candidate), cost
        offset, chosen = best
        taken.append(chosen)
        leader = {"arrowstyle": "-", "color": label.color, "linewidth": 0.5} if np.max(np.abs(offset)) > LEADER else None
        text = axes.annotate(
            literal(label.text),
            (float(label.place[0]), float(label.place[1])),
            xytext=(float(offset[0]), float(offset[1])),
            textcoords="offset points",
            fontsize=SMALL,
            color=label.color,
            ha={-1.0: "right", 0.0: "center", 1.0: "left"}[float(np.sign(offset[0]))],
            va={-1.0: "top", 0.0: "center", 1.0: "bottom"}[float(np.sign(offset[1]))],
            zorder=5.0,
            arrowprops=leader,
        )
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])


def _sampled(line: np.ndarray) -> np.ndarray:
    """Points along a line, `STEP` apart."""
    parts = [line[-1:]]
    for start, end in itertools.pairwise(line):
        count = max(1, int(np.linalg.norm(end - start) / STEP))
        parts.append(start + np.arange(count)[:, None] / count * (end - start))
    return np.concatenate(parts)


def _cost(box: np.ndarray, ink: np.ndarray, taken: Sequence[np.ndarray], frame: np.ndarray) -> float:
    """What a name at a place would hide: other names most of all, then the frame, then lines."""
    cost = float(np.sum(np.all((ink > box[0] - 1.0) & (ink < box[1] + 1.0), axis=1)))
    for other in taken:
        shared = np.minimum(box[1], other[1]) - np.maximum(box[0], other[0]) + 2.0
        if np.all(shared > 0.0):
            cost += 20.0 + float(np.prod(shared))
    beyond = float(np.sum(np.maximum(0.0, -box[0])) + np.sum(np.maximum(0.0, box[1] - frame)))
    return cost + 10.0 * beyond
