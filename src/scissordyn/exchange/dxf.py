"""Drawings in DXF: lines are bars, common ends are pins.

Layers say the rest: what is on ``ground`` is fixed, a line on ``guide`` is one that pins slide along, a bar on ``input`` is to
be driven. A point or a circle joins all bars through its place, so that it is the pivot of two bars that cross.
"""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

from scissordyn.components.place import Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.exchange.drawing import LINEAR_DENSITY, UNITS, Block, Drawing, DrawnBar, Imported, assembled, uniform
from scissordyn.lookup import library

MARKS = {"POINT": "location", "CIRCLE": "center"}  # Entities that are pins, and what their places are called

GROUND_LAYER, GUIDE_LAYER, INPUT_LAYER = "ground", "guide", "input"

TOLERANCE = 1e-6  # Ends nearer than this fraction of the drawing are one pin
NEAR = 1e-3  # Ends nearer than this fraction that are not one pin are named
NUMBERED = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 13: "um", 14: "dm"}  # Units of length by the number of $INSUNITS

SAMPLE = "scissordyn import linkage.dxf --unit mm -o case.toml"


def read_dxf(text: str, *, unit: str = "", linear_density: float = LINEAR_DENSITY, tolerance: float | None = None) -> Imported:
    """The mechanism of a drawing in DXF.

    Parameters
    ----------
    text : str
        Content of the file.
    unit : str
        Unit of length, for a drawing that names none: "mm", "cm", "m", "in" or "ft".
    linear_density : float
        Mass per length of its bars [kg/m].
    tolerance : float, optional
        Ends nearer than this are one pin [m]; a millionth of the drawing if not given.

    Returns
    -------
    Imported
        Bars and pins are numbered in the order of the drawing.

    Raises
    ------
    InputError
        If it is no DXF, has no lines, or no unit or another one than is given.
    """
    document = _document(text)
    factor = _unit(document, text, unit)
    notes: list[str] = []
    entities = list(_expanded(document.modelspace(), notes))
    read = [(_places(entity, factor), entity.dxf.layer.lower()) for entity in entities]
    bars, marks = ([part for part in read if (len(part[0]) > 1) is several and part[0]] for several in (True, False))
    guides = [corners for corners, layer in bars if layer == GUIDE_LAYER]
    fixed = [place for places, layer in (*bars, *marks) if layer == GROUND_LAYER for place in places]
    drawn = [(corners, layer) for corners, layer in bars if layer not in (GROUND_LAYER, GUIDE_LAYER)]
    unknown = Counter(entity.dxftype() for entity, (places, _) in zip(entities, read, strict=True) if not places)
    if not drawn:
        listed = ", ".join(f"{count} {kind}" for kind, count in sorted(unknown.items())) or "nothing"
        raise InputError(f"a DXF without lines that are bars; it has {listed}", "LINE or straight LWPOLYLINE, one for each bar")
    notes += [f"{count} {kind} left out: it is no bar, pin or guide" for kind, count in sorted(unknown.items())]
    drawing = _drawing(drawn, [place for (place,), _ in marks], fixed, guides, linear_density, tolerance, notes)
    notes += [
        f"masses: a DXF has none; {linear_density:g} kg/m along each bar is assumed",
        "drive: a DXF has none; add [drive], or driven(speed=...)",
        "gravity: a DXF has none, and it is 0; set structure.gravity",
    ]
    mechanism = assembled(drawing)
    driven = [name.name for name, (_, layer) in zip(drawing.bars, drawn, strict=True) if layer == INPUT_LAYER]
    return Imported(replace(mechanism, input_body=driven[0]) if driven else mechanism, tuple(notes))


def _document(text: str) -> Any:
    ezdxf = library("ezdxf", "exchange", "DXF")
    try:
        return ezdxf.read(io.StringIO(text))
    except (ezdxf.DXFError, OSError, ValueError, IndexError) as error:
        raise InputError(f"no DXF: {str(error) or 'it is cut off'}", "a drawing in DXF", SAMPLE) from None


def _unit(document: Any, text: str, unit: str) -> float:
    """Metres in the drawing's unit."""
    # a document of the library has units of its own where the file has none
    code = int(document.header.get("$INSUNITS", 0)) if "$INSUNITS" in text else 0
    named = NUMBERED.get(code, "")
    if unit and unit not in UNITS:
        raise InputError(f"unit '{unit}'{did_you_mean(unit, UNITS)} of a drawing", "one of " + ", ".join(UNITS), SAMPLE)
    if code and not named:
        raise InputError(f"$INSUNITS = {code} in the DXF", "one of " + ", ".join(UNITS), SAMPLE)
    if unit and named and unit != named:
        raise InputError(f"unit '{unit}', but the DXF says '{named}'", f"'{named}', or a DXF with another $INSUNITS")
    if not unit and not named:
        raise InputError("a DXF without a unit of length ($INSUNITS)", "one of " + ", ".join(UNITS), SAMPLE)
    return UNITS[unit or named]


