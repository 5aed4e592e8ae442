"""Form fields for the values of a case, with unit, bounds and help from the declarations of the keys."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scissordyn.casefile.case import REPEATABLE_TABLES, WEAR_READER
from scissordyn.casefile.code import Code
from scissordyn.casefile.part import component_part
from scissordyn.casefile.quantity import read_numbers, read_quantity, rounded_text, unit_factor
from scissordyn.casefile.structure import STRUCTURES, BendingTable, ClearanceTable, ControlTable
from scissordyn.casefile.table import Key, Reader, Shape, Table, plain_table, table_of
from scissordyn.casefile.text import table_name
from scissordyn.casefile.time_function import TIME_FUNCTION_TABLES, DriveTable
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.errors import InputError
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.laws.oil import OILS
from scissordyn.model.clearance import Lubrication
from scissordyn.model.options import Options
from scissordyn.model.section import MATERIALS, SECTIONS
from scissordyn.model.walk import Route
from scissordyn.units import Quantity, short

SLIDER_FIELDS = ("clearance", "speed", "kinetic", "angle", "end", "duration", "limit")
"""Input fields of the page that initially have a slider, in the tables of `SLIDER_TABLES` and in [structure]."""

# Tables of a case file whose input fields can have sliders, in addition to [structure]
SLIDER_TABLES = ("drive", "control", "clearance", "guide_clearance")

# Reader of one table of a case file, by name of the table
TABLE_READERS: Mapping[str, Reader] = {
    "drive": DriveTable.reader(),
    "control": ControlTable.reader(),
    "wear": WEAR_READER,
    **{section: read for section, (read, _) in REPEATABLE_TABLES.items()},
}
CHOICES: Mapping[tuple[Any, str], str] = {
    (BendingTable, "section"): "; ".join(sample for _, sample in SECTIONS.values()),
    (BendingTable, "material"): ", ".join(MATERIALS),
    (BendingTable, "modes"): "auto; a number of modes",
    (BendingTable, "elements"): "a number of elements",
    (ClearanceTable, "lubrication"): ", ".join(OILS),
    (plain_table(Lubrication), "oil"): ", ".join(OILS),
}
"""Allowed texts of input fields with a text or a count, by table class and key; these fields have no slider."""
VECTOR_UNITS = {"position": "m", "centre": "m", "through": "m", "coupler_point": "m", "velocity": "m/s"}
"""Unit of each key of a case file whose value has two coordinates."""


NUMBER = r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*"  # pattern of a number in the text of an input field


@dataclass(frozen=True)
class Field:
    """Form field: a value of a case, or both coordinates of a point."""

    place: Route
    group: str  # Table or part that contains the value
    name: str
    text: str  # Text as written, with its unit
    value: tuple[float, ...]  # Values in SI units
    quantity: Quantity
    starred: bool = False  # True if the field initially has a slider
    law: str = ""  # Law that contains the field, if the case gives only the name of the law
    choices: str = ""  # Allowed texts, for a field that is not numeric

    @property
    def key(self) -> str:
        """Place in the case as one text, which identifies the field."""
        return ".".join(map(str, self.place))

    @property
    def label(self) -> str:
        """Text with group and name of the field."""
        return f"{self.group if self.group != 'structure' else ''} {self.name.replace('_', ' ')}".strip()

    @property
    def range(self) -> tuple[float, float, bool] | None:
        """Ends of the slider in SI units, and True for a logarithmic scale; None without a slider."""
        turn = math.radians(30.0)  # the slider of an angle extends by this to both sides [rad]
        spread = 4.0  # other sliders extend from value / spread to value * spread, on a logarithmic scale
        if len(self.value) != 1:
            return None
        value = self.value[0]
        low = max(bound for bound in (self.quantity.above, self.quantity.minimum) if bound is not None)
        high = min(bound for bound in (self.quantity.below, self.quantity.maximum) if bound is not None)
        if self.quantity.unit == "rad":
            return max(low, value - turn), min(high, value + turn), False
        if value == 0.0:
            # zero has no scale, so that only a bounded parameter gets a slider
            return (low, high, False) if math.isfinite(high - low) and high - low <= 10.0 else None
        if value < 0.0:
            return max(low, spread * value), min(high, value / spread), False
        ends = max(low, value / spread), min(high, spread * value)
        return *ends, ends[0] > 0.0 and ends[1] / ends[0] > 3.0

    @property
    def unit(self) -> str:
        """Unit in the text of the value; "" without unit."""
        return re.sub(rf"^{NUMBER}(?:,{NUMBER})*", "", self.text)

    @property
    def is_integer(self) -> bool:
        """True for a count."""
        return self.quantity.unit == "1" and self.text.isdecimal()

    @property
    def shown(self) -> str:
        """Text of the field, shortened if it has many digits."""
        longest = 14  # number of characters that fit in the form
        if len(self.text) <= longest or len(self.value) != 1:
            return self.text
        value = self.value[0]
        return short(value, "m") if self.quantity.unit == "m" else f"{value:.5g} {self.quantity.unit}".removesuffix(" 1")

    def plain(self) -> dict[str, Any]:
        """Return the field as a dictionary for the page."""
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
            or (self.quantity.expected if len(self.value) == 1 else f"two numbers [{self.quantity.unit}]"),
            "starred": self.starred and span is not None,
            "slider": slider,
            "whole": self.is_integer,
            "unit": unit,
            "factor": unit_factor(unit, self.quantity.unit) if unit else 1.0,
        }


def fields_of(tree: Mapping[str, Any], code: Code) -> list[Field]:
    """Return the form fields of all tables of a case file."""
    structure = tree.get("structure", {})
    kind = STRUCTURES[structure["kind"]]
    fields = list(_table_fields(kind, structure, ("structure",), "structure", code, star=not _sets_start(tree)))
    for section in (section for section in TABLE_READERS if section in tree):
        tables = tree[section]
        many = isinstance(tables, list)
        for index, item in enumerate(tables if many else [tables]):
            group = f"{section.replace('_', ' ')} {table_name(item)}".strip()
            place: Route = (section, index) if many else (section,)
            table = _component(item["type"], code) if section == "component" else _table_in(TABLE_READERS[section].shape())
            fields += _table_fields(table, item, place, group, code, star=section in SLIDER_TABLES)
    options = table_of(Options, until="50 ms", step="0.1 ms")
    return [*fields, *_table_fields(options, tree.get("run", {}), ("run",), "run", code)]


def _table_in(shape: Shape) -> Any:
    """Return the table class in a schema, alone or as one of several alternatives; None if there is none."""
    if isinstance(shape, Mapping):
        return next(filter(None, map(_table_in, (*shape.get("anyOf", ()), shape.get("items")))), None)
    return shape if isinstance(shape, type) else None  # a schema may also be that of a number or a text


def _table_of_key(key: Key, reader: Reader, entries: Mapping[str, Any]) -> Any:
    """Return the table class of a key's value; that of a motion depends on the kind of its coordinate."""
    if key.name == "motion" and "coordinate" in entries:
        return DriveTable if "angle" in entries["coordinate"] else TIME_FUNCTION_TABLES["m"]
    return BendingTable if key.name == "bars" else _table_in(reader.shape())


