"""How values of keys are read: by a reader in the annotation, or by that of their type; and what a key is for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Any

from scissordyn.annotation import members

Shape = Any  # A class of tables, or a mapping of JSON Schema whose values may be such classes

Context = dict[str, Any]
"""What readers know beside their value: the "folder" of relative file names, and the "values" of the keys before in a table."""


@dataclass(frozen=True, eq=False)
class Reader:
    """In an annotation: how the value of a key is read, and what is accepted."""

    read: Callable[[Any, Context], Any]
    shape: Callable[[], Shape]


@dataclass(frozen=True, eq=False)
class About:
    """In an annotation: what a key is for, in one line, and examples of its values."""

    description: str = ""
    examples: Sequence[Any] = ()


def reader(shape: Callable[[], Shape]) -> Callable[[Callable[[Any, Context], Any]], Reader]:
    """Makes a function a reader; what it accepts is asked for late, since tables are made late."""
    return lambda read: Reader(read, shape)


_READERS: dict[frozenset[Any], Callable[[tuple[Any, ...]], Reader]] = {}
"""By the members of a type: from what an annotation says beside it, such as a unit, to the reader."""


def read_as(hint: Any, make: Reader | Callable[[tuple[Any, ...]], Reader]) -> None:
    """Let all keys of a type be read by a reader, unless their annotation has another."""
    _READERS[frozenset(members(hint))] = make if callable(make) else lambda _: make


def reader_of(hint: Any, about: tuple[Any, ...]) -> Reader | None:
    make = _READERS.get(frozenset(members(hint)) - {NoneType})
    return None if make is None else make(about)
