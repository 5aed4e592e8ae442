"""Readers of values in a case file by type: points, lists, laws, controllers, materials and oils."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import partial
from typing import Any

from scissordyn.annotation import MismatchError, body_point
from scissordyn.casefile.code import AbsentPart, code_of
from scissordyn.casefile.quantity import NumbersText, read_numbers
from scissordyn.casefile.table import Context, Reader, Shape, add_prefix, build, plain_table, read_as, reader, toml, with_key
from scissordyn.components.place import BodyPoint, Point
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError, did_you_mean
from scissordyn.laws.catalogue import BY_KIND, MATERIALS
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.material import Material
from scissordyn.laws.oil import OILS, Oil, oil_of
from scissordyn.model.clearance import Lubrication
from scissordyn.plugin.element import SLOTS
from scissordyn.units import Pairs, Quantity


def columns_shape(columns: Mapping[str, Shape]) -> Shape:
    """Return the JSON Schema of a table with required columns."""
    return {"type": "object", "properties": columns, "required": list(columns), "additionalProperties": False}


def _unit(about: tuple[Any, ...]) -> str:
    return next((extra.unit for extra in about if isinstance(extra, Quantity)), "m")


def pair_reader(unit: str) -> Reader:
    """Return the reader of a text with two numbers and their unit."""

    @reader(lambda: NumbersText(unit, 2))
    def read(given: Any, _: Context) -> Point:
        numbers = read_numbers(given, unit)
        if len(numbers) != 2:
            raise InputError(f"{len(numbers)} numbers", f"two numbers and their unit [{unit}]", f'"0.1, 0.2 {unit}"')
        return numbers[0], numbers[1]

    return read


PLACE = pair_reader("m")  # Reader of a position in a case file: two coordinates with a unit of length


def _numbers(unit: str) -> Reader:
    return Reader(lambda given, _: read_numbers(given, unit), lambda: NumbersText(unit, None))


def _pairs(pairs: Pairs) -> Reader:
    units = dict(zip(pairs.names, pairs.units, strict=True))

    @reader(lambda: columns_shape({name: NumbersText(unit, None) for name, unit in units.items()}))
    def read(given: Any, _: Context) -> tuple[Point, ...]:
        if not isinstance(given, Mapping) or given.keys() != units.keys():
            sample = toml({name: f"0, 1 {unit}" for name, unit in units.items()})
            raise InputError("not a table of two lists", f"the keys {pairs.names[0]} and {pairs.names[1]}", sample)
        first, second = (read_numbers(given[name], unit) for name, unit in units.items())
        if len(first) != len(second):
            raise InputError(f"{len(first)} {pairs.names[0]} and {len(second)} {pairs.names[1]}", "lists of equal length")
        return tuple(zip(first, second, strict=True))

    return read


@reader(lambda: {"type": "array", "items": NumbersText("m", 2)})
def _corners(given: Any, context: Context) -> tuple[Point, ...]:
    if not isinstance(given, list):
        raise InputError("not a list of corners", "a list of places", 'corners = ["-20, -10 mm", "20, -10 mm", "0, 10 mm"]')
    corners = []
    for place in given:
        with add_prefix("a corner"):
            corners.append(PLACE.read(place, context))
    return tuple(corners)


@reader(lambda: {"type": "object", "additionalProperties": NumbersText("m", 2), "propertyNames": {"pattern": "^[^.]+$"}})
def _points(given: Any, context: Context) -> dict[str, Point]:
    if not isinstance(given, Mapping):
        raise InputError("not a table of points", "a name and a place for each point", 'points = { tip = "0.1, 0.2 m" }')
    points: dict[str, Point] = {}
    for name, place in given.items():
        with add_prefix(f"point '{name}'"):
            if "." in name and not code_of(context).recorded:
                raise InputError("the name has a dot", "a name without a dot, which separates body and point")
            points[name] = PLACE.read(place, context)
    return points


def _named_numbers(unit: str) -> Reader:
    @reader(lambda: {"type": "object", "additionalProperties": NumbersText(unit, 1)})
    def read(given: Any, _: Context) -> dict[str, float]:
        if not isinstance(given, Mapping):
            raise InputError("not a table of numbers", f"a name and a number with its unit [{unit}] for each entry")
        numbers: dict[str, float] = {}
        for name, value in given.items():
            with add_prefix(f"'{name}'"):
                numbers[name], *others = read_numbers(value, unit)
                if others:
                    raise InputError(f"{1 + len(others)} numbers", f"one number with its unit [{unit}]")
        return numbers

    return read


@reader(lambda: {"type": "string", "pattern": r"^.+\..+$"})
def _body_point(given: Any, context: Context) -> BodyPoint:
    if (
        isinstance(given, list) and len(given) == 2 and all(isinstance(name, str) for name in given)
    ):  # body and point as a list, because the name has a dot
        return given[0], given[1]
    try:
        return body_point(given if isinstance(given, str) else "")
    except MismatchError:
        raise InputError("not a point of a body", 'text "BODY.POINT", where the body may be ground', '"crank.end"') from None


BODY_POINT = _body_point  # Reader of a point of a body in a case file, such as "crank.end"


@reader(lambda: {"type": "string"})
def _named_or_placed(given: Any, context: Context) -> str | Point:
    if (
        isinstance(given, list) and len(given) == 1 and isinstance(given[0], str)
    ):  # name of a point as a list, because the name has a comma
        return given[0]
    if not isinstance(given, str):
        raise InputError("not a point", 'the name of a point, or a place as "1.2, 0 m"', 'point = "end"')
    place: str | Point = given if "," not in given else PLACE.read(given, context)
    return place


@reader(lambda: {"type": "array", "items": {"type": "string"}})
def _names(given: Any, context: Context) -> tuple[str, ...]:
    if not isinstance(given, list | tuple) or not all(isinstance(name, str) for name in given):
        raise InputError("not a list of names", "names of bodies", '["crank", "crank/1"]')
    return tuple(given)


read_as(BodyPoint, BODY_POINT)
read_as(Point, lambda about: pair_reader(_unit(about)))
read_as(str | Point, _named_or_placed)
read_as(Mapping[str, Point], _points)
read_as(Mapping[str, float], lambda about: _named_numbers(_unit(about)))
read_as(tuple[Point, ...], lambda about: next((_pairs(extra) for extra in about if isinstance(extra, Pairs)), _corners))
read_as(tuple[float, ...], lambda about: _numbers(_unit(about)))
read_as(tuple[str, ...], _names)


SUGGESTED_LAWS = {"stiffness": "liu", "damping": "flores", "friction": "none"}
"""Names of the laws that templates suggest, by kind of law: the defaults of a clearance joint."""

CONTROLLER_EXAMPLE: dict[str, Any] = {"name": "pid", "proportional": "2e4 N m/rad", "derivative": "1500 N m s/rad"}
"""Controller that templates and error messages show as an example."""


def _read_element(slot: str, given: Any, context: Context) -> Any:
    """Read a law or a controller; a damping law gets the restitution coefficient of its table, if that is given."""
    key, classes, file, sample = (
        ("name", CONTROLLERS, "my_control.py:steer", f"controller = {toml(CONTROLLER_EXAMPLE)}")
        if slot == "controller"
        else ("law", BY_KIND[slot], "my_laws.py:soft", f'{slot} = "{SUGGESTED_LAWS[slot]}"')
    )
    title, allowed = SLOTS[slot].slot.title, ", ".join(classes) + f", or a class or function in a file as {file}"
    parameters = dict(given) if isinstance(given, Mapping) else {key: given}
    name = parameters.pop(key, None)
    if not isinstance(name, str):
        raise InputError(f"the {title} has no name", allowed, sample)
    restitution = context.get("values", {}).get("restitution") if slot == "damping" else None
    if restitution is not None:
        if "restitution" in parameters:
            raise InputError(f"restitution is given both for the joint and for its {title}", "one restitution")
        parameters["restitution"] = restitution
    code = code_of(context)
    kind: Any = code.element(slot, name, parameters) if code.names(name) else classes.get(name)
    if isinstance(kind, AbsentPart):
        return kind
    if kind is None:
        near = get_close_matches(name, classes, n=1, cutoff=0.5) if slot != "controller" else []
        example = f'{slot} = "{near[0]}"' if near else sample
        raise InputError(f"unknown {title} '{name}'{did_you_mean(name, classes)}", allowed, example)
    if restitution is not None and "restitution" not in {field.name for field in dataclasses.fields(kind)}:
        what = f"restitution is given for the joint, but {title} '{name}' does not have this parameter"
        raise InputError(what, "no key restitution, or a damping law with a restitution coefficient")
    return build(kind, parameters, context)


def _named_tables(key: str, classes: Mapping[str, type]) -> Shape:
    """Return the JSON Schema of a law or controller: its name, or a table with its parameters.

    Parameters of user-defined classes are not checked.
    """
    in_file = {"type": "string", "pattern": r"\.py:"}
    tables = [with_key(key, {"const": name}, plain_table(kind)) for name, kind in classes.items()]
    further = {"type": "object", "properties": {key: in_file}, "required": [key]}
    return {"anyOf": [{"enum": list(classes)}, in_file, *tables, further]}


def _table_or_name(kind: type, names: Iterable[str] | None) -> Shape:
    """Return the JSON Schema of a name or a table of parameters; if `names` is None, any name is allowed."""
    text = {"type": "string"} if names is None else {"enum": list(names)}
    return {"anyOf": [text, with_key("name", {"type": "string"}, plain_table(kind), required=False)]}


@reader(lambda: _table_or_name(Material, MATERIALS))
def _read_material(given: Any, context: Context) -> Any:
    if isinstance(given, Mapping):
        return build(Material, {"name": "custom", **given}, context)
    if not isinstance(given, str) or given not in MATERIALS:
        allowed = ", ".join(MATERIALS) + ", or a table of youngs_modulus, poisson_ratio and density"
        raise InputError(f"unknown material{did_you_mean(str(given), MATERIALS)}", allowed)
    return MATERIALS[given]


@reader(lambda: _table_or_name(Oil, None))
def _read_oil(given: Any, context: Context) -> Any:
    if isinstance(given, Mapping):
        return build(Oil, {"name": "custom", **given}, context)
    if not isinstance(given, str):
        raise InputError(f"unknown oil {given!r}", ", ".join(OILS) + ", or a table of viscosity_40, viscosity_100 and density")
    return oil_of(given)


@reader(lambda: {"anyOf": [{"type": "string"}, plain_table(Lubrication)]})
def _read_lubrication(given: Any, context: Context) -> Any:
    return build(Lubrication, {"oil": given} if isinstance(given, str) else given, context)


for _slot, _kind in ((Elastic, "stiffness"), (Damping, "damping"), (Friction, "friction")):
    read_as(_slot, Reader(partial(_read_element, _kind), partial(_named_tables, "law", BY_KIND[_kind])))
read_as(Controller, Reader(partial(_read_element, "controller"), partial(_named_tables, "name", CONTROLLERS)))
read_as(Material, _read_material)
read_as(Oil, _read_oil)
read_as(Lubrication, _read_lubrication)
