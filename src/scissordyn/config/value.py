"""Readers of values by their type, whatever key has them: points, places, lists of numbers, of pairs and of names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scissordyn.annotation import MismatchError, body_point
from scissordyn.component.place import BodyPoint, Point
from scissordyn.config.code import code_of
from scissordyn.config.quantity import numbers_pattern, read_numbers
from scissordyn.config.table import Context, Reader, Shape, located, read_as, reader, toml
from scissordyn.errors import InputError
from scissordyn.units import Pairs, Quantity


def numbers_shape(unit: str, count: int | None = None) -> Shape:
    return {"type": "string", "pattern": numbers_pattern(unit, count)}


def columns_shape(columns: Mapping[str, Shape]) -> Shape:
    """A table of columns, all of which are given."""
    return {"type": "object", "properties": columns, "required": list(columns), "additionalProperties": False}


def _unit(about: tuple[Any, ...]) -> str:
    return next((extra.unit for extra in about if isinstance(extra, Quantity)), "m")


def pair(unit: str) -> Reader:
    """For two numbers and their unit."""

    @reader(lambda: numbers_shape(unit, 2))
    def read(given: Any, _: Context) -> Point:
        numbers = read_numbers(given, unit)
        if len(numbers) != 2:
            raise InputError(f"{len(numbers)} numbers", f"two numbers and their unit [{unit}]", f'"0.1, 0.2 {unit}"')
        return numbers[0], numbers[1]

    return read


PLACE = pair("m")


def _numbers(unit: str) -> Reader:
    return Reader(lambda given, _: read_numbers(given, unit), lambda: numbers_shape(unit))


def _pairs(pairs: Pairs) -> Reader:
    units = dict(zip(pairs.names, pairs.units, strict=True))

    @reader(lambda: columns_shape({name: numbers_shape(unit) for name, unit in units.items()}))
    def read(given: Any, _: Context) -> tuple[Point, ...]:
        if not isinstance(given, Mapping) or given.keys() != units.keys():
            sample = toml({name: f"0, 1 {unit}" for name, unit in units.items()})
            raise InputError("not a table of two lists", f"the keys {pairs.names[0]} and {pairs.names[1]}", sample)
        first, second = (read_numbers(given[name], unit) for name, unit in units.items())
        if len(first) != len(second):
            raise InputError(f"{len(first)} {pairs.names[0]} and {len(second)} {pairs.names[1]}", "as many of both")
        return tuple(zip(first, second, strict=True))

    return read


@reader(lambda: {"type": "array", "items": numbers_shape("m", 2)})
def _corners(given: Any, context: Context) -> tuple[Point, ...]:
    if not isinstance(given, list):
        raise InputError("not a list of corners", "a list of places", 'corners = ["-20, -10 mm", "20, -10 mm", "0, 10 mm"]')
    corners = []
    for place in given:
        with located("a corner"):
            corners.append(PLACE.read(place, context))
    return tuple(corners)


@reader(lambda: {"type": "object", "additionalProperties": numbers_shape("m", 2), "propertyNames": {"pattern": "^[^.]+$"}})
def _points(given: Any, context: Context) -> dict[str, Point]:
    if not isinstance(given, Mapping):
        raise InputError("not a table of points", "a name and a place for each point", 'points = { tip = "0.1, 0.2 m" }')
    points: dict[str, Point] = {}
    for name, place in given.items():
        with located(f"point '{name}'"):
            if "." in name and not code_of(context).recorded:
                raise InputError("a dot in the name", "names without a dot, which separates body and point")
            points[name] = PLACE.read(place, context)
    return points


@reader(lambda: {"type": "string", "pattern": r"^.+\..+$"})
def _body_point(given: Any, context: Context) -> BodyPoint:
    if isinstance(given, list) and len(given) == 2 and all(isinstance(name, str) for name in given):  # a name with a dot
        return given[0], given[1]
    try:
        return body_point(given if isinstance(given, str) else "")
    except MismatchError:
        raise InputError("not a point of a body", 'text "BODY.POINT", where the body may be ground', '"crank.end"') from None


BODY_POINT = _body_point


@reader(lambda: {"type": "string"})
def _named_or_placed(given: Any, context: Context) -> str | Point:
    if isinstance(given, list) and len(given) == 1 and isinstance(given[0], str):  # a name with a comma
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


def _of_points(about: tuple[Any, ...]) -> Reader:
    """Pairs of numbers with a meaning, or else corners."""
    return next((_pairs(extra) for extra in about if isinstance(extra, Pairs)), _corners)


read_as(BodyPoint, BODY_POINT)
read_as(Point, lambda about: pair(_unit(about)))
read_as(str | Point, _named_or_placed)
read_as(Mapping[str, Point], _points)
read_as(tuple[Point, ...], _of_points)
read_as(tuple[float, ...], lambda about: _numbers(_unit(about)))
read_as(tuple[str, ...], _names)
