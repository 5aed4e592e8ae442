"""Parts of a mechanism in a case file: bodies, joints, guides, connections, ground points, springs, loads, motors, stops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.declaration import Declaration
from scissordyn.component.place import BodyPoint, Point
from scissordyn.component.time_function import TimeFunction
from scissordyn.component.user import component_class
from scissordyn.config.body_point import BODY_POINT
from scissordyn.config.code import AbsentPart, code_of
from scissordyn.config.control import CONTROLLER
from scissordyn.config.coupling import COORDINATE_DRIVE, CouplingTable
from scissordyn.config.quantity import read_numbers
from scissordyn.config.shape import About, Context, Reader, Shape, reader
from scissordyn.config.table import Hints, Table, filler, located, table_of, toml
from scissordyn.config.time_function import ANGLE, DISTANCE, TIME_FUNCTION, TORQUE
from scissordyn.config.unit_pattern import numbers_pattern
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.body import Body, bar
from scissordyn.model.connection import Weld
from scissordyn.model.coupling import CoordinateDrive
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.track import Track
from scissordyn.model.walk import declared
from scissordyn.units import Pairs, Quantity, quantities


def pair(unit: str) -> Reader:
    """For ``Annotated[Point, pair("m")]``: a key whose value is two numbers and their unit."""
    sample = f'"0.1, 0.2 {unit}"'

    @reader(lambda: {"type": "string", "pattern": numbers_pattern(unit, 2)})
    def read(given: Any, _: Context) -> Point:
        numbers = read_numbers(given, unit)
        if len(numbers) != 2:
            raise InputError(f"{len(numbers)} numbers", f"two numbers and their unit [{unit}]", sample)
        return numbers[0], numbers[1]

    return read


def _named_places() -> Shape:
    place = {"type": "string", "pattern": numbers_pattern("m", 2)}
    return {"type": "object", "additionalProperties": place, "propertyNames": {"pattern": "^[^.]+$"}}


@reader(_named_places)
def _read_points(given: Any, context: Context) -> dict[str, Point]:
    if not isinstance(given, Mapping):
        raise InputError("not a table of points", "a name and a place for each point", 'points = { tip = "0.1, 0.2 m" }')
    read, points = pair("m").read, dict[str, Point]()
    for name, place in given.items():
        with located(f"point '{name}'"):
            if "." in name and not code_of(context).recorded:
                raise InputError("a dot in the name", "names without a dot, which separates body and point")
            points[name] = read(place, context)
    return points


_BODY = quantities(Body)


class BodyTable(Table):
    """A rigid body."""

    name: Annotated[str, About("name, unique in the mechanism", examples=["crank"])]
    mass: Annotated[float, _BODY["mass"], About(examples=["1 kg"])]
    length: Annotated[
        float | None,
        Quantity("m", above=0.0, help='makes it a straight bar with points "start", "middle" and "end", uniform by default'),
        About(examples=["0.2 m"]),
    ] = None
    inertia: Annotated[
        float | None,
        Quantity("kg m^2", above=0.0, help="about the mass centre; without it and without length the body does not rotate"),
        About(examples=["0.01 kg m^2"]),
    ] = None
    points: Annotated[
        Mapping[str, Point],
        _read_points,
        About("points that joints refer to, in the body's frame", examples=[{"tip": "0.2, 0.05 m"}]),
    ] = MappingProxyType({})
    centre: Annotated[
        Point | None,
        pair("m"),
        About("mass centre in the body's frame; of a bar its middle", examples=["0.1, 0 m"]),
    ] = None
    position: Annotated[
        Point | None,
        pair("m"),
        About("of the origin of the body's frame at the start; it follows from the others", examples=["0, 0 m"]),
    ] = None
    angle: Annotated[float | None, _BODY["angle"], About(examples=["30 deg"])] = None
    velocity: Annotated[
        Point | None,
        pair("m/s"),
        About("of the origin at the start; it follows from those that are given", examples=["0, 0 m/s"]),
    ] = None
    angular_velocity: Annotated[float | None, _BODY["angular_velocity"], About(examples=["0 rpm"])] = None

    def body(self) -> Body:
        start: dict[str, Any] = {"position": self.position, "angle": self.angle}
        straight = None if self.length is None else bar(self.name, length=self.length, mass=self.mass, inertia=self.inertia)
        points = {**(straight.points if straight else {}), **self.points}
        if straight is not None and len(points) < len(straight.points) + len(self.points):
            twice = next(name for name in self.points if name in straight.points)
            raise InputError(f"body '{self.name}': point '{twice}', which a bar has already", "another name")
        return Body(
            name=self.name,
            mass=self.mass,
            inertia=straight.inertia if straight else self.inertia,
            points=points,
            centre=self.centre or (straight.centre if straight else (0.0, 0.0)),
            velocity=self.velocity,
            angular_velocity=self.angular_velocity,
            **start,
        )


class GroundTable(Table):
    """A point of the fixed frame."""

    name: Annotated[str, About('name; joints refer to it as "ground.NAME"', examples=["O"])]
    position: Annotated[Point, pair("m"), About("its position", examples=["0, 0 m"])]


@reader(lambda: BodyTable)
def _read_body(given: Any, context: Context) -> Body:
    return BodyTable.read(given, context).body()


@reader(lambda: GroundTable)
def _read_ground(given: Any, context: Context) -> tuple[str, Point]:
    table = GroundTable.read(given, context)
    return table.name, table.position


@dataclass(frozen=True)
class Part:
    """The table of a kind of part."""

    keys: Callable[[], type[Table]]  # Makes the table, see `table`
    reader: Reader  # Builds the part from the table
    fills: str  # Its field of `Mechanism`
    help: str  # What it is, in one line

    @property
    def table(self) -> type[Table]:
        return self.keys()


def _part(kind: type, fills: str, help: str, hints: Callable[[], Hints], **examples: Any) -> Part:
    """A part whose keys are the fields of its dataclass."""
    keys = cache(lambda: table_of(kind, hints(), **examples))
    return Part(keys, filler(kind, keys), fills, help)


_REFERENCE: Any = Annotated[BodyPoint, BODY_POINT, About('a point, as "BODY.POINT" or "ground.POINT"')]
_NAME: Hints = (("name", Annotated[str, About("name, unique among its kind")]),)
_ENDS: Hints = (*_NAME, ("start", _REFERENCE), ("end", _REFERENCE))
_BODIES: Hints = (
    *_NAME,
    ("body", Annotated[str, About("the body that it acts on")]),
    ("base", Annotated[str, About("the body that it acts against")]),
)
_FUNCTIONS: Mapping[str, Any] = {
    "time_function": Annotated[TimeFunction | None, TIME_FUNCTION, About("a factor over time, 1 without it")],
    "motion": Annotated[TimeFunction | None, DISTANCE, About("the distance over time, without a length")],
    "reference": Annotated[TimeFunction | None, ANGLE, About("the reference angle over time")],
    "feed_forward": Annotated[TimeFunction | None, TORQUE, About("a torque over time for the controller")],
}
"""Readers of fields that are time functions, by name."""


def _two_lists(pairs: Pairs) -> Shape:
    lists = {
        name: {"type": "string", "pattern": numbers_pattern(unit)} for name, unit in zip(pairs.names, pairs.units, strict=True)
    }
    return {"type": "object", "properties": lists, "required": list(pairs.names), "additionalProperties": False}


def _pairs_of(pairs: Pairs) -> Reader:
    """For ``Annotated[tuple[Point, ...], Pairs(...)]``: a key whose value is two lists of numbers."""
    sample = {name: f"0, 1 {unit}" for name, unit in zip(pairs.names, pairs.units, strict=True)}

    @reader(lambda: _two_lists(pairs))
    def read(given: Any, _: Context) -> tuple[Point, ...]:
        if not isinstance(given, Mapping) or sorted(given) != sorted(pairs.names):
            raise InputError("not a table of two lists", f"the keys {pairs.names[0]} and {pairs.names[1]}", toml(sample))
        first, second = (read_numbers(given[name], unit) for name, unit in zip(pairs.names, pairs.units, strict=True))
        if len(first) != len(second):
            raise InputError(f"{len(first)} {pairs.names[0]} and {len(second)} {pairs.names[1]}", "as many of both")
        return tuple(zip(first, second, strict=True))

    return read


@reader(lambda: {"type": "array", "items": {"type": "string"}})
def _read_names(given: Any, context: Context) -> tuple[str, ...]:
    if not isinstance(given, list | tuple) or not all(isinstance(name, str) for name in given):
        raise InputError("not a list of names", "names of bodies", '["crank", "crank/1"]')
    return tuple(given)


def _numbers(unit: str) -> Reader:
    """For a key whose value is some numbers with a unit."""

    @reader(lambda: {"type": "string", "pattern": numbers_pattern(unit)})
    def read(given: Any, _: Context) -> tuple[float, ...]:
        return read_numbers(given, unit)

    return read


def _component_hints(kind: type) -> Hints:
    """How the fields of a component class are read."""
    port = kind.declaration.port  # type: ignore[attr-defined]
    hints: dict[str, Any] = dict((*_NAME, *_BODIES[1:]) if port.turning else _NAME)
    hints.update((name, _REFERENCE) for name in port.points)
    for name, field in declared(kind).items():
        for extra in field.extras:
            if isinstance(extra, Pairs):
                hints[name] = Annotated[tuple[Point, ...], _pairs_of(extra), About(extra.help)]
            elif isinstance(extra, Quantity) and field.hint == Point:
                hints[name] = Annotated[Point, pair(extra.unit), About(extra.help)]
            elif isinstance(extra, Quantity) and field.hint == tuple[float, ...]:
                hints[name] = Annotated[tuple[float, ...], _numbers(extra.unit), About(extra.help)]
        if name in _FUNCTIONS:
            hints[name] = _FUNCTIONS[name]
        elif field.hint is Controller:
            hints[name] = Annotated[Controller, CONTROLLER, About("scissordyn controllers lists them")]
        elif field.hint == tuple[str, ...]:
            hints[name] = Annotated[tuple[str, ...], _read_names, About("names of bodies")]
        elif field.hint == BodyPoint | None:
            hints[name] = Annotated[BodyPoint | None, BODY_POINT, About('a point, as "BODY.POINT"')]
    return tuple((name, hints[name]) for name in declared(kind) if name in hints)


_LISTED = {"rod": "rods", "latch": "latches"}
"""Components that a mechanism has in lists of their own."""


@cache
def _component_part(kind: Any) -> Part:
    """The table of a component class, from its declaration."""
    declaration: Declaration = kind.declaration
    first_line = (kind.__doc__ or "").strip().splitlines()[0]
    help = first_line[:1].lower() + first_line[1:].split(": ")[0].rstrip(".")
    fills = _LISTED.get(declaration.section, "components")
    return _part(
        kind, fills, help, lambda: _component_hints(kind), name=declaration.section.replace("_", " "), **declaration.example
    )


class UserComponentTable(Table):
    """A component of a class in a file of the user's own, or any one; the further keys are the fields of the class."""

    type: Annotated[
        str,
        About(
            "the class, as 'file.py:Class', or any component as 'spring', where the order of several kinds counts",
            examples=["my_components.py:Rubber"],
        ),
    ]


