"""Read linkages of SolveSpace: sketches in files that end in .slvs.

Lines of fixed length are bars. Bars that constraints hold together are one body, or a part of the ground. A point that a
constraint keeps on a line slides in a guide.
"""

from __future__ import annotations

import cmath
import math
import re
from collections import defaultdict
from collections.abc import Hashable
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import (
    LINEAR_DENSITY,
    Block,
    Drawing,
    DrawnBar,
    Imported,
    mechanism_of_drawing,
    plain_name,
    uniform,
    with_printable_notes,
)
from scissordyn.exchange.rigid_set import Pair, RigidSets, Slide
from scissordyn.exchange.source import POINTS_MAX, listed
from scissordyn.exchange.xml_element import numbers
from scissordyn.model.coupling import Coupling, RelativeAngle
from scissordyn.model.mechanism import Mechanism
from scissordyn.tolerance import DATA_TOL
from scissordyn.units import checked

EXAMPLE = "scissordyn import linkage.slvs -o case.toml"  # Correct command, which error texts show

SKETCH, SKETCH_3D, ROTATED, TRANSLATED, LINKED = 5001, 5000, 5200, 5201, 5300  # Type numbers of groups in a SolveSpace file

# Type numbers of entities in a SolveSpace file; points: up to the first
POINT_MAX, WORKPLANE, LINE, CIRCLE, ARC = 2999, 10000, 11000, 13000, 14000

# Type numbers of SolveSpace constraints
COINCIDENT, DISTANCE, AT_MIDPOINT, RADIUS, ON_CIRCLE, ANGLE, FIXED_POINT = 20, 30, 70, 90, 100, 120, 200

# Type numbers of SolveSpace constraints that keep a point on a line
TO_PLANE, TO_LINE, ALONG, IN_PLANE, ON_LINE = 31, 32, 34, 41, 42
HORIZONTAL, VERTICAL, PARALLEL, PERPENDICULAR = 80, 81, 121, 122  # Type numbers of SolveSpace constraints of directions

# Type numbers of SolveSpace constraints of equal lengths, their ratio or difference, equal radii
EQUAL_SIZES = (50, 51, 56, 130)
IGNORED = (110, 1000)  # Type numbers of SolveSpace constraints without effect in a plane: equal orientation of parts, comments
REFERENCES = (1, 2, 3)  # Numbers of the SolveSpace requests that create the three coordinate planes

# Descriptions of SolveSpace constraints that the import does not support, by type number
REST = {33: "distance to a face", 43: "point on a face", 52: "equal lengths and distances", 53: "equal distances"}
REST |= {54: "equal angles", 55: "equal lengths of line and arc"}
REST |= dict.fromkeys((60, 61, 62, 63), "symmetric") | dict.fromkeys((123, 124, 125), "tangent")


@checked
def read_slvs(text: str, *, linear_density: float = LINEAR_DENSITY) -> Imported:
    """Return the mechanism of a SolveSpace sketch.

    Parameters
    ----------
    text : str
        Content of the file.
    linear_density : float
        Mass per length of the lines, which have no mass in the file [kg/m].

    Returns
    -------
    Imported
        Bars have the names of their first lines in SolveSpace, such as "r004". A line that only an angle holds to the ground
        is free to turn; the first one is the input.

    Raises
    ------
    InputError
        If the text is not such a file, or no bar in it moves.
    """
    if "SolveSpaceREVa" not in text[:40]:
        raise InputError("the text is not a file of SolveSpace", "a file that begins with SolveSpaceREVa", EXAMPLE)
    try:
        sketch = _Sketch(_records(text))
    except LookupError as error:
        number = error.args[0] if isinstance(error.args[0], int) else 0
        what = f"the file refers to {number:08x}, which is not in it"
        raise InputError(what, "a complete file", EXAMPLE) from None
    return with_printable_notes(sketch.mechanism(linear_density), sketch.notes)


