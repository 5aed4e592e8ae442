"""Parts of a mechanism in a case file: bodies, joints, guides, connections, ground points and components."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from scissordyn.casefile.code import AbsentPart, code_of
from scissordyn.casefile.quantity import NumbersText, exact_text, read_quantity, rounded_text
from scissordyn.casefile.table import (
    About,
    Call,
    Context,
    Hints,
    Reader,
    Shape,
    Table,
    add_place,
    dataclass_reader,
    keys_of,
    make_table,
    read_as,
    reader,
    table_of,
    table_reader,
    toml,
)
from scissordyn.casefile.time_function import time_function
from scissordyn.casefile.value import BODY_POINT
from scissordyn.components.catalogue import COMPONENTS, component_class
from scissordyn.components.declaration import Declaration
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.time_function import TimeFunction
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.addition import with_backlash, without_backlash
from scissordyn.model.body import Body, Track, bar
from scissordyn.model.coupling import (
    Belt,
    Coordinate,
    CoordinateDrive,
    Coupling,
    Distance,
    FurtherInput,
    RelativeAngle,
    Screw,
    Slide,
    Teeth,
)
from scissordyn.model.joint import Guide, Revolute, Weld
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import Quantity, quantities

# Correct coordinates of couplings and drives, which error texts show
COORDINATE_EXAMPLES = (
    '{ angle = "planet", base = "arm" }, { slide = "rack.tip", direction = "0 deg" } or { distance = ["a.end", "b.end"] }'
)


@reader(lambda: {"type": "array", "items": {"type": "string", "pattern": r"^.+\..+$"}, "minItems": 2, "maxItems": 2})
def _read_points(given: Any, context: Context) -> tuple[BodyPoint, BodyPoint]:
    if not isinstance(given, list) or len(given) != 2:
        raise InputError("not two points", "a list of two points", '["base.pin", "crank.end"]')
    first, second = (BODY_POINT.read(point, context) for point in given)
    return first, second


class CoordinateTable(Table):
    """Coordinate of a coupling or drive: an angle of a body, a displacement of a point, or a distance of two points."""

    angle: Annotated[str | None, About("body whose angle against the base is the coordinate")] = None
    slide: Annotated[BodyPoint | None, About("point whose displacement along the direction is the coordinate, in the base")] = (
        None
    )
    distance: Annotated[tuple[BodyPoint, BodyPoint] | None, _read_points, About("two points")] = None
    base: Annotated[str, About("a body, or the ground")] = GROUND
    direction: Annotated[float | None, quantities(Slide)["direction"]] = None
    exactly_one = ("angle", "slide", "distance")

    def check(self) -> None:
        self.coordinate()

    def coordinate(self) -> Coordinate:
        if sum(part is not None for part in (self.angle, self.slide, self.distance)) != 1:
            raise InputError("a coordinate without angle, slide or distance", COORDINATE_EXAMPLES)
        if self.slide is not None:
            return Slide(self.slide, self.direction or 0.0, self.base)
        if self.direction is not None or (self.distance is not None and self.base != GROUND):
            raise InputError("a key direction or base that this kind of coordinate does not have", COORDINATE_EXAMPLES)
        return RelativeAngle(self.angle, self.base) if self.angle is not None else Distance(*self.distance)  # type: ignore[misc]


def ratio_unit(output: Coordinate, input: Coordinate) -> str:
    return "1" if output.unit == input.unit else f"{output.unit}/{input.unit}"


@reader(lambda: {"type": ["number", "string"]})
def _read_ratio(given: Any, context: Context) -> float:
    unit = ratio_unit(context["values"]["output"], context["values"]["input"])
    sample = {"1": "-0.5", "m/rad": '"5 mm/turn"', "rad/m": '"0.2 turn/mm"'}[unit]
    return read_quantity(given, Quantity(unit, help="ratio"), sample.strip('"'))


@reader(lambda: {"type": "string"})
def _read_offset(given: Any, context: Context) -> float:
    return read_quantity(given, Quantity(context["values"]["output"].unit, help="offset"))


@reader(lambda: {"type": "array", "items": {"type": "object", "required": ["ratio"]}})
def _read_further(given: Any, context: Context) -> tuple[FurtherInput, ...]:
    if not isinstance(given, list):
        raise InputError("not a list of further inputs", "a list of coordinates with their ratios", toml(_FURTHER_EXAMPLE))
    parts, output = list[FurtherInput](), context["values"]["output"]
    for index, item in enumerate(given):
        with add_place(index, given=item):
            if not isinstance(item, Mapping) or "ratio" not in item:
                raise InputError("a further input without a ratio", "a coordinate with its ratio", toml(_FURTHER_EXAMPLE))
            coordinate = CoordinateTable.read(
                {key: value for key, value in item.items() if key != "ratio"}, context
            ).coordinate()
            ratio = _read_ratio.read(item["ratio"], {**context, "values": {"output": output, "input": coordinate}})
            parts.append(FurtherInput(coordinate, ratio))
    return tuple(parts)


# example of the further inputs of a coupling, as help shows it
_FURTHER_EXAMPLE = [{"distance": ["block.pulley", "ground.P"], "ratio": -1}]

# Reader of the motion of a coordinate, an angle or a distance over time
_READ_MOTION = Reader(
    lambda given, context: time_function(context["values"]["coordinate"].unit).read(given, context), lambda: {"type": "object"}
)


read_as(Coordinate, table_reader(lambda: CoordinateTable, CoordinateTable.coordinate))

# type and help text of a key that takes a coordinate
_COORDINATE_KEY = Annotated[Coordinate, About(f"a coordinate: {COORDINATE_EXAMPLES}")]

# Types and help texts of the keys of the table [[coupling]]
COUPLING_KEYS: Hints = (
    ("output", _COORDINATE_KEY),
    ("input", _COORDINATE_KEY),
    (
        "ratio",
        Annotated[
            float,
            _read_ratio,
            Quantity("1"),
            About('output divided by input, for example -0.5 or "5 mm/turn"; negative in opposite senses'),
        ],
    ),
    (
        "offset",
        Annotated[float | None, _read_offset, About("output for a zero input; by default that of the assembled mechanism")],
    ),
    ("further", Annotated[tuple[FurtherInput, ...], _read_further, About("further inputs, each a coordinate with its ratio")]),
    ("transmission", None),  # replaced by the keys `teeth`, `belt` and `screw`
)
TRANSMISSIONS: Mapping[str, type] = {"teeth": Teeth, "belt": Belt, "screw": Screw}
"""Class that describes where the force of a coupling acts, by key of the table [[coupling]]."""
BacklashTable = table_of(
    with_backlash, (("mechanism", None), ("coupling", None)), spelt={"backlash": "angle"}, backlash="0.5 deg"
)


@reader(lambda: {"anyOf": [NumbersText("rad", negative=False), BacklashTable]})
def _read_backlash(given: Any, context: Context) -> Call:
    return BacklashTable.read({"angle": given} if isinstance(given, str) else given, context)


# Unit, bound and help text of the backlash of a coupling
_BACKLASH_QUANTITY = Quantity(
    "rad", above=0.0, help='angle between both flanks, for example "0.5 deg", or a table with the law of their contacts'
)

# the key `backlash` of a coupling as a table, as help shows it
_BACKLASH_EXAMPLE = {"angle": "0.5 deg", "stiffness": 1e5, "restitution": 0.5}


class CouplingTable(
    table_of(  # type: ignore[misc]
        Coupling,
        COUPLING_KEYS,
        name="mesh",
        output={"angle": "wheel"},
        input={"angle": "crank"},
        ratio=-0.5,
        offset="5 deg",
        further=_FURTHER_EXAMPLE,
    )
):
    """Coupling: a linear relation of two coordinates."""

    teeth: Annotated[
        Teeth | None,
        dataclass_reader(Teeth, pressure_angle="20 deg"),
        About("gears or a rack whose force acts at the pitch point", examples=[{"pressure_angle": "20 deg"}]),
    ] = None
    belt: Annotated[
        Belt | None,
        dataclass_reader(Belt, radius="50 mm", pretension="100 N"),
        About("a belt or a chain whose spans pull at both pulleys", examples=[{"radius": "50 mm"}]),
    ] = None
    screw: Annotated[
        Screw | None,
        dataclass_reader(Screw, centre="bearing"),
        About("a screw whose thrust acts back on its bearing", examples=[{"centre": "bearing"}]),
    ] = None
    backlash: Annotated[Any, _read_backlash, _BACKLASH_QUANTITY, About(examples=[_BACKLASH_EXAMPLE])] = None

    def check(self) -> None:
        self.result()

    def result(self) -> Coupling:
        """Return the coupling with its teeth, belt or screw, if one of these keys is given."""
        transmissions = [name for name in TRANSMISSIONS if getattr(self, name) is not None]
        if len(transmissions) > 1:
            raise InputError(f"the keys {' and '.join(transmissions)} in one coupling", "one of these keys")
        coupling: Coupling = super().result()
        return dataclasses.replace(coupling, transmission=getattr(self, transmissions[0])) if transmissions else coupling


# Types and help texts of the keys of the table [[coordinate_drive]]
COORDINATE_DRIVE_KEYS: Hints = (
    ("coordinate", _COORDINATE_KEY),
    ("motion", Annotated[TimeFunction, _READ_MOTION, About("the angle, or the distance, over time")]),
)


def coupling_lines(mechanism: Mechanism) -> list[str]:
    """Return a line of text for each coupling, for the preview of a case."""
    lines, (bare, backlashes) = [], without_backlash(mechanism)
    for part in bare.couplings:
        unit, name = ratio_unit(part.output, part.input), part.name
        ratio = rounded_text(part.ratio, unit) if unit == "1" else exact_text((part.ratio,), unit)
        inputs = f"{ratio} x {coordinate_words(part.input)}"
        for more in part.further:
            unit = ratio_unit(part.output, more.coordinate)
            by = rounded_text(more.ratio, unit) if unit == "1" else exact_text((more.ratio,), unit)
            inputs += f" + {by} x {coordinate_words(more.coordinate)}"
        offset = f" + {rounded_text(part.offset, part.output.unit)}" if part.offset else ""
        sense = "as a sum" if part.further else "in opposite senses" if part.ratio < 0.0 else "in the same sense"
        text = f"Coupling {name}: {coordinate_words(part.output)} = {inputs}{offset}, {sense}"
        text += transmission_words(part)
        lines.append(
            f"{text}, backlash {rounded_text(backlashes[name]['backlash'], 'rad')}." if name in backlashes else f"{text}."
        )
    return lines


def transmission_words(part: Coupling) -> str:
    """Return a clause that describes the teeth, belt or screw of a coupling; "" for a coupling without these."""
    match part.transmission:
        case Teeth(pressure_angle=angle):
            return f", teeth with a pressure angle of {rounded_text(angle, 'rad')}"
        case Belt(radius=radius, pretension=pretension):
            kind = "an open" if part.ratio > 0.0 else "a crossed"
            return f", {kind} belt on a pitch radius of {rounded_text(radius, 'm')}, pretension {rounded_text(pretension, 'N')}"
        case Screw():
            return ", a screw"
        case _:
            return ""


def coordinate_words(coordinate: Coordinate) -> str:
    if isinstance(coordinate, Distance):
        return f"distance of {'.'.join(coordinate.start)} and {'.'.join(coordinate.end)}"
    against = "" if coordinate.base == GROUND else f" against {coordinate.base}"
    if isinstance(coordinate, Slide):
        return f"slide of {'.'.join(coordinate.point)} along {rounded_text(coordinate.direction, 'rad')}{against}"
    return f"angle of {coordinate.body}{against}"


# Unit and help text of the key `centre` of the table [[body]]
_CENTRE_QUANTITY = Quantity("m", help="mass centre in the body's frame; of a bar its middle")

# Help text of the key `length` of the table [[body]]
_LENGTH_HELP = 'length of a straight bar with points "start", "middle" and "end", uniform by default'

# Help text of the key `inertia` of the table [[body]]
_INERTIA_HELP = "moment of inertia about the mass centre; without inertia and length the body does not rotate"


def _body_keys() -> dict[str, tuple[Any, Any]]:
    """Return the keys of the table of a body, including those of a straight bar."""
    examples: dict[str, Any] = {"position": "0, 0 m", "angle": "30 deg", "velocity": "0, 0 m/s", "angular_velocity": "0 rpm"}
    examples["payloads"] = "12 kg"
    keys = keys_of(Body, (), name="crank", mass="1 kg", points={"tip": "0.2, 0.05 m"}, **examples)
    further = {
        "length": (Annotated[float | None, Quantity("m", above=0.0, help=_LENGTH_HELP), About(examples=["0.2 m"])], None),
        "inertia": (
            Annotated[float | None, Quantity("kg m^2", above=0.0, help=_INERTIA_HELP), About(examples=["0.01 kg m^2"])],
            None,
        ),
        "centre": (Annotated[Point | None, _CENTRE_QUANTITY, About(examples=["0.1, 0 m"])], None),
    }
    order = dict.fromkeys(("name", "mass", "length", "inertia", "points", "centre", *keys))
    return {key: (keys | further)[key] for key in order}


class _Body(Table):
    """A rigid body."""

    def body(self) -> Body:
        fields: dict[str, Any] = dict(vars(self))
        length, points, centre = fields.pop("length"), fields["points"], fields["centre"]
        if length is None:
            return Body(**fields | {"centre": centre or (0.0, 0.0)})
        straight = bar(fields["name"], length=length, mass=fields["mass"], inertia=fields["inertia"])
        twice = next((name for name in points if name in straight.points), None)
        if twice is not None:
            raise InputError(f"body '{straight.name}': point '{twice}' is already a point of the bar", "another name")
        straight_points = {**straight.points, **points}
        return Body(**fields | {"inertia": straight.inertia, "points": straight_points, "centre": centre or straight.centre})


BodyTable = make_table("BodyTable", _Body, _body_keys(), _Body.__doc__)


class GroundTable(Table):
    """A point of the fixed frame."""

    name: Annotated[str, About('name; joints refer to it as "ground.NAME"', examples=["O"])]
    position: Annotated[Point, Quantity("m", help="its position"), About(examples=["0, 0 m"])]

    def place(self) -> tuple[str, Point]:
        return self.name, self.position


@dataclass(frozen=True)
class Part:
    """Kind of part in a case file, such as [[joint]]: its table, its reader, and the field of `Mechanism` for its parts."""

    keys: Callable[[], type[Table]]  # creates the table class
    reader: Reader  # reader of one table, which returns the part
    fills: str  # field of `Mechanism` with the parts
    help: str  # one-line description

    @property
    def table(self) -> type[Table]:
        return self.keys()


def _part(kind: type, fills: str, help: str, hints: Hints = (), **examples: Any) -> Part:
    """Return a kind of part whose keys are the fields of a dataclass."""
    keys = cache(lambda: table_of(kind, hints, **examples))
    return Part(keys, table_reader(keys), fills, help)


# Field of `Mechanism` for component tables whose parts are not in its field `components`
_COMPONENT_FIELDS = {
    "rod": "rods",
    "latch": "latches",
}


@cache
def _component_part(kind: Any) -> Part:
    """Return the kind of part for a component class, from its declaration."""
    declaration: Declaration = kind.declaration
    first_line = (kind.__doc__ or "").strip().splitlines()[0]
    help = first_line[:1].lower() + first_line[1:].split(": ")[0].rstrip(".")
    fills = _COMPONENT_FIELDS.get(declaration.section, "components")
    return _part(kind, fills, help, name=declaration.section.replace("_", " "), **declaration.example)


class UserComponentTable(Table):
    """A component of any class, for example of a user's file; the further keys are the fields of the class."""

    type: Annotated[
        str,
        About(
            "a class, for example 'file.py:Class', or a component such as 'spring' if the order of several kinds matters",
            examples=["my_components.py:Rubber"],
        ),
    ]