def _any_component() -> Shape:
    """A component by its section, or one of a class of the user's own, whose keys are not known."""
    named = {"type": {"type": "string", "pattern": r"\.py:"}}
    ours = [
        {"properties": {"type": {"const": section}}, "required": ["type"]} for section in COMPONENTS if section not in _LISTED
    ]
    return {"type": "object", "anyOf": [*ours, {"properties": named, "required": ["type"]}]}


@reader(_any_component)
def _read_user_component(given: Any, context: Context) -> Any:
    keys = dict(given) if isinstance(given, Mapping) else {}
    table = UserComponentTable.read({"type": keys.pop("type")} if "type" in keys else keys, context)
    code = code_of(context)
    if not code.names(table.type):
        return component_part(table.type, Path()).reader.read(keys, context)
    kind = code.component(table.type, keys)
    return kind if isinstance(kind, AbsentPart) else _component_part(kind).reader.read(keys, context)


def component_part(type: str, folder: Path) -> Part:
    """What a table [[component]] is read by, from its `type`; a file that it names is executed."""
    classes = {section: kind for section, kind in COMPONENTS.items() if section not in _LISTED}
    if ".py:" not in type and type not in classes:
        raise InputError(
            f"unknown component '{type}'{did_you_mean(type, classes)}",
            ", ".join(classes) + ", or a class in a file as my_components.py:Rubber",
        )
    return _component_part(classes[type] if type in classes else component_class(type, folder))


