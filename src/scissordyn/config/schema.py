"""JSON Schema of case and study files, made from the tables that read them."""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, get_args, get_origin

from scissordyn.annotation import members
from scissordyn.config.quantity import name_of, quantity_pattern
from scissordyn.config.table import Key, Reader, Table
from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity

FILES = ("case", "study")

DRAFT = "http://json-schema.org/draft-07/schema#"
"""The newest that the extensions of editors for TOML read."""

PLAIN = {str: "string", bool: "boolean", int: "integer", float: "number"}

Schema = dict[str, Any]


def schema(which: str = "case") -> Schema:
    """The JSON Schema of a kind of file.

    What it cannot see: bounds of numbers with a unit other than their sign, dimensions of composed units, names that refer to
    other tables, keys that exclude each other in a table, Python files of the user's own, and everything that only the whole
    mechanism shows. `scissordyn check` sees these.
    """
    if which not in FILES:
        raise InputError(f"schema of '{which}'{did_you_mean(which, FILES)}", ", ".join(FILES), "scissordyn schema case")
    if which == "case":
        from scissordyn.config.case import CaseTable

        table: type[Table] = CaseTable
    else:
        from scissordyn.config.study import StudyText

        table = StudyText
    writer = _Writer()
    top = writer.shared(writer.table(table))
    writer.defined |= {name: writer.shared(definition) for name, definition in writer.defined.items()} | writer.patterns
    return {
        "$schema": DRAFT,
        "title": f"scissordyn {which} file",
        **top,
        "definitions": dict(sorted(writer.defined.items())),
    }


class _Writer:
    """Schemas of tables, each written once."""

    def __init__(self) -> None:
        self.defined: dict[str, Schema] = {}
        self.names: dict[type[Table], str] = {}
        self.patterns: dict[str, Schema] = {}

    def reference(self, table: type[Table]) -> Schema:
        name = self.names.get(table)
        if name is None:
            name, count = table.__name__.removesuffix("Table").removesuffix("_table") or "Table", 1
            while name in self.defined:
                count += 1
                name = f"{table.__name__}_{count}"
            self.names[table] = name
            self.defined[name] = {}  # the place is taken while its own tables are written
            self.defined[name] = self.table(table)
        return {"$ref": f"#/definitions/{name}"}

    def shared(self, schema: Any) -> Any:
        """A schema with patterns of units, which are long, in a place of their own."""
        if isinstance(schema, list):
            return [self.shared(entry) for entry in schema]
        if not isinstance(schema, dict):
            return schema
        name = name_of(schema["pattern"]) if isinstance(schema.get("pattern"), str) else ""
        if not name:
            return {key: self.shared(value) for key, value in schema.items()}
        self.patterns[name] = {"type": "string", "pattern": schema["pattern"]}
        rest = {key: value for key, value in schema.items() if key not in ("type", "pattern")}
        reference = {"$ref": f"#/definitions/{name}"}
        return {"allOf": [reference], **rest} if rest else reference

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
            accepted = _number(key.quantity, key.hint, key.words)
        else:
            accepted = self._of(key.hint)
        assert accepted, f"no schema for {key.hint!r}"
        described = [key.help.rstrip("."), key.quantity.allowed if key.quantity is not None else ""]
        text = "; ".join(filter(None, described))
        about: Schema = {"description": text} if text else {}
        if key.examples:
            about["examples"] = list(key.examples)
        if isinstance(key.default, str | bool) and key.default != "":
            about["default"] = key.default
        # beside a reference some editors read nothing else
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
            # of what Python alone can give, such as a section, there is no value in a file
            kept = [schema for member in members(annotation) if (schema := self._of(member))]
            return kept[0] if len(kept) == 1 else {"anyOf": kept}
        if isinstance(annotation, type) and issubclass(annotation, Table):
            return self.reference(annotation)
        if annotation in PLAIN:
            return {"type": PLAIN[annotation]}
        return {}

    def shape(self, shape: Any) -> Schema:
        """What a reader says that it accepts, with tables as references."""
        if isinstance(shape, type) and issubclass(shape, Table):
            return self.reference(shape)
        return {key: self._inner(value) for key, value in shape.items()}

    def _inner(self, value: Any) -> Any:
        if isinstance(value, type | Mapping):
            return self.shape(value)
        return [self._inner(entry) for entry in value] if isinstance(value, list) else value


def _number(quantity: Quantity, annotation: Any, words: tuple[str, ...]) -> Schema:
    """A number with its unit, or a plain one with its bounds; or one of some words."""
    if quantity.unit == "1":
        accepted: Schema = {"type": "integer" if int in members(annotation) else "number"}
        bounds = ("minimum", quantity.minimum), ("maximum", quantity.maximum)
        open_bounds = ("exclusiveMinimum", quantity.above), ("exclusiveMaximum", quantity.below)
        accepted |= {name: value for name, value in (*bounds, *open_bounds) if value is not None}
    else:
        low = quantity.minimum if quantity.above is None else quantity.above
        accepted = {"type": "string", "pattern": quantity_pattern(quantity.unit, negative=low is None or low < 0.0)}
    return {"anyOf": [accepted, {"enum": list(words)}]} if words else accepted
