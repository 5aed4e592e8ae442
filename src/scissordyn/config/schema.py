"""Generate the JSON Schema of case and study files from the table classes, with regular expressions for quantities."""

from __future__ import annotations

import re
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin

from scissordyn.annotation import members
from scissordyn.casefile.quantity import (
    CELSIUS,
    PREFIX_DEFINITIONS,
    SMALL_PREFIX_DEFINITIONS,
    UNIT_DEFINITIONS,
    NumbersText,
    unit_factor,
)
from scissordyn.casefile.table import Key, Reader, Table
from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity

FILE_KINDS = ("case", "study")  # kinds of files that have a schema

SCHEMA_DRAFT = "http://json-schema.org/draft-07/schema#"
"""Newest draft of JSON Schema that editors support for TOML."""

JSON_TYPES = {str: "string", bool: "boolean", int: "integer", float: "number"}  # JSON Schema type of each Python type

Schema = dict[str, Any]


def schema(which: str = "case") -> Schema:
    """Return the JSON Schema of case or study files.

    The schema does not check the bounds of numbers with a unit except their sign, the dimensions of composed units, names that
    refer to other tables, keys that exclude each other, user-defined Python files, and the mechanism as a whole. The command
    `scissordyn check` checks them.
    """
    if which not in FILE_KINDS:
        raise InputError(
            f"no schema for '{which}'{did_you_mean(which, FILE_KINDS)}", ", ".join(FILE_KINDS), "scissordyn schema case"
        )
    if which == "case":
        from scissordyn.casefile.case import CaseTable

        table: type[Table] = CaseTable
    else:
        from scissordyn.config.study import StudyText

        table = StudyText
    writer = _Writer()
    return {
        "$schema": SCHEMA_DRAFT,
        "title": f"scissordyn {which} file",
        **writer.table(table),
        "definitions": dict(sorted(writer.defined.items())),
    }


class _Writer:
    """Generator of the schemas of table classes; each schema is defined once, and other schemas refer to it by name."""

    def __init__(self) -> None:
        self.defined: dict[str, Schema] = {}
        self.names: dict[type[Table], str] = {}

    def reference(self, table: type[Table]) -> Schema:
        name = self.names.get(table)
        if name is None:
            name, count = table.__name__.removesuffix("Table").removesuffix("_table") or "Table", 1
            while name in self.defined:
                count += 1
                name = f"{table.__name__}_{count}"
            self.names[table] = name
            self.defined[name] = {}  # reserve the name while the schemas of nested tables are generated
            self.defined[name] = self.table(table)
        return {"$ref": f"#/definitions/{name}"}

    def table(self, table: type[Table]) -> Schema:
        keys = table.declared_keys()
        written: Schema = {"type": "object"}
        about = next(iter((table.__doc__ or "").strip().splitlines()), "")
        if about:
            written["description"] = about
        written |= {"properties": {name: self.key(key) for name, key in keys.items()}, "additionalProperties": False}
        required = [name for name, key in keys.items() if key.required]
        if required:
            written["required"] = required
        if table.exactly_one:
            written["oneOf"] = [{"required": [key]} for key in table.exactly_one]
        return written

    def key(self, key: Key) -> Schema:
        if key.reader is not None:
            accepted = self.shape(key.reader.shape())
        elif key.quantity is not None:
            accepted = self._number(key.quantity, key.hint, key.words)
        else:
            accepted = self._of(key.hint)
        assert accepted, f"no schema for {key.hint!r}"
        described = [key.help.rstrip("."), key.quantity.expected if key.quantity is not None else ""]
        text = "; ".join(filter(None, described))
        about: Schema = {"description": text} if text else {}
        if key.examples:
            about["examples"] = list(key.examples)
        if isinstance(key.default, str | bool) and key.default != "":
            about["default"] = key.default
        # some editors ignore keys next to a reference
        return {**accepted, **about} if "$ref" not in accepted else {"allOf": [accepted], **about}

    def _of(self, annotation: Any) -> Schema:
        origin, inner = get_origin(annotation), get_args(annotation)
        if origin is Annotated:
            reader = next((extra for extra in inner[1:] if isinstance(extra, Reader)), None)
            return self._of(inner[0]) if reader is None else self.shape(reader.shape())
        if origin is Literal:
            return {"enum": list(inner)}
        if origin in (list, Sequence):
            return {"type": "array", "items": self._of(inner[0])}
        if origin in (typing.Union, types.UnionType):
            # a value that can only be given in Python, such as a section object, has no form in a file
            kept = [schema for member in members(annotation) if (schema := self._of(member))]
            return kept[0] if len(kept) == 1 else {"anyOf": kept}
        if isinstance(annotation, type) and issubclass(annotation, Table):
            return self.reference(annotation)
        if annotation in JSON_TYPES:
            return {"type": JSON_TYPES[annotation]}
        return {}

    def shape(self, shape: Any) -> Schema:
        """Return the schema of the values that a reader accepts; tables and long patterns in it become references."""
        if isinstance(shape, NumbersText):
            self.defined[shape.name] = {"type": "string", "pattern": pattern_of(shape)}
            return {"$ref": f"#/definitions/{shape.name}"}
        if isinstance(shape, type) and issubclass(shape, Table):
            return self.reference(shape)
        return {key: self._inner(value) for key, value in shape.items()}

    def _inner(self, value: Any) -> Any:
        if isinstance(value, type | Mapping | NumbersText):
            return self.shape(value)
        return [self._inner(entry) for entry in value] if isinstance(value, list) else value

    def _number(self, quantity: Quantity, annotation: Any, words: tuple[str, ...]) -> Schema:
        """Return the schema of a quantity: text with number and unit, or a plain number with bounds; or one of `words`."""
        if quantity.unit == "1":
            accepted: Schema = {"type": "integer" if int in members(annotation) else "number"}
            bounds = ("minimum", quantity.minimum), ("maximum", quantity.maximum)
            open_bounds = ("exclusiveMinimum", quantity.above), ("exclusiveMaximum", quantity.below)
            accepted |= {name: value for name, value in (*bounds, *open_bounds) if value is not None}
        else:
            low = quantity.minimum if quantity.above is None else quantity.above
            accepted = self.shape(NumbersText(quantity.unit, negative=low is None or low < 0.0))
        return {"anyOf": [accepted, {"enum": list(words)}]} if words else accepted


