"""Time functions of drives, loads and lengths in a case file: their kinds, and how each is read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from scissordyn.component.time_function import (
    ConstantSpeed,
    Cycloidal,
    Harmonic,
    Polynomial,
    Tabulated,
    TimeFunction,
    Trapezoidal,
)
from scissordyn.config.code import code_of
from scissordyn.config.quantity import read_numbers, read_quantity, unit_factor
from scissordyn.config.shape import About, Context, Reader, Shape, reader
from scissordyn.config.table import Hints, Table, described, located, made_table, toml
from scissordyn.config.text import read_text
from scissordyn.config.unit_pattern import numbers_pattern, quantity_pattern
from scissordyn.errors import InputError
from scissordyn.units import Quantity, quantities

HEADER = re.compile(
    r"\s*#?\s*time\s*\[(?P<time>[^]]+)\]\s*[,;\s]\s*(?P<name>angle|factor|length|torque)\s*\[(?P<unit>[^]]+)\]\s*"
)
SAMPLE = 'table = { time = "0 10 20 30 40 50 ms", angle = "30 31 34 39 46 55 deg" }'
LENGTHS = 'table = { time = "0 10 20 30 40 50 ms", length = "500 501 504 509 516 525 mm" }'
TORQUES = 'table = { time = "0 10 20 30 40 50 ms", torque = "0 1 2 3 2 1 N m" }'
FACTORS = 'table = { time = "0 10 20 30 40 50 ms", factor = [0, 0.1, 0.3, 0.6, 0.9, 1] }'


TABULATED = {
    "angle": ("rad", "angle [deg]", SAMPLE),
    "length": ("m", "length [mm]", LENGTHS),
    "factor": ("1", "factor [1]", FACTORS),
    "torque": ("N m", "torque [N m]", TORQUES),
}
"""What can be tabulated: unit, heading in a file, and a sample."""


def read_tabulated(given: Any, folder: Path, name: str = "angle") -> Tabulated:
    """An angle, a length or a factor given at instants."""
    if isinstance(given, str):
        return _from_file(folder / given, name)
    if not isinstance(given, Mapping) or set(given) != {"time", name}:
        raise InputError(f"not a table of time and {name}", f"a file name, or the keys time and {name}", TABULATED[name][2])
    values = _plain(given[name]) if name == "factor" else read_numbers(given[name], TABULATED[name][0])
    return Tabulated(read_numbers(given["time"], "s"), values)


def _plain(given: Any) -> tuple[float, ...]:
    if not isinstance(given, list):
        raise InputError("factor is not a list of numbers", "a list of plain numbers", FACTORS)
    return tuple(read_quantity(number, Quantity("1"), FACTORS) for number in given)


def _from_file(path: Path, name: str) -> Tabulated:
    # a case may be somebody else's, and name a file that he must not see: no text of the file is in a message
    wanted = f"time [ms], {TABULATED[name][1]}"
    header, *lines = read_text(path, "a text file with two columns").splitlines() or [""]
    units = HEADER.fullmatch(header)
    if units is None or units["name"] != name or (name == "factor" and units["unit"] != "1"):
        raise InputError(f"'{path}' does not begin with the heading of a table", "a first line that names both columns", wanted)
    rows = []
    for number, line in enumerate(lines, start=2):
        entries = re.split(r"[,;\s]+", line.strip())
        if entries == [""]:
            continue
        try:
            time, value = map(float, entries)
        except ValueError:
            raise InputError(f"'{path}' line {number} is no two numbers", "two numbers in each line", "10, 35.5") from None
        rows.append((time, value))
    with located(f"'{path}' line 1"):
        scale = unit_factor(units["time"], "s"), 1.0 if name == "factor" else unit_factor(units["unit"], TABULATED[name][0])
    return Tabulated(tuple(time * scale[0] for time, _ in rows), tuple(value * scale[1] for _, value in rows))


def _tables(name: str) -> Shape:
    """The name of a file, or two lists."""
    listed = {"type": "array", "items": {"type": "number"}}
    values = listed if name == "factor" else {"type": "string", "pattern": numbers_pattern(TABULATED[name][0])}
    keys = {"time": {"type": "string", "pattern": numbers_pattern("s")}, name: values}
    table = {"type": "object", "properties": keys, "required": ["time", name], "additionalProperties": False}
    return {"anyOf": [{"type": "string"}, table]}


def _table_reader(name: str) -> Reader:
    @reader(lambda: _tables(name))
    def read(given: Any, context: Context) -> Tabulated:
        if isinstance(given, str) and code_of(context).recorded:
            raise InputError("the name of a file in a run", "the numbers themselves", TABULATED[name][2])
        return read_tabulated(given, context.get("folder", Path()), name)

    return read


def powers(unit: str) -> tuple[str, ...]:
    """Units of the coefficients of a polynomial of time whose values have a unit, from the constant up."""
    return (unit, f"{unit}/s", *(f"{unit}/s^{power}" for power in range(2, 6)))


def _coefficients(units: tuple[str, ...]) -> Shape:
    number = {"type": "number"}
    coefficients = [number if unit == "1" else {"type": "string", "pattern": quantity_pattern(unit)} for unit in units]
    return {"type": "array", "items": coefficients, "additionalItems": False, "minItems": 1, "maxItems": len(units)}


def _polynomial_reader(unit: str, sample: str) -> Reader:
    """Coefficients from the constant up, each with the unit of its power of time."""
    units = powers(unit)

    @reader(lambda: _coefficients(units))
    def read(given: Any, _: Context) -> Polynomial:
        if not isinstance(given, list) or not 1 <= len(given) <= len(units):
            raise InputError("not a list of one to six coefficients", "coefficients from the constant up", sample)
        coefficients = []
        for power, (number, wanted) in enumerate(zip(given, units, strict=False)):
            with located(f"coefficient {power}"):
                coefficients.append(read_quantity(number, Quantity(wanted), sample))
        return Polynomial(tuple(coefficients))

    return read


class MotionTable(Table):
    """Time functions, of which one is given."""

    sample: ClassVar[str] = 'speed = "150 rpm"'

    def motion(self) -> TimeFunction:
        keys = self.exactly_one
        chosen = {key: value for key in keys if (value := getattr(self, key)) is not None}
        if len(chosen) != 1:
            came = f"{len(chosen)} time functions" + (f" ({', '.join(chosen)})" if chosen else "")
            raise InputError(came, f"exactly one of {', '.join(keys[:-1])} and {keys[-1]}", self.sample)
        motion: Any = next(iter(chosen.values()))
        return ConstantSpeed(motion) if isinstance(motion, float) else motion


MOVES = {"start": "30 deg", "end": "60 deg", "duration": "2 s"}
OSCILLATION = {"mean": "45 deg", "amplitude": "15 deg", "angular_frequency": "3 Hz"}


class DriveTable(MotionTable):
    """A prescribed angle: one of speed, harmonic, table, polynomial, cycloidal and trapezoidal."""

    speed: Annotated[float | None, quantities(ConstantSpeed)["speed"], About(examples=["150 rpm"])] = None
    harmonic: Annotated[
        Harmonic | None,
        described(Harmonic, **OSCILLATION),
        About(
            "mean + amplitude sin(angular_frequency t + phase), in place of speed",
            examples=[{**OSCILLATION, "phase": "0 deg"}],
        ),
    ] = None
    table: Annotated[
        Tabulated | None,
        _table_reader("angle"),
        About('a file that starts with "time [ms], angle [deg]", in place of speed', examples=["motion.csv"]),
    ] = None
    polynomial: Annotated[
        Polynomial | None,
        _polynomial_reader("rad", 'polynomial = ["30 deg", "10 deg/s", "5 deg/s^2"]'),
        About("coefficients of the powers of time, in place of speed", examples=[["30 deg", "10 deg/s"]]),
    ] = None
    cycloidal: Annotated[
        Cycloidal | None,
        described(Cycloidal, **MOVES),
        About("a smooth move from rest to rest, in place of speed", examples=[MOVES]),
    ] = None
    trapezoidal: Annotated[
        Trapezoidal | None,
        described(Trapezoidal, **MOVES),
        About(
            "a move with ramps of constant acceleration, to and fro with strokes, in place of speed",
            examples=[{**MOVES, "strokes": 6}],
        ),
    ] = None
    body: Annotated[str, About("the driven body", examples=["unit 1/bar 1"])] = ""

    def check(self) -> None:
        self.motion()


DriveTable.exactly_one = tuple(key for key in DriveTable.declared_keys() if key != "body")


def _values(kind: type, unit: str) -> Hints:
    """The fields of a motion that are values, read in a unit; a phase stays an angle."""
    return tuple(
        (name, Annotated[float, Quantity(unit, help=quantity.help)])
        for name, quantity in quantities(kind).items()
        if quantity.unit == "rad" and name != "phase"
    )


def _table_of(
    name: str, key: str, unit: str, polynomial: str, moves: Mapping[str, Any], oscillation: Mapping[str, Any], speed: str = ""
) -> type[MotionTable]:
    """The time functions of some values over time, with examples."""
    value = {"1": "factor", "m": "length", "N m": "torque"}[unit]
    keys: dict[str, tuple[Any, Any]] = {}
    if speed:
        keys["speed"] = (Annotated[float | None, Quantity(powers(unit)[1], help=speed)], None)
    keys["harmonic"] = (Annotated[Harmonic | None, described(Harmonic, _values(Harmonic, unit), **oscillation)], None)
    keys["table"] = (Annotated[Tabulated | None, _table_reader(value)], None)
    keys["polynomial"] = (Annotated[Polynomial | None, _polynomial_reader(unit, f"polynomial = {polynomial}")], None)
    for kind in (Cycloidal, Trapezoidal):
        move = described(kind, _values(kind, unit), **moves)
        keys[kind.__name__.lower()] = (Annotated[kind | None, move], None)
    about = f"A {value} over time: one of {', '.join([*keys][:-1])} and {[*keys][-1]}."
    table = made_table(name, MotionTable, keys, about)
    table.exactly_one, table.sample = tuple(keys), f"{key} = {toml({'cycloidal': moves})}"
    return table


TimeFunctionTable = _table_of(
    "TimeFunctionTable",
    "time_function",
    "1",
    '[0, "0.5 1/s"]',
    {"start": 0, "end": 1, "duration": "2 s"},
    {"mean": 0, "amplitude": 1, "angular_frequency": "3 Hz"},
    "a factor that grows from zero at this rate",
)
DistanceTable = _table_of(
    "DistanceTable",
    "motion",
    "m",
    '["0.5 m", "0.1 m/s"]',
    {"start": "0.5 m", "end": "0.8 m", "duration": "2 s"},
    {"mean": "0.5 m", "amplitude": "0.1 m", "angular_frequency": "3 Hz"},
)
TorqueTable = _table_of(
    "TorqueTable",
    "feed_forward",
    "N m",
    '["0 N m", "1 N m/s"]',
    {"start": "0 N m", "end": "5 N m", "duration": "2 s"},
    {"mean": "0 N m", "amplitude": "1 N m", "angular_frequency": "3 Hz"},
    "a torque that grows from zero at this rate",
)


def _time_function_reader(table: type[MotionTable]) -> Reader:
    return Reader(lambda given, context: table.read(given, context).motion(), lambda: table)


TIME_FUNCTION = _time_function_reader(TimeFunctionTable)
"""For ``Annotated[TimeFunction | None, TIME_FUNCTION]``: a key whose value is a factor over time."""

DISTANCE = _time_function_reader(DistanceTable)
"""For ``Annotated[TimeFunction | None, DISTANCE]``: a key whose value is a length over time."""

TORQUE = _time_function_reader(TorqueTable)
"""For ``Annotated[TimeFunction | None, TORQUE]``: a key whose value is a torque over time."""


@reader(lambda: DriveTable)
def _read_angle(given: Any, context: Context) -> TimeFunction:
    if isinstance(given, Mapping) and "body" in given:
        raise InputError("unknown key 'body' in a reference", "the motion alone", 'reference = { speed = "20 rpm" }')
    return DriveTable.read(given, context).motion()


ANGLE = _read_angle
"""For ``Annotated[TimeFunction | None, ANGLE]``: a key whose value is an angle over time."""
