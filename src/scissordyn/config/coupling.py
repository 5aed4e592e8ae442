"""Couplings and coordinate drives in a case file."""

from __future__ import annotations

from typing import Annotated, Any

from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.component.time_function import TimeFunction
from scissordyn.config.body_point import BODY_POINT
from scissordyn.config.quantity import read_quantity
from scissordyn.config.shape import About, Context, reader
from scissordyn.config.table import Hints, Table
from scissordyn.config.time_function import ANGLE, DISTANCE
from scissordyn.errors import InputError
from scissordyn.model.coupling import Coordinate, Distance, RelativeAngle, Slide
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
    slide: Annotated[BodyPoint | None, BODY_POINT, About("point whose displacement along the direction it is, in the base")] = (
        None
    )
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
    function: TimeFunction = (ANGLE if context["values"]["coordinate"].unit == "rad" else DISTANCE).read(given, context)
    return function


_NAME = ("name", Annotated[str, About("name, unique among its kind")])
_COORDINATE = Annotated[Coordinate, _read_coordinate, About(f"a coordinate: {SAMPLE}")]

COUPLING: Hints = (
    _NAME,
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
COORDINATE_DRIVE: Hints = (
    _NAME,
    ("coordinate", _COORDINATE),
    ("motion", Annotated[TimeFunction, _read_motion, About("the angle, or the distance, over time")]),
)
