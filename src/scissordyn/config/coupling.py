"""Couplings and coordinate drives in a case file."""

from __future__ import annotations

from typing import Annotated, Any

from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.component.time_function import TimeFunction
from scissordyn.config.quantity import exact, quantity_pattern, read_quantity, written
from scissordyn.config.table import About, Call, Context, Hints, Table, read_as, reader, table_of
from scissordyn.config.time_function import time_function
from scissordyn.config.value import BODY_POINT
from scissordyn.errors import InputError
from scissordyn.model.addition import closed, with_backlash
from scissordyn.model.coupling import Coordinate, Coupling, Distance, RelativeAngle, Slide
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import Quantity, quantities

SAMPLE = '{ angle = "planet", base = "arm" }, { slide = "rack.tip", direction = "0 deg" } or { distance = ["a.end", "b.end"] }'


@reader(lambda: {"type": "array", "items": {"type": "string", "pattern": r"^.+\..+$"}, "minItems": 2, "maxItems": 2})
def _read_points(given: Any, context: Context) -> tuple[BodyPoint, BodyPoint]:
    if not isinstance(given, list) or len(given) != 2:
        raise InputError("not two points", "a list of two points", '["base.pin", "crank.end"]')
    first, second = (BODY_POINT.read(point, context) for point in given)
    return first, second


class CoordinateTable(Table):
    """An angle of a body, a slide of a point, or a distance of two points."""

    angle: Annotated[str | None, About("body whose angle it is, against the base")] = None
    slide: Annotated[BodyPoint | None, About("point whose displacement along the direction it is, in the base")] = None
    distance: Annotated[tuple[BodyPoint, BodyPoint] | None, _read_points, About("two points")] = None
    base: Annotated[str, About("a body, or the ground")] = GROUND
    direction: Annotated[float | None, quantities(Slide)["direction"]] = None
    exactly_one = ("angle", "slide", "distance")

    def check(self) -> None:
        """One kind of coordinate."""
        self.coordinate()

    def coordinate(self) -> Coordinate:
        """What the table describes."""
        if sum(part is not None for part in (self.angle, self.slide, self.distance)) != 1:
            raise InputError("a coordinate needs one of angle, slide and distance", SAMPLE)
        if self.slide is not None:
            return Slide(self.slide, self.direction or 0.0, self.base)
        if self.direction is not None or (self.distance is not None and self.base != GROUND):
            raise InputError("a direction or a base beside what has none", SAMPLE)
        return RelativeAngle(self.angle, self.base) if self.angle is not None else Distance(*self.distance)  # type: ignore[misc]


@reader(lambda: CoordinateTable)
def _read_coordinate(given: Any, context: Context) -> Coordinate:
    return CoordinateTable.read(given, context).coordinate()


def ratio_unit(output: Coordinate, input: Coordinate) -> str:
    """The unit of the ratio of a coupling."""
    return "1" if output.unit == input.unit else f"{output.unit}/{input.unit}"


@reader(lambda: {"type": ["number", "string"]})
def _read_ratio(given: Any, context: Context) -> float:
    unit = ratio_unit(context["values"]["output"], context["values"]["input"])
    sample = {"1": "-0.5", "m/rad": '"5 mm/turn"', "rad/m": '"0.2 turn/mm"'}[unit]
    return read_quantity(given, Quantity(unit, help="ratio"), sample.strip('"'))


@reader(lambda: {"type": "string"})
def _read_offset(given: Any, context: Context) -> float:
    return read_quantity(given, Quantity(context["values"]["output"].unit, help="offset"))


@reader(lambda: {"type": "object"})
def _read_motion(given: Any, context: Context) -> TimeFunction:
    function: TimeFunction = time_function(context["values"]["coordinate"].unit).read(given, context)
    return function


read_as(Coordinate, _read_coordinate)
_COORDINATE = Annotated[Coordinate, About(f"a coordinate: {SAMPLE}")]

COUPLING: Hints = (
    ("output", _COORDINATE),
    ("input", _COORDINATE),
    (
        "ratio",
        Annotated[
            float, _read_ratio, Quantity("1"), About('output over input, as -0.5 or "5 mm/turn"; negative in opposite senses')
        ],
    ),
    ("offset", Annotated[float | None, _read_offset, About("output where the input is zero; as assembled without it")]),
)
BacklashTable = table_of(
    with_backlash,
    (("mechanism", None), ("coupling", None)),
    spelt={"backlash": "angle"},
    backlash="0.5 deg",
)
"""The backlash of a coupling."""


@reader(lambda: {"anyOf": [{"type": "string", "pattern": quantity_pattern("rad", negative=False)}, BacklashTable]})
def _read_backlash(given: Any, context: Context) -> Call:
    return BacklashTable.read({"angle": given} if isinstance(given, str) else given, context)


_BACKLASH = Quantity("rad", above=0.0, help='angle between both flanks, as "0.5 deg" or with the law of their contacts')
_FLANKS = {"angle": "0.5 deg", "stiffness": 1e5, "restitution": 0.5}


class CouplingTable(
    table_of(  # type: ignore[misc]
        Coupling, COUPLING, name="mesh", output={"angle": "wheel"}, input={"angle": "crank"}, ratio=-0.5, offset="5 deg"
    )
):
    """A linear relation of two coordinates."""

    backlash: Annotated[Any, _read_backlash, _BACKLASH, About(examples=[_FLANKS])] = None

    def check(self) -> None:
        self.result()

    def opened(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with the backlash of the coupling, if it has one."""
        opened: Mechanism = mechanism if self.backlash is None else self.backlash.result(mechanism, self.name)
        return opened


COORDINATE_DRIVE: Hints = (
    ("coordinate", _COORDINATE),
    ("motion", Annotated[TimeFunction, _read_motion, About("the angle, or the distance, over time")]),
)


def coupling_lines(mechanism: Mechanism) -> list[str]:
    """A line for each coupling, as its case file has it."""
    lines, (bare, backlashes) = [], closed(mechanism)
    for part in bare.couplings:
        unit, name = ratio_unit(part.output, part.input), part.name
        ratio = written(part.ratio, unit) if unit == "1" else exact((part.ratio,), unit)
        offset = f" + {written(part.offset, part.output.unit)}" if part.offset else ""
        sense = "in opposite senses" if part.ratio < 0.0 else "in the same sense"
        text = f"Coupling {name}: {coordinate_words(part.output)} = {ratio} x {coordinate_words(part.input)}{offset}, {sense}"
        lines.append(f"{text}, backlash {written(backlashes[name]['backlash'], 'rad')}." if name in backlashes else f"{text}.")
    return lines


def coordinate_words(coordinate: Coordinate) -> str:
    """A coordinate in words."""
    if isinstance(coordinate, Distance):
        return f"distance of {'.'.join(coordinate.start)} and {'.'.join(coordinate.end)}"
    against = "" if coordinate.base == GROUND else f" against {coordinate.base}"
    if isinstance(coordinate, Slide):
        return f"slide of {'.'.join(coordinate.point)} along {written(coordinate.direction, 'rad')}{against}"
    return f"angle of {coordinate.body}{against}"
