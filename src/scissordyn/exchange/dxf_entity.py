"""Convert entities of a DXF to straight lines and points in the plane, in world coordinates.

Blocks are expanded. Hidden and unsupported entities are left out and reported.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from scissordyn.casefile.text import NESTING_MAX
from scissordyn.components.place import Point
from scissordyn.errors import InputError
from scissordyn.exchange.source import listed
from scissordyn.model.body import check_place
from scissordyn.tolerance import DATA_TOL

# Largest number of entities in a DXF, also after blocks are expanded; reading them takes about 10 s and 130 MB
ENTITIES_MAX = 50_000


# Attributes of DXF entities that contain a position, in the order tried; notes about left-out entities print it
LOCATION_ATTRIBUTES = ("start", "center", "location", "insert")

UNSUPPORTED_REASON = "it is not a bar, pin or guide"  # Reason in notes about DXF entities that the import leaves out

CURVE_FIT, SPLINE_FIT = 2, 4  # Flags of a POLYLINE whose vertices are not on the curve


class Shape(NamedTuple):
    """Polyline, given by its corners, or point or circle, given by its position."""

    places: tuple[Point, ...]  # Corners, or the position [m]
    closed: bool  # True for a closed polyline
    layer: str  # Layer name in lower case
    label: str  # Text with kind, handle and block of the entity
    heights: tuple[float, ...]  # z coordinates of `places` [m]
    bulges: tuple[float, ...] = ()  # Tangents of a quarter of each side's arc angle; empty for a point
    insert: int = 0  # Number of the inserted block; 0 outside blocks


@dataclass
class Entities:
    """Collector of the shapes of a drawing, and of the labels of entities that are left out, by reason."""

    factor: float  # Unit of the drawing [m]
    layers: Any  # Table of layers of the DXF
    has_handles: bool  # True if entities have handles, which labels show
    curved: bool = False  # True if arcs, circles and other curves are read as lines
    shapes: list[Shape] = field(default_factory=list)
    left_out: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    notes: list[str] = field(default_factory=list)
    count: int = 0
    insert: int = 0  # Number of the block that is being read

    def read(self, space: Any) -> None:
        """Add the entities of a layout or a block."""
        self._visit(space, None, "0", "", ())

    def _visit(self, space: Iterable[Any], matrix: Any, layer_of_insert: str, hidden: str, blocks: tuple[str, ...]) -> None:
        """Add the entities of a layout or block, with the transformation `matrix`.

        `layer_of_insert` is the layer of entities on layer 0. `hidden` is the reason why the block is not shown, or "".
        `blocks` are the names of the blocks around the entities.
        """
        for entity in space:
            self._add_count(1)
            kind, own_layer = entity.dxftype(), str(_value(entity, "layer", "0"))
            if kind == "ATTDEF":  # attribute definition, which draws nothing itself
                continue
            layer = layer_of_insert if own_layer == "0" else own_layer
            label = self._label(entity, kind, blocks)
            reason = hidden or self._hidden(entity, layer)
            if kind == "INSERT":
                # an insert on a layer that is off hides only the entities on layer 0
                shown = "" if reason.endswith(" is off") else reason
                self._expand(entity, matrix, layer, shown, blocks, label)
            elif reason:
                self.left_out[reason].append(label)
            else:
                self._add(entity, kind, matrix, layer.lower(), label)

    def _expand(self, insert: Any, matrix: Any, layer: str, hidden: str, blocks: tuple[str, ...], label: str) -> None:
        """Add the entities of an inserted block at each of its positions."""
        name = str(insert.dxf.get("name", ""))
        block = insert.block()
        if block is None:
            raise InputError(f"{label} refers to block '{name}', which is not in the DXF", "a DXF with all its blocks")
        if name.lower() in [outer.lower() for outer in blocks]:
            raise InputError(f"block '{name}' of the DXF inserts itself", "blocks that do not contain themselves")
        if len(blocks) == NESTING_MAX:
            raise InputError(f"block '{name}' of the DXF is nested too deeply", f"at most {NESTING_MAX} levels")
        self._add_count(insert.mcount)
        if block.block.is_xref:
            self.left_out[f"block '{name}' is in another file"].append(label)
            return
        for attribute in insert.attribs:
            self.left_out[UNSUPPORTED_REASON].append(self._label(attribute, "ATTRIB", blocks))
        if _is_clipped(insert):
            self.notes.append(f"clipping (XCLIP) of {label} left out: the whole block '{name}' is read")
        outer = self.insert
        for number, copy in enumerate(insert.multi_insert() if insert.mcount > 1 else [insert]):
            placed = copy.matrix44()
            self.insert = self.count - number
            self._visit(block, placed if matrix is None else placed * matrix, layer, hidden, (*blocks, name))
        self.insert = outer

    def _add(self, entity: Any, kind: str, matrix: Any, layer: str, label: str) -> None:
        try:
            places, bulges, closed = _geometry(entity, kind, self.curved)
            if self.curved and any(bulges):
                if not all(abs(bulge) * DATA_TOL <= 1.0 for bulge in bulges):
                    raise ValueError("a bulge without bound")
                places, bulges = _arcs(entity, places, bulges, matrix, closed=closed)
            world = [place if matrix is None else matrix.transform(place) for place in places]
            scaled = [(self.factor * p.x, self.factor * p.y, self.factor * p.z) for p in world]
        except ZeroDivisionError:
            raise InputError(f"{label} of the DXF: its extrusion vector is zero", "0, 0, 1 or another vector") from None
        except (ArithmeticError, AttributeError, TypeError, ValueError) as error:
            raise InputError(f"{label} of the DXF has wrong coordinates: {error}", "numbers") from None
        for x, y, z in scaled:
            check_place(f"{label} of the DXF in m", (x, y))
            check_place(f"z of {label} of the DXF in m", (z, 0.0))
        if not scaled:
            curved = kind in ("LWPOLYLINE", "POLYLINE")
            self.left_out["it is curved, or has one corner" if curved else UNSUPPORTED_REASON].append(label)
            return
        plane = tuple((x, y) for x, y, _ in scaled)
        heights = tuple(z for *_, z in scaled)
        self.shapes.append(Shape(plane, closed, layer, label, heights, tuple(bulges), self.insert))

    def _add_count(self, number: int) -> None:
        self.count += number
        if self.count > ENTITIES_MAX:
            raise InputError(
                f"the DXF has more than {ENTITIES_MAX} entities after its blocks are expanded",
                "a drawing with only the linkage",
            )

    def _hidden(self, entity: Any, layer: str) -> str:
        """Return the reason why the drawing does not show an entity; "" for a visible entity."""
        if _value(entity, "invisible", 0):
            return "it is invisible"
        entry = self.layers.get(layer) if layer in self.layers else None
        if entry is None:
            return ""
        if entry.is_frozen():
            return f"layer '{layer}' is frozen"
        return f"layer '{layer}' is off" if entry.is_off() else ""

    def _label(self, entity: Any, kind: str, blocks: tuple[str, ...]) -> str:
        """Return a text that identifies an entity in notes: its kind, handle or position, and block."""
        handle = str(_value(entity, "handle", "") or "") if self.has_handles else ""
        where = handle or next(
            (f"at ({p.x:g}, {p.y:g})" for name in LOCATION_ATTRIBUTES if (p := _value(entity, name, None)) is not None), ""
        )
        return " ".join(filter(None, (kind, where, f"of block '{blocks[-1]}'" if blocks else "")))


def _geometry(entity: Any, kind: str, curved: bool) -> tuple[list[Any], list[float], bool]:
    """Return the corners of an entity in world coordinates, the bulges of its sides, and True if they form a closed line.

    A point has one corner, its position. Unless `curved` is true, a circle or ellipse has one corner too, its centre, and
    other curves have none. Unsupported kinds have no corners. Ellipses and splines become chords.
    """
    full_turn_tol = 1e-6  # an ellipse with a smaller opening counts as closed [rad]
    bulge_max = 1e-6  # a side with a smaller bulge counts as straight [side lengths]
    chord_gap = 1e-4  # largest distance of a chord from an ellipse or spline [sizes of the curve]
    dxf, corners, bulges, closed = entity.dxf, list[Any](), list[float](), False
    if kind == "LINE":
        corners = [dxf.start, dxf.end]
    elif kind == "POINT":
        return [dxf.location], [], False
    elif kind == "ELLIPSE" and not curved:
        turn = abs(dxf.end_param - dxf.start_param)
        return ([dxf.center] if abs(turn - 2.0 * math.pi) < full_turn_tol else []), [], False
    elif kind == "CIRCLE" and not curved:
        return [entity.ocs().to_wcs(dxf.center)], [], False
    elif kind in ("CIRCLE", "ARC") and curved:
        start = _value(entity, "start_angle", 0.0)
        turn = (_value(entity, "end_angle", 0.0) - start) % 360.0
        centre, across, up = entity.ocs().to_wcs(dxf.center), dxf.radius * entity.ocs().ux, dxf.radius * entity.ocs().uy
        angles = (math.radians(start), math.radians(start + turn))
        corners = [centre + math.cos(angle) * across + math.sin(angle) * up for angle in angles]
        bulges = [math.tan(math.radians(turn / 4.0))]
        if not turn:
            corners, bulges, closed = [centre - across, centre + across], [1.0, 1.0], True
    elif kind in ("ELLIPSE", "SPLINE") and curved:
        reference_points = (
            entity.construction_tool().control_points if kind == "SPLINE" else [dxf.center, dxf.center + dxf.major_axis]
        )
        size = max(reference_points[0].distance(place) for place in reference_points)
        corners = list(entity.flattening(chord_gap * size))
        closed = corners[0].distance(corners[-1]) <= DATA_TOL * size
        corners = corners[: len(corners) - closed]
    elif kind == "LWPOLYLINE":
        corners, closed = list(entity.vertices_in_wcs()), bool(entity.closed)
        bulges = [bulge for *_, bulge in entity.get_points("xyb")]
    elif kind == "POLYLINE" and (entity.is_2d_polyline or entity.is_3d_polyline) and not dxf.flags & (CURVE_FIT | SPLINE_FIT):
        corners, closed = list(entity.points_in_wcs()), bool(entity.is_closed)
        bulges = [vertex.dxf.get("bulge", 0.0) for vertex in entity.vertices]
    if len(corners) < 2 or not (curved or all(abs(bulge) <= bulge_max for bulge in bulges)):
        return [], [], closed
    sides = len(corners) - (not closed)
    return corners, (bulges or [0.0] * sides)[:sides], closed


def _arcs(entity: Any, corners: list[Any], bulges: list[float], matrix: Any, *, closed: bool) -> tuple[list[Any], list[float]]:
    """Return corners and bulges of an entity as seen after a transformation: mirrored arcs, or chords of stretched arcs."""
    ocs = entity.ocs()
    x, y = (complex(*(axis if matrix is None else matrix.transform_direction(axis)).vec2) for axis in (ocs.ux, ocs.uy))
    for sense in (1.0, -1.0):
        if abs(y - 1j * sense * x) <= DATA_TOL * abs(x):
            return corners, [sense * bulge for bulge in bulges]
    chords = list[Any]()
    for (start, end), bulge in zip(pairwise([*corners, corners[0]]), bulges, strict=False):
        parts = np.linspace(0.0, 1.0, 1 + math.ceil(720.0 / math.pi * math.atan(abs(bulge))) + (bulge == 0.0))  # of 1 deg
        z, _ = curve_points(np.array([0.0, 1.0]), np.array([bulge, 0.0]), parts[:-1])
        across = ocs.uz.cross(end - start)
        chords += [start + (end - start) * part.real + across * part.imag for part in z[0]]
    chords += [] if closed else [corners[-1]]
    return chords, [0.0] * (len(chords) - (not closed))


def curve_points(corners: np.ndarray, bulges: np.ndarray, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return complex positions at fractions `parts` of each side of a closed line, and their derivatives; a row a side."""
    half = 2.0 * np.arctan(bulges)[:, None]
    half = np.where(half == 0.0, np.finfo(float).eps ** 2, half)  # sin(x) = x there: the limit of a straight side
    side = (np.roll(corners, -1) - corners)[:, None] / np.sin(half)
    places = corners[:, None] + side * np.sin(half * parts) * np.exp(1j * half * (parts - 1.0))
    return places, side * half * np.exp(1j * half * (2.0 * parts - 1.0))


def _value(entity: Any, name: str, default: Any) -> Any:
    """Return an attribute of an entity, or `default` if entities of its kind do not have the attribute."""
    return entity.dxf.get(name, default) if entity.dxf.is_supported(name) else default


def _is_clipped(insert: Any) -> bool:
    """Return True if a clipping path hides a part of an inserted block."""
    if not insert.has_extension_dict:
        return False
    from ezdxf.xclip import XClip

    clip = XClip(insert)
    return bool(clip.has_clipping_path and clip.is_clipping_enabled)


def notes_of(left_out: dict[str, list[str]]) -> Iterator[str]:
    """Yield a note for each reason and kind of left-out entities."""
    for reason, labels in sorted(left_out.items()):
        kinds: dict[str, list[str]] = defaultdict(list)
        for label in labels:
            kinds[label.split()[0]].append(label)
        for kind, same in sorted(kinds.items()):
            yield f"{len(same)} {kind} left out: {reason}: {listed(same)}"