def _expanded(entities: Iterable[Any], notes: list[str]) -> Iterator[Any]:
    """The entities with blocks in place of their inserts, nested ones too."""
    for entity in entities:
        if entity.dxftype() != "INSERT":
            yield entity
            continue
        for insert in entity.multi_insert() if entity.mcount > 1 else [entity]:
            skipped: list[str] = []
            parts = insert.virtual_entities(
                skipped_entity_callback=lambda part, reason, skipped=skipped: skipped.append(f"{part.dxftype()} ({reason})")
            )
            # what is on layer "0" of a block is on the layer of its insert
            for part in _expanded(parts, notes):
                if part.dxf.layer == "0":
                    part.dxf.layer = insert.dxf.layer
                yield part
            notes += [f"{what} of block '{insert.dxf.name}' left out" for what in skipped]


def _places(entity: Any, factor: float) -> list[Point]:
    """The corners of a bar, which has straight sides only, or the place of a mark; none of anything else."""
    kind, places = entity.dxftype(), []
    if kind == "LINE":
        places = [entity.dxf.start, entity.dxf.end]
    elif kind == "LWPOLYLINE" and len(entity) > 1 and not any(bulge for *_, bulge in entity.get_points("xyb")):
        places = entity.get_points("xy")
    elif kind in MARKS:
        places = [entity.dxf.get(MARKS[kind])]
    return [(factor * float(x), factor * float(y)) for x, y, *_ in places]


def _drawing(
    drawn: list[tuple[list[Point], str]],
    marks: list[Point],
    fixed: list[Point],
    guides: list[list[Point]],
    density: float,
    tolerance: float | None,
    notes: list[str],
) -> Drawing:
    """Pins where ends meet or marks are; bars with the pins on them."""
    ends = [corner for corners, _ in drawn for corner in corners]
    size = max(math.dist(a, b) for a in ends for b in ends)
    near = TOLERANCE * size if tolerance is None else tolerance
    pins: dict[str, Point] = {}
    for place in (*ends, *marks):
        if not any(math.dist(place, other) <= near for other in pins.values()):
            pins[f"pin {len(pins) + 1}"] = place
    bars = []
    for number, (corners, _) in enumerate(drawn, start=1):
        on = [_pin_at(corner, pins, near) for corner in corners]
        inside = [_pin_at(mark, pins, near) for mark in marks if _on_side(mark, corners, near)]
        bars.append(uniform(f"bar {number}", tuple(dict.fromkeys(on)), pins, density))
        bars[-1] = replace(bars[-1], pins=tuple(dict.fromkeys((*on, *inside))))
    grounded = [_pin_at(place, pins, near) for place in fixed]
    notes += [
        f"ground at ({x:g} m, {y:g} m) left out: no bar has an end or a point there"
        for (x, y), pin in zip(fixed, grounded, strict=True)
        if not pin
    ]
    if not any(grounded) and not guides:
        notes.append(f"nothing is grounded: draw a point or a circle at each fixed pin on the layer '{GROUND_LAYER}'")
    _name_near(pins, bars, near, NEAR * size, notes)
    unused = [pin for pin in pins if not any(pin in bar.pins for bar in bars)]
    notes += [f"point '{pin}' left out: no bar passes through it" for pin in unused]
    blocks = [block for guide in guides for block in _guided(guide, bars, pins, near, notes)]
    return Drawing(
        {pin: place for pin, place in pins.items() if pin not in unused},
        tuple(dict.fromkeys(filter(None, grounded))),
        tuple(bars),
        tuple(blocks),
    )


def _pin_at(place: Point, pins: dict[str, Point], near: float) -> str:
    return next((pin for pin, other in pins.items() if math.dist(place, other) <= near), "")


def _on_side(place: Point, corners: list[Point], near: float) -> bool:
    return any(_distance(place, a, b) <= near for a, b in pairwise(corners))


def _distance(place: Point, start: Point, end: Point) -> float:
    """From a place to a side."""
    ux, uy = end[0] - start[0], end[1] - start[1]
    part = ((place[0] - start[0]) * ux + (place[1] - start[1]) * uy) / max(ux * ux + uy * uy, 1e-300)
    part = min(1.0, max(0.0, part))
    return math.dist(place, (start[0] + part * ux, start[1] + part * uy))


def _name_near(pins: dict[str, Point], bars: Iterable[DrawnBar], near: float, wide: float, notes: list[str]) -> None:
    """Name ends that almost meet, and ends on the side of a bar that nothing joins to it."""
    names = list(pins)
    apart = [(a, b, math.dist(pins[a], pins[b])) for k, a in enumerate(names) for b in names[k + 1 :]]
    notes += [f"'{a}' and '{b}' are {gap:.3g} m apart and not joined" for a, b, gap in apart if gap <= wide]
    for bar in bars:
        corners = [pins[pin] for pin in bar.pins]
        for pin, place in pins.items():
            if pin not in bar.pins and _on_side(place, corners, near):
                notes.append(f"'{pin}' ends on '{bar.name}' and is not joined to it: draw a point there to join them")


def _guided(guide: list[Point], bars: list[DrawnBar], pins: dict[str, Point], near: float, notes: list[str]) -> list[Block]:
    """The pins on a guide line, each led by the first bar on it."""
    start, end = guide[0], guide[-1]
    guided = []
    for pin, place in pins.items():
        bar = next((bar.name for bar in bars if pin in bar.pins), "")
        if bar and _distance(place, start, end) <= near:
            guided.append(Block(pin, pin, math.atan2(end[1] - start[1], end[0] - start[0]), follower=bar))
    if not guided:
        notes.append(f"guide from ({start[0]:g} m, {start[1]:g} m) left out: no pin is on it")
    return guided
