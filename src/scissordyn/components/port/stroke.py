"""Strokes of symbols: lines, written once in the frame of their port and in sizes of a symbol, and placed in a scene."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

Strokes = tuple[np.ndarray, ...]
"""Each of shape (points, 2), or (points, 3) on a line, with the part of the distance first; placed (samples, points, 2) [m]."""

AXIS_POINTS = 9  # Points of the axis of a beam, or of each span of a bar that bends

AXIS_LINE = np.stack([np.linspace(0.0, 1.0, AXIS_POINTS), np.zeros(AXIS_POINTS)], axis=1)

SQUARE = 0.7 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])

Drawn = tuple[Strokes, np.ndarray]  # Placed strokes, and where the name belongs, shape (samples, 2) [m]


class Scene(Protocol):
    """What the drawing of a component asks of a picture, at some samples of a run."""

    size: float
    """Radius of a symbol [m]."""

    def place(self, reference: tuple[str, Any]) -> np.ndarray:
        """A point of a body, shape (samples, 2) [m]."""

    def angle(self, body: str) -> np.ndarray:
        """Angle of a body, or of the ground, shape (samples,) [rad]."""

    def pivot(self, body: str, base: str) -> tuple[np.ndarray, float]:
        """Where two bodies turn against each other, shape (samples, 2) [m]; by how much this symbol there is enlarged."""

    def force(self, component: Any) -> np.ndarray:
        """Force of a component, as part of the largest of the run, shape (samples, 2)."""


def arc(radius: float, first: float, last: float, points: int = 25) -> np.ndarray:
    """An arc about the origin between two angles [deg]."""
    angle = np.radians(np.linspace(first, last, points))
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def around(part: float, stroke: np.ndarray) -> np.ndarray:
    """A stroke about a place on a line."""
    return np.column_stack([np.full(len(stroke), part), stroke])


def spiral() -> np.ndarray:
    """A spiral of 2.25 turns."""
    turn = np.linspace(0.0, 4.5 * math.pi, 60)
    radius = np.linspace(0.3, 1.0, 60)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def hatched(first: np.ndarray, last: np.ndarray, out: np.ndarray, ticks: int) -> Strokes:
    """A wall between two points, hatched on its outer side."""
    feet = first + np.linspace(0.0, 1.0, ticks)[:, None] * (last - first)
    return (np.stack([first, last]), *(np.stack([foot, foot + out]) for foot in feet))


def spread(strokes: Strokes, start: np.ndarray, end: np.ndarray, size: float) -> Drawn:
    """Strokes along and across a line between two points."""
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
    """Strokes about a point, turned by an angle."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return tuple(
        where[:, None] + size * np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1) for x, y in (s.T for s in strokes)
    )


def bent(
    part: np.ndarray, start: np.ndarray, end: np.ndarray, length: float, angles: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """A bent axis at parts of its length: the cubic with its ends and their directions, shape (samples, points, 2) [m]."""
    s = part[:, None]
    tangents = [length * np.stack([np.cos(angle), np.sin(angle)], axis=-1) for angle in angles]
    shapes = 1.0 + s * s * (2.0 * s - 3.0), s * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s), s * s * (s - 1.0)
    vectors = start, tangents[0], end, tangents[1]
    return np.asarray(sum((shape * vector[:, None] for shape, vector in zip(shapes, vectors, strict=True)), np.zeros(())))
