"""Base class of the tables of a case file: declare keys by annotations, read and check them, and locate errors."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass
from functools import cache
from types import MappingProxyType, NoneType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeVar, get_args, get_origin, get_type_hints

from scissordyn.annotation import members, plain_hint
from scissordyn.casefile.quantity import INTEGER_MAX, example, read_quantity, rounded_text
from scissordyn.casefile.text import Place, place_text
from scissordyn.components.declaration import MEANINGS
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.walk import declared, is_described, non_default_fields
from scissordyn.plugin.element import Part
from scissordyn.units import Quantity, Sample, help_of, hints_of

Shape = Any  # schema of accepted values: a table class, or a JSON Schema mapping whose values may be table classes

Context = dict[str, Any]
"""Context of a reader: the "folder" of relative file names, and the "values" of the earlier keys in the table."""


@dataclass(frozen=True, eq=False)
class Reader:
    """Metadata in the annotation of a key: function that reads its value, and schema of the accepted values."""

    read: Callable[[Any, Context], Any]
    shape: Callable[[], Shape]


@dataclass(frozen=True, eq=False)
class About:
    """Metadata in the annotation of a key: one-line description and example values."""

    description: str = ""
    examples: Sequence[Any] = ()


def reader(shape: Callable[[], Shape]) -> Callable[[Callable[[Any, Context], Any]], Reader]:
    """Return a decorator that converts a function to a `Reader`; `shape` is called later, when all tables exist."""
    return lambda read: Reader(read, shape)


_READERS: dict[frozenset[Any], Callable[[tuple[Any, ...]], Reader]] = {}
"""Functions that create the reader of a type from the metadata of its annotation (such as a unit), by members of the type."""


def read_as(hint: Any, make: Reader | Callable[[tuple[Any, ...]], Reader]) -> None:
    """Register the default reader for keys of a type."""
    _READERS[frozenset(members(hint))] = make if callable(make) else lambda _: make


def reader_of(hint: Any, about: tuple[Any, ...]) -> Reader | None:
    make = _READERS.get(frozenset(members(hint)) - {NoneType})
    return None if make is None else make(about)


Hints = tuple[tuple[str, Any], ...]  # names of fields, each with an annotation that replaces that of the field


# description of a value in error messages, by its expected type
TYPE_TEXTS = {str: "text", int: "a whole number", bool: "true or false", float: "a number"}


BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")  # Pattern of a TOML key that needs no quotes


def toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "{ " + ", ".join(toml_entries(value)) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int) and abs(value) > INTEGER_MAX:
        return "a number of hundreds of digits"
    return f"{value!r}"


def toml_entries(table: Mapping[str, Any]) -> list[str]:
    """Return the texts "key = value" of a TOML table, one for each key."""
    return [f"{key if BARE_KEY.fullmatch(key) else toml(key)} = {toml(value)}" for key, value in table.items()]


@dataclass(frozen=True)
class Key:
    """Key of a table: name, type, default, quantity, reader, description and examples."""

    name: str
    hint: Any
    default: Any
    quantity: Quantity | None
    reader: Reader | None
    description: str
    examples: Sequence[Any]

    @property
    def required(self) -> bool:
        return self.default is MISSING

    @property
    def words(self) -> tuple[str, ...]:
        """Texts that the key accepts, alone or as an alternative to a number."""
        return tuple(word for hint in members(self.hint) if get_origin(hint) is Literal for word in get_args(hint))

    @property
    def help(self) -> str:
        """One-line description of the key."""
        return (self.quantity.help if self.quantity else "") or self.description

    @property
    def sample(self) -> str:
        """Example value as TOML: the first example, the default, or any allowed value."""
        if self.examples:
            return toml(self.examples[0])
        value = None if self.required else self.default
        if self.quantity is None:
            return toml(value)
        text = example(self.quantity) if value is None else rounded_text(float(value), self.quantity.unit)
        return text if self.quantity.unit == "1" else toml(text)

    def read(self, given: Any, context: Context) -> Any:
        """Convert the given value of the key to SI units; raise `InputError` if it is not allowed."""
        if self.reader is not None:
            return self.reader.read(given, context)
        if self.quantity is None or (isinstance(given, str) and given in self.words):
            return _plain(given, self.hint, context)
        try:
            if self.words and not isinstance(given, int | str):
                raise InputError("not a whole number", f"a whole number {self.quantity.bounds}", self.sample)
            number = read_quantity(given, self.quantity, self.sample.strip('"'))
        except InputError as error:
            sample = toml(error.example) if self.quantity.unit != "1" else error.example
            allowed = " or ".join((error.expected, *map(toml, self.words)))
            raise InputError(error.what, allowed, f"{self.name} = {sample}") from None
        try:
            return _plain(number, self.hint, context)
        except PlacedError as error:
            raise PlacedError(
                (), error.given, error.text, f"{error.expected} {self.quantity.bounds}", f"{self.name} = {self.sample}"
            ) from None


def _make_key(name: str, annotation: Any, default: Any) -> Key:
    """Return the key with an annotation; of several descriptions or examples in the annotation the last ones are used."""
    annotated = get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()
    about = [extra for extra in annotated if isinstance(extra, About)]
    quantity = next((extra for extra in annotated if isinstance(extra, Quantity)), None)
    chosen = next((extra for extra in annotated if isinstance(extra, Reader)), None)
    by_type = None if chosen else reader_of(annotation, annotated)
    return Key(
        name,
        plain_hint(annotation),
        default,
        None if by_type else quantity,  # a reader by type checks each number itself
        chosen or by_type,
        next((extra.description for extra in reversed(about) if extra.description), "") or help_of(annotation),
        next((extra.examples for extra in reversed(about) if extra.examples), ()),
    )


def _plain(given: Any, hint: Any, context: Context) -> Any:
    """Check a value without a unit against the type `hint` and return it; raise `InputError` if the type is wrong."""
    kinds, words = members(hint), list[str]()
    for kind in kinds:
        if kind is Any or (kind is NoneType and given is None):
            return given
        if get_origin(kind) in (list, Sequence):
            return read_list(given, get_args(kind)[0], context)
        if isinstance(kind, type) and issubclass(kind, Table):
            return kind.read(given, context)
        if get_origin(kind) is Literal:
            words += get_args(kind)
            if isinstance(given, str) and given in words:
                return given
        elif kind is float and type(given) in (int, float):
            return float(given)
        elif type(given) is kind:
            return given
    allowed = [TYPE_TEXTS[kind] for kind in kinds if kind in TYPE_TEXTS]
    if allowed == ["text"] and isinstance(given, list):
        allowed = ["one text, not a list"]
    quoted = [f"'{word}'" for word in words]
    allowed += [", ".join(quoted[:-1]) + f" or {quoted[-1]}" if quoted[1:] else quoted[0]] if quoted else []
    raise PlacedError((), f" = {toml(given)}{did_you_mean(given, words)}", "", " or ".join(allowed))


NOT_A_LIST = "not a list of tables"  # error if the value of a repeatable table is not a list of tables


def read_list(given: Any, hint: Any, context: Context) -> list[Any]:
    """Read the items of a list by the annotation `hint`; errors contain the index of the item."""
    if not isinstance(given, list):
        raise InputError(NOT_A_LIST, "a list")
    key, values = _make_key("", hint, MISSING), []
    for index, item in enumerate(given):
        with add_place(index, given=item):
            values.append(key.read(item, context))
    return values


@contextmanager
def add_place(*place: int | str, given: Any = MISSING) -> Iterator[None]:
    """Add a place in the file, and the value there, to any `InputError` raised in the block."""
    try:
        yield
    except PlacedError as error:
        whole = (*place, *error.place)
        raise PlacedError(whole, error.given, error.text, error.expected, error.example, key=error.key) from None
    except PartError:
        raise
    except InputError as error:
        plain = isinstance(given, list) and all(isinstance(value, str | int | float) for value in given)
        shown = plain or not (given is MISSING or isinstance(given, Mapping | list))
        allowed = f"tables headed [[{place[-1]}]]" if error.what == NOT_A_LIST else error.expected
        raise PlacedError(place, f" = {toml(given)}" if shown else "", error.what, allowed, error.example) from None


class Table:
    """Table of a case file. Annotations of a subclass declare its keys; quantities have units, and other keys are errors."""

    exactly_one: ClassVar[tuple[str, ...]] = ()
    """Alternative keys: a file must have exactly one of them."""
    _keys: ClassVar[Mapping[str, Key]]

    if TYPE_CHECKING:  # keys that `make_table` declares

        def __getattr__(self, name: str) -> Any: ...

    @classmethod
    def declared_keys(cls) -> Mapping[str, Key]:
        """Return the declared keys by name, those of base classes first."""
        if "_keys" not in vars(cls):
            hints = get_type_hints(cls, include_extras=True)
            names = [name for name, hint in hints.items() if get_origin(hint) is not ClassVar]
            cls._keys = {name: _make_key(name, hints[name], getattr(cls, name, MISSING)) for name in names}
        return cls._keys

    @classmethod
    def reader(cls) -> Reader:
        """Return the reader of a key whose value is a table of this kind."""
        return Reader(cls.read, lambda: cls)

    @classmethod
    def read(cls, given: Any, context: Context) -> Self:
        """Read parsed TOML; return the table with values in SI units, or raise `InputError` for the first error."""
        keys = cls.declared_keys()
        if isinstance(given, list) and len(given) == 1 and isinstance(given[0], Mapping):
            raise InputError("a list of tables", "one table, headed by a name in single brackets")
        if not isinstance(given, Mapping):
            raise InputError("not a table", "the keys " + ", ".join(keys))
        for key in given:
            if key not in keys:
                what = f"unknown key '{key}'{did_you_mean(key, keys)}"
                raise PlacedError((), "", what, ", ".join(keys) or "no keys", key=str(key))
        for name, key in keys.items():
            if key.required and name not in given:
                raise PlacedError((), "", f"missing key '{name}'", key.help, f"{name} = {key.sample}")
        values: dict[str, Any] = {}
        for name, key in keys.items():
            value = given.get(name, key.default)
            # a default may be a value as in a case file, for example "liu" or the table of a law
            if name in given or (key.reader is not None and isinstance(value, str | dict)):
                with add_place(name, given=value):
                    values[name] = key.read(value, {**context, "values": values})
            else:
                values[name] = value
        return cls(**values)

    def __init__(self, **values: Any) -> None:
        vars(self).update(values)
        self.check()

    def check(self) -> None:
        """Raise `InputError` if the values of several keys are inconsistent."""


AnyTable = TypeVar("AnyTable", bound=Table)


Keys = Mapping[str, tuple[Any, Any]]  # annotation and default of each key; `MISSING` if there is no default


def make_table(name: str, base: type[AnyTable], keys: Keys, doc: str | None = None) -> type[AnyTable]:
    """Create a table class with the given keys, in addition to those of its base class."""
    defaults = {key: default for key, (_, default) in keys.items() if default is not MISSING}
    hints = {key: hint for key, (hint, _) in keys.items()}
    return type(name, (base,), {**defaults, "__annotations__": hints, "__doc__": doc, "__module__": __name__})


class Call(Table):
    """Table whose keys are the fields of a dataclass or the arguments of a function."""

    function: ClassVar[Callable[..., Any]]
    arguments: ClassVar[Mapping[str, str]]

    def result(self, *before: Any) -> Any:
        """Call the dataclass or function with the values of the keys; `before` are its first arguments, which have no keys."""
        return type(self).function(*before, **{name: getattr(self, key) for key, name in self.arguments.items()})


def _documented(described: Callable[..., Any]) -> dict[str, str]:
    """Return the first sentence on each parameter in the docstrings of a function, or of a class and its bases."""
    texts: dict[str, str] = {}
    for part in reversed(described.__mro__) if isinstance(described, type) else (described,):
        docstring = inspect.cleandoc(part.__doc__ or "")
        for names, text in re.findall(r"^(\w[\w, ]*) : .*\n((?:    .*\n?)+)", docstring, re.MULTILINE):
            sentence = re.split(r"[.;](?:\s|$)", " ".join(text.split()))[0]
            texts.update({name.strip(): sentence[:1].lower() + sentence[1:] for name in names.split(",")})
    return texts


def _defaults(described: Callable[..., Any]) -> dict[str, Any]:
    """Return the defaults of fields or arguments as in a case file: materials by name, laws by name or with their numbers."""
    if not isinstance(described, type):
        parameters = inspect.signature(described).parameters.values()
        return {
            parameter.name: MISSING if parameter.default is parameter.empty else parameter.default for parameter in parameters
        }
    defaults = {name: field.default for name, field in declared(described).items()}
    return {name: _in_case_file(default) if is_described(default) else default for name, default in defaults.items()}


def _in_case_file(described: Any) -> Any:
    """Return the name of a material or law, or a law's table if some of its numbers differ from their defaults."""
    numbers = {field.name: value for field, value in non_default_fields(described)} if isinstance(described, Part) else {}
    return {"law": described.name, **numbers} if numbers else described.name