def _component(kind: str, code: Code) -> type[Table]:
    named = code.reference("component", kind) if ".py:" in kind else kind
    return component_part(named, code.folder or Path()).table


def _sets_start(tree: Mapping[str, Any]) -> bool:
    """Return True if a drive, a reference or an actuated length determines the start, not the structure's angle."""
    many = [table if isinstance(table, list) else [table] for table in (tree.get("drive", []), tree.get("control", []))]
    references = (control.get("reference", {}) for control in many[1])
    actuated = any("motion" in rod for rod in tree.get("rod", []))
    return actuated or any({*motion} - {"speed", "body"} for motion in (*many[0], *references))


def _table_fields(
    table: type[Table], entries: Mapping[str, Any], place: Route, group: str, code: Code, *, star: bool = False, law: str = ""
) -> Iterator[Field]:
    """Yield the fields of a table, including keys with default values.

    `place` and `group` locate the table in the case. With `star`, fields of `SLIDER_FIELDS` have sliders. `law` is the name of
    the law that the table describes.
    """
    for key, declaration in table.declared_keys().items():
        here = (*place, key)
        value = entries.get(key, None if declaration.required else declaration.default)
        quantity = declaration.quantity
        if isinstance(value, str | int) and (table, key) in CHOICES:
            units = Quantity("", help=declaration.help)
            yield Field(here, group, key, str(value), (), units, choices=CHOICES[table, key])
        elif quantity is not None and quantity.unit and not isinstance(value, tuple | Mapping | list):
            yield from _number_field(here, group, key, value, quantity, star=star, law=law)
        elif key == "points" and isinstance(value, Mapping):
            for name, point in value.items():
                yield from _number_field(
                    (*here, name), group, f"point {name}", point, Quantity("m", help=declaration.help), count=2
                )
        elif isinstance(value, str) and key in VECTOR_UNITS:
            yield from _number_field(here, group, key, value, Quantity(VECTOR_UNITS[key], help=declaration.help), count=2)
        elif key in BY_KIND or key == "controller":
            yield from _law_fields(key, value, entries, here, group, code, star=star)
        elif isinstance(value, Mapping) and declaration.reader is not None:
            inner = _table_of_key(declaration, declaration.reader, entries)
            if inner is not None:
                within = f"{group}, {key.replace('_', ' ')}"
                yield from _table_fields(inner, value, here, within, code, star=star and key != "reference")


def _law_fields(
    key: str, value: Any, entries: Mapping[str, Any], place: Route, group: str, code: Code, *, star: bool
) -> Iterator[Field]:
    """Yield the fields of a contact law or a controller that is the value of a key in the table `entries`."""
    inner = value if isinstance(value, Mapping) else {}
    name = str(inner.get("name" if key == "controller" else "law") if inner else value)
    kind: Any = CONTROLLERS.get(name) if key == "controller" else BY_KIND[key].get(name)
    if ".py:" in name:
        kind = code.element(key, name, inner)
    if kind is None:
        return
    for field in _table_fields(plain_table(kind), inner, place, f"{group}, {key}", code, star=star, law=name):
        if not (field.name == "restitution" and key == "damping" and entries.get("restitution") is not None):
            yield field


def _number_field(
    place: Route, group: str, name: str, value: Any, quantity: Quantity, *, star: bool = False, law: str = "", count: int = 1
) -> Iterator[Field]:
    """Yield the field of a value with `count` numbers; yield nothing if the value has another form."""
    if isinstance(value, str):
        try:
            numbers = read_numbers(value, quantity.unit) if count > 1 else (read_quantity(value, quantity),)
        except InputError:  # the unit depends on other keys, which are not known here
            return
        if quantity.unit == "K":  # a slider needs a unit without offset
            value = rounded_text(numbers[0], "K")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        numbers = (float(value),)
        value = repr(value) if quantity.unit == "1" else rounded_text(float(value), quantity.unit)
    else:
        return
    if len(numbers) == count:
        yield Field(place, group, name, value, numbers, quantity, star and name in SLIDER_FIELDS, law)
