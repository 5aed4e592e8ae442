"""Symbols of components, couplings and coordinate drives, as lines in the fixed frame for pictures and films.

Each component class declares its symbol; the component's port returns the strokes and their position.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scissordyn.components.cam import Cam
from scissordyn.components.edge_contact import EdgeContact
from scissordyn.components.place import GROUND
from scissordyn.components.port import AXIS
from scissordyn.components.port.stroke import Strokes, turned
from scissordyn.model.coupling import Coordinate, Coupling, Distance, RelativeAngle, Slide
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.style import SIZES
from scissordyn.record.placement import Placement
from scissordyn.record.results import Run, values_at

CIRCLE_ANGLES = np.linspace(0.0, 2.0 * math.pi, 97)  # Angles of the points of a drawn circle [rad]


@dataclass(frozen=True)
class Symbol:
    name: str
    kind: str  # The symbol
    strokes: Strokes  # (samples, points, 2) Lines in the fixed frame [m]
    anchor: np.ndarray  # (samples, 2) Position of the name [m]

    @property
    def bar(self) -> str:
        """Name of the bending bar that contains this element; "" if there is none."""
        bar, element, _ = self.name.rpartition("/beam")
        return bar if element and self.kind == "beam" else ""


@dataclass
class _Scene:
    """Picture data that ports request (`component.port.stroke.Scene`)."""

    run: Run
    mechanism: Mechanism
    placement: Placement
    samples: Any
    size: float
    symbols_at: dict[str, int] = field(default_factory=dict)

    def place(self, reference: tuple[str, Any]) -> np.ndarray:
        return self.placement.place(reference)

    def angle(self, body: str) -> np.ndarray:
        return self.placement.angle(body)

    def pivot(self, body: str, base: str) -> tuple[np.ndarray, float]:
        """Return the position of the joint between two bodies, and the factor by which the symbol there is enlarged.

        Without a joint the position is the mass centre of the first body.

        The second value scales the symbol so that symbols at one hinge do not coincide.
        """
        ring = 0.4  # increase of the radius of each further symbol at the same hinge, as a fraction of the first radius
        where, anchor = f"body {body}", None
        for joint in self.mechanism.joints:
            if {joint.journal[0], joint.bearing[0]} == {body, base}:
                where, anchor = f"joint {joint.name}", self.place(joint.bearing)
                break
        rank = self.symbols_at[where] = self.symbols_at.get(where, -1) + 1
        return self.placement.centre(body) if anchor is None else anchor, 1.0 + ring * rank

    def force(self, component: Any) -> np.ndarray:
        section = component.declaration.section
        force = values_at(self.run, f"{section}_force", "time", "axis", **{section: component.name})
        largest = float(np.max(np.linalg.norm(force, axis=-1))) or 1.0
        return self.placement.vectors(force[self.samples].reshape(-1, 2)) / largest


def cross_sections(mechanism: Mechanism) -> frozenset[str]:
    """Return the bodies that are cross-sections of bending bars; the beam elements are drawn instead of these bodies."""
    beams: list[Any] = [part for part in mechanism.components if part.declaration.symbol == "beam"]
    bent = [part for part in beams if part.mass_per_length > 0.0]
    sections = [part.sections if part.declaration.port is AXIS else (part.start[0], part.end[0]) for part in bent]
    return frozenset(name for names in sections for name in names)


def symbols(run: Run, mechanism: Mechanism, placement: Placement, samples: Any, size: float) -> list[Symbol]:
    scene = _Scene(run, mechanism, placement, samples, size)
    components: tuple[Any, ...] = (*mechanism.components, *mechanism.latches, *mechanism.rods)
    drawn: list[Symbol] = []
    for part in components:
        port, kind = part.declaration.port, part.declaration.symbol
        drawn.append(Symbol(part.name, kind, *port.drawn(part, port.symbols[kind], scene)))
    return drawn + coupling_symbols(mechanism, placement, size)


def coupling_symbols(mechanism: Mechanism, placement: Placement, size: float) -> list[Symbol]:
    drawn = [Symbol(part.name, "coupling", *coupling_strokes(part, placement, size)) for part in mechanism.couplings]
    return drawn + [
        Symbol(drive.name, "drive", *drive_strokes(drive.coordinate, placement, size)) for drive in mechanism.coordinate_drives
    ]


def coupling_strokes(part: Coupling, placement: Placement, size: float) -> tuple[Strokes, np.ndarray]:
    """Return the lines of a coupling and the position of its name: wheels at the pivots, and what connects them."""
    ends = [_anchor(coordinate, placement) for coordinate in (part.output, part.input)]
    middle = 0.5 * (ends[0] + ends[1])
    distance = float(np.max(np.linalg.norm(ends[1] - ends[0], axis=-1)))
    angles = [coordinate if isinstance(coordinate, RelativeAngle) else None for coordinate in (part.output, part.input)]
    if part.further:
        spans = [(coordinate.start, coordinate.end) for _, coordinate in part.terms if isinstance(coordinate, Distance)]
        lines = [np.stack([placement.place(start), placement.place(end)], axis=1) for start, end in spans]
        return tuple(lines) or (np.stack([_anchor(coordinate, placement) for _, coordinate in part.terms], axis=1),), middle
    if angles[0] and angles[1] and distance > 0.0:
        ratio, moving = part.ratio, GROUND not in (angles[0].base, angles[1].base)
        meshes = ratio < 0.0 or (moving and ratio != 1.0)
        first = (
            distance / abs(1.0 - ratio)
            if meshes
            else SIZES.wheel_radius * distance / max(1.0, abs(ratio)) / (1.0 + SIZES.wheel_radius)
        )
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
        return tuple(
            _wheel(angle, end, (1.0 + SIZES.wheel_radius * k) * size, placement) for k, (angle, end, _) in enumerate(wheels)
        ), middle
    return (np.stack(ends, axis=1),), middle


def drive_strokes(coordinate: Coordinate, placement: Placement, size: float) -> tuple[Strokes, np.ndarray]:
    """Return the lines of a driven coordinate and the position of its name: an arc, an arrow or a line between points."""
    anchor = _anchor(coordinate, placement)
    if isinstance(coordinate, RelativeAngle):
        turn = placement.angle(coordinate.body)[:, None] + np.linspace(0.3, 2.0, 17)
        arc = anchor[:, None] + 1.5 * size * _unit_vector(turn)
        return (arc, _arrow_head(arc[:, -1], turn[:, -1] + 0.5 * math.pi, size)), anchor
    if isinstance(coordinate, Slide):
        along = placement.angle(coordinate.base) + coordinate.direction
        tip = anchor + 3.0 * size * _unit_vector(along)
        return (np.stack([anchor, tip], axis=1), _arrow_head(tip, along, size)), anchor
    start, end = placement.place(coordinate.start), placement.place(coordinate.end)
    span = end - start
    barrel = start + 0.55 * span
    across = 0.5 * size * np.stack([-span[:, 1], span[:, 0]], axis=-1) / np.linalg.norm(span, axis=-1)[:, None]
    outline = np.stack([start + across, barrel + across, barrel - across, start - across, start + across], axis=1)
    return (outline, np.stack([barrel, end], axis=1)), 0.5 * (start + end)


def wheel_points(placement: Placement) -> np.ndarray:
    """Return points of coupling wheels, cams and edges, for the region of a picture, shape (points, 2) [m]."""
    strokes = [stroke for part in placement.mechanism.couplings for stroke in coupling_strokes(part, placement, 0.0)[0]]
    outlined: list[Any] = [part for part in placement.mechanism.components if isinstance(part, Cam | EdgeContact)]
    for part in outlined:
        strokes += turned(part.outline[:1], placement.place(part.start), placement.angle(part.start[0]), 1.0)
    return np.concatenate([np.empty((0, 2)), *(stroke.reshape(-1, 2) for stroke in strokes)])


def _anchor(coordinate: Coordinate, placement: Placement) -> np.ndarray:
    """Return the pivot of an angle, the point of a slide, or the middle of a distance, shape (samples, 2) [m]."""
    if isinstance(coordinate, RelativeAngle):
        bodies = coordinate.bodies if coordinate.body != GROUND else coordinate.bodies[::-1]
        joints = (joint for joint in placement.mechanism.joints if {joint.journal[0], joint.bearing[0]} == set(bodies))
        joint = next(joints, None)
        return placement.centre(bodies[0]) if joint is None else placement.place(joint.bearing)
    if isinstance(coordinate, Slide):
        return placement.place(coordinate.point)
    ends: np.ndarray = placement.place(coordinate.start) + placement.place(coordinate.end)
    return 0.5 * ends


def _unit_vector(angle: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _wheel(angle: RelativeAngle, centre: np.ndarray, radius: float, placement: Placement) -> np.ndarray:
    """Return a pitch circle with a radius line that turns with the body."""
    rim = centre[:, None] + radius * _unit_vector(placement.angle(angle.body)[:, None] + CIRCLE_ANGLES)
    return np.concatenate([centre[:, None], rim], axis=1)


def _belt(centres: list[np.ndarray], radii: tuple[float, float]) -> Strokes:
    """Return both outer tangents of two circles."""
    span = centres[1] - centres[0]
    distance = np.linalg.norm(span, axis=-1)
    along = np.arctan2(span[:, 1], span[:, 0])
    lean = np.arccos(np.clip((radii[0] - radii[1]) / distance, -1.0, 1.0))
    return tuple(
        np.stack(
            [centre + radius * _unit_vector(along + side * lean) for centre, radius in zip(centres, radii, strict=True)], axis=1
        )
        for side in (1.0, -1.0)
    )


def _arrow_head(tip: np.ndarray, along: np.ndarray, size: float) -> np.ndarray:
    wings: list[Any] = [tip - 0.9 * size * _unit_vector(along + side) for side in (0.45, -0.45)]
    return np.stack([wings[0], tip, wings[1]], axis=1)
