"""Symbols of components: lines in the fixed frame, the same in pictures and in films.

A component is drawn by the symbol that its class declares. The strokes of a symbol are written once, in the frame of its port:
along and across a line, around a hinge, at a point.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.component.place import GROUND
from scissordyn.component.port import ACTUATOR, FRAME, HINGE, LINE, POINT
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.placement import Placement

__all__ = ["STROKES", "Symbol", "cross_sections", "symbols"]

CURVE = 9
"""Points of the axis of a beam element."""

RING = 0.4
"""By how much of the first one's radius each further symbol at the same hinge is larger."""

ARROW = 3.0
"""Length of the arrow of the largest force of a run, in sizes."""


@dataclass(frozen=True)
class Symbol:
    """The lines of a component.

    Parameters
    ----------
    name : str
    kind : str
        The symbol.
    strokes : tuple of ndarray, each of shape (samples, points, 2)
        In the fixed frame [m].
    anchor : ndarray, shape (samples, 2)
        Where its name belongs [m].
    """

    name: str
    kind: str
    strokes: tuple[np.ndarray, ...]
    anchor: np.ndarray


def _arc(radius: float, first: float, last: float, points: int = 25) -> np.ndarray:
    angle = np.radians(np.linspace(first, last, points))
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _along(*points: tuple[float, float, float]) -> np.ndarray:
    """Points of a line's symbol: part of the distance, and sizes along and across it."""
    return np.array(points, float)


def _around(part: float, circle: np.ndarray) -> np.ndarray:
    return np.column_stack([np.full(len(circle), part), circle])


def _coils() -> np.ndarray:
    part = np.concatenate([[0.0, 0.15], np.linspace(0.2, 0.8, 8), [0.85, 1.0]])
    aside = np.concatenate([[0.0, 0.0], np.resize([0.4, -0.4], 8), [0.0, 0.0]])
    return np.column_stack([part, np.zeros(part.size), aside])


def _spiral() -> np.ndarray:
    turn = np.linspace(0.0, 4.5 * math.pi, 60)
    radius = np.linspace(0.3, 1.0, 60)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def _hatched(first: np.ndarray, last: np.ndarray, out: np.ndarray, ticks: int = 5) -> tuple[np.ndarray, ...]:
    """A wall between two points, hatched on its outer side."""
    feet = first + np.linspace(0.0, 1.0, ticks)[:, None] * (last - first)
    return (np.stack([first, last]), *(np.stack([foot, foot + out]) for foot in feet))


