"""Read the time functions of drives, loads and lengths in a case file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from scissordyn.casefile.code import code_of
from scissordyn.casefile.quantity import NumbersText, read_numbers, read_quantity, unit_factor
from scissordyn.casefile.table import (
    About,
    Context,
    Reader,
    Shape,
    Table,
    add_prefix,
    dataclass_reader,
    make_table,
    read_as,
    reader,
    table_reader,
    toml,
)
from scissordyn.casefile.text import read_text
from scissordyn.casefile.value import columns_shape
from scissordyn.components.time_function import (
    ConstantSpeed,
    Cycloidal,
    Harmonic,
    OverTime,
    Polynomial,
    Tabulated,
    TimeFunction,
    Trapezoidal,
)
from scissordyn.errors import InputError
from scissordyn.units import Quantity, quantities

# Pattern of the first line of a file with a time function, for example "time [s], angle [deg]"
HEADER_PATTERN = re.compile(
    r"\s*#?\s*time\s*\[(?P<time>[^]]+)\]\s*[,;\s]\s*(?P<name>angle|factor|length|torque)\s*\[(?P<unit>[^]]+)\]\s*"
)


@dataclass(frozen=True)
class FunctionQuantity:
    """Quantity that a time function has as its value, such as an angle: its names and units, and examples in TOML."""

    name: str  # name of the column in a table
    unit: str  # SI unit
    shown: str  # unit in the heading of a data file
    key: str  # usual key of a time function of this quantity
    column: Any  # example of a table: values at 0, 10, ..., 50 ms
    coefficients: list[Any]  # example of the coefficients of a polynomial
    ends: tuple[Any, Any]  # example of start and end of a motion
    oscillation: tuple[Any, Any]  # example of mean and amplitude of an oscillation
    speed: Quantity | None = None  # quantity of a constant speed; None if this kind has no constant speed

    @property
    def table(self) -> str:
        return f"table = {toml({'time': '0 10 20 30 40 50 ms', self.name: self.column})}"

    @property
    def move(self) -> dict[str, Any]:
        return {"start": self.ends[0], "end": self.ends[1], "duration": "2 s"}

    @property
    def harmonic(self) -> dict[str, Any]:
        return {"mean": self.oscillation[0], "amplitude": self.oscillation[1], "angular_frequency": "3 Hz"}


FUNCTION_QUANTITIES: Mapping[str, FunctionQuantity] = {
    "rad": FunctionQuantity(
        name="angle",
        unit="rad",
        shown="deg",
        key="drive",
        column="30 31 34 39 46 55 deg",
        coefficients=["30 deg", "10 deg/s", "5 deg/s^2"],
        ends=("30 deg", "60 deg"),
        oscillation=("45 deg", "15 deg"),
        speed=quantities(ConstantSpeed)["speed"],
    ),
    "m": FunctionQuantity(
        name="length",
        unit="m",
        shown="mm",
        key="motion",
        column="500 501 504 509 516 525 mm",
        coefficients=["0.5 m", "0.1 m/s"],
        ends=("0.5 m", "0.8 m"),
        oscillation=("0.5 m", "0.1 m"),
    ),
    "1": FunctionQuantity(
        name="factor",
        unit="1",
        shown="1",
        key="time_function",
        column=[0, 0.1, 0.3, 0.6, 0.9, 1],
        coefficients=[0, "0.5 1/s"],
        ends=(0, 1),
        oscillation=(0, 1),
        speed=Quantity("1/s", help="a factor that grows from zero at this rate"),
    ),
    "N m": FunctionQuantity(
        name="torque",
        unit="N m",
        shown="N m",
        key="feed_forward",
        column="0 1 2 3 2 1 N m",
        coefficients=["0 N m", "1 N m/s"],
        ends=("0 N m", "5 N m"),
        oscillation=("0 N m", "1 N m"),
        speed=Quantity("N m/s", help="a torque that grows from zero at this rate"),
    ),
}
"""Quantities that time functions can have as values, by SI unit."""


def powers(unit: str) -> tuple[str, ...]:
    """Return the units of the coefficients of a polynomial in time, from the constant to the highest power."""
    return (unit, f"{unit}/s", *(f"{unit}/s^{power}" for power in range(2, 6)))


def read_tabulated(given: Any, folder: Path, unit: str = "rad") -> Tabulated:
    """Read a time function from a table with the keys `time` and values, or from the data file that is named."""
    values, name = FUNCTION_QUANTITIES[unit], FUNCTION_QUANTITIES[unit].name
    if isinstance(given, str):
        return _from_file(folder / given, values)
    if not isinstance(given, Mapping) or set(given) != {"time", name}:
        raise InputError(f"not a table of time and {name}", f"a file name, or the keys time and {name}", values.table)
    column = read_numbers(given[name], unit) if unit != "1" else _plain(given[name], values.table)
    return Tabulated(read_numbers(given["time"], "s"), column)


def _plain(given: Any, sample: str) -> tuple[float, ...]:
    if not isinstance(given, list):
        raise InputError("factor is not a list of numbers", "a list of plain numbers", sample)
    return tuple(read_quantity(number, Quantity("1"), sample) for number in given)


def _from_file(path: Path, values: FunctionQuantity) -> Tabulated:
    # a case may name a file that its author is not allowed to read: no message contains text of the file
    wanted = f"time [ms], {values.name} [{values.shown}]"
    header, *lines = read_text(path, "a text file with two columns").splitlines() or [""]
    units = HEADER_PATTERN.fullmatch(header)
    if units is None or units["name"] != values.name or (values.unit == "1" and units["unit"] != "1"):
        raise InputError(f"'{path}' does not begin with the heading of a table", "a first line that names both columns", wanted)
    rows = []
    for number, line in enumerate(lines, start=2):
        entries = re.split(r"[,;\s]+", line.strip())
        if entries == [""]:
            continue
        try:
            time, value = map(float, entries)
        except ValueError:
            raise InputError(
                f"'{path}' line {number} does not have two numbers", "two numbers in each line", "10, 35.5"
            ) from None
        rows.append((time, value))
    with add_prefix(f"'{path}' line 1"):
        scale = unit_factor(units["time"], "s"), 1.0 if values.unit == "1" else unit_factor(units["unit"], values.unit)
    return Tabulated(tuple(time * scale[0] for time, _ in rows), tuple(value * scale[1] for _, value in rows))


def table_shape(unit: str) -> Shape:
    column = {"type": "array", "items": {"type": "number"}} if unit == "1" else NumbersText(unit, None)
    return columns_shape({"time": NumbersText("s", None), FUNCTION_QUANTITIES[unit].name: column})


def _table_reader(unit: str) -> Reader:
    @reader(lambda: {"anyOf": [{"type": "string"}, table_shape(unit)]})
    def read(given: Any, context: Context) -> Tabulated:
        if isinstance(given, str) and code_of(context).recorded:
            raise InputError("a saved run names a data file", "the numbers of the table", FUNCTION_QUANTITIES[unit].table)
        return read_tabulated(given, context.get("folder", Path()), unit)

    return read


def _coefficients(units: tuple[str, ...]) -> Shape:
    number = {"type": "number"}
    coefficients = [number if unit == "1" else NumbersText(unit) for unit in units]
    return {"type": "array", "items": coefficients, "additionalItems": False, "minItems": 1, "maxItems": len(units)}


def _polynomial_reader(unit: str) -> Reader:
    """Return the reader of a list of polynomial coefficients in ascending order, each with its unit."""
    units, sample = powers(unit), f"polynomial = {toml(FUNCTION_QUANTITIES[unit].coefficients)}"

    @reader(lambda: _coefficients(units))
    def read(given: Any, _: Context) -> Polynomial:
        if not isinstance(given, list) or not 1 <= len(given) <= len(units):
            raise InputError("not a list of one to six coefficients", "coefficients in ascending order", sample)
        coefficients = []
        for power, (number, wanted) in enumerate(zip(given, units, strict=False)):
            with add_prefix(f"coefficient {power}"):
                coefficients.append(read_quantity(number, Quantity(wanted), sample))
        return Polynomial(tuple(coefficients))

    return read


class MotionTable(Table):
    """Table of a time function; exactly one of its keys is given, and the key is the kind of time function."""

    sample: ClassVar[str]

    def check(self) -> None:
        self.motion()

    def motion(self) -> TimeFunction:
        keys = self.exactly_one
        chosen = {key: value for key in keys if (value := getattr(self, key)) is not None}
        if len(chosen) != 1:
            came = f"{len(chosen)} time functions" + (f" ({', '.join(chosen)})" if chosen else "")
            raise InputError(came, f"exactly one of {', '.join(keys[:-1])} and {keys[-1]}", self.sample)
        motion: Any = next(iter(chosen.values()))
        return ConstantSpeed(motion) if isinstance(motion, float) else motion


def units_of(kind: type, unit: str) -> dict[str, str]:
    """Return the units of the fields of a time function for values in `unit`; a phase has always the unit of an angle."""
    numbers = quantities(kind).items()
    return {name: unit if number.unit == "rad" and name != "phase" else number.unit for name, number in numbers}


def _filled(kind: type, unit: str, examples: Mapping[str, Any]) -> Reader:
    units = units_of(kind, unit)
    numbers = ((name, number) for name, number in quantities(kind).items() if number.unit != units[name])
    hints = tuple((name, Annotated[float, Quantity(units[name], help=number.help)]) for name, number in numbers)
    return dataclass_reader(kind, hints, **examples)


def _table_of(name: str, unit: str, what: str) -> type[MotionTable]:
    """Create the table class of time functions with values in `unit`."""
    values, keys = FUNCTION_QUANTITIES[unit], dict[str, tuple[Any, Any]]()
    instead = ", instead of speed" if values.speed else ""
    headings = f'a file that starts with "time [ms], {values.name} [{values.shown}]"'
    ramps = "a move with ramps of constant acceleration, to and fro with strokes"
    sine = "mean + amplitude sin(angular_frequency t + phase)"
    kinds: tuple[tuple[str, Any, Reader, str, Any], ...] = (
        ("harmonic", Harmonic, _filled(Harmonic, unit, values.harmonic), sine, {**values.harmonic, "phase": "0 deg"}),
        ("table", Tabulated, _table_reader(unit), headings, "motion.csv"),
        ("polynomial", Polynomial, _polynomial_reader(unit), "coefficients of the powers of time", values.coefficients[:2]),
        ("cycloidal", Cycloidal, _filled(Cycloidal, unit, values.move), "a smooth move from rest to rest", values.move),
        ("trapezoidal", Trapezoidal, _filled(Trapezoidal, unit, values.move), ramps, {**values.move, "strokes": 6}),
    )
    if values.speed is not None:
        keys["speed"] = (Annotated[float | None, values.speed, About(examples=["150 rpm"] if unit == "rad" else [])], None)
    for key, kind, read, about, example in kinds:
        keys[key] = (Annotated[kind | None, read, About(about + instead, [example])], None)
    *others, last = keys
    table = make_table(name, MotionTable, keys, f"{what}: one of {', '.join(others)} and {last}.")
    table.exactly_one = tuple(keys)
    table.sample = 'speed = "150 rpm"' if unit == "rad" else f"{values.key} = {toml({'cycloidal': values.move})}"
    return table


AngleTable = _table_of("AngleTable", "rad", "A prescribed angle")
TIME_FUNCTION_TABLES = {
    "1": _table_of("TimeFunctionTable", "1", "A factor over time"),
    "m": _table_of("DistanceTable", "m", "A length over time"),
    "rad": AngleTable,
    "N m": _table_of("TorqueTable", "N m", "A torque over time"),
}
"""Table classes of time functions, by the unit of their values."""


class DriveTable(AngleTable):  # type: ignore[misc, valid-type]
    """Table [drive]: a prescribed angle, one of speed, harmonic, table, polynomial, cycloidal and trapezoidal."""

    body: Annotated[str, About("the driven body", examples=["unit 1/bar 1"])] = ""


def time_function(unit: str) -> Reader:
    """Return the reader of a key whose value is a time function."""
    return table_reader(lambda: TIME_FUNCTION_TABLES[unit], MotionTable.motion)


read_as(TimeFunction, lambda about: time_function(next((extra.unit for extra in about if isinstance(extra, OverTime)), "1")))
