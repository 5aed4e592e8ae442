"""Descriptions as plain data and back, so that a saved run can be run again."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from collections.abc import Mapping
from typing import Any

from scissordyn.errors import InputError

__all__ = ["from_plain", "to_plain"]

PACKAGE = "scissordyn"
KIND = "kind"
FUNCTION = "function"


def to_plain(described: Any) -> Any:
    """A frozen description as nested dicts, lists, strings and numbers.

    Parameters
    ----------
    described : dataclass instance, tuple, mapping, str, number, bool or None

    Returns
    -------
    plain
        Fit for JSON; numbers survive bit for bit.
    """
    if dataclasses.is_dataclass(described) and not isinstance(described, type):
        kind = f"{type(described).__module__}.{type(described).__qualname__}"
        values = {field.name: to_plain(getattr(described, field.name)) for field in dataclasses.fields(described) if field.init}
        return {KIND: kind.removeprefix(f"{PACKAGE}."), **values}
    if isinstance(described, tuple | list):
        return [to_plain(item) for item in described]
    if isinstance(described, Mapping):
        return {str(key): to_plain(value) for key, value in described.items()}
    if described is None or isinstance(described, str | int | float | bool):
        return described
    if callable(described):
        return {KIND: FUNCTION, "name": getattr(described, "__name__", repr(described)), "source": _source(described)}
    raise InputError(f"a {type(described).__name__} inside a description", "values that can be written to a file")


def from_plain(plain: Any) -> Any:
    """The description that `to_plain` wrote.

    Parameters
    ----------
    plain
        Nested dicts, lists, strings and numbers.

    Returns
    -------
    described

    Raises
    ------
    InputError
        If it names something that this version of the package does not have.
    """
    if isinstance(plain, list):
        return tuple(from_plain(item) for item in plain)
    if not isinstance(plain, dict):
        return plain
    values = {key: from_plain(value) for key, value in plain.items() if key != KIND}
    if KIND not in plain:
        return values
    if plain[KIND] == FUNCTION:
        # a file is data: nothing in it is executed
        raise InputError(
            f"the run uses the Python function '{values['name']}', whose source is in its attributes but is not executed",
            "laws from the catalogue or from a file",
            f"put it in a file and give the law as 'my_laws.py:{values['name']}'",
        )
    module, _, name = str(plain[KIND]).rpartition(".")
    try:
        described = getattr(importlib.import_module(f"{PACKAGE}.{module}"), name)
        return described(**values)
    except (ImportError, AttributeError, TypeError) as error:
        raise InputError(f"a description of kind '{plain[KIND]}' that this version cannot read ({error})") from None


def _source(function: Any) -> str:
    """Source text of a function, for the reader of a saved run; empty where there is none."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return ""
