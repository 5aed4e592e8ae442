"""Entries in which what two saved runs say of themselves differs."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from scissordyn.config.quantity import written
from scissordyn.model.walk import declared
from scissordyn.run.configuration import Configuration


def differences(one: Any, two: Any, place: str = "", unit: str = "") -> Iterator[tuple[str, str, str]]:
    """Entries in which two descriptions differ, with their address."""
    parts = [None if part is None else list(part) for part in (_parts(one, unit), _parts(two, unit))]
    left, right = ({name: (value, of) for name, value, of in part or ()} for part in parts)
    if parts[0] is None or parts[1] is None or type(one) is not type(two) or (isinstance(one, tuple) and len(one) != len(two)):
        if one != two:
            yield place, *_texts(one, two, unit)
        return
    for name in dict.fromkeys((*left, *right)):
        (value, of), (other, _) = left.get(name, (None, "")), right.get(name, (None, ""))
        yield from differences(value, other, f"{place}.{name}" if place else name, of)


def _parts(value: Any, unit: str) -> Iterable[tuple[str, Any, str]] | None:
    """Name, value and unit of what a value is made of; None for what is one thing."""
    if isinstance(value, Mapping):
        return ((str(key), part, unit) for key, part in value.items())
    if isinstance(value, tuple):
        return ((str(getattr(part, "name", None) or k), part, unit) for k, part in enumerate(value))
    kind = type(value)
    if not dataclasses.is_dataclass(kind):
        return None
    return (
        (name, getattr(value, name), field.quantity.unit if field.quantity is not None else "")
        for name, field in declared(kind).items()
        if (kind, name) != (Configuration, "text")
    )


def _texts(one: Any, two: Any, unit: str) -> tuple[str, str]:
    """Two values in short, with as many digits as it takes to tell them apart."""
    for digits in (6, 12, 17):
        found = _short(one, unit, digits), _short(two, unit, digits)
        if found[0] != found[1]:
            break
    return found


def _short(value: Any, unit: str, digits: int) -> str:
    if isinstance(value, float) and unit and digits < 17:
        number, _, named = written(float(f"{value:.{digits}g}"), unit).partition(" ")
        return f"{float(number):.{digits}g} {named}".rstrip()
    if isinstance(value, float):
        return f"{value:.{digits}g} {unit if unit != '1' else ''}".rstrip()
    if isinstance(value, tuple | Mapping):
        return "1 entry" if len(value) == 1 else f"{len(value)} entries"
    if dataclasses.is_dataclass(type(value)):
        return str(type(value).__name__)
    return "-" if value is None else str(value)
