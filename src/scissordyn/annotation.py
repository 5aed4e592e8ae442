"""Check values against type annotations, and describe values and annotations in messages."""

from __future__ import annotations

import types
import typing
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from numbers import Real
from typing import Annotated, Any

_ACCEPTED: set[tuple[Any, type]] = set()
"""Pairs of a type hint and a type whose values fit it unchanged, to make repeated checks fast."""

SHOWN_LENGTH_MAX = 60  # [characters] longer values are truncated in messages


class MismatchError(ValueError):
    """Error: a value does not fit its annotation."""


def is_number(value: object) -> bool:
    """Return True if a value is a real number, also of NumPy; a bool is not a number."""
    return isinstance(value, Real) and not isinstance(value, bool)


@cache
def plain_hint(hint: Any) -> Any:
    """Return a type hint without `Annotated`."""
    return typing.get_args(hint)[0] if typing.get_origin(hint) is Annotated else hint


@cache
def members(hint: Any) -> tuple[Any, ...]:
    """Return the members of a union, flattened; any other hint is its only member."""
    hint = plain_hint(hint)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return tuple(inner for member in typing.get_args(hint) for inner in members(member))
    return (hint,)


def accepted(value: Any, hint: Any) -> Any:
    """Return a value that fits its annotation, with numbers and sequences of other libraries converted to Python's own.

    Raises `MismatchError` if the value does not fit.
    """
    pair = hint, type(value)
    if pair in _ACCEPTED:
        return value
    fitting = _accepted(value, hint)
    if fitting is value and type_decides(hint):
        _ACCEPTED.add(pair)
    return fitting


@cache
def type_decides(hint: Any) -> bool:
    """Return True if the type of a value is sufficient to check it against a hint; it is not for sequences and literals."""
    return all(isinstance(member, type) and typing.get_origin(member) is None for member in members(hint))


def _accepted(value: Any, hint: Any) -> Any:
    kinds = members(hint)
    if len(kinds) > 1:
        for member in kinds:
            try:
                return accepted(value, member)
            except MismatchError:
                continue
        raise MismatchError
    hint = kinds[0]
    origin, inside = typing.get_origin(hint), typing.get_args(hint)
    if hint in (float, int):
        return _number(value, hint)
    if origin is typing.Literal:
        if not isinstance(value, str | int) or value not in inside:
            raise MismatchError
        return value
    if origin is tuple:
        return _entries(value, inside)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise MismatchError
        return _unless_same(value, {accepted(key, inside[0]): accepted(item, inside[1]) for key, item in value.items()})
    if origin is Callable:
        if not callable(value):
            raise MismatchError
        return value
    if isinstance(origin, type) and issubclass(origin, Iterable):
        if not isinstance(value, Iterable) or isinstance(value, str | bytes):
            raise MismatchError
        # do not iterate over other iterables, which may be iterators, or over `ArrayLike`, which may be nested
        checked = isinstance(value, list | tuple) and bool(inside) and origin.__module__ == "collections.abc"
        for item in value if checked else ():
            accepted(item, inside[0])
        return value
    if isinstance(origin, type) and not isinstance(value, origin):
        raise MismatchError
    return _object(value, hint)


def _number(value: Any, kind: type) -> Any:
    if type(value) in (float, int) and (kind is float or type(value) is int):
        return value
    if not is_number(value):
        raise MismatchError
    try:
        converted = kind(value)
    except (ValueError, OverflowError):  # nan and infinity cannot be converted to int
        raise MismatchError from None
    if converted != value and kind is int:
        raise MismatchError
    return converted


def _object(value: Any, hint: Any) -> Any:
    if hint is Any or not isinstance(hint, type):
        return value
    if hint is bool and type(value).__name__ in ("bool", "bool_"):  # NumPy's bool is not a subclass of bool
        return bool(value)
    if isinstance(value, type) or not isinstance(value, hint):
        raise MismatchError
    return value


def body_point(text: str) -> tuple[str, str]:
    """Return body and point of the text "BODY.POINT"; raise `MismatchError` for any other text."""
    body, _, point = text.rpartition(".")
    if not (body and point):
        raise MismatchError
    return body, point


def _entries(value: Any, inside: tuple[Any, ...]) -> tuple[Any, ...]:
    if isinstance(value, str) and inside == (str, str):
        return body_point(value)
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise MismatchError
    try:
        items = tuple(value)
    except TypeError:  # array without dimensions
        raise MismatchError from None
    hints = inside[:1] * len(items) if inside[1:] == (Ellipsis,) else inside
    if len(items) != len(hints):
        raise MismatchError
    entries = tuple(map(accepted, items, hints))
    return _unless_same(value, entries) if isinstance(value, tuple) else entries


def _unless_same(value: Any, new: Any) -> Any:
    """Return `new`, a sequence or mapping with converted entries, if an entry differs from that of `value`; else `value`."""
    pairs = zip(value.items(), new.items(), strict=True) if isinstance(value, Mapping) else zip(value, new, strict=True)
    return value if all(old is other or (isinstance(old, tuple) and old == other) for old, other in pairs) else new


def in_words(hint: Any) -> str:
    """Return an annotation as text for a message, for example "text" or "ConstantSpeed, Harmonic or None"."""
    kinds = members(hint)
    if len(kinds) > 1:
        words = list(dict.fromkeys(map(in_words, kinds)))
        return f"{', '.join(words[:-1])} or {words[-1]}" if words[1:] else words[0]
    hint = kinds[0]
    origin, inside = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Literal:
        return " or ".join(f'"{name}"' for name in inside)
    if origin is tuple and inside[1:] == (Ellipsis,):
        return f"a tuple, each entry {in_words(inside[0])}"
    if origin is tuple:
        return f"({', '.join(map(in_words, inside))})"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"a dict of {in_words(inside[0])} to {in_words(inside[1])}"
    if origin is Callable:
        return "a function"
    if isinstance(origin, type):
        return f"several, each {in_words(inside[0])}" if inside else "several"
    names = {str: "text", float: "a number", int: "a whole number", bool: "True or False", types.NoneType: "None"}
    return names.get(hint) or f"{getattr(hint, '__name__', hint)}"


def shown(value: Any) -> str:
    """Return a value as text for a message, cut to `SHOWN_LENGTH_MAX` characters."""
    text = f"the class {value.__name__}" if isinstance(value, type) else " ".join(repr(value).split())
    return text if len(text) <= SHOWN_LENGTH_MAX else f"{text[: SHOWN_LENGTH_MAX - 3]}..."