_JOINT: Hints = (
    ("name", Annotated[str, About("name; [[clearance]] refers to it")]),
    ("journal", Annotated[BodyPoint, BODY_POINT, About("the point that carries the journal")]),
    ("bearing", Annotated[BodyPoint, BODY_POINT, About("the point that carries the bearing")]),
    ("clearance", None),
)
_GUIDE: Hints = (
    ("name", Annotated[str, About("name; [[guide_clearance]] refers to it")]),
    ("follower", Annotated[BodyPoint, BODY_POINT, About("the guided point")]),
    ("through", Annotated[Point, pair("m"), About("a point of the line")]),
    ("body", Annotated[str, About("the body that carries the line")]),
    ("aligned", Annotated[bool, About("whether the follower also keeps its angle against the line")]),
    ("clearance", None),
)


@reader(lambda: {"type": "string"})
def _read_place(given: Any, context: Context) -> str | Point:
    if isinstance(given, list) and len(given) == 1 and isinstance(given[0], str):  # a name with a comma
        return given[0]
    if not isinstance(given, str):
        raise InputError("not a point", 'the name of a point, or a place as "1.2, 0 m"', 'point = "end"')
    return given if "," not in given else pair("m").read(given, context)


_TRACK: Hints = (
    ("name", Annotated[str, About("name of the tracked point")]),
    ("body", Annotated[str, About("the body")]),
    ("point", Annotated[str | Point, _read_place, About('a point of the body, or a place in its frame as "1.2, 0 m"')]),
)