def _records(text: str) -> dict[str, dict[int, dict[str, Any]]]:
    """Return groups, requests, entities and constraints by their numbers (handles)."""
    records: dict[str, dict[int, dict[str, Any]]] = {kind: {} for kind in ("Group", "Request", "Entity", "Constraint")}
    fields: dict[str, Any] = defaultdict(str, remap=[])
    for number, line in enumerate(text.splitlines(), start=1):
        key, equals, value = line.strip().partition("=")
        name = key.partition(".")[2]
        try:
            if equals and name.startswith("act"):
                fields[name] = numbers(value, 1, f"line {number}: {name}")[0]
            elif equals and name != "remap":
                fields[name] = int(value, 16) if name.endswith(".v") else int(value) if name == "type" else value
            elif row := re.fullmatch(r"(\d+) ([0-9a-f]{8}) (\d+)", key):
                fields["remap"].append((int(row[1]), int(row[2], 16), int(row[3])))
        except ValueError:
            raise InputError(f"line {number} of the file: '{line[:60]}'", "a number", EXAMPLE) from None
        if key.startswith("Add"):
            if key[3:] in records:
                fields.setdefault("type", 0)
                if not isinstance(fields["h.v"], int):
                    raise InputError(f"line {number} of the file ends a part without a number", "a complete file", EXAMPLE)
                records[key[3:]][fields["h.v"]] = fields
            fields = defaultdict(str, remap=[])
    if len(records["Entity"]) > POINTS_MAX:
        raise InputError(f"the file has {len(records['Entity'])} entities", f"at most {POINTS_MAX}", EXAMPLE)
    return records


