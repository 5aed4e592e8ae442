"""Base of the tables of a case file, and the text of their errors."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

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

from scissordyn.annotation import members
from scissordyn.config.line import Place, address
from scissordyn.config.quantity import example, read_quantity, written
from scissordyn.config.shape import Accepts, accepting
from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity, Sample, extras

Hints = tuple[tuple[str, Any], ...]
"""Names of fields, and the annotations by which they are read in place of their own."""

Context = dict[str, Path]
"""Context of a table: the "folder" of relative file names."""


LARGEST_SHOWN = 10**300
"""Whole numbers beyond it are not written out; Python refuses to write more than 4300 digits."""


WORDS = {"string_type": "text", "int_type": "a whole number", "bool_type": "true or false"}
"""What a key has to be, by pydantic's type of error."""


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
    if isinstance(value, int) and abs(value) > LARGEST_SHOWN:
        return "a number of hundreds of digits"
    return f"{value!r}"


def quantity_of(table: type[BaseModel], key: str) -> Quantity | None:
    """The quantity that a key declares, if its value is one."""
    return next((extra for extra in table.model_fields[key].metadata if isinstance(extra, Quantity)), None)


def words_of(hint: Any) -> tuple[str, ...]:
    """The words that an annotation allows, in place of a number or alone."""
    return tuple(word for each in members(hint) if get_origin(each) is Literal for word in get_args(each))


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

    exactly_one: ClassVar[tuple[str, ...]] = ()
    """Keys of which a file gives one."""

    # a validator is built for the tables that a case has when they are read, not for all when they are declared
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, arbitrary_types_allowed=True, defer_build=True)

    @classmethod
    def reader(cls) -> PlainValidator:
        """For ``Annotated[Any, ClearanceTable.reader()]``: a key whose value is such a table."""
        return PlainValidator(accepting(lambda: cls)(lambda given, info: cls.model_validate(given, context=info.context)))

    @model_validator(mode="before")
    @classmethod
    def _know_the_keys(cls, given: Any) -> Any:
        if not isinstance(given, Mapping):
            raise InputError("not a table", "the keys " + ", ".join(cls.model_fields))
        for key in given:
            if key not in cls.model_fields:
                said = f"unknown key '{key}'{did_you_mean(key, cls.model_fields)}"
                raise UnknownKeyError(str(key), said, ", ".join(cls.model_fields) or "no keys")
        for key, field in cls.model_fields.items():
            if field.is_required() and key not in given:
                raise InputError(f"missing key '{key}'", key_help(cls, key), f"{key} = {key_sample(cls, key)}")
        return given

    @field_validator("*", mode="before")
    @classmethod
    def _read_quantities(cls, value: Any, info: ValidationInfo) -> Any:
        key = info.field_name or ""
        quantity = quantity_of(cls, key)
        words = words_of(cls.model_fields[key].annotation)
        if quantity is None or (isinstance(value, str) and value in words):
            return value
        try:
            if words and not isinstance(value, int | str):
                raise InputError("not a whole number, an integer", quantity.allowed)
            return read_quantity(value, quantity, key_sample(cls, key).strip('"'))
        except InputError as error:
            sample = toml(error.type_this) if quantity.unit != "1" else error.type_this
            allowed = " or ".join((error.allowed, *map(toml, words)))
            raise InputError(error.what, allowed, f"{key} = {sample}") from None


def _documented(docstrings: Iterable[str | None]) -> dict[str, str]:
    """First sentences of the parameters in docstrings; later ones count."""
    found: dict[str, str] = {}
    for docstring in docstrings:
        for names, text in re.findall(r"^(\w[\w, ]*) : .*\n((?:    .*\n?)+)", inspect.cleandoc(docstring or ""), re.MULTILINE):
            sentence = re.split(r"[.;](?:\s|$)", " ".join(text.split()))[0]
            found.update({name.strip(): sentence[:1].lower() + sentence[1:] for name in names.split(",")})
    return found


def keys_of(described_type: type, hints: Hints = (), **examples: Any) -> dict[str, Any]:
    """The keys of the table that fills a frozen dataclass, see `table_of`, as pydantic takes them."""
    annotations = {**get_type_hints(described_type, include_extras=True), **dict(hints)}
    documented = _documented(ancestor.__doc__ for ancestor in reversed(described_type.__mro__))
    keys: dict[str, Any] = {}
    for field in dataclasses.fields(described_type):
        if annotations[field.name] is None:
            continue
        default = field.default if field.default_factory is dataclasses.MISSING else field.default_factory()
        arguments: dict[str, Any] = {}  # only known ones: the annotation may have its own
        if dataclasses.is_dataclass(default):  # a law or a material, which a file names
            default, arguments["validate_default"] = default.name, True  # type: ignore[union-attr]
        if field.name in examples:
            arguments["examples"] = [examples[field.name]]
        if field.name in documented and field.name not in dict(hints):
            arguments["description"] = documented[field.name]
        keys[field.name] = (annotations[field.name], Field(... if default is dataclasses.MISSING else default, **arguments))
    return keys


def table_of(described_type: type, hints: Hints = (), **examples: Any) -> type[Table]:
    """The table that fills a frozen dataclass: a key for each field, with its quantity and default."""
    return create_model(described_type.__name__, __base__=Table, **keys_of(described_type, hints, **examples))


class Call(Table):
    """The arguments of a function as the keys of a table, see `table_of_call`."""

    function: ClassVar[Callable[..., Any]]
    arguments: ClassVar[Mapping[str, str]]

    def result(self, *before: Any) -> Any:
        """What the function gives for them, after the arguments that have no key."""
        return type(self).function(*before, **{name: getattr(self, key) for key, name in self.arguments.items()})