PARTS: Mapping[str, Part] = {
    "body": Part(lambda: BodyTable, _read_body, "bodies", "a rigid body"),
    "ground": Part(lambda: GroundTable, _read_ground, "ground", "a point of the fixed frame"),
    "joint": _part(
        Revolute,
        "joints",
        "a pin between two bodies",
        lambda: _JOINT,
        name="crank pin",
        journal="crank.end",
        bearing="rod.start",
    ),
    "guide": _part(
        Guide,
        "guides",
        "a straight line that keeps a point of a body on it",
        lambda: _GUIDE,
        name="guide",
        follower="slider.centre",
        through="0, 0 m",
    ),
    "weld": _part(
        Weld, "welds", "a rigid connection of two bodies", lambda: _ENDS, name="weld", start="rod.end", end="tool.base"
    ),
    "track": _part(Track, "tracks", "a point whose motion is recorded", lambda: _TRACK, name="tip", body="rod", point="end"),
    "coupling": Part(
        lambda: CouplingTable,
        CouplingTable.reader(),
        "couplings",
        "a linear relation of two angles, slides or distances",
    ),
    "coordinate_drive": _part(
        CoordinateDrive,
        "coordinate_drives",
        "a prescribed angle between bodies, slide or distance",
        lambda: COORDINATE_DRIVE,
        name="elbow",
        coordinate={"angle": "rod", "base": "crank"},
        motion={"cycloidal": {"start": "0 deg", "end": "60 deg", "duration": "2 s"}},
    ),
    **{
        section: _component_part(kind)
        for section, kind in COMPONENTS.items()
        if section != "actuator"  # a table [control] describes it
    },
    "component": Part(
        lambda: UserComponentTable,
        _read_user_component,
        "components",
        "a component of a class in a file of your own",
    ),
}
"""The further tables of a case file, apart from [structure], [drive], [[clearance]] and [run]."""

COMPONENT_SECTIONS = tuple(section for section in PARTS if section in COMPONENTS)
"""Tables of the package's own components."""


def assembled(base: Mapping[str, Any], parts: Mapping[str, list[Any]]) -> Mechanism:
    """A mechanism from its structure and the further parts of the file."""
    fields = {"bodies": (), "ground": (), **base}
    for name, part in PARTS.items():
        there = (item for item in parts[name] if not isinstance(item, AbsentPart))
        fields[part.fills] = (*fields.get(part.fills, ()), *there)
    return Mechanism(**fields)
