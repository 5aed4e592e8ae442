"""A case as Python that can be run elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import scissordyn
from scissordyn.errors import InputError
from scissordyn.explore.case import Case
from scissordyn.model.walk import given, is_described
from scissordyn.plugin.origin import origin_of

WIDTH = 110


def python_of(case: Case) -> str:
    """Python that describes the mechanism of a case and simulates it; its numbers are those of the case bit for bit."""
    imports: dict[str, str] = {}
    body = _code(case.mechanism, imports, 0)
    options = [f"{field.name}={value!r}" for field, value in given(case.options)]
    lines = ["import scissordyn as sd", *(f"from {module} import {name}" for name, module in sorted(imports.items()))]
    return "\n".join([*lines, "", f"mechanism = {body}", f"run = sd.simulate(mechanism, {', '.join(options)})", ""])


def _code(value: Any, imports: dict[str, str], depth: int) -> str:
    """A value as an expression."""
    if is_described(value):
        arguments = [f"{field.name}={_code(inner, imports, depth + 1)}" for field, inner in given(value)]
        return _wrapped(f"{_name(type(value), imports)}(", arguments, ")", depth)
    if isinstance(value, tuple):
        items = [_code(item, imports, depth + 1) for item in value]
        return _wrapped("(", [f"{items[0]},"] if len(items) == 1 else items, ")", depth)
    if isinstance(value, Mapping):
        return _wrapped("{", [f"{key!r}: {_code(item, imports, depth + 1)}" for key, item in value.items()], "}", depth)
    if value is None or isinstance(value, str | int | float):
        return repr(value)
    raise InputError(
        f"'{getattr(value, '__name__', value)}', a function of yours, in the case",
        "a case without functions of your own",
        "Save run",
    )


def _name(kind: type, imports: dict[str, str]) -> str:
    if getattr(scissordyn, kind.__name__, None) is kind:
        return f"sd.{kind.__name__}"
    if origin_of(kind) is not None:
        raise InputError(f"the class '{kind.__name__}' of yours in the case", "a case without classes of your own", "Save run")
    imports[kind.__name__] = kind.__module__
    return kind.__name__


def _wrapped(first: str, items: list[str], last: str, depth: int) -> str:
    """Items on one line, or one on each line where they are long."""
    line = f"{first}{', '.join(items)}{last}"
    if len(line) + 4 * depth <= WIDTH and "\n" not in line:
        return line
    inner, outer = "    " * (depth + 1), "    " * depth
    ends = [item.rstrip(",") for item in items]
    return "\n".join([first, *(f"{inner}{item}," for item in ends), f"{outer}{last}"])
