"""Base of the tables of a case file, and the text of their errors."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationError,
    ValidationInfo,
    create_model,
    field_validator,
    model_validator,
)

from scissordyn.config.quantity import example, read_quantity, written
from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity

__all__ = [
    "Context",
    "Hints",
    "Table",
    "build",
    "described",
    "instance",
    "key_help",
    "key_sample",
    "located",
    "quantity_of",
    "table_of",
    "toml",
]

Hints = tuple[tuple[str, Any], ...]
"""Names of fields, and the annotations by which they are read in place of their own."""

Context = dict[str, Path]
"""Context of a table: the "folder" of relative file names."""


def toml(value: Any) -> str:
    """A value as TOML on one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return f"{value!r}"


def quantity_of(table: type[BaseModel], key: str) -> Quantity | None:
    """The quantity that a key declares, if its value is one."""
    return next((extra for extra in table.model_fields[key].metadata if isinstance(extra, Quantity)), None)


def key_help(table: type[BaseModel], key: str) -> str:
    """Description of a key in one line."""
    quantity = quantity_of(table, key)
    return (quantity.help if quantity else "") or table.model_fields[key].description or ""


def key_sample(table: type[BaseModel], key: str) -> str:
    """An example value of a key, as TOML: its first example, its default, or any allowed value."""
    field, quantity = table.model_fields[key], quantity_of(table, key)
    if field.examples:
        return toml(field.examples[0])
    value = None if field.is_required() else field.get_default(call_default_factory=True)
    if quantity is None:
        return toml(value)
    text = example(quantity) if value is None else written(float(value), quantity.unit)
    return text if quantity.unit == "1" else toml(text)


class Table(BaseModel):
    """A table of a case file: an unknown key is an error, and a quantity is read with its unit."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, arbitrary_types_allowed=True)

    @model_validator(mode="before")
    @classmethod
    def _know_the_keys(cls, given: Any) -> Any:
        if not isinstance(given, Mapping):
            raise InputError("not a table", "the keys " + ", ".join(cls.model_fields))
        for key in given:
            if key not in cls.model_fields:
                raise InputError(
                    f"unknown key '{key}'{did_you_mean(str(key), cls.model_fields)}", ", ".join(cls.model_fields) or "no keys"
                )
        for key, field in cls.model_fields.items():
            if field.is_required() and key not in given:
                raise InputError(f"missing key '{key}'", key_help(cls, key), f"{key} = {key_sample(cls, key)}")
        return given

    @field_validator("*", mode="before")
    @classmethod
    def _read_quantities(cls, value: Any, info: ValidationInfo) -> Any:
        key = info.field_name or ""
        quantity = quantity_of(cls, key)
        if quantity is None:
            return value
        try:
            return read_quantity(value, quantity)
        except InputError as error:
            sample = toml(error.type_this) if error.type_this else key_sample(cls, key)
            raise InputError(error.what, error.allowed, f"{key} = {sample}") from None


def _documented(described_type: type) -> dict[str, str]:
    """First sentences of the parameters in the docstrings of a dataclass and its bases."""
    found: dict[str, str] = {}
    for ancestor in reversed(described_type.__mro__):
        for names, text in re.findall(
            r"^(\w[\w, ]*) : .*\n((?:    .*\n?)+)", inspect.cleandoc(ancestor.__doc__ or ""), re.MULTILINE
        ):
            sentence = re.split(r"[.;](?:\s|$)", " ".join(text.split()))[0]
            found.update({name.strip(): sentence[:1].lower() + sentence[1:] for name in names.split(",")})
    return found


def table_of(described_type: type, hints: Hints = (), **examples: Any) -> type[Table]:
    """The table that fills a frozen dataclass: a key for each field, with its quantity and default.

    Parameters
    ----------
    described_type : type
        A frozen dataclass whose fields can be written in a case file.
    hints : tuple of (str, annotation), optional
        How fields are read whose annotation is not sufficient.
    **examples
        Examples of keys without a default.
    """
    annotations = {**get_type_hints(described_type, include_extras=True), **dict(hints)}
    documented = _documented(described_type)
    keys: dict[str, Any] = {}
    for field in dataclasses.fields(described_type):
        default = field.default if field.default is not dataclasses.MISSING else ...
        arguments: dict[str, Any] = {}  # only known ones: the annotation may have its own
        if field.name in examples:
            arguments["examples"] = [examples[field.name]]
        if field.name in documented and field.name not in dict(hints):
            arguments["description"] = documented[field.name]
        keys[field.name] = (annotations[field.name], Field(default, **arguments))
    return create_model(described_type.__name__, __base__=Table, **keys)


_table_of = cache(table_of)


def build(described_type: Any, given: Any, context: Context | None) -> Any:
    """An instance of a frozen dataclass from the table that a case file gives for it."""
    return _filled(described_type, _table_of(described_type), given, context)


def _filled(described_type: Any, table: type[Table], given: Any, context: Context | None) -> Any:
    values = table.model_validate(given, context=context)
    return described_type(**{key: getattr(values, key) for key in given})


def described(described_type: type, hints: Hints = (), **examples: Any) -> PlainValidator:
    """For ``Annotated[Harmonic, described(Harmonic)]``: a key whose value is a table that fills a frozen dataclass."""
    table = table_of(described_type, hints, **examples)
    return PlainValidator(lambda given, info: _filled(described_type, table, given, info.context))


AnyTable = TypeVar("AnyTable", bound=Table)


def instance(table: type[AnyTable], given: Any, context: Context) -> AnyTable:
    """A table read from parsed TOML.

    Parameters
    ----------
    table : subclass of Table
    given : mapping
        Parsed TOML.
    context : dict
        See `Context`.

    Raises
    ------
    InputError
        For the first error, with its place in the file.
    """
    try:
        return table.model_validate(given, context=context)
    except ValidationError as error:
        raise _explained(error, ()) from None


@contextmanager
def located(place: str) -> Iterator[None]:
    """Put a place of the case file before the text of any `InputError`."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error.what}", error.allowed, error.type_this) from None


def _explained(error: ValidationError, outer: tuple[int | str, ...]) -> InputError:
    """The first error of pydantic as one line."""
    first = error.errors(include_url=False)[0]
    place = (*outer, *first["loc"])
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, ValidationError):  # from an inner table that pydantic does not validate
        return _explained(cause, place)
    came, given = ".".join(map(str, place)), first["input"]
    if not isinstance(given, Mapping | list):
        came += f" = {toml(given)}"
    if isinstance(cause, InputError):
        return InputError(f"{came}: {cause.what}" if came else cause.what, cause.allowed, cause.type_this)
    if first["type"] == "list_type":
        return InputError(f"{came}: not a list of tables", f"tables headed [[{place[-1]}]]")
    names = re.findall(r"'([^']+)'", str(first.get("ctx", {}).get("expected", "")))
    return InputError(came + did_you_mean(str(given), names), first["msg"].removeprefix("Input should be "))