def keys_of(described: Callable[..., Any], hints: Hints = (), **examples: Any) -> dict[str, tuple[Any, Any]]:
    """Return annotations and defaults of the keys for a dataclass or function; a hint of None removes a parameter."""
    annotations = {**hints_of(inspect.unwrap(described)), **dict(hints)}
    documented = {**MEANINGS, **_documented(described)}
    keys: dict[str, tuple[Any, Any]] = {}
    for name, default in _defaults(described).items():
        if annotations[name] is not None:
            description = "" if name in dict(hints) or help_of(annotations[name]) else documented.get(name, "")
            about = About(description, [examples[name]] if name in examples else [])
            keys[name] = (Annotated[annotations[name], about], default)
    return keys


def table_of(
    described: Callable[..., Any],
    hints: Hints = (),
    *,
    base_table: type[Call] = Call,
    spelt: Mapping[str, str] = MappingProxyType({}),
    **examples: Any,
) -> type[Call]:
    """Create the table class for the fields of a frozen dataclass or the arguments of a function.

    `hints` replace annotations, `spelt` gives keys with another name than their parameter, `examples` have example values.
    """
    keys = {spelt.get(name, name): key for name, key in keys_of(described, hints, **examples).items()}
    return call_table(described, keys, base=base_table, spelt=spelt)