AnyCall = TypeVar("AnyCall", bound=Call)


def table_of_call(
    function: Callable[..., Any],
    hints: Hints,
    *,
    base: type[AnyCall],
    spelt: Mapping[str, str] = MappingProxyType({}),
    **examples: Any,
) -> type[AnyCall]:
    """The table whose keys are the arguments of a function, with their quantities and defaults."""
    annotations = {**get_type_hints(function, include_extras=True), **dict(hints)}
    documented, keys, arguments = _documented([function.__doc__]), dict[str, Any](), dict[str, str]()
    for name, parameter in inspect.signature(function).parameters.items():
        if annotations[name] is None:
            continue
        more: dict[str, Any] = {"examples": [examples[name]]} if name in examples else {}
        if name not in dict(hints):
            more["description"] = next((one.help for one in extras(annotations[name])), "") or documented.get(name, "")
        default = ... if parameter.default is parameter.empty else parameter.default
        key = spelt.get(name, name)
        keys[key], arguments[key] = (annotations[name], Field(default, **more)), name
    table = create_model(f"{function.__name__}_table", __base__=base, __doc__=function.__doc__, **keys)
    table.function, table.arguments = staticmethod(function), arguments
    return table


_table_of = cache(table_of)


def build(described_type: Any, given: Any, context: Context | None) -> Any:
    """An instance of a frozen dataclass from the table that a case file gives for it."""
    return _filled(described_type, _table_of(described_type), given, context)


def filled_table(described_type: Any) -> type[Table]:
    """The table that `build` reads."""
    return _table_of(described_type)


def with_key(key: str, value: Any, table: type[Table], *, required: bool = True) -> type[Table]:
    """A table with one more key, whose schema is given; for editors, which reads nothing."""
    field = (Annotated[Any, Accepts(lambda: value)], ... if required else None)
    return create_model(f"{table.__name__}_{key}", __base__=table, __doc__=table.__doc__, **{key: field})  # type: ignore[call-overload, no-any-return]


def _filled(described_type: Any, table: type[Table], given: Any, context: Context | None) -> Any:
    values = table.model_validate(given, context=context)
    return described_type(**{key: getattr(values, key) for key in given})


def described(described_type: type, hints: Hints = (), **examples: Any) -> PlainValidator:
    """For ``Annotated[Harmonic, described(Harmonic)]``: a key whose value is a table that fills a frozen dataclass."""
    return filler(described_type, cache(lambda: table_of(described_type, hints, **examples)))


def filler(described_type: type, keys: Callable[[], type[Table]]) -> PlainValidator:
    """Reads a table, which is made when the first one is read, and fills a frozen dataclass."""
    return PlainValidator(accepting(keys)(lambda given, info: _filled(described_type, keys(), given, info.context)))


AnyTable = TypeVar("AnyTable", bound=Table)


def instance(table: type[AnyTable], given: Any, context: Context) -> AnyTable:
    """A table read from parsed TOML."""
    try:
        return table.model_validate(given, context=context)
    except ValidationError as error:
        raise _explained(error, ()) from None


class PlacedError(InputError):
    """An error at a place of a case file."""

    def __init__(
        self, place: Place, given: str, what: str, allowed: str = "", type_this: object = "", *, key: str | None = None
    ) -> None:
        self.place, self.given, self.text, self.key = place, given, what, key
        super().__init__(self.said(address({}, place)), allowed, in_a_file(type_this))

    def said(self, where: str) -> str:
        """What is wrong, with its place in words."""
        return ": ".join(filter(None, (f"{where}{self.given}", self.text)))


class UnknownKeyError(InputError):
    """A key that a table does not have."""

    def __init__(self, key: str, what: str, allowed: str) -> None:
        super().__init__(what, allowed)
        self.key = key


def in_a_file(sample: object) -> str:
    """What the user can type, in the form of a case file."""
    if isinstance(sample, Sample):
        return f"{sample.key} = {toml(written(sample.value, sample.unit))}"
    return str(sample)


@contextmanager
def located(where: str) -> Iterator[None]:
    """Put some words before the text of any `InputError`."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error.what}", error.allowed, in_a_file(error.type_this)) from None


@contextmanager
def placed(*place: int | str) -> Iterator[None]:
    """Give any `InputError` its place in the case file."""
    try:
        yield
    except InputError as error:
        raise PlacedError(place, "", error.what, error.allowed, error.type_this) from None


def _explained(error: ValidationError, outer: Place) -> InputError:
    """The first error of pydantic as one line."""
    first = error.errors(include_url=False)[0]
    place = (*outer, *first["loc"])
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, ValidationError):  # from an inner table that pydantic does not validate
        return _explained(cause, place)
    given = "" if isinstance(first["input"], Mapping | list) else f" = {toml(first['input'])}"
    if isinstance(cause, InputError):
        key = cause.key if isinstance(cause, UnknownKeyError) else None
        return PlacedError(place, given, cause.what, cause.allowed, cause.type_this, key=key)
    if first["type"] == "list_type":
        return PlacedError(place, given, "not a list of tables", f"tables headed [[{place[-1]}]]")
    names = re.findall(r"'([^']+)'", str(first.get("ctx", {}).get("expected", "")))
    allowed = WORDS.get(first["type"], first["msg"].removeprefix("Input should be "))
    return PlacedError(place, given + did_you_mean(first["input"], names), "", allowed)
