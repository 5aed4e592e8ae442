"""What a study asks as plain data for JSON, and back: by the fields of its frozen dataclasses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from types import MappingProxyType
from typing import Any, get_args, get_origin, get_type_hints

from scissordyn.annotation import members
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.configuration import write_configuration
from scissordyn.run.options import Options

Read = Mapping[Any, Callable[[Any], Any]]  # How values of some types are read
EARLIER = {"address": "path"}  # What fields were called in earlier files


def to_plain(value: Any) -> Any:
    if isinstance(value, Mechanism):
        return write_configuration(value)
    if isinstance(value, Options):
        return value.keywords
    if hasattr(value, "to_plain"):
        return value.to_plain()
    if isinstance(value, Mapping):
        return {key: to_plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(entry) for entry in value]
    if is_dataclass(value) and not isinstance(value, type):
        named = {field.name: to_plain(getattr(value, field.name)) for field in fields(value)}
        return {"kind": value.kind, **named} if hasattr(value, "kind") else named
    return value


def from_plain(hint: Any, plain: Any, read: Read = MappingProxyType({})) -> Any:
    """What `to_plain` wrote of a value with this annotation."""
    kind: Any = next((member for member in members(hint) if member is not type(None)), Any)
    if kind in read:
        return None if plain is None else read[kind](plain)
    arguments = get_args(kind)
    if get_origin(kind) is tuple:
        kinds = [arguments[0]] * len(plain) if arguments[-1] is ... else arguments
        return tuple(from_plain(inner, entry, read) for inner, entry in zip(kinds, plain, strict=True))
    if get_origin(kind) is dict:
        return {key: from_plain(arguments[1], entry, read) for key, entry in plain.items()}
    if is_dataclass(kind) and isinstance(plain, Mapping):
        hints = get_type_hints(kind)
        named: dict[Any, Any] = {EARLIER.get(name, name): entry for name, entry in plain.items()}
        built: Any = kind
        return built(**{name: from_plain(hints[name], entry, read) for name, entry in named.items()})
    return plain