def call_table(
    described: Callable[..., Any], keys: Keys, *, base: type[Call], spelt: Mapping[str, str] = MappingProxyType({})
) -> type[Call]:
    """Create a table class with the given keys; a key named like a parameter of `described` becomes its argument."""
    table = make_table(described.__name__, base, keys, None if isinstance(described, type) else described.__doc__)
    names = {spelt.get(name, name): name for name in _defaults(described)}
    table.function, table.arguments = staticmethod(described), {key: names[key] for key in keys if key in names}
    return table


plain_table = cache(table_of)
"""Return the table class of a dataclass, without changes of its keys."""


def build(described: Any, given: Any, context: Context) -> Any:
    """Return an instance of a frozen dataclass from its table in a case file."""
    return plain_table(described).read(given, context).result()


def with_key(key: str, value: Any, table: type[Table], *, required: bool = True) -> type[Table]:
    """Return a table class with one more key, for the JSON Schema only; it is not used to read files."""
    hint = Annotated[Any, Reader(lambda given, _: given, lambda: value)]
    return make_table(f"{table.__name__}_{key}", table, {key: (hint, MISSING if required else None)}, table.__doc__)


def dataclass_reader(kind: type, hints: Hints = (), **examples: Any) -> Reader:
    """Return the reader of a key whose value is a table with the fields of a frozen dataclass."""
    return table_reader(cache(lambda: table_of(kind, hints, **examples)))


