"""Lines of couplings and coordinate drives: pitch circles, belts, arrows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.component.place import GROUND
from scissordyn.component.port.stroke import Strokes
from scissordyn.model.coupling import Coordinate, Coupling, RelativeAngle, Slide
from scissordyn.run.answer.placement import Placement

CIRCLE = np.linspace(0.0, 2.0 * math.pi, 97)

NEAR = 0.5
"""Radii of wheels whose pivots coincide, or of a pulley, at most: as a multiple of the symbols' size, or of their distance."""


def coupling_strokes(part: Coupling, placement: Placement, size: float) -> tuple[Strokes, np.ndarray]:
    """The lines of a coupling and where its name belongs: wheels at the pivots of its angles, and what connects them."""
    ends = [_anchor(coordinate, placement) for coordinate in (part.output, part.input)]
    middle = 0.5 * (ends[0] + ends[1])
    distance = float(np.max(np.linalg.norm(ends[1] - ends[0], axis=-1)))
    angles = [coordinate if isinstance(coordinate, RelativeAngle) else None for coordinate in (part.output, part.input)]
    if angles[0] and angles[1] and distance > 0.0:
        ratio, moving = part.ratio, GROUND not in (angles[0].base, angles[1].base)
        meshes = ratio < 0.0 or (moving and ratio != 1.0)
        first = distance / abs(1.0 - ratio) if meshes else NEAR * distance / max(1.0, abs(ratio)) / (1.0 + NEAR)
        radii = first, first * abs(ratio)
        strokes = [_wheel(angle, end, radius, placement) for angle, end, radius in zip(angles, ends, radii, strict=True)]  # type: ignore[arg-type]
        return (*strokes, *(() if meshes else _belt(ends, radii))), middle
    wheels = [
        (angle, end, abs(part.ratio if k else 1.0 / part.ratio))
        for k, (angle, end) in enumerate(zip(angles, ends, strict=True))
        if angle is not None
    ]
    if len(wheels) == 1 and distance > 0.0 and wheels[0][2] > size:  # a pinion
        return (_wheel(*wheels[0], placement),), wheels[0][1]
    if len(wheels) == 2:
        return tuple(_wheel(angle, end, (1.0 + NEAR * k) * size, placement) for k, (angle, end, _) in enumerate(wheels)), middle
    return (np.stack(ends, axis=1),), middle


def drive_strokes(coordinate: Coordinate, placement: Placement, size: float) -> tuple[Strokes, np.ndarray]:
    """The lines of a driven coordinate and where its name belongs: an arc, an arrow along a slide, or a line between points."""
    anchor = _anchor(coordinate, placement)
    if isinstance(coordinate, RelativeAngle):
        turn = placement.angle(coordinate.body)[:, None] + np.linspace(0.3, 2.0, 17)
        arc = anchor[:, None] + 1.5 * size * _unit(turn)
        return (arc, _head(arc[:, -1], turn[:, -1] + 0.5 * math.pi, size)), anchor
    if isinstance(coordinate, Slide):
        along = placement.angle(coordinate.base) + coordinate.direction
        tip = anchor + 3.0 * size * _unit(along)
        return (np.stack([anchor, tip], axis=1), _head(tip, along, size)), anchor
    start, end = placement.place(coordinate.start), placement.place(coordinate.end)
    span = end - start
    barrel = start + 0.55 * span
    across = 0.5 * size * np.stack([-span[:, 1], span[:, 0]], axis=-1) / np.linalg.norm(span, axis=-1)[:, None]
    outline = np.stack([start + across, barrel + across, barrel - across, start - across, start + across], axis=1)
    return (outline, np.stack([barrel, end], axis=1)), 0.5 * (start + end)


def coupling_points(placement: Placement) -> np.ndarray:
    """Points of the wheels of couplings, for the region of a picture, shape (points, 2) [m]."""
    strokes = [stroke for part in placement.mechanism.couplings for stroke in coupling_strokes(part, placement, 0.0)[0]]
    return np.concatenate([np.empty((0, 2)), *(stroke.reshape(-1, 2) for stroke in strokes)])


def _anchor(coordinate: Coordinate, placement: Placement) -> np.ndarray:
    """The pivot of an angle, the point of a slide, or the middle of a distance, shape (samples, 2) [m]."""
    if isinstance(coordinate, RelativeAngle):
        bodies = coordinate.bodies if coordinate.body != GROUND else coordinate.bodies[::-1]
        joints = (joint for joint in placement.mechanism.joints if {joint.journal[0], joint.bearing[0]} == set(bodies))
        joint = next(joints, None)
        return placement.centre(bodies[0]) if joint is None else placement.place(joint.bearing)
    if isinstance(coordinate, Slide):
        return placement.place(coordinate.point)
    ends: np.ndarray = placement.place(coordinate.start) + placement.place(coordinate.end)
    return 0.5 * ends


def _unit(angle: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _wheel(angle: RelativeAngle, centre: np.ndarray, radius: float, placement: Placement) -> np.ndarray:
    """A pitch circle with a line to where the body points."""
    rim = centre[:, None] + radius * _unit(placement.angle(angle.body)[:, None] + CIRCLE)
    return np.concatenate([centre[:, None], rim], axis=1)


def _belt(centres: list[np.ndarray], radii: tuple[float, float]) -> Strokes:
    """Both outer tangents of two circles."""
    span = centres[1] - centres[0]
    distance = np.linalg.norm(span, axis=-1)
    along = np.arctan2(span[:, 1], span[:, 0])
    lean = np.arccos(np.clip((radii[0] - radii[1]) / distance, -1.0, 1.0))
    return tuple(
        np.stack([centre + radius * _unit(along + side * lean) for centre, radius in zip(centres, radii, strict=True)], axis=1)
        for side in (1.0, -1.0)
    )


def _head(tip: np.ndarray, along: np.ndarray, size: float) -> np.ndarray:
    wings: list[Any] = [tip - 0.9 * size * _unit(along + side) for side in (0.45, -0.45)]
    return np.stack([wings[0], tip, wings[1]], axis=1)
