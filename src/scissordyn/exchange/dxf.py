"""Read drawings in DXF: lines are bars, and common ends are pins; or closed outlines are bars, and their holes are pins.

Layers mark the other parts: entities on ``ground`` are fixed, a line on ``guide`` guides pins, and a bar on ``input`` is the
driven one. A point or circle joins all bars that pass through it, for example two crossing bars at their pivot.
"""

from __future__ import annotations

import io
import logging
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from scissordyn.components.place import Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.exchange.assembly import assembly_of, read_assembly
from scissordyn.exchange.drawing import (
    LINEAR_DENSITY,
    UNITS,
    Block,
    Drawing,
    DrawnBar,
    Imported,
    mechanism_of_drawing,
    plain_name,
    uniform,
    with_printable_notes,
)
from scissordyn.exchange.dxf_entity import ENTITIES_MAX, Entities, Shape, notes_of
from scissordyn.exchange.dxf_outline import find_parts, inside
from scissordyn.exchange.source import POINTS_MAX, listed
from scissordyn.lookup import library
from scissordyn.tolerance import DATA_TOL, REPORTED_FRACTION
from scissordyn.units import checked
from scissordyn.warning import LISTED_MAX

GROUND_LAYER, GUIDE_LAYER, INPUT_LAYER = "ground", "guide", "input"  # DXF layers of fixed pins, guides and the driven bar

# Length units of a DXF, by the integer in its header variable $INSUNITS
UNIT_CODES = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 13: "um", 14: "dm"}


# Pattern of the end of a complete DXF: group code 0, then EOF
EOF_PATTERN = re.compile(r"^[ \t]*0[ \t]*\r?\n[ \t]*EOF[\s\x1a]*\Z", re.MULTILINE)

EXAMPLE = "scissordyn import linkage.dxf --unit mm -o case.toml"  # Correct import command, which error texts show


@checked
def read_dxf(
    text: str,
    *,
    unit: str = "",
    linear_density: float = LINEAR_DENSITY,
    tolerance: float | None = None,
    thickness: float | None = None,
    density: float | None = None,
) -> Imported:
    """Return the mechanism of a drawing in DXF.

    Without `thickness` and `density` lines are bars. With both, closed outlines are bars and circles in them are pins.

    Parameters
    ----------
    text : str
        Content of the file.
    unit : str
        Length unit of a drawing without one: "mm", "cm", "m", "in" or "ft".
    linear_density : float
        Mass per length of the bars [kg/m].
    tolerance : float, optional
        Largest distance of ends or centres of holes that form one pin [m]; by default a millionth of the drawing's size.
    thickness, density : float, optional
        Thickness [m] and density [kg/m^3] of parts that are drawn by their outlines.

    Returns
    -------
    Imported
        Bars and pins are numbered in the order of the drawing.

    Raises
    ------
    InputError
        If the text is not a DXF, has no lines or outlines, has no unit, or has another unit than the given one.
    """
    if (thickness is None) != (density is None):
        missing = "density" if density is None else "thickness"
        raise InputError(f"outlines without a {missing}", "both", "--thickness '5 mm' --density '7850 kg/m^3'")
    area_density = None if thickness is None or density is None else thickness * density
    if area_density is not None and not area_density > 0.0:
        raise InputError(f"thickness = {thickness:g} m, density = {density:g} kg/m^3", "values above 0")
    notes: list[str] = []
    codes = [code.strip() for code in text.split("\n")[::2]]  # Codes and values are on alternate lines
    if codes.count("0") > ENTITIES_MAX:
        raise InputError(f"a DXF with more than {ENTITIES_MAX} entities", "a drawing with only the linkage", EXAMPLE)
    document = _document(text, notes)
    unit = _unit(document, text, unit)
    factor = UNITS[unit]
    if assembly := assembly_of(document):
        if area_density:
            notes.append("thickness and density are not used: the masses are those of the exported mechanism")
        return with_printable_notes(read_assembly(assembly, factor, notes), notes)
    entities = Entities(factor, document.layers, has_handles="5" in codes, curved=area_density is not None)
    entities.read(document.modelspace())
    linkage = _Linkage(entities, unit, tolerance, linear_density, area_density)
    notes += [*notes_of(entities.left_out), *entities.notes, *_other_layouts(document), *linkage.notes]
    notes += [
        f"masses: a DXF has none; {linear_density:g} kg/m along each bar is assumed"
        if area_density is None
        else f"masses: those of the outlines without their holes, of {area_density:g} kg/m^2",
        "drive: a DXF has none; add [drive], or driven(speed=...)",
        "gravity: a DXF has none, and it is 0; set structure.gravity",
    ]
    mechanism = mechanism_of_drawing(linkage.drawing)
    return with_printable_notes(replace(mechanism, input_body=linkage.driven[0]) if linkage.driven else mechanism, notes)


