"""Traversal of descriptions: their fields, the value at a path, and a copy with another value there."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, get_type_hints

from scissordyn.components.place import Point
from scissordyn.units import Quantity, extras, hints_of, quantities

Route = tuple[str | int, ...]  # Fields, keys and indices, from the top of a description
POINTS = Quantity("m", help="point that joints refer to, in the body's frame")  # Unit and help text of the points of a body


@dataclass(frozen=True)
class Declared:
    """Field of a class of descriptions (see `model`), as its annotation declares it."""

    name: str
    hint: Any  # Type, without the extras of `Annotated`
    extras: tuple[Any, ...]  # Extras of `Annotated`, such as a `Quantity` or a `Meaning`
    quantity: Quantity | None  # Unit and bounds, if it is a number
    default: Any  # `dataclasses.MISSING` for a required field


@dataclass(frozen=True)
class Place:
    """Value inside a description: where it is, and the unit, bounds and meaning that its field declares."""

    path: Route  # Fields, keys and indices that lead to it from the top of the description
    value: Any
    quantity: Quantity | None


def declared(kind: Any) -> Mapping[str, Declared]:
    """Return the declared fields of a class of descriptions, by name."""
    return _declared(kind)


@cache
def _declared(kind: Any) -> Mapping[str, Declared]:
    plain, annotated, numbers = get_type_hints(kind), hints_of(kind), quantities(kind)
    fields = {}
    for field in dataclasses.fields(kind):
        if field.init and not field.name.startswith("_"):
            name, hint = field.name, plain[field.name]
            default = field.default if field.default_factory is dataclasses.MISSING else field.default_factory()
            quantity = POINTS if hint == Mapping[str, Point] else numbers.get(name)
            fields[name] = Declared(name, hint, extras(annotated[name]), quantity, default)
    return MappingProxyType(fields)


def is_described(value: Any) -> bool:
    """Return whether a value is a description: an object with declared fields."""
    return dataclasses.is_dataclass(value) and not isinstance(value, type)


def non_default_fields(described: Any) -> Iterator[tuple[Declared, Any]]:
    """Yield the fields of a description whose values differ from their defaults, with these values."""
    for field in declared(type(described)).values():
        value = getattr(described, field.name)
        if repr(value) != repr(field.default) or value != field.default:
            yield field, value


def at(described: Any, path: Sequence[str | int]) -> Any:
    """Return the value at a path inside a description."""
    for key in path:
        described = getattr(described, str(key)) if is_described(described) else described[key]
    return described


def replaced(described: Any, path: Sequence[str | int], value: Any) -> Any:
    """Return a frozen description with another value at a path."""
    if not path:
        return value
    first, *rest = path
    inner: Any = replaced(at(described, path[:1]), rest, value)
    if isinstance(described, tuple):
        return tuple(inner if index == first else part for index, part in enumerate(described))
    if isinstance(described, Mapping):
        return {**described, first: inner}
    return dataclasses.replace(described, **{str(first): inner})
