"""Bars as outlines with holes, in DXF, and as a cut list."""

from __future__ import annotations

import io
import math
from typing import NamedTuple

from scissordyn.component.place import Point
from scissordyn.errors import InputError
from scissordyn.lookup import library
from scissordyn.model.body import Body
from scissordyn.model.clearance import Clearance
from scissordyn.model.mechanism import Mechanism

MARGIN = 2.0  # Distance of the outline from a hole's centre, in hole radii, unless a width is given


class Hole(NamedTuple):
    """A hole of a bar or the journal that sits in one."""

    joint: str
    place: Point
    radius: float
    journal: bool


def holes_of(mechanism: Mechanism, body: Body, pin_radius: float | None) -> list[Hole]:
    """The holes of a bar, one for each joint on it.

    A joint with clearance has a bore of the journal's radius plus the clearance; an ideal one has pin and bore of the radius
    that is given for it.
    """
    holes = []
    for joint in mechanism.joints:
        for (name, point), journal in ((joint.journal, True), (joint.bearing, False)):
            if name != body.name:
                continue
            gap = joint.clearance
            if isinstance(gap, Clearance):
                radius = gap.journal_radius if journal else gap.journal_radius + gap.clearance
            elif pin_radius is None:
                raise InputError(
                    f"the ideal joint '{joint.name}' has no size", "a radius for the pins of ideal joints", "--pin '5 mm'"
                )
            else:
                radius = pin_radius
            holes.append(Hole(joint.name, body.points[point], radius, journal))
    return holes


def drawing(mechanism: Mechanism, *, pin_radius: float | None = None, width: float | None = None) -> str:
    """A drawing in DXF, in millimetres: each bar on its own, with its holes at their sizes and its name."""
    ezdxf = library("ezdxf", "exchange", "DXF")
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 4
    for name, color in (("outline", 7), ("bore", 1), ("journal", 5), ("text", 8)):
        document.layers.add(name, color=color)
    space = document.modelspace()
    down = 0.0
    for body, holes in _bars(mechanism, pin_radius):
        radius = _edge(body, holes, width)
        corners = _outline(body, radius)
        low, high = min(y for _, y in corners), max(y for _, y in corners)
        down -= 1e3 * (high + 2.0 * radius)
        _draw_outline(space, corners, radius, down)
        for hole in holes:
            layer = "journal" if hole.journal else "bore"
            space.add_circle((1e3 * hole.place[0], down + 1e3 * hole.place[1]), 1e3 * hole.radius, dxfattribs={"layer": layer})
        left = 1e3 * (min(x for x, _ in corners) + 1.5 * radius)
        label = space.add_text(body.name, height=1e3 * 0.5 * radius, dxfattribs={"layer": "text"})
        label.set_placement((left, down + 1e3 * (high + 1.15 * radius)))
        down -= 1e3 * (radius - low)
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _bars(mechanism: Mechanism, pin_radius: float | None) -> list[tuple[Body, list[Hole]]]:
    bodies = [(body, holes_of(mechanism, body, pin_radius)) for body in mechanism.bodies]
    bars = [(body, holes) for body, holes in bodies if holes and len(set(body.points.values())) > 1]
    if not bars:
        raise InputError("no bar with a joint in the mechanism", "bars", "scissordyn new scissor")
    return bars


def _edge(body: Body, holes: list[Hole], width: float | None) -> float:
    largest = max(hole.radius for hole in holes)
    if width is None:
        return MARGIN * largest
    if not 0.5 * width > largest:
        raise InputError(f"bar '{body.name}' {1e3 * width:g} mm wide with a hole of {2e3 * largest:g} mm", "a wider bar")
    return 0.5 * width


def _outline(body: Body, radius: float) -> list[Point]:
    """The convex hull of the points of a bar, anticlockwise (Andrew's monotone chain)."""
    places = sorted(set(body.points.values()))

    def half(points: list[Point]) -> list[Point]:
        chain: list[Point] = []
        for point in points:
            while len(chain) > 1 and _left(chain[-2], chain[-1], point) <= 1e-12 * radius**2:
                chain.pop()
            chain.append(point)
        return chain[:-1]

    return half(places) + half(places[::-1])


def _left(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _draw_outline(space: object, corners: list[Point], radius: float, down: float) -> None:
    """A closed polyline around the hull at a distance, round at its corners."""
    points = []
    count = len(corners)
    for k, corner in enumerate(corners):
        before, after = corners[k - 1], corners[(k + 1) % count]
        first, last = _normal(before, corner), _normal(corner, after)
        turn = math.atan2(first[0] * last[1] - first[1] * last[0], first[0] * last[0] + first[1] * last[1]) % (2.0 * math.pi)
        for normal, bulge in ((first, math.tan(0.25 * turn)), (last, 0.0)):
            x, y = corner[0] + radius * normal[0], corner[1] + radius * normal[1]
            points.append((1e3 * x, down + 1e3 * y, bulge))
    space.add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": "outline"})  # type: ignore[attr-defined]


def _normal(a: Point, b: Point) -> Point:
    """Outwards from a side of an anticlockwise outline."""
    length = math.dist(a, b)
    return (b[1] - a[1]) / length, (a[0] - b[0]) / length


def cut_list(mechanism: Mechanism, *, pin_radius: float | None = None) -> bytes:
    """One row for each hole or pin of a bar, bars with equal holes together."""
    groups: dict[tuple[object, ...], list[tuple[Body, list[Hole]]]] = {}
    for body, holes in _bars(mechanism, pin_radius):
        key = tuple(sorted((round(h.place[0], 9), round(h.place[1], 9), round(h.radius, 9), h.journal) for h in holes))
        groups.setdefault((key, _length(body), round(body.mass, 9)), []).append((body, holes))
    rows = ["bar,count,names,length [mm],mass [kg],x [mm],y [mm],diameter [mm],kind,joint"]
    for number, same in enumerate(groups.values(), start=1):
        body, holes = same[0]
        names = " | ".join(part.name for part, _ in same)
        for hole in sorted(holes, key=lambda hole: hole.place):
            cells = [number, len(same), f'"{names}"', f"{1e3 * _length(body):.6g}", f"{body.mass:.6g}"]
            cells += [f"{1e3 * x:.6g}" for x in hole.place]
            cells += [f"{2e3 * hole.radius:.6g}", "pin" if hole.journal else "bore", f'"{hole.joint}"']
            rows.append(",".join(map(str, cells)))
    return ("\n".join(rows) + "\n").encode()


def _length(body: Body) -> float:
    """Between its outermost points [m]."""
    return round(max(math.dist(a, b) for a in body.points.values() for b in body.points.values()), 9)