class _Messages(logging.Handler):
    """Logging handler that adds a note for each warning of ezdxf."""

    def __init__(self, notes: list[str]) -> None:
        super().__init__(logging.WARNING)
        self.notes = notes

    def emit(self, record: logging.LogRecord) -> None:
        if len(self.notes) < LISTED_MAX and (note := f"ezdxf: {record.getMessage()}") not in self.notes:
            self.notes.append(note)


def _document(text: str, notes: list[str]) -> Any:
    ezdxf = library("ezdxf", "exchange", "DXF")
    logger, messages = logging.getLogger("ezdxf"), _Messages(notes)
    propagates, logger.propagate = logger.propagate, False
    logger.addHandler(messages)
    try:
        document = ezdxf.read(io.StringIO(text, newline=None))  # line ends of all systems
    except (ezdxf.DXFError, ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        raise InputError(f"cannot read the DXF: {str(error) or 'it is cut off'}", "a drawing in DXF", EXAMPLE) from None
    finally:
        logger.removeHandler(messages)
        logger.propagate = propagates
    if not EOF_PATTERN.search(text):
        raise InputError("the DXF does not end with EOF: it is truncated", "the complete file", EXAMPLE)
    return document


def _unit(document: Any, text: str, unit: str) -> str:
    """Return the length unit of a drawing: that of the file, or `unit` if the file has none."""
    # ezdxf sets a default unit if the file has none
    code = int(document.header.get("$INSUNITS", 0)) if "$INSUNITS" in text else 0
    file_unit = UNIT_CODES.get(code, "")
    if unit and unit not in UNITS:
        raise InputError(
            f"unknown unit '{unit}'{did_you_mean(unit, UNITS)} of a drawing", "one of " + ", ".join(UNITS), EXAMPLE
        )
    if code and not file_unit:
        raise InputError(f"unknown unit $INSUNITS = {code} in the DXF", "one of " + ", ".join(UNITS), EXAMPLE)
    if unit and file_unit and unit != file_unit:
        raise InputError(f"unit '{unit}', but the DXF has '{file_unit}'", f"'{file_unit}', or a DXF with another $INSUNITS")
    if not unit and not file_unit:
        raise InputError("a DXF without a unit of length ($INSUNITS)", "one of " + ", ".join(UNITS), EXAMPLE)
    return unit or file_unit


def _other_layouts(document: Any) -> Iterator[str]:
    """Yield a note for each paper layout with entities, which are not read."""
    for layout in document.layouts:
        count = 0 if layout.is_modelspace else sum(entity.dxftype() != "VIEWPORT" for entity in layout)
        if count:
            yield f"layout '{layout.name}' left out ({count} entities): only the model space is read"


class _Pins:
    """Pins of a drawing with generated names; positions within a tolerance are one pin."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.places: dict[str, Point] = {}
        self._cells: dict[tuple[int, int], list[str]] = {}

    def add(self, place: Point) -> None:
        if not self.find(place):
            name = f"pin {len(self.places) + 1}"
            self.places[name] = place
            self._cells.setdefault(self._cell(place), []).append(name)

    def find(self, place: Point) -> str:
        """Return the name of the pin at a position; "" if there is none."""
        i, j = self._cell(place)
        for cell in ((i + k, j + m) for k in (-1, 0, 1) for m in (-1, 0, 1)):
            for name in self._cells.get(cell, ()):
                if math.dist(self.places[name], place) <= self.tolerance:
                    return name
        return ""

    def _cell(self, place: Point) -> tuple[int, int]:
        return math.floor(place[0] / self.tolerance), math.floor(place[1] / self.tolerance)


class _Bar(NamedTuple):
    """Bar of a drawing with the pins at its corners."""

    name: str
    shape: Shape
    corners: tuple[str, ...]  # Pins in drawing order; a closed outline repeats the first pin at the end
    sides: tuple[tuple[str, str], ...]  # Sides without overlaps, as pairs of pins

    @property
    def label(self) -> str:
        return f"'{self.name}' ({self.shape.label})"


class _Linkage:
    """Linkage in a drawing: recognise pins, bars and guides among the shapes of the drawing."""

    def __init__(
        self, entities: Entities, unit: str, tolerance: float | None, density: float, area_density: float | None = None
    ) -> None:
        self.unit, self.factor, self.density = unit, UNITS[unit], density
        self.notes: list[str] = []
        lines = [shape for shape in entities.shapes if len(shape.places) > 1]
        self.marks = [shape for shape in entities.shapes if len(shape.places) == 1]
        grounds = [shape for shape in entities.shapes if shape.layer == GROUND_LAYER]
        drawn = [shape for shape in lines if shape.layer not in (GROUND_LAYER, GUIDE_LAYER)]
        if not drawn:
            raise _no_bars(entities)
        if area_density is None and sum(len(shape.places) for shape in entities.shapes) > POINTS_MAX:
            raise InputError(
                f"a DXF with more than {POINTS_MAX} corners and points", "a drawing with only the linkage", EXAMPLE
            )
        x, y = np.array([corner for shape in drawn for corner in shape.places]).T
        self.size = math.hypot(np.ptp(x), np.ptp(y))
        if tolerance is not None and not tolerance > 0.0:
            raise InputError(f"tolerance = {tolerance:g} m", "a length above 0", "--tolerance '5 um'")
        self.tolerance = DATA_TOL * self.size if tolerance is None else tolerance
        if not self.tolerance > 0.0:
            raise InputError("the lines of the DXF have no length", "lines between two places", EXAMPLE)
        self._name_heights(entities.shapes)
        self.pins = _Pins(self.tolerance)
        if area_density is None:
            self.bars = self._bars(drawn)
            for mark in self.marks:
                self.pins.add(mark.places[0])
            self._keep_places()
            bars = self._joined()
        else:
            bars, grounds = self._outlined(entities.shapes, area_density)
        self.used = {pin for bar in bars for pin in bar.pins}
        fixed = self._fixed(grounds)
        self._name_unused()
        self._name_near()
        guides = [shape for shape in lines if shape.layer == GUIDE_LAYER]
        blocks = self._guided(guides, bars, fixed)
        if not fixed and not blocks:
            self.notes.append(f"nothing is grounded: draw a point or a circle at each fixed pin on the layer '{GROUND_LAYER}'")
        self.driven = [bar.name for bar in self.bars if bar.shape.layer == INPUT_LAYER]
        if len(self.driven) > 1:
            self.notes.append(f"{listed(self.driven)} on layer '{INPUT_LAYER}': only the first one is driven")
        self.drawing = Drawing(self.pins.places, fixed, bars, tuple(blocks))

    def _note(self, lines: Iterable[str]) -> None:
        """Add notes of one kind, at most `LISTED_MAX` of them."""
        lines = list(lines)
        self.notes += lines[:LISTED_MAX]
        if len(lines) > LISTED_MAX:
            self.notes.append(f"{len(lines) - LISTED_MAX} more notes of this kind")

    def _at(self, place: Point) -> str:
        return f"({place[0] / self.factor:g}, {place[1] / self.factor:g}) {self.unit}"

    def _length(self, length: float) -> str:
        return f"{length / self.factor:.3g} {self.unit}"

    def _name_heights(self, shapes: Iterable[Shape]) -> None:
        """Add a note about entities whose z coordinate differs from the median of all."""
        shapes = list(shapes)
        middle = float(np.median([z for shape in shapes for z in shape.heights]))
        heights = [(max(abs(z - middle) for z in shape.heights), shape.label) for shape in shapes]
        away = [label for height, label in heights if height > self.tolerance]
        if away:
            self.notes.append(
                f"z left out of {listed(away)}, up to {self._length(max(heights)[0])} above or below the others: the drawing "
                "is read as seen along z"
            )

    def _bars(self, drawn: list[Shape]) -> list[_Bar]:
        bars, short = list[_Bar](), list[str]()
        for shape in drawn:
            if max(math.dist(shape.places[0], place) for place in shape.places) <= self.tolerance:
                short.append(f"{shape.label} at {self._at(shape.places[0])}")
                continue
            for place in shape.places:
                self.pins.add(place)
            path = [self.pins.find(place) for place in (*shape.places, *shape.places[: shape.closed])]
            corners = tuple(pin for k, pin in enumerate(path) if k == 0 or pin != path[k - 1])
            bars.append(_Bar(f"bar {len(bars) + 1}", shape, corners, _sides(corners, self.pins.places, self.tolerance)))
        if short:
            self.notes.append(f"{listed(short)} left out: no length")
        if not bars:
            raise InputError("the lines of the DXF have no length", "lines between two places", EXAMPLE)
        return bars

    def _keep_places(self) -> None:
        self.names = list(self.pins.places)
        self.xy = np.array([self.pins.places[name] for name in self.names])

    def _outlined(self, shapes: list[Shape], area_density: float) -> tuple[tuple[DrawnBar, ...], list[Shape]]:
        """Return the parts that closed outlines draw, and what is on the ground layer: points, lines, holes of a frame."""
        outlines = find_parts([s for s in shapes if s.layer != GUIDE_LAYER], area_density, self.tolerance, self.notes)
        self.marks, bars, grounds = outlines.marks, list[DrawnBar](), list[Shape]()
        self.bars = []
        for mark in self.marks:
            self.pins.add(mark.places[0])
        self._keep_places()
        for shape, part, holes in outlines.parts:
            places = tuple((z.real, z.imag) for z, _ in (hole.round for hole in holes))
            pins = tuple(dict.fromkeys(map(self.pins.find, places)))
            if shape.layer == GROUND_LAYER:
                grounds.append(shape._replace(places=places))
            else:
                bars.append(replace(part, name=f"bar {len(bars) + 1}", pins=pins))
                self.bars.append(_Bar(bars[-1].name, shape, pins, ()))
        if not bars:
            raise InputError(
                "the DXF has no closed outline with a hole", "a closed outline with circles for each part", EXAMPLE
            )
        grounds += [shape for shape in (*outlines.marks, *outlines.lines) if shape.layer == GROUND_LAYER]
        self._note(
            f"{shape.label} from {self._at(shape.places[0])} to {self._at(shape.places[-1])} left out: it closes no outline"
            for shape in outlines.lines
            if shape.layer != GROUND_LAYER
        )
        return tuple(bars), grounds

    def _joined(self) -> tuple[DrawnBar, ...]:
        """Return the bars with the drawn points on them as pins; add notes about ends that touch a bar without a point."""
        marked = np.zeros(len(self.names), bool)
        index = {name: k for k, name in enumerate(self.names)}
        marked[[index[self.pins.find(mark.places[0])] for mark in self.marks]] = True
        drawn_bars, bars_by_corners = [], dict[frozenset[str], _Bar]()
        ends, twins = list[str](), list[str]()
        for bar in self.bars:
            touched = np.zeros(len(self.names), bool)
            for a, b in bar.sides:
                touched |= _distances(self.xy, self.xy[index[a]], self.xy[index[b]])[0] <= self.tolerance
            corners = dict.fromkeys(bar.corners)
            if bar.corners[0] == bar.corners[-1]:
                within = marked & inside(self.xy, self.xy[[index[pin] for pin in bar.corners]])
            else:
                within = np.zeros_like(marked)
            pins_on_bar = [self.names[k] for k in np.flatnonzero((touched & marked) | within)]
            pins = tuple(dict.fromkeys((*corners, *pins_on_bar)))
            drawn_bars.append(uniform(bar.name, pins, self.pins.places, self.density, bar.sides))
            ends += [
                f"{self._pin(k)} ends on {bar.label} and is not joined to it: draw a point there to join them"
                for k in np.flatnonzero(touched & ~marked).tolist()
                if self.names[k] not in corners
            ]
            twin = bars_by_corners.setdefault(frozenset(corners), bar)
            if twin is not bar:
                twins.append(f"{bar.label} has the corners of {twin.label}: both are kept, with their masses")
        self._note(ends)
        self._note(twins)
        return tuple(drawn_bars)

    def _pin(self, k: int) -> str:
        return f"'{self.names[k]}' at {self._at(self.pins.places[self.names[k]])}"

    def _fixed(self, shapes: list[Shape]) -> tuple[str, ...]:
        """Return the fixed pins; add notes about points and lines on the ground layer that fix nothing."""
        fixed, empty, passed = dict[str, None](), list[str](), list[str]()
        for shape in shapes:
            for place in shape.places:
                pin = self.pins.find(place)
                if pin in self.used:
                    fixed[pin] = None
                else:
                    empty.append(f"ground at {self._at(place)} left out ({shape.label}): no bar has an end or a point there")
        for shape in shapes:
            for start, end in pairwise(shape.places):
                distance, part = _distances(self.xy, np.array(start), np.array(end))
                for k in np.flatnonzero((distance <= self.tolerance) & (part > 0.0) & (part < 1.0)).tolist():
                    if self.names[k] in self.used and self.names[k] not in fixed:
                        passed.append(
                            f"{self._pin(k)} is on {shape.label} of layer '{GROUND_LAYER}' and is not fixed: draw a point "
                            "there on that layer to fix it"
                        )
        self._note(empty)
        self._note(passed)
        return tuple(fixed)

    def _name_unused(self) -> None:
        self._note(
            f"{mark.label} at {self._at(mark.places[0])} left out: no bar passes through it"
            for mark in self.marks
            if mark.layer != GROUND_LAYER and self.pins.find(mark.places[0]) not in self.used
        )

    def _name_near(self) -> None:
        """Add notes about pins that almost coincide but are not joined."""
        from scipy.spatial import cKDTree

        names = [name for name in self.names if name in self.used]
        if len(names) < 2:
            return
        xy = np.array([self.pins.places[name] for name in names])
        gaps, others = (columns[:, 1].tolist() for columns in map(np.asarray, cKDTree(xy).query(xy, k=2)))  # nearest pin
        pairs = {
            (min(k, other), max(k, other)): gaps[k]
            for k, other in enumerate(others)
            if gaps[k] <= REPORTED_FRACTION * self.size
        }
        self._note(
            f"'{names[a]}' and '{names[b]}' at {self._at(self.pins.places[names[a]])} are not joined: they are "
            f"{self._length(gap)} apart"
            for (a, b), gap in pairs.items()
        )

    def _guided(self, guides: list[Shape], bars: tuple[DrawnBar, ...], fixed: tuple[str, ...]) -> list[Block]:
        """Return a block for each pin on a guide line that is not fixed; the first bar on the pin follows the guide."""
        first = {pin: bar.name for bar in reversed(bars) for pin in bar.pins}
        blocks: dict[tuple[str, float], Block] = {}
        for shape in guides:
            start, end = _extremes(shape.places)
            where = f"guide {shape.label} at {self._at(shape.places[0])} left out"
            if math.dist(start, end) <= self.tolerance:
                self.notes.append(f"{where}: it has no length, so no direction")
                continue
            distance, _ = _distances(np.array(shape.places), np.array(start), np.array(end))
            if distance.max() > self.tolerance:
                self.notes.append(f"{where}: it bends, and a guide is straight")
                continue
            direction = math.atan2(end[1] - start[1], end[0] - start[0])
            is_on_guide = _distances(self.xy, np.array(start), np.array(end))[0] <= self.tolerance
            guided = [self.names[k] for k in np.flatnonzero(is_on_guide) if self.names[k] in first]
            if not guided:
                self.notes.append(f"{where}: no pin is on it")
            for pin in guided:
                directions = [other_direction for other_pin, other_direction in blocks if other_pin == pin]
                if pin in fixed or any(abs(math.sin(other - direction)) <= DATA_TOL for other in directions):
                    continue
                name = plain_name(pin, (block.name for block in blocks.values()))
                blocks[pin, direction] = Block(name, pin, direction, follower=first[pin])
        return list(blocks.values())


def _extremes(places: tuple[Point, ...]) -> tuple[Point, Point]:
    """Return the two outermost of some points on one line, in drawing order."""
    far = max(places, key=lambda place: math.dist(place, places[0]))
    other = max(places, key=lambda place: math.dist(place, far))
    return (other, far) if places.index(other) < places.index(far) else (far, other)


def _no_bars(entities: Entities) -> InputError:
    """Return the error for a drawing without bars."""
    kinds = Counter(label.split()[0] for labels in entities.left_out.values() for label in labels)
    kinds.update(shape.label.split()[0] for shape in entities.shapes)
    listed_kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
    return InputError(
        f"the DXF has no line that is a bar; it has {listed_kinds or 'nothing'}",
        "LINE or straight LWPOLYLINE, one for each bar"
        + ("; outlines of parts need --thickness and --density" if kinds.keys() & {"LWPOLYLINE", "ARC"} else ""),
    )


def _sides(corners: tuple[str, ...], places: dict[str, Point], tolerance: float) -> tuple[tuple[str, str], ...]:
    """Return the sides of a polyline without overlaps; each side is divided at the corners on it."""
    pins = list(dict.fromkeys(corners))
    if len(pins) == 2:
        return ((pins[0], pins[1]),)
    xy = np.array([places[pin] for pin in pins])
    sides: dict[frozenset[str], tuple[str, str]] = {}
    for a, b in pairwise(corners):
        distance, part = _distances(xy, np.array(places[a]), np.array(places[b]))
        on = np.flatnonzero(distance <= tolerance)
        path = [pins[k] for k in on[np.argsort(part[on], kind="stable")]]
        sides |= {frozenset(pair): pair for pair in pairwise(path)}
    return tuple(sides.values())


def _distances(xy: np.ndarray, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances of points from a side, and their nearest points on the side, as fractions of its length."""
    along = end - start
    part = np.clip((xy - start) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
    return np.hypot(*(xy - start - part[:, None] * along).T), part