def table_reader(keys: Callable[[], type[Any]], result: Callable[[Any], Any] = lambda table: table.result()) -> Reader:
    """Return the reader of a table that is converted by `result`; the table class is created when first needed."""
    return Reader(lambda given, context: result(keys().read(given, context)), keys)


def instance(table: type[AnyTable], given: Any, context: Context) -> AnyTable:
    """Read a table from parsed TOML; raise `PlacedError` for the first error."""
    try:
        return table.read(given, context)
    except PlacedError:
        raise
    except InputError as error:
        raise PlacedError((), "", error.what, error.expected, error.example) from None


class PlacedError(InputError):
    """Error with its place in a case file and the value there."""

    def __init__(
        self, place: Place, given: str, what: str, allowed: str = "", example: object = "", *, key: str | None = None
    ) -> None:
        self.place, self.given, self.text, self.key = place, given, what, key
        super().__init__(self.error_text(place_text({}, place)), allowed, example_text(example))

    def error_text(self, where: str) -> str:
        return ": ".join(filter(None, (f"{where}{self.given}", self.text)))


class PartError(InputError):
    """Error about a part that the text names; the table whose value required the part's motion adds no place."""


def example_text(sample: object) -> str:
    """Return an example value as the text to type in a case file."""
    if isinstance(sample, Sample):
        return f"{sample.key} = {toml(rounded_text(sample.value, sample.unit))}"
    return str(sample)


@contextmanager
def add_prefix(where: str) -> Iterator[None]:
    """Add the prefix `where` to the text of any `InputError` raised in the block."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error.what}", error.expected, example_text(error.example)) from None