def _any_component() -> Shape:
    """Return the schema of a [[component]] table: a component of the package, or a user-defined class with unknown keys."""
    named = {"type": {"type": "string", "pattern": r"\.py:"}}
    ours = [
        {"properties": {"type": {"const": section}}, "required": ["type"]}
        for section in COMPONENTS
        if section not in _COMPONENT_FIELDS
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
    """Return the kind of part for a [[component]] table with a given `type`; a file that `type` names is executed."""
    classes = {section: kind for section, kind in COMPONENTS.items() if section not in _COMPONENT_FIELDS}
    if ".py:" not in type and type not in classes:
        raise InputError(
            f"unknown component '{type}'{did_you_mean(type, classes)}",
            ", ".join(classes) + ", or a class in a file, such as my_components.py:Rubber",
        )
    return _component_part(classes[type] if type in classes else component_class(type, folder))


# Type hint that removes the key `clearance` of a joint or guide; the table [[clearance]] describes clearances
_NO_CLEARANCE: Hints = (("clearance", None),)

PARTS: Mapping[str, Part] = {
    "body": Part(lambda: BodyTable, table_reader(lambda: BodyTable, _Body.body), "bodies", "a rigid body"),
    "ground": Part(
        lambda: GroundTable, table_reader(lambda: GroundTable, GroundTable.place), "ground", "a point of the fixed frame"
    ),
    "joint": _part(
        Revolute,
        "joints",
        "a pin between two bodies",
        _NO_CLEARANCE,
        name="crank pin",
        journal="crank.end",
        bearing="rod.start",
    ),
    "guide": _part(
        Guide,
        "guides",
        "a straight line that keeps a point of a body on it",
        _NO_CLEARANCE,
        name="guide",
        follower="slider.centre",
        through="0, 0 m",
    ),
    "weld": _part(Weld, "welds", "a rigid connection of two bodies", name="weld", start="rod.end", end="tool.base"),
    "track": _part(Track, "tracks", "a point whose motion is recorded", name="tip", body="rod", point="end"),
    "coupling": Part(
        lambda: CouplingTable, CouplingTable.reader(), "couplings", "a linear relation of two angles, slides or distances"
    ),
    "coordinate_drive": _part(
        CoordinateDrive,
        "coordinate_drives",
        "a prescribed angle between bodies, slide or distance",
        COORDINATE_DRIVE_KEYS,
        name="elbow",
        coordinate={"angle": "rod", "base": "crank"},
        motion={"cycloidal": {"start": "0 deg", "end": "60 deg", "duration": "2 s"}},
    ),
    **{
        section: _component_part(kind)
        for section, kind in COMPONENTS.items()
        if section != "actuator"  # described by a [control] table
    },
    "component": Part(
        lambda: UserComponentTable, _read_user_component, "components", "a component of a class in the user's file"
    ),
}
"""Case file tables that describe one part of the mechanism each, by name."""

# names of the tables of the package's own components
COMPONENT_SECTIONS = tuple(section for section in PARTS if section in COMPONENTS)


def assemble(base: Mapping[str, Any], parts: Mapping[str, list[Any]]) -> Mechanism:
    """Build a mechanism from the fields of its structure and the parts of other tables."""
    fields = {"bodies": (), "ground": (), **base}
    for name, part in PARTS.items():
        there = (item for item in parts[name] if not isinstance(item, AbsentPart))
        fields[part.fills] = (*fields.get(part.fills, ()), *there)
    return Mechanism(**fields)
