"""What stands in the annotation of a key of a table: its reader, what that accepts for editors, and what the key is for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

Shape = Any
"""A class of tables, or a mapping of JSON Schema whose values may be such classes."""

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