_STRAIGHT = _along((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
_DIAMOND = _along((0.5, -0.4, 0.0), (0.5, 0.0, 0.3), (0.5, 0.4, 0.0), (0.5, 0.0, -0.3), (0.5, -0.4, 0.0))
_SQUARE = np.array([[-0.7, -0.7], [0.7, -0.7], [0.7, 0.7], [-0.7, 0.7], [-0.7, -0.7]])

STROKES: Mapping[str, tuple[np.ndarray, ...]] = MappingProxyType(
    {
        "line": (_STRAIGHT, _DIAMOND),
        "rod": (_STRAIGHT,),
        "spring": (_coils(),),
        "cable": (_STRAIGHT, _around(0.0, _arc(0.25, 0.0, 360.0)), _around(1.0, _arc(0.25, 0.0, 360.0))),
        "coil": (
            _around(0.0, _arc(0.7, 0.0, 360.0)),
            _around(0.0, 0.65 * _spiral()),
            _along((0.0, 0.0, 0.7), (1.0, 0.0, 0.0)),
        ),
        "hinge": (_SQUARE,),
        "spiral": (_spiral(),),
        "tape": (np.concatenate([_arc(0.8, -60.0, 60.0), _arc(1.15, 60.0, -60.0), _arc(0.8, -60.0, -59.0, 2)[:1]]),),
        "arc": (_arc(1.0, -135.0, 135.0), np.array([[-1.0, 0.85], _arc(1.0, 135.0, 135.0, 1)[0], [-0.45, 1.15]])),
        "motor": (_arc(1.0, 0.0, 360.0, 37), np.array([[-0.4, -0.4], [-0.4, 0.4], [0.0, -0.1], [0.4, 0.4], [0.4, -0.4]])),
        "stop": _hatched(np.array([0.35, 0.75]), np.array([0.7, 1.5]), np.array([-0.35, -0.1]), 4),
        "latch": (
            np.array([[0.3, -1.3], [1.2, -1.3], [1.2, -0.5], [0.85, -0.5], [0.85, -0.95], [0.3, -0.95], [0.3, -1.3]]),
            _arc(0.55, -90.0, 0.0, 9),
        ),
        "travel": (
            np.array([[-1.5, 0.0], [1.5, 0.0]]),
            np.array([[1.1, 0.25], [1.5, 0.0], [1.1, -0.25]]),
            np.array([[-1.1, 0.25], [-1.5, 0.0], [-1.1, -0.25]]),
        ),
        "wall": _hatched(np.array([0.0, -1.2]), np.array([0.0, 1.2]), np.array([0.4, 0.4]), 6),
        "frame": (_SQUARE,),
        "beam": (_STRAIGHT,),
        "bushing": (
            _arc(0.45, 0.0, 360.0, 37),
            _arc(1.0, 0.0, 360.0, 37),
            *(np.stack([0.45 * spoke, spoke]) for spoke in _arc(1.0, 22.5, 337.5, 8)),
        ),
    }
)
"""Strokes in the frame of a port and in sizes; those of lines have the part of the distance first."""

UPRIGHT = ("motor",)
"""Symbols that do not turn with their body."""


def cross_sections(mechanism: Mechanism) -> frozenset[str]:
    """The bodies that are cross-sections of bars that bend: the elements are drawn in their place."""
    beams: list[Any] = [part for part in mechanism.components if part.declaration.symbol == "beam"]
    return frozenset(end[0] for beam in beams if beam.mass_per_length > 0.0 for end in (beam.start, beam.end))


def symbols(run: xr.Dataset, mechanism: Mechanism, placement: Placement, samples: Any, size: float) -> list[Symbol]:
    """The symbols of all components of a mechanism.

    Parameters
    ----------
    run : Dataset
        For the direction of forces.
    mechanism : Mechanism
    placement : Placement
        At the same samples.
    samples : index along "time"
    size : float
        Radius of a symbol [m].

    Returns
    -------
    list of Symbol
    """
    found: list[Symbol] = []
    ranks: dict[str, int] = {}
    components: tuple[Any, ...] = (*mechanism.components, *mechanism.latches, *mechanism.rods)
    for part in components:
        port, kind = part.declaration.port, part.declaration.symbol
        if port is LINE:
            strokes, anchor = _on_a_line(STROKES[kind], placement.place(part.start), placement.place(part.end), size)
        elif port is HINGE or port is ACTUATOR:
            where, anchor = _pivot(mechanism, placement, part.body, part.base)
            ranks[where] = ranks.get(where, -1) + 1
            turned = np.zeros(placement.count) if kind in UPRIGHT else placement.angle(part.body)
            strokes = _turned(STROKES[kind], anchor, turned, size * (1.0 + RING * ranks[where]))
        elif port is POINT:
            strokes, anchor = _arrow(run, part, placement, samples, size)
        elif kind == "beam":
            strokes, anchor = _bent(placement, part)
        elif port is FRAME:
            anchor, end = placement.place(part.start), placement.place(part.end)
            strokes = (*_turned(STROKES[kind], anchor, placement.angle(part.start[0]), size), np.stack([anchor, end], axis=1))
        else:
            anchor = placement.place(part.point)
            turn = part.direction + placement.angle(GROUND)
            along = np.array([math.cos(turn[0]), math.sin(turn[0])])
            if kind == "stop":
                anchor, kind = anchor + (part.limit - anchor @ along)[:, None] * along, "wall"
            strokes = _turned(STROKES[kind], anchor, turn, size)
        found.append(Symbol(part.name, part.declaration.symbol, strokes, anchor))
    return found


def _bent(placement: Placement, part: Any) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """The bent axis of a beam element: the cubic with its ends and their directions."""
    start, end = placement.place(part.start), placement.place(part.end)
    tangents = []
    for body in (part.start[0], part.end[0]):
        angle = placement.angle(body)
        tangents.append(part.length * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    s = np.linspace(0.0, 1.0, CURVE)[:, None]
    shapes = 1.0 + s * s * (2.0 * s - 3.0), s * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s), s * s * (s - 1.0)
    vectors = start, tangents[0], end, tangents[1]
    axis = sum((shape * vector[:, None] for shape, vector in zip(shapes, vectors, strict=True)), np.zeros(()))
    return (np.asarray(axis),), np.asarray(axis)[:, CURVE // 2]


def _on_a_line(
    strokes: tuple[np.ndarray, ...], start: np.ndarray, end: np.ndarray, size: float
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
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


def _turned(strokes: tuple[np.ndarray, ...], where: np.ndarray, angle: np.ndarray, size: float) -> tuple[np.ndarray, ...]:
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return tuple(
        where[:, None] + size * np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1) for x, y in (s.T for s in strokes)
    )


def _pivot(mechanism: Mechanism, placement: Placement, body: str, base: str) -> tuple[str, np.ndarray]:
    """The joint between two bodies and where it is; the mass centre of the first where no joint connects them."""
    for joint in mechanism.joints:
        if {joint.journal[0], joint.bearing[0]} == {body, base}:
            return f"joint {joint.name}", placement.place(joint.bearing)
    return f"body {body}", placement.centre(body)


def _arrow(
    run: xr.Dataset, part: Any, placement: Placement, samples: Any, size: float
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """An arrow that ends at the point, in the direction of the force, as long as its part of the run's largest."""
    section = part.declaration.section
    force = run[f"{section}_force"].sel({section: part.name}).transpose("time", "axis").values
    largest = float(np.max(np.linalg.norm(force, axis=-1))) or 1.0
    vector = ARROW * size / largest * placement.vectors(force[samples].reshape(-1, 2))
    tip = placement.place(part.point)
    across = np.stack([-vector[:, 1], vector[:, 0]], axis=-1)
    tail = tip - vector
    head = np.stack([tip - 0.3 * vector + 0.12 * across, tip, tip - 0.3 * vector - 0.12 * across], axis=1)
    return (np.stack([tail, tip], axis=1), head), tail
