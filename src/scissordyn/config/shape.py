"""What a reader of a case file accepts, for editors: a table, or JSON Schema in which a table stands for its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

Shape = Any
"""A class of tables, or a mapping of JSON Schema whose values may be such classes."""

Reader = TypeVar("Reader", bound=Callable[..., Any])

_SHAPES: dict[Callable[..., Any], Callable[[], Shape]] = {}


@dataclass(frozen=True)
class Accepts:
    """In an annotation: what a key accepts whose reader stands elsewhere."""

    shape: Callable[[], Shape]  # Gives it when it is asked for


def accepting(shape: Callable[[], Shape]) -> Callable[[Reader], Reader]:
    """For a function that reads a value: say what it accepts."""

    def noted(reader: Reader) -> Reader:
        _SHAPES[reader] = shape
        return reader

    return noted


def shape_of(reader: Callable[..., Any]) -> Shape:
    """What a function that reads a value accepts; a `KeyError` if it does not say."""
    return _SHAPES[reader]()
