"""Results of a function that are kept with the object they were computed from."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

__all__ = ["has_kept", "keep", "kept", "take_over", "without_kept"]

Source = TypeVar("Source")
Found = TypeVar("Found")

PLACE = "_kept"


def kept(function: Callable[[Source], Found]) -> Callable[[Source], Found]:
    """A function of one immutable object that computes its result once for each and keeps it there.

    It is told by identity, since comparing two descriptions takes as long as computing. Callers must not change the result.
    """

    @functools.wraps(function)
    def found(source: Source) -> Found:
        results: dict[Any, Any] = source.__dict__.setdefault(PLACE, {})
        if function not in results:
            results[function] = function(source)
        result: Found = results[function]
        return result

    return found


def has_kept(function: Callable[[Source], Found], source: Source) -> bool:
    """Whether the result of a `kept` function is there."""
    return function.__wrapped__ in source.__dict__.get(PLACE, ())  # type: ignore[attr-defined]


def keep(function: Callable[[Source], Found], source: Source, result: Found) -> None:
    """Keep a result of a `kept` function that is known without computing it."""
    source.__dict__.setdefault(PLACE, {})[function.__wrapped__] = result  # type: ignore[attr-defined]


def take_over(function: Callable[[Source], Found], known: Source, other: Source) -> None:
    """Keep with another object what one of them has kept, where both have the same result; nothing if it has not."""
    if has_kept(function, known):
        keep(function, other, function(known))


def without_kept(source: object) -> dict[str, Any]:
    """The attributes of an object without what is kept with it, to be copied or sent to another process."""
    return {name: value for name, value in source.__dict__.items() if name != PLACE}
