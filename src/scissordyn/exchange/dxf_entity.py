"""Convert entities of a DXF to straight lines and points in the plane, in world coordinates.

Blocks are expanded. Hidden and unsupported entities are left out and reported.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from scissordyn.casefile.text import NESTING_MAX
from scissordyn.components.place import Point
from scissordyn.errors import InputError
from scissordyn.model.body import check_place

ENTITIES_MAX = 50_000  # Largest number of entities, before and after blocks are expanded; reading takes about 10 s and 130 MB


# Attributes, in order of trial, with the position by which notes name an entity
LOCATION_ATTRIBUTES = ("start", "center", "location", "insert")

UNSUPPORTED_REASON = "it is not a bar, pin or guide"  # Reason in notes about left-out entities

CURVE_FIT, SPLINE_FIT = 2, 4  # Flags of a POLYLINE whose vertices are not on the curve


class Shape(NamedTuple):
    """Polyline, given by its corners, or point or circle, given by its position."""

    places: tuple[Point, ...]  # Corners, or the position [m]
    closed: bool  # True for a closed polyline
    layer: str  # Layer name in lower case
    label: str  # Text with kind, handle and block of the entity
    heights: tuple[float, ...]  # z coordinates of `places` [m]


@dataclass
class Entities:
    """Collector of the shapes of a drawing, and of the labels of entities that are left out, by reason."""

    factor: float  # Unit of the drawing [m]
    layers: Any  # Table of layers of the DXF
    has_handles: bool  # True if entities have handles, which labels show
    shapes: list[Shape] = field(default_factory=list)
    left_out: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    notes: list[str] = field(default_factory=list)
    count: int = 0

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
        for one in insert.multi_insert() if insert.mcount > 1 else [insert]:
            placed = one.matrix44()
            self._visit(block, placed if matrix is None else placed * matrix, layer, hidden, (*blocks, name))

    def _add(self, entity: Any, kind: str, matrix: Any, layer: str, label: str) -> None:
        try:
            places, closed = _geometry(entity, kind)
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
        self.shapes.append(Shape(plane, closed, layer, label, tuple(z for *_, z in scaled)))

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
        described = self.layers.get(layer) if layer in self.layers else None
        if described is None:
            return ""
        if described.is_frozen():
            return f"layer '{layer}' is frozen"
        return f"layer '{layer}' is off" if described.is_off() else ""

    def _label(self, entity: Any, kind: str, blocks: tuple[str, ...]) -> str:
        """Return a text that identifies an entity in notes: its kind, handle or position, and block."""
        handle = str(_value(entity, "handle", "") or "") if self.has_handles else ""
        where = handle or next(
            (f"at ({p.x:g}, {p.y:g})" for name in LOCATION_ATTRIBUTES if (p := _value(entity, name, None)) is not None), ""
        )
        return " ".join(filter(None, (kind, where, f"of block '{blocks[-1]}'" if blocks else "")))


def _geometry(entity: Any, kind: str) -> tuple[list[Any], bool]:
    """Return the corners of an entity in world coordinates, and True if they form a closed line.

    A point, circle or ellipse has one corner, its centre. The list is empty for curves and unsupported kinds.
    """
    full_turn_tol = 1e-6  # an ellipse with a smaller opening counts as closed [rad]
    bulge_max = 1e-6  # a side with a smaller bulge counts as straight [side lengths]
    dxf = entity.dxf
    if kind == "LINE":
        return [dxf.start, dxf.end], False
    if kind == "POINT":
        return [dxf.location], False
    if kind == "CIRCLE":
        return [entity.ocs().to_wcs(dxf.center)], False
    if kind == "ELLIPSE":
        turn = abs(dxf.end_param - dxf.start_param)
        return ([dxf.center] if abs(turn - 2.0 * math.pi) < full_turn_tol else []), False
    if kind == "LWPOLYLINE":
        straight = all(abs(bulge) <= bulge_max for *_, bulge in entity.get_points("xyb"))
        return (list(entity.vertices_in_wcs()) if straight and len(entity) > 1 else []), bool(entity.closed)
    if kind == "POLYLINE" and (entity.is_2d_polyline or entity.is_3d_polyline):
        straight = all(abs(vertex.dxf.get("bulge", 0.0)) <= bulge_max for vertex in entity.vertices)
        straight &= not dxf.flags & (CURVE_FIT | SPLINE_FIT)
        return (list(entity.points_in_wcs()) if straight and len(entity.vertices) > 1 else []), bool(entity.is_closed)
    return [], False


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


def listed(labels: Iterable[str], most: int = 5) -> str:
    """Return a text with the first `most` labels and the number of further ones."""
    names = list(labels)
    further = len(names) - most
    return ", ".join(names[:most]) + (f" and {further} more" if further > 0 else "")


def notes_of(left_out: dict[str, list[str]]) -> Iterator[str]:
    """Yield a note for each reason and kind of left-out entities."""
    for reason, labels in sorted(left_out.items()):
        kinds: dict[str, list[str]] = defaultdict(list)
        for label in labels:
            kinds[label.split()[0]].append(label)
        for kind, same in sorted(kinds.items()):
            yield f"{len(same)} {kind} left out: {reason}: {listed(same)}"
