"""The numbers of a case as fields of a form: unit, bounds and help come from their declarations."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scissordyn.casefile.case import LISTS
from scissordyn.casefile.code import Code
from scissordyn.casefile.part import component_part
from scissordyn.casefile.quantity import read_numbers, read_quantity, unit_factor, written
from scissordyn.casefile.structure import STRUCTURES, BendingTable, ClearanceTable, ControlTable
from scissordyn.casefile.table import Key, Reader, Shape, Table, plain_table, table_of
from scissordyn.casefile.text import handle
from scissordyn.casefile.time_function import TABLES, DriveTable
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.errors import InputError
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.laws.oil import OILS
from scissordyn.model.clearance import Lubrication
from scissordyn.model.options import Options
from scissordyn.model.section import MATERIALS, SECTIONS
from scissordyn.model.walk import Route
from scissordyn.units import Quantity, short

STARRED = ("clearance", "speed", "kinetic", "angle", "end", "duration", "limit")
"""Names of fields that have a slider at first, in the tables of `STARRED_IN`."""

STARRED_IN = ("drive", "control", "clearance", "guide_clearance")  # Tables with such fields, and that of the structure
SPREAD = 4.0  # A slider goes from a value divided by this number to the value times it, on a logarithmic scale
TURN = math.radians(30.0)  # The slider of an angle goes so far to either side [rad]

READERS: Mapping[str, Reader] = {
    "drive": DriveTable.reader(),
    "control": ControlTable.reader(),
    **{section: read for section, (read, _) in LISTS.items()},
}
CHOICES: Mapping[tuple[Any, str], str] = {
    (BendingTable, "section"): "; ".join(sample for _, sample in SECTIONS.values()),
    (BendingTable, "material"): ", ".join(MATERIALS),
    (BendingTable, "modes"): "auto; a number of modes",
    (BendingTable, "elements"): "a number of elements",
    (ClearanceTable, "lubrication"): ", ".join(OILS),
    (plain_table(Lubrication), "oil"): ", ".join(OILS),
}
"""What can be written where a table takes a text or a number of parts, which has a field without a slider."""
PAIRS = {"position": "m", "centre": "m", "through": "m", "coupler_point": "m", "velocity": "m/s"}
"""Keys of two numbers, with their units."""

LONG = 14  # Letters of a text that has room in the form

NUMBER = r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*"


@dataclass(frozen=True)
class Field:
    """One number of a case, or the two numbers of a point."""

    place: Route
    group: str  # The table or part that it belongs to
    name: str
    text: str  # As it is written, with its unit
    value: tuple[float, ...]  # In SI
    quantity: Quantity
    starred: bool = False  # Whether it has a slider at first
    law: str = ""  # Name of the law that holds it, where the case gives the law by name alone
    choices: str = ""  # What is allowed, of a text that is no number

    @property
    def key(self) -> str:
        """The place as one text."""
        return ".".join(map(str, self.place))

    @property
    def label(self) -> str:
        """Its name with that of its group, in words."""
        return f"{self.group if self.group != 'structure' else ''} {self.name.replace('_', ' ')}".strip()

    @property
    def range(self) -> tuple[float, float, bool] | None:
        """Ends of a slider in SI, and whether its scale is logarithmic; None where there is none."""
        if len(self.value) != 1:
            return None
        value = self.value[0]
        low = max(bound for bound in (self.quantity.above, self.quantity.minimum) if bound is not None)
        high = min(bound for bound in (self.quantity.below, self.quantity.maximum) if bound is not None)
        if self.quantity.unit == "rad":
            return max(low, value - TURN), min(high, value + TURN), False
        if value == 0.0:
            # without a size to go by, only what is bounded on both sides has a range
            return (low, high, False) if math.isfinite(high - low) and high - low <= 10.0 else None
        if value < 0.0:
            return max(low, SPREAD * value), min(high, value / SPREAD), False
        ends = max(low, value / SPREAD), min(high, SPREAD * value)
        return *ends, ends[0] > 0.0 and ends[1] / ends[0] > 3.0

    @property
    def unit(self) -> str:
        """The unit in which it is written; "" without one."""
        return re.sub(rf"^{NUMBER}(?:,{NUMBER})*", "", self.text)

    @property
    def shown(self) -> str:
        """Its text; of one with many digits the first ones."""
        if len(self.text) <= LONG or len(self.value) != 1:
            return self.text
        value = self.value[0]
        return short(value, "m") if self.quantity.unit == "m" else f"{value:.5g} {self.quantity.unit}".removesuffix(" 1")

    def plain(self) -> dict[str, Any]:
        """The field for the form."""
        span = self.range
        slider = None if span is None else {"low": span[0], "high": span[1], "logarithmic": span[2], "value": self.value[0]}
        unit = self.unit if len(self.value) == 1 else ""
        return {
            "key": self.key,
            "group": self.group,
            "name": self.name.replace("_", " "),
            "text": self.text,
            "shown": self.shown,
            "help": self.quantity.help,
            "allowed": self.choices
            or (self.quantity.allowed if len(self.value) == 1 else f"two numbers [{self.quantity.unit}]"),
            "starred": self.starred and span is not None,
            "slider": slider,
            "whole": self.quantity.unit == "1" and self.text.isdecimal(),
            "unit": unit,
            "factor": unit_factor(unit, self.quantity.unit) if unit else 1.0,
        }


def fields_of(tree: Mapping[str, Any], code: Code) -> list[Field]:
    """The fields of a case file."""
    structure = tree.get("structure", {})
    kind = STRUCTURES[structure["kind"]]
    fields = list(_of_table(kind, structure, ("structure",), "structure", code, star=not _places(tree)))
    for section in (section for section in READERS if section in tree):
        tables = tree[section]
        many = isinstance(tables, list)
        for index, item in enumerate(tables if many else [tables]):
            group = f"{section.replace('_', ' ')} {handle(item)}".strip()
            place: Route = (section, index) if many else (section,)
            table = _component(item["type"], code) if section == "component" else _table_in(READERS[section].shape())
            fields += _of_table(table, item, place, group, code, star=section in STARRED_IN)
    options = table_of(Options, until="50 ms", step="0.1 ms")
    return [*fields, *_of_table(options, tree.get("run", {}), ("run",), "run", code)]


def _table_in(shape: Shape) -> Any:
    """The table that a reader accepts, alone or as one of several shapes; None if there is none."""
    if isinstance(shape, Mapping):
        return next(filter(None, map(_table_in, (*shape.get("anyOf", ()), shape.get("items")))), None)
    return shape if isinstance(shape, type) else None  # a reader may take a number or a text as well


def _table_of_key(key: Key, reader: Reader, given: Mapping[str, Any]) -> Any:
    """The table that is the value of a key; the motion of a coordinate is read by what the coordinate is."""
    if key.name == "motion" and "coordinate" in given:
        return DriveTable if "angle" in given["coordinate"] else TABLES["m"]
    return BendingTable if key.name == "bars" else _table_in(reader.shape())


def _component(kind: str, code: Code) -> type[Table]:
    named = code.reference("component", kind) if ".py:" in kind else kind
    return component_part(named, code.folder or Path()).table


def _places(tree: Mapping[str, Any]) -> bool:
    """Whether a drive, a reference or an actuated length, and not the structure's angle, says where the motion starts."""
    many = [table if isinstance(table, list) else [table] for table in (tree.get("drive", []), tree.get("control", []))]
    references = (control.get("reference", {}) for control in many[1])
    actuated = any("motion" in rod for rod in tree.get("rod", []))
    return actuated or any({*motion} - {"speed", "body"} for motion in (*many[0], *references))


