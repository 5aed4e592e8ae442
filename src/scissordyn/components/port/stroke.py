"""Define strokes of symbols: lines in the frame of a port, in symbol sizes, which are placed in a scene."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

Strokes = tuple[np.ndarray, ...]
"""Arrays (points, 2), or (points, 3) on a line, with the fraction of the distance first; placed (samples, points, 2) [m]."""

# Drawn axis of a straight beam, or of each span of a flexible bar, by fractions of its length
AXIS_LINE = np.linspace((0.0, 0.0), (1.0, 0.0), 9)
AXIS_POINTS = len(AXIS_LINE)  # Number of points of `AXIS_LINE`

# Corners of a drawn square [symbol sizes]
SQUARE = np.array([[-0.7, -0.7], [0.7, -0.7], [0.7, 0.7], [-0.7, 0.7], [-0.7, -0.7]])

Drawn = tuple[Strokes, np.ndarray]  # Placed strokes, and position of the name, shape (samples, 2) [m]


class Scene(Protocol):
    """Picture data for the drawing of a component, at some samples of a run."""

    size: float
    """Radius of a symbol [m]."""

    def place(self, reference: tuple[str, Any]) -> np.ndarray:
        """Return the position of a body's point, shape (samples, 2) [m]."""

    def angle(self, body: str) -> np.ndarray:
        """Return the angle of a body or of the ground, shape (samples,) [rad]."""

    def pivot(self, body: str, base: str) -> tuple[np.ndarray, float]:
        """Return the position of a pivot, shape (samples, 2) [m], and a scale of this symbol."""

    def force(self, component: Any) -> np.ndarray:
        """Return the force of a component relative to the largest of the run, shape (samples, 2)."""


def arc(radius: float, first: float, last: float, points: int = 25) -> np.ndarray:
    """Return an arc about the origin between two angles [deg]."""
    angle = np.radians(np.linspace(first, last, points))
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def around(part: float, stroke: np.ndarray) -> np.ndarray:
    """Return a stroke about the place at a fraction of a line."""
    return np.column_stack([np.full(len(stroke), part), stroke])


def spiral() -> np.ndarray:
    """Return a spiral of 2.25 turns."""
    turn = np.linspace(0.0, 4.5 * math.pi, 60)
    radius = np.linspace(0.3, 1.0, 60)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def hatched(first: np.ndarray, last: np.ndarray, out: np.ndarray, ticks: int) -> Strokes:
    """Return a wall between two points, hatched on its outer side."""
    feet = first + np.linspace(0.0, 1.0, ticks)[:, None] * (last - first)
    return (np.stack([first, last]), *(np.stack([foot, foot + out]) for foot in feet))


def spread(strokes: Strokes, start: np.ndarray, end: np.ndarray, size: float) -> Drawn:
    """Place strokes along and across a line between two points."""
    apart = end - start
    length = np.linalg.norm(apart, axis=-1, keepdims=True)
    along = apart / np.where(length > 0.0, length, 1.0)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    placed = tuple(
        start[:, None]
        + stroke[:, :1] * apart[:, None]
        + size * (stroke[:, 1:2] * along[:, None] + stroke[:, 2:] * across[:, None])
        for stroke in strokes
    )
    return placed, 0.5 * (start + end)


def turned(strokes: Strokes, where: np.ndarray, angle: np.ndarray, size: float) -> Strokes:
    """Place strokes about a point, turned by an angle."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return tuple(
        where[:, None] + size * np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1) for x, y in (s.T for s in strokes)
    )


def bent(
    part: np.ndarray, start: np.ndarray, end: np.ndarray, length: float, angles: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return a bent axis: the cubic with given ends and end directions, shape (samples, points, 2) [m]."""
    s = part[:, None]
    tangents = [length * np.stack([np.cos(angle), np.sin(angle)], axis=-1) for angle in angles]
    shapes = 1.0 + s * s * (2.0 * s - 3.0), s * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s), s * s * (s - 1.0)
    vectors = start, tangents[0], end, tangents[1]
    return np.asarray(sum((shape * vector[:, None] for shape, vector in zip(shapes, vectors, strict=True)), np.zeros(())))