# Pattern of the text of a number without a sign
UNSIGNED_NUMBER_PATTERN = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
# Pattern of the text of -0, which is allowed where a number must not be negative
NEGATIVE_ZERO_PATTERN = r"-(?:0+\.?0*|\.0+)(?:[eE][+-]?[0-9]+)?"
ANY_NUMBER_PATTERN = rf"[+-]?{UNSIGNED_NUMBER_PATTERN}"  # pattern of the text of a number with or without a sign
UNIT_OPERATORS = r"[ ²³^*/·()0-9-]+"  # characters between two units of a composed unit


def _names(definition: str) -> list[str]:
    first, *others = (part.strip() for part in definition.split("="))
    return [name.removesuffix("-") for name in (first, *others[1:]) if name != "_"]


@cache
def _units() -> tuple[str, ...]:
    """Return the names of all units without prefix, longest first."""
    names = {name for definition in UNIT_DEFINITIONS for name in _names(definition)}
    return tuple(sorted(names, key=lambda name: (-len(name), name)))


@cache
def _any_unit() -> str:
    return f"(?:{_prefix()}{_either(_units())})"


def _prefixed(names: list[str]) -> str:
    """Return a regular expression of units with prefixes, without combinations such as "min" that are another unit."""
    alternatives = []
    for name in names:
        taken = {other.removesuffix(name) for other in _units() if other.endswith(name) and other != name}
        alternatives.append(f"{_prefix(frozenset(taken))}{_either([name])}")
    return "|".join(alternatives)


def _either(names: Iterable[str], symbol_letters: int = 3) -> str:
    """Return a regular expression of unit names; words may be in the plural, symbols not, because "ms" is a millisecond.

    `symbol_letters`: [letters] unit names with more letters are words, which may be in the plural.
    """
    return f"(?:{'|'.join(re.escape(name) + ('s?' if len(name) > symbol_letters else '') for name in names)})"


@cache
def _prefix(without: frozenset[str] = frozenset()) -> str:
    prefixes = {
        name for definition in (*PREFIX_DEFINITIONS, *SMALL_PREFIX_DEFINITIONS) for name in _names(definition)
    } - without
    return f"(?:{'|'.join(sorted(prefixes, key=lambda name: (-len(name), name)))})?"


@cache
def _unit_pattern(unit: str) -> str:
    """Return a regular expression of the units of one dimension: single units by name, or composed units."""
    single = []
    for name in _units():
        try:
            unit_factor(name, unit)
        except InputError:
            continue
        single.append(name)
    unit_name = _any_unit()
    composed = [
        rf"{unit_name}(?:{UNIT_OPERATORS}{unit_name})+[)0-9²³^*-]*",
        rf"{unit_name} *(?:\^|\*\*) *-?[0-9]+",
        rf"{unit_name}[²³]",
        rf"1 */ *{unit_name}[)0-9²³^*-]*",
    ]
    if single:
        composed.insert(0, _prefixed(single))
    if unit == "K":
        composed += [re.escape(name) for name in CELSIUS]
    return f"(?:{'|'.join(composed)})"


@cache
def pattern_of(text: NumbersText) -> str:
    """Return the regular expression of a text with numbers and a unit."""
    number = ANY_NUMBER_PATTERN if text.negative else rf"(?:\+?{UNSIGNED_NUMBER_PATTERN}|{NEGATIVE_ZERO_PATTERN})"
    times = "*" if text.numbers is None else f"{{{text.numbers - 1}}}"
    more = "" if text.numbers == 1 else rf"(?:(?:\s*,\s*|\s+){ANY_NUMBER_PATTERN}){times}"
    return rf"^\s*{number}{more}\s*,?\s*{_unit_pattern(text.unit)}\s*$"