def _of_table(
    table: type[Table], given: Mapping[str, Any], place: Route, group: str, code: Code, *, star: bool = False, law: str = ""
) -> Iterator[Field]:
    """The fields of one table, those that are not written included."""
    for key, declaration in table.declared_keys().items():
        here = (*place, key)
        value = given.get(key, None if declaration.required else declaration.default)
        quantity = declaration.quantity
        if isinstance(value, str | int) and (table, key) in CHOICES:
            yield _choice(here, group, str(value), declaration.help, CHOICES[table, key])
        elif quantity is not None and quantity.unit and not isinstance(value, tuple | Mapping | list):
            yield from _field(here, group, key, value, quantity, star=star, law=law)
        elif key == "points" and isinstance(value, Mapping):
            for name, point in value.items():
                yield from _field((*here, name), group, f"point {name}", point, Quantity("m", help=declaration.help), count=2)
        elif isinstance(value, str) and key in PAIRS:
            yield from _field(here, group, key, value, Quantity(PAIRS[key], help=declaration.help), count=2)
        elif key in BY_KIND or key == "controller":
            yield from _of_law(key, value, given, here, group, code, star=star)
        elif isinstance(value, Mapping) and declaration.reader is not None:
            inner = _table_of_key(declaration, declaration.reader, given)
            if inner is not None:
                within = f"{group}, {key.replace('_', ' ')}"
                yield from _of_table(inner, value, here, within, code, star=star and key != "reference")


def _of_law(
    key: str, value: Any, given: Mapping[str, Any], place: Route, group: str, code: Code, *, star: bool
) -> Iterator[Field]:
    """The fields of a contact law or of a controller."""
    inner = value if isinstance(value, Mapping) else {}
    name = str(inner.get("name" if key == "controller" else "law") if inner else value)
    kind: Any = CONTROLLERS.get(name) if key == "controller" else BY_KIND[key].get(name)
    if ".py:" in name:
        kind = code.element(key, name, inner)
    if kind is None:
        return
    for field in _of_table(plain_table(kind), inner, place, f"{group}, {key}", code, star=star, law=name):
        if not (field.name == "restitution" and key == "damping" and given.get("restitution") is not None):
            yield field


def _choice(place: Route, group: str, value: str, help: str, choices: str) -> Field:
    return Field(place, group, str(place[-1]), value, (), Quantity("", help=help), choices=choices)


def _field(
    place: Route, group: str, name: str, value: Any, quantity: Quantity, *, star: bool = False, law: str = "", count: int = 1
) -> Iterator[Field]:
    """The field of one number, written or by default, or of two; none of anything else."""
    if isinstance(value, str):
        try:
            numbers = read_numbers(value, quantity.unit) if count > 1 else (read_quantity(value, quantity),)
        except InputError:  # of a unit that depends on other keys; the reader of the case knows it
            return
        if quantity.unit == "K":  # degrees Celsius have no factor, which sliders need
            value = written(numbers[0], "K")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        numbers = (float(value),)
        value = repr(value) if quantity.unit == "1" else written(float(value), quantity.unit)
    else:
        return
    if len(numbers) == count:
        yield Field(place, group, name, value, numbers, quantity, star and name in STARRED, law)