class _Sketch:
    """Points, lines and constraints of a file in the plane of its first sketch."""

    def __init__(self, records: dict[str, dict[int, dict[str, Any]]]) -> None:
        self.groups, self.requests, self.entities = (records[kind] for kind in ("Group", "Request", "Entity"))
        constraints = {number: part for number, part in records["Constraint"].items() if part["reference"] != "1"}
        self.constraints = {number: part for number, part in constraints.items() if part["type"] not in IGNORED}
        self.notes = list[str]()
        plane = next((0x80000001 | number << 16 for number, group in self.groups.items() if group["type"] == SKETCH), 0)
        if plane not in self.entities:
            raise InputError("the file has no sketch in a workplane", "a linkage in a workplane", EXAMPLE)
        self.basis = _rotation(self.entities[plane])
        self.copies: dict[tuple[int, int], dict[int, int]] = defaultdict(dict)  # Copied entities by their originals
        active = self._active()
        self.space = {n: 1e-3 * self.basis @ _place(part) for n, part in self.entities.items() if part["type"] <= POINT_MAX}
        self.rigid = RigidSets({number: complex(x, y) for number, (x, y, _) in self.space.items()})
        self._join_points()
        kinds = {number: self.entities[number]["type"] for number in sorted(active)}
        lines = [number for number, kind in kinds.items() if kind == LINE]
        self.lines = {number: self._pair(number) for number in lines if self._is_in_plane(number)}
        self.lines = {number: pair for number, pair in self.lines.items() if len(pair) == 2}
        if tilted := [self.label(number) for number in lines if number not in self.lines]:
            self.notes.append(f"{listed(tilted)} left out: no length in the plane of the sketch")
        if curves := [number for number, kind in kinds.items() if kind > LINE and kind not in (CIRCLE, ARC)]:
            self.notes.append(f"{listed(map(self.label, curves))} left out: no line, circle or arc")
        self.inputs: list[Pair] = []
        self._add_constraints()

    def _active(self) -> set[int]:
        """Return the entities of sketches, links and copies of sketches; name the other groups."""
        active, left_out = set[int](), dict[str, None]()
        for number in self.entities:
            group = self.groups[number >> 16 & 0x7FFF if number >> 31 else self.requests[number >> 16]["group.v"]]
            if group["type"] in (SKETCH, SKETCH_3D, LINKED):
                active.add(number)
            elif group["type"] not in (ROTATED, TRANSLATED):
                left_out[group["name"]] = None
        for number, group in self.groups.items():
            for index, source, copy in group["remap"] if group["type"] in (ROTATED, TRANSLATED) else ():
                copied = 0x80000000 | number << 16 | index
                if source in active and copied in self.entities:
                    active.add(copied)
                    self.copies[number, copy][source] = copied
        if left_out:
            self.notes.append(f"groups {', '.join(left_out)} left out: no sketches, links or copies of sketches")
        return active

    def _is_in_plane(self, line: int) -> bool:
        start, end = (self.space[self.entities[line][f"point[{k}].v"]] for k in (0, 1))
        along = abs(complex(*(end - start)[:2]))
        return bool(along > 0.0 and abs(end[2] - start[2]) <= DATA_TOL * along)

    def _join_points(self) -> None:
        """Find the points that form one pin, and the pins of the ground."""
        for part in self.constraints.values():
            if part["type"] == COINCIDENT:
                self.rigid.pins.join(self._pin(part, "ptA.v"), self._pin(part, "ptB.v"))
        for number, group in self.groups.items():
            if group["predef.origin.v"] and 0x80000002 | number << 16 in self.space:
                self.rigid.pins.join(self._pin(group, "predef.origin.v"), 0x80000002 | number << 16)
        originals = {copy: source for copied in self.copies.values() for source, copy in copied.items()}
        linked = [0x8000 | number for number, group in self.groups.items() if group["type"] == LINKED]
        seen: dict[tuple[Any, ...], int] = {}
        for number, place in self.space.items():
            cell = tuple(np.round(place / (DATA_TOL * 1e-3)))
            if number in originals and np.ptp([place, self.space[originals[number]]], axis=0).max() <= DATA_TOL * 1e-3:
                self.rigid.pins.join(originals[number], number)  # a copy that is not moved
            elif number >> 16 in linked:
                self.rigid.pins.join(seen.setdefault((number >> 16, *cell), number), number)  # a pin of the linked file
        fixed = [number for number in self.space if number >> 16 in REFERENCES]
        fixed += [part["ptA.v"] for part in self.constraints.values() if part["type"] == FIXED_POINT]
        self.rigid.bodies[0] |= {self.rigid.pins.find(number) for number in fixed}

    def label(self, number: int) -> str:
        """Return the name of an entity: that of its request in SolveSpace, or its group and its number there."""
        if not number >> 31:
            return f"r{number >> 16:03x}"
        return f"{self.groups[number >> 16 & 0x7FFF]['name'] or 'group'} {number & 0xFFFF}"

    def _is_thin(self, number: int) -> bool:
        """Return True for a construction line."""
        return not number >> 31 and bool(self.requests[number >> 16]["construction"] == "1")

    def _pin(self, part: dict[str, Any], key: str) -> int:
        self.space[part[key]]  # raises KeyError for an unknown point
        pin: int = self.rigid.pins.find(part[key])
        return pin

    def _pair(self, line: int) -> Pair:
        return frozenset(self._pin(self.entities[line], f"point[{k}].v") for k in (0, 1))

    def _turn(self, number: int) -> Hashable:
        """Return the direction of a line as a member of the classes of directions; that of the ground for an axis."""
        return self._pair(number) if self.entities[number]["type"] == LINE else GROUND

    def _size(self, number: int) -> Hashable:
        """Return the length of a line or the radius of a circle as a member of the classes of lengths."""
        return self._pair(number) if self.entities[number]["type"] == LINE else ("radius", number)

    def _add_constraints(self) -> None:
        """Add what the constraints fix, and find the bodies; at last the angles that are not those of inputs."""
        rigid = self.rigid
        for number, part in self.entities.items():
            if part["type"] == ARC:
                for end in ("point[1].v", "point[2].v"):
                    rigid.lengths.join(("radius", number), frozenset((self._pin(part, "point[0].v"), self._pin(part, end))))
        for copied in self.copies.values():
            for source, copy in copied.items():
                if source in self.lines and copy in self.lines:
                    rigid.lengths.join(self.lines[source], self.lines[copy])
                    rigid.turns.join(self.lines[source], self.lines[copy])
                    rigid.relations.append((self.label(copy), self.lines[source], self.lines[copy]))
        rigid.images = [
            {rigid.pins.find(a): rigid.pins.find(b) for a, b in copied.items() if a in self.space}
            for copied in self.copies.values()
        ]
        for number, part in self.groups.items():
            if part["type"] == LINKED:
                rigid.bodies.append({self.rigid.pins.find(point) for point in self.space if point >> 16 == 0x8000 | number})
        for number, part in self.constraints.items():
            self._add(f"c{number:03x}", part)
        rigid.find_bodies(self.lines.values())
        for number, part in self.constraints.items():
            if part["type"] != ANGLE:
                continue
            turns = [self._turn(part[key]) for key in ("entityA.v", "entityB.v")]
            is_fixed = [rigid.turns.find(turn) == rigid.turns.find(GROUND) for turn in turns]
            free = part["entityA.v" if is_fixed[1] else "entityB.v"]
            bar = self._turn(free)
            moves = isinstance(bar, frozenset) and any(bar <= body for body in rigid.bodies[1:])
            if any(is_fixed) and not all(is_fixed) and moves and not self._is_thin(free):
                self.inputs.append(self._pair(free))
                self.notes.append(f"{self.label(free)} is free to turn: its angle c{number:03x} to the ground is the start")
            else:
                rigid.relate(f"c{number:03x} (angle)", *turns)
                rigid.find_bodies()

    def _add(self, label: str, part: dict[str, Any]) -> None:
        """Add the effect of a constraint on lengths, directions and slides."""
        rigid, kind = self.rigid, part["type"]
        ends = [self._pin(part, key) for key in ("ptA.v", "ptB.v") if part[key]]
        if kind == DISTANCE:
            rigid.lengths.join("fixed", frozenset(ends))
        elif kind == RADIUS:
            rigid.lengths.join("fixed", ("radius", part["entityA.v"]))
        elif kind == ON_CIRCLE:
            centre = self._pin(self.entities[part["entityA.v"]], "point[0].v")
            rigid.lengths.join(("radius", part["entityA.v"]), frozenset((centre, *ends)))
        elif kind in EQUAL_SIZES:
            rigid.lengths.join(self._size(part["entityA.v"]), self._size(part["entityB.v"]))
        elif kind == AT_MIDPOINT and ends and self.entities[part["entityA.v"]]["type"] == LINE:
            rigid.middles.append((f"{label} (midpoint)", ends[0], self._pair(part["entityA.v"])))
        elif kind in (HORIZONTAL, VERTICAL):
            rigid.relate(f"{label} (direction)", frozenset(ends) or self._pair(part["entityA.v"]), GROUND)
        elif kind in (PARALLEL, PERPENDICULAR):
            rigid.relate(f"{label} (direction)", self._turn(part["entityA.v"]), self._turn(part["entityB.v"]))
        elif kind in (ON_LINE, TO_LINE):
            pair = self._pair(part["entityA.v"])
            rigid.slides.append(Slide(ends[0], tuple(pair), pair, rigid.angle(pair), f"{label} (point on a line)"))
        elif kind in (TO_PLANE, IN_PLANE, ALONG):
            entity = self.entities[part["entityA.v"]]
            if entity["type"] == LINE:
                turn, across = self._turn(part["entityA.v"]), rigid.angle(self._pair(part["entityA.v"]))
            else:
                normal = self.entities[entity["normal.v"]] if entity["type"] == WORKPLANE else entity
                x, y, _ = self.basis @ _rotation(normal)[2]
                turn, across = GROUND, cmath.phase(complex(x, y))
                if math.hypot(x, y) < DATA_TOL:
                    return  # a distance along the normal of the sketch
            anchors = ends[1:] or sorted(rigid.bodies[0])[:1]
            for pin, anchor in ((ends[0], anchors[0]), (anchors[0], ends[0])):
                rigid.slides.append(Slide(pin, (anchor,), turn, across + math.pi / 2.0, f"{label} (distance)"))
        elif kind not in (COINCIDENT, ANGLE, FIXED_POINT):
            entities = [self.entities[part[f"entity{k}.v"]] for k in "ABCD" if part[f"entity{k}.v"]]
            ends += [self._pin(e, f"point[{k}].v") for e in entities for k in (0, 1) if e[f"point[{k}].v"]]
            rigid.rest.append((f"{label} ({REST.get(kind, 'unknown')})", {*ends}))

    def mechanism(self, density: float) -> Mechanism:
        """Return the mechanism of the bodies; `density` is the mass per length of the lines [kg/m]."""
        rigid, pins = self.rigid, self._pin_names()
        places = {name: (rigid.places[pin].real, rigid.places[pin].imag) for pin, name in pins.items()}
        names, bars = [GROUND], list[DrawnBar]()
        for body in rigid.bodies[1:]:
            inside = [number for number, pair in self.lines.items() if pair <= body]
            solid = [number for number in inside if not self._is_thin(number)] or inside
            group: dict[str, Any] = self.groups[solid[0] >> 16 & 0x7FFF] if solid and solid[0] >> 31 else {"type": 0}
            label = group["name"] if group["type"] == LINKED else self.label(solid[0]) if solid else "bar"
            names.append(plain_name(label, names))
            sides = dict.fromkeys(tuple(pins[pin] for pin in sorted(self.lines[number])) for number in solid)
            bar_pins = tuple(dict.fromkeys([*chain(*sides), *(pins[pin] for pin in sorted(body))]))
            bars.append(uniform(names[-1], bar_pins, places, density, [(a, b) for a, b in sides]))
        if not bars:
            expected = "a linkage; delete the dimension that holds its motion"
            raise InputError("no line of fixed length moves in the sketch", expected, EXAMPLE)
        blocks = self._blocks(pins, names, density)
        used = {pin for bar in bars for pin in bar.pins} | {block.pin for block in blocks}
        fixed = tuple(name for pin, name in pins.items() if pin in rigid.bodies[0] and name in used)
        drawing = Drawing(places, fixed, tuple(bars), tuple(blocks))
        self.notes += [
            *(f"{label} left out: the mechanism does not keep it" for label in dict.fromkeys(rigid.unused_constraints())),
            f"masses: none in the file; {density:g} kg/m along each line is assumed",
            "gravity: none in the file, so it is 0; set structure.gravity",
        ]
        mechanism = mechanism_of_drawing(drawing)
        if not (fixed or any(block.carrier == GROUND for block in blocks)):
            self.notes.append("nothing is grounded: join a point to the origin of the sketch, or fix it")
        driven = [names[k] for pair in self.inputs for k, body in enumerate(rigid.bodies) if k and pair <= body]
        couplings = tuple(
            Coupling(plain_name(f"coupling of {label}", ()), RelativeAngle(names[a]), RelativeAngle(names[b]), 1.0)
            for label, a, b in rigid.couplings()
        )
        return replace(mechanism, couplings=couplings, input_body=driven[0] if driven else mechanism.input_body)

    def _blocks(self, pins: dict[int, str], names: list[str], density: float) -> list[Block]:
        """Return a block for each pin that slides on a body or on the ground; name lines that are neither bars nor guides."""
        rigid, blocks, slides_by_body = self.rigid, list[Block](), self.rigid.slides_by_body()
        for (number, pin), (slide, *_) in slides_by_body.items():
            followers = [names[k] for k, body in enumerate(rigid.bodies) if k and pin in body]
            label = plain_name(f"slide of {pins[pin]}", (block.guide for block in blocks))
            if followers:
                blocks.append(Block("", pins[pin], slide.angle, carrier=names[number], follower=followers[0], guide=label))
            elif number and pin in rigid.bodies[0]:  # its pin is fixed, so that its mass has no effect
                blocks.append(
                    Block(f"block of {pins[pin]}", pins[pin], slide.angle, density * 1e-3, names[number], guide=label)
                )
        carrying = {slide.turn for slides in slides_by_body.values() for slide in slides}
        bars = {number: pair for number, pair in self.lines.items() if not self._is_thin(number) and pair not in carrying}
        loose = [number for number, pair in bars.items() if not any(pair <= body for body in rigid.bodies)]
        self.notes += [f"{listed(map(self.label, loose))} left out: no fixed length"] if loose else []
        return blocks

    def _pin_names(self) -> dict[int, str]:
        """Return the names of the pins, which are those of their first points."""
        names: dict[int, str] = {}
        for number in sorted(self.space, key=lambda number: (number >> 16 in REFERENCES or bool(number >> 31), number)):
            label = self.label(number) + ("" if number >> 31 else f" p{number & 0xFFFF}")
            label = "origin" if number >> 16 in REFERENCES else label
            pin = self.rigid.pins.find(number)
            if pin not in names:
                names[pin] = plain_name(label, names.values())
        return names


def _place(point: dict[str, Any]) -> np.ndarray:
    """Return the position of a point in space [mm]; the file leaves out zeros."""
    return np.array([point[f"actPoint.{axis}"] or 0.0 for axis in "xyz"])


def _rotation(normal: dict[str, Any]) -> np.ndarray:
    """Return the axes of the coordinate system of a normal, as rows, from its quaternion."""
    w, *vector = (normal[f"actNormal.{key}"] or 0.0 for key in ("w", "vx", "vy", "vz"))
    v, unit = np.array(vector), np.identity(3)
    return np.asarray((w * w - v @ v) * unit + 2.0 * np.outer(v, v) + 2.0 * w * np.cross(v, unit))
