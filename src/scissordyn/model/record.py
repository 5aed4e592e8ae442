"""Descriptions as plain data, so that a saved run says what was run."""

from __future__ import annotations

import hashlib
import inspect
import tokenize
import types
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from scissordyn.errors import InputError
from scissordyn.model.walk import declared, is_described
from scissordyn.plugin.user_file import origin_of

PACKAGE = "scissordyn"
KIND = "kind"
FUNCTION, CLASS = "function", "class"
"""What the data have in place of a class of the package, and for a Python function and a class that are in no file."""

DIGEST = "digest"  # Beside a function or a class of the user's own: the digest of its file


def to_plain(described: Any) -> Any:
    """A frozen description as nested dicts, lists, strings and numbers."""
    if isinstance(described, _SCALARS):
        return described
    if isinstance(described, tuple | list):
        if _SCALAR_TYPES.issuperset(map(type, described)):
            return list(described)
        # scalars, most of all values, without a call each
        return [item if isinstance(item, _SCALARS) else to_plain(item) for item in described]
    if isinstance(described, Mapping):
        return {str(key): value if isinstance(value, _SCALARS) else to_plain(value) for key, value in described.items()}
    if is_described(described):
        kind: Any = type(described)
        values = {}
        for name in declared(kind):
            value = getattr(described, name)
            values[name] = value if isinstance(value, _SCALARS) else to_plain(value)
        return _headed(kind) | values
    if callable(described):
        name = getattr(described, "__name__", repr(described))
        return {KIND: FUNCTION, "name": name, "source": source_of(described), DIGEST: code_digest(described)}
    raise InputError(f"a {type(described).__name__} inside a description", "values that can be written to a file")


def _headed(described: Any) -> dict[str, Any]:
    """What the data say of a class: its name, or where it is from and the digest of what it computes."""
    if described.__module__.startswith(f"{PACKAGE}.") or not hasattr(described, "declaration"):
        return {KIND: kind_of(described)}
    origin = origin_of(described)
    if origin is not None:
        return {KIND: origin[0], DIGEST: origin[1]}
    code = [*described.declaration.kernels.values(), described.parameters]
    return {KIND: CLASS, CLASS: described.__qualname__, DIGEST: code_digest(code)}


def first_difference(first: Any, second: Any, place: str = "") -> tuple[str, Any, Any]:
    """The first place at which two trees of plain data that differ do so, and what is there in each."""
    while isinstance(first, dict | list) and type(first) is type(second):
        entries, others = _entries(first), _entries(second)
        key = next(key for key in {**entries, **others} if entries.get(key) != others.get(key))
        place += f"[{key}]" if isinstance(first, list) else f"{'.' if place else ''}{key}"
        first, second = entries.get(key), others.get(key)
    return place, first, second


def _entries(tree: dict[str, Any] | list[Any]) -> dict[Any, Any]:
    return tree if isinstance(tree, dict) else dict(enumerate(tree))


_SCALARS = (str, int, float, bool, type(None))
_SCALAR_TYPES = frozenset(_SCALARS)


@cache
def kind_of(described: type) -> str:
    """What a class is called in a file."""
    return f"{described.__module__}.{described.__qualname__}".removeprefix(f"{PACKAGE}.")


def source_of(function: Any) -> str:
    """Source text of a function, for the reader of a saved run; empty where there is none."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError, SyntaxError, tokenize.TokenError):  # none, or its file has changed
        return ""


def code_digest(function: Any) -> str:
    """A digest of what a Python function computes: its byte code, and the constants and functions that it refers to."""
    digest = hashlib.sha256()
    for part in _parts(function, set()):
        digest.update(f"{len(part)} ".encode() + part)
    return digest.hexdigest()[:16]


def _parts(value: Any, met: set[int]) -> Iterator[bytes]:
    """What a value consists of; of a module, a class or an object only the name, what it does is a matter of versions."""
    value = getattr(value, "py_func", value)  # compiled beforehand
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
    """Names that byte code looks up, that of functions inside included."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _names(constant)
