"""Descriptions as plain data, which a saved run contains."""

from __future__ import annotations

import hashlib
import inspect
import tokenize
import types
from collections.abc import Iterator, Mapping
from functools import cache, partial
from typing import Any

from scissordyn.errors import InputError
from scissordyn.model.walk import declared, is_described
from scissordyn.plugin.user_file import origin_of

PACKAGE = "scissordyn"  # Name of this package, with which the modules of built-in classes begin
KIND = "kind"  # Key for the class of a model object in its plain data (types of JSON)
FUNCTION, CLASS = "function", "class"
"""Keys for user-defined functions and classes in plain data (types of JSON)."""

DIGEST = "digest"  # Key for the digest of a user-defined function or class in plain data (types of JSON)


def to_plain(described: Any) -> Any:
    """Convert a frozen description to nested dicts, lists, strings and numbers."""
    if isinstance(described, _SCALARS):
        return described
    if isinstance(described, tuple | list):
        if _SCALAR_TYPES.issuperset(map(type, described)):
            return list(described)
        # scalars are most of all values and get no call of their own
        return [item if isinstance(item, _SCALARS) else to_plain(item) for item in described]
    if isinstance(described, Mapping):
        return {str(key): value if isinstance(value, _SCALARS) else to_plain(value) for key, value in described.items()}
    if is_described(described):
        kind: Any = type(described)
        values = {}
        for name in declared(kind):
            value = getattr(described, name)
            values[name] = value if isinstance(value, _SCALARS) else to_plain(value)
        return _head_of(kind) | values
    if callable(described):
        name = getattr(described, "__name__", repr(described))
        return {KIND: FUNCTION, "name": name, "source": source_of(described), DIGEST: code_digest(described)}
    raise InputError(f"a {type(described).__name__} in a mechanism or its options", "values that can be written to a file")


def _head_of(described: Any) -> dict[str, Any]:
    """Return the name of a class; for a user-defined one its origin and the digest of its code."""
    if described.__module__.startswith(f"{PACKAGE}.") or not hasattr(described, "declaration"):
        return {KIND: kind_of(described)}
    origin = origin_of(described)
    if origin is not None:
        return {KIND: origin[0], DIGEST: origin[1]}
    code = [*described.declaration.kernels.values(), described.parameters]
    return {KIND: CLASS, CLASS: described.__qualname__, DIGEST: code_digest(code)}


def first_difference(first: Any, second: Any, place: str = "") -> tuple[str, Any, Any]:
    """Return the first place at which two unequal trees of plain data differ, and both values."""
    while isinstance(first, dict | list) and type(first) is type(second):
        entries, others = _entries(first), _entries(second)
        key = next(key for key in {**entries, **others} if entries.get(key) != others.get(key))
        place += f"[{key}]" if isinstance(first, list) else f"{'.' if place else ''}{key}"
        first, second = entries.get(key), others.get(key)
    return place, first, second


def _entries(tree: dict[str, Any] | list[Any]) -> dict[Any, Any]:
    """Return the entries of a dictionary or list by key or index."""
    return tree if isinstance(tree, dict) else dict(enumerate(tree))


_SCALARS = (str, int, float, bool, type(None))  # Types of values that `to_plain` leaves unchanged
_SCALAR_TYPES = frozenset(_SCALARS)  # Types in `_SCALARS`, as a set to compare with the types of a list's entries


@cache
def kind_of(described: type) -> str:
    """Return the name of a class in a file."""
    return f"{described.__module__}.{described.__qualname__}".removeprefix(f"{PACKAGE}.")


def source_of(function: Any) -> str:
    """Return the source text of a function; empty if it is not available."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError, SyntaxError, tokenize.TokenError):  # no source, or its file has changed
        return ""


def function_text(function: Any) -> str:
    """Return the source of a function, or its byte code without one; that of a `functools.partial` has its arguments too."""
    if isinstance(function, partial):
        return f"{function_text(function.func)}{function.args}{sorted(function.keywords.items())}"
    return source_of(function) or repr(getattr(function, "__code__", function))


def code_digest(function: Any) -> str:
    """Return a digest of a Python function: byte code, constants, and functions that it refers to."""
    digest = hashlib.sha256()
    for part in _parts(function, set()):
        digest.update(f"{len(part)} ".encode() + part)
    return digest.hexdigest()[:16]


def _parts(value: Any, met: set[int]) -> Iterator[bytes]:
    """Yield the parts of a value as bytes; only the name for a module, class or object, whose behaviour its version fixes."""
    value = getattr(value, "py_func", value)  # compiled functions
    if isinstance(value, types.FunctionType):
        if id(value) in met:
            return
        met.add(id(value))
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        names = sorted(set(_names(value.__code__)) & value.__globals__.keys())
        yield from _parts([value.__code__, value.__defaults__, cells, *(value.__globals__[name] for name in names)], met)
    elif isinstance(value, types.CodeType):
        yield value.co_code
        yield from _parts([value.co_names, value.co_consts], met)
    elif isinstance(value, tuple | list):
        yield f"{len(value)} entries".encode()
        for item in value:
            yield from _parts(item, met)
    elif isinstance(value, set | frozenset):
        yield from _parts(sorted(map(repr, value)), met)
    elif hasattr(value, "tobytes"):
        yield value.tobytes()
    elif value is None or isinstance(value, str | bytes | int | float | complex):
        yield repr(value).encode()
    else:
        yield getattr(value, "__qualname__", getattr(value, "__name__", type(value).__qualname__)).encode()


def _names(code: types.CodeType) -> Iterator[str]:
    """Yield the names that byte code looks up, including those of inner functions."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _names(constant)
