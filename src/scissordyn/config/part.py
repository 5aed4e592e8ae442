"""Parts of a mechanism in a case file: bodies, joints, guides, connections, ground points, springs, loads, motors, stops."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, PlainValidator, ValidationInfo

from scissordyn.config.quantity import read_numbers
from scissordyn.config.table import Hints, Table, described, located, table_of
from scissordyn.config.time_function import DISTANCE, REACH, TIME_FUNCTION
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.body import GROUND, Body, Point, bar
from scissordyn.model.connection import Latch, Rod, Weld
from scissordyn.model.drive import TimeFunction
from scissordyn.model.element import AngleStop, Force, Motor, Spring, Torque, TorsionSpring, TravelStop
from scissordyn.model.joint import BodyPoint, Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import Quantity, quantities

__all__ = ["ELEMENTS", "PARTS", "BodyTable", "Part", "assembled", "pair"]


def pair(unit: str) -> PlainValidator:
    """For ``Annotated[Point, pair("m")]``: a key whose value is two numbers and their unit."""
    sample = f'"0.1, 0.2 {unit}"'

    def read(given: Any) -> Point:
        numbers = read_numbers(given, unit)
        if len(numbers) != 2:
            raise InputError(f"{len(numbers)} numbers", f"two numbers and their unit [{unit}]", sample)
        return numbers[0], numbers[1]

    return PlainValidator(read)


def _read_points(given: Any) -> dict[str, Point]:
    if not isinstance(given, Mapping):
        raise InputError("not a table of points", "a name and a place for each point", 'points = { tip = "0.1, 0.2 m" }')
    read, points = pair("m").func, dict[str, Point]()
    for name, place in given.items():
        with located(f"point '{name}'"):
            if "." in name:
                raise InputError("a dot in the name", "names without a dot, which separates body and point")
            points[name] = read(place)  # type: ignore[call-arg]
    return points


def _read_body_point(given: Any) -> BodyPoint:
    body, dot, point = given.rpartition(".") if isinstance(given, str) else ("", "", "")
    if not (dot and body and point):
        raise InputError("not a point of a body", 'text "BODY.POINT", where the body may be ground', '"crank.end"')
    return body, point


BODY_POINT = PlainValidator(_read_body_point)
"""For ``Annotated[BodyPoint, BODY_POINT]``: a key whose value is "body.point"."""

_BODY = quantities(Body)


class BodyTable(Table):
    """A rigid body."""

    name: Annotated[str, Field(description="name, unique in the mechanism", examples=["crank"])]
    mass: Annotated[float, _BODY["mass"], Field(examples=["1 kg"])]
    length: Annotated[
        float | None,
        Quantity("m", above=0.0, help='makes it a straight bar with points "start", "middle" and "end", uniform by default'),
        Field(examples=["0.2 m"]),
    ] = None
    inertia: Annotated[
        float | None,
        Quantity("kg m^2", above=0.0, help="about the mass centre; without it and without length the body does not rotate"),
        Field(examples=["0.01 kg m^2"]),
    ] = None
    points: Annotated[
        Mapping[str, Point],
        PlainValidator(_read_points),
        Field(description="points that joints refer to, in the body's frame", examples=[{"tip": "0.2, 0.05 m"}]),
    ] = Field(default_factory=dict)
    centre: Annotated[
        Point | None,
        pair("m"),
        Field(description="mass centre in the body's frame; of a bar its middle", examples=["0.1, 0 m"]),
    ] = None
    position: Annotated[
        Point, pair("m"), Field(description="position of the origin of the body's frame at the start", examples=["0, 0 m"])
    ] = (0.0, 0.0)
    angle: Annotated[float, _BODY["angle"], Field(examples=["30 deg"])] = 0.0
    velocity: Annotated[
        Point, pair("m/s"), Field(description="of the origin at the start, where it is not prescribed", examples=["0, 0 m/s"])
    ] = (0.0, 0.0)
    angular_velocity: Annotated[float, _BODY["angular_velocity"], Field(examples=["0 rpm"])] = 0.0

    def body(self) -> Body:
        """The body that the table describes."""
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

    name: Annotated[str, Field(description='name; joints refer to it as "ground.NAME"', examples=["O"])]
    position: Annotated[Point, pair("m"), Field(description="its position", examples=["0, 0 m"])]


def _read_body(given: Any, info: ValidationInfo) -> Body:
    return BodyTable.model_validate(given, context=info.context).body()


def _read_ground(given: Any, info: ValidationInfo) -> tuple[str, Point]:
    table = GroundTable.model_validate(given, context=info.context)
    return table.name, table.position


@dataclass(frozen=True)
class Part:
    """The table of a kind of part.

    Parameters
    ----------
    table : subclass of Table
        Its keys.
    reader : PlainValidator
        Builds the part from the table.
    fills : str
        Its field of `Mechanism`.
    help : str
        What it is, in one line.
    references : tuple of str
        Keys that name a point of a body.
    bodies : tuple of str
        Keys that name a body.
    """

    table: type[Table]
    reader: PlainValidator
    fills: str
    help: str
    references: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()


def _part(kind: type, fills: str, help: str, hints: Hints = (), **examples: Any) -> Part:
    """A part whose keys are the fields of its dataclass."""
    named = tuple(name for name, hint in hints if hint is _REFERENCE)
    table = table_of(kind, hints, **examples)
    bodies = tuple(name for name in ("body", "base") if name in table.model_fields)
    return Part(table, described(kind, hints, **examples), fills, help, named, bodies)


_REFERENCE: Any = Annotated[BodyPoint, BODY_POINT, Field(description='a point, as "BODY.POINT" or "ground.POINT"')]
_NAME: Hints = (("name", Annotated[str, Field(description="name, unique among its kind")]),)
_ENDS: Hints = (*_NAME, ("start", _REFERENCE), ("end", _REFERENCE))
_BODIES: Hints = (
    *_NAME,
    ("body", Annotated[str, Field(description="the body that it acts on")]),
    ("base", Annotated[str, Field(description="the body that it acts against")]),
)
_TIME_FUNCTION: Hints = (
    ("time_function", Annotated[TimeFunction | None, TIME_FUNCTION, Field(description="a factor over time, 1 without it")]),
)
_FADE = {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}}


class JointTable(Table):
    """A pin between two bodies."""

    name: Annotated[str, Field(description="name; [[clearance]] refers to it", examples=["crank pin"])]
    journal: Annotated[BodyPoint, BODY_POINT, Field(description="the point that carries the journal", examples=["crank.end"])]
    bearing: Annotated[BodyPoint, BODY_POINT, Field(description="the point that carries the bearing", examples=["rod.start"])]


def _read_joint(given: Any, info: ValidationInfo) -> Revolute:
    table = JointTable.model_validate(given, context=info.context)
    return Revolute(table.name, table.journal, table.bearing)


class GuideTable(Table):
    """A straight line that keeps a point of a body on it."""

    name: Annotated[str, Field(description="name; [[guide_clearance]] refers to it", examples=["guide"])]
    follower: Annotated[BodyPoint, BODY_POINT, Field(description="the guided point", examples=["slider.centre"])]
    through: Annotated[Point, pair("m"), Field(description="a point of the line", examples=["0, 0 m"])] = Guide.through
    direction: Annotated[float, quantities(Guide)["direction"]] = Guide.direction
    body: Annotated[str, Field(description="the body that carries the line")] = Guide.body
    aligned: Annotated[bool, Field(description="whether the follower also keeps its angle against the line")] = Guide.aligned


def _read_guide(given: Any, info: ValidationInfo) -> Guide:
    table = GuideTable.model_validate(given, context=info.context)
    return Guide(table.name, table.follower, table.through, table.direction, table.body, table.aligned)


PARTS: Mapping[str, Part] = {
    "body": Part(BodyTable, PlainValidator(_read_body), "bodies", "a rigid body"),
    "ground": Part(GroundTable, PlainValidator(_read_ground), "ground", "a point of the fixed frame"),
    "joint": Part(JointTable, PlainValidator(_read_joint), "joints", "a pin between two bodies", ("journal", "bearing")),
    "guide": Part(
        GuideTable,
        PlainValidator(_read_guide),
        "guides",
        "a straight line that keeps a point of a body on it",
        ("follower",),
        ("body",),
    ),
    "weld": _part(Weld, "welds", "a rigid connection of two bodies", _ENDS, name="weld", start="rod.end", end="tool.base"),
    "rod": _part(
        Rod,
        "rods",
        "a massless rigid rod between two points, or a drive of their distance",
        (
            *_ENDS,
            ("motion", Annotated[TimeFunction | None, DISTANCE, Field(description="the distance over time, without a length")]),
        ),
        name="jack",
        start="ground.O",
        end="rod.middle",
        length="0.5 m",
        motion={"cycloidal": REACH},
    ),
    "latch": _part(
        Latch,
        "latches",
        "a lock that engages when two bodies reach an angle",
        _BODIES,
        name="latch",
        body="rod",
        angle="80 deg",
    ),
    "spring": _part(
        Spring,
        "elements",
        "a spring and damper between two points",
        _ENDS,
        name="spring",
        start="rod.middle",
        end="ground.O",
        stiffness="200 N/m",
        free_length="0.1 m",
        damping="2 N s/m",
    ),
    "torsion_spring": _part(
        TorsionSpring,
        "elements",
        "a hinge spring and damper between two bodies",
        _BODIES,
        name="hinge spring",
        body="rod",
        stiffness="2 N m/rad",
        free_angle="90 deg",
        damping="0.1 N m s/rad",
    ),
    "force": _part(
        Force,
        "elements",
        "a force on a point",
        (
            *_NAME,
            ("point", _REFERENCE),
            ("force", Annotated[Point, pair("N"), Field(description="its components")]),
            *_TIME_FUNCTION,
        ),
        name="load",
        point="rod.middle",
        force="0, -10 N",
        time_function=_FADE,
    ),
    "torque": _part(
        Torque,
        "elements",
        "a torque on a body",
        (*_BODIES, *_TIME_FUNCTION),
        name="torque",
        body="crank",
        torque="1 N m",
        time_function=_FADE,
    ),
    "angle_stop": _part(
        AngleStop,
        "elements",
        "an end stop of a rotation",
        _BODIES,
        name="stop",
        body="rod",
        angle="80 deg",
    ),
    "travel_stop": _part(
        TravelStop,
        "elements",
        "an end stop of a translating point",
        (*_NAME, ("point", _REFERENCE)),
        name="buffer",
        point="slider.centre",
        direction="90 deg",
        limit="1.5 m",
    ),
    "motor": _part(
        Motor,
        "elements",
        "a motor whose torque falls with its speed",
        _BODIES,
        name="motor",
        body="crank",
        stall_torque="5 N m",
        no_load_speed="300 rpm",
        limit="4 N m",
    ),
}
"""The further tables of a case file, apart from [structure], [drive], [[clearance]] and [run]."""

ELEMENTS = tuple(name for name, part in PARTS.items() if part.fills == "elements")


def _check_references(parts: Mapping[str, Iterable[Any]], fields: Mapping[str, tuple[Any, ...]]) -> None:
    """Raise `InputError`, with its place, for the first part with an unknown body or point."""
    points: dict[str, list[str]] = {body.name: list(body.points) for body in fields["bodies"]}
    points[GROUND] = [name for name, _ in fields["ground"]]
    for section, found in parts.items():
        for index, part in enumerate(found):
            with located(f"{section}.{index}"):
                for key in PARTS[section].bodies:
                    _check_body(part.name, key, getattr(part, key), points)
                for key in PARTS[section].references:
                    body, point = getattr(part, key)
                    _check_body(part.name, key, body, points)
                    if point not in points[body]:
                        raise InputError(
                            f"'{part.name}': {key} = '{body}.{point}', but body '{body}' has no point '{point}'"
                            + did_you_mean(point, points[body]),
                            "one of " + (", ".join(points[body]) or "none"),
                        )


def _check_body(name: str, key: str, body: str, points: Mapping[str, list[str]]) -> None:
    if body not in points:
        raise InputError(f"'{name}': {key}: no body '{body}'{did_you_mean(body, points)}", "one of " + ", ".join(points))


def assembled(base: Mapping[str, Any], parts: Mapping[str, list[Any]]) -> Mechanism:
    """A mechanism from its structure and the further parts of the file.

    Parameters
    ----------
    base : mapping
        Fields of `Mechanism`.
    parts : mapping of str to list of part
        By the keys of `PARTS`.

    Returns
    -------
    Mechanism
    """
    fields = {"bodies": (), "ground": (), **base}
    for name, part in PARTS.items():
        fields[part.fills] = (*fields.get(part.fills, ()), *parts[name])
    _check_references(parts, fields)
    return Mechanism(**fields)
