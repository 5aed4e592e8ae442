"""Descriptions from plain data, so that a saved run can be run again.

A file is data. What it says is compared with the declarations of the dataclasses that describe mechanisms: which classes may
stand at a place, which fields they have and of which type. Only these classes are ever called. A function of the user's own is
taken from a file that the user names, never from one that the data names.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, TypeVar, cast

from scissordyn.annotation import members
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.declaration import Component
from scissordyn.component.user import component_class
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.control.controller import Controller
from scissordyn.control.user import UserController
from scissordyn.errors import InputError, command
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.user import UserDamping, UserElastic, UserFriction
from scissordyn.model.record import CLASS, DIGEST, FUNCTION, KIND, kind_of
from scissordyn.model.walk import declared
from scissordyn.plugin.element import SLOTS, element_class
from scissordyn.plugin.user_file import file_digest

PLUGINS: Mapping[type, tuple[type, ...]] = MappingProxyType(
    {
        Elastic: (*BY_KIND["stiffness"].values(), UserElastic),
        Damping: (*BY_KIND["damping"].values(), UserDamping),
        Friction: (*BY_KIND["friction"].values(), UserFriction),
        Controller: (*CONTROLLERS.values(), UserController),
        Component: tuple(COMPONENTS.values()),
    }
)
"""What stands for a declared protocol: the entries of its catalogue, and the user's own."""

LARGEST = 2**1023
"""Above it an integer is no float."""

Described = TypeVar("Described")


@dataclass(frozen=True)
class Description:
    """What a file says of one object: its class and its fields, compared with the declaration. The class is not called."""

    kind: type  # One of the classes that are declared for the place
    # Fields, each a `Description`, a tuple, a mapping, a text, a number, None, or a function that is only named. They can be
    # read as attributes; one that the file leaves out has its default
    values: Mapping[str, Any]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name in self.values:
            return self.values[name]
        field = declared(self.kind).get(name)
        if field is not None and field.default is not dataclasses.MISSING:
            return field.default
        raise InputError(f"a {kind_of(self.kind)} without '{name}'", "a file that scissordyn wrote")


@dataclass(frozen=True)
class NamedFunction:
    """A function of the user that a file names."""

    name: str
    file: str  # Where it was when the file was written; empty for a function that was handed over in Python


@dataclass(frozen=True)
class UserPart:
    """A part of a class of the user's, which a file of data names; its fields are compared when it is built."""

    place: str  # "component", or the slot of a law or a controller
    file: str  # Where the class was when the data were written; empty for one that was made in Python
    name: str  # Of the class
    digest: str  # Of the file
    values: Mapping[str, Any]

    kind: ClassVar[None] = None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name not in self.values:
            raise AttributeError(name)
        return self.values[name]


def from_plain(plain: Any, declared: type[Described], *, allow_code: Sequence[Path] = ()) -> Described:
    """The description that `to_plain` wrote."""
    built: Described = build(parse(plain, declared), allow_code=allow_code)
    return built


def parse(plain: Any, hint: Any, place: str = "") -> Any:
    """Compare plain data with a declaration; nothing is called."""
    place = place or getattr(hint, "__name__", str(hint)).lower()
    alternatives = _alternatives(hint)
    if any(typing.get_origin(each) is Callable for each in alternatives):
        return _named_function(plain, place)
    for each in alternatives:
        origin, inside = typing.get_origin(each), typing.get_args(each)
        if origin is tuple and isinstance(plain, list):
            return _parse_tuple(plain, inside, place)
        if isinstance(origin, type) and issubclass(origin, Mapping) and isinstance(plain, dict):
            return {str(key): parse(value, inside[1], f"{place}.{key}") for key, value in plain.items()}
        if (origin is typing.Literal and isinstance(plain, str) and plain in inside) or _is_scalar(plain, each):
            return plain
    described = {kind_of(each): each for each in alternatives if isinstance(each, type) and dataclasses.is_dataclass(each)}
    if not (described and isinstance(plain, dict)):
        raise InputError(f"{place} is {_shown(plain)}", "what scissordyn writes there")
    kind = plain.get(KIND)
    base = next((member for member in members(hint) if isinstance(member, type) and member in PLUGINS), None)
    if isinstance(kind, str) and base is not None and (".py:" in kind or kind == CLASS):
        file, _, name = kind.rpartition(":") if kind != CLASS else ("", "", str(plain.get(CLASS)))
        rest = {key: value for key, value in plain.items() if key not in (KIND, CLASS, DIGEST)}
        slot = "component" if base is Component else base.slot.name  # type: ignore[attr-defined]
        return UserPart(slot, file, name, str(plain.get(DIGEST, "")), MappingProxyType(rest))
    if not (isinstance(kind, str) and kind in described):
        raise InputError(f"{place} of kind {_shown(kind)}", "a kind that this version of scissordyn has there")
    return _parse_class(plain, described[kind], place)


def _parse_class(plain: dict[str, Any], found: type, place: str) -> Description:
    fields = declared(found)
    unknown = plain.keys() - fields.keys() - {KIND}
    if unknown:
        raise InputError(
            f"{place} has {_shown(min(unknown))}", f"the fields of {kind_of(found)}: {', '.join(fields) or 'none'}"
        )
    values = {key: parse(plain[key], fields[key].hint, f"{place}.{key}") for key in plain if key != KIND}
    return Description(found, MappingProxyType(values))


def build(described: Any, *, allow_code: Sequence[Path] = ()) -> Any:
    """Make the objects that were described."""
    if isinstance(described, tuple):
        return tuple(build(item, allow_code=allow_code) for item in described)
    if isinstance(described, UserPart):
        what = SLOTS[described.place].slot.title if described.place in SLOTS else described.place
        found = _permitted(NamedFunction(described.name, described.file), described.digest, allow_code, what, "class")
        own = described.place not in SLOTS
        made = component_class(found, Path.cwd()) if own else element_class(described.place, found, Path.cwd())[0]
        values = {KIND: kind_of(made), **described.values}
        return build(_parse_class(values, made, described.name), allow_code=allow_code)
    if not isinstance(described, Description):
        return described
    values = {
        key: _permitted(value, described.values.get("digest"), allow_code, cast(Any, described.kind).slot.title)
        if isinstance(value, NamedFunction)
        else build(value, allow_code=allow_code)
        for key, value in described.values.items()
    }
    try:
        return described.kind(**values)
    except InputError:
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(f"a description of kind '{kind_of(described.kind)}' that cannot be used ({error})") from None


@cache
def _alternatives(hint: Any) -> tuple[Any, ...]:
    """What may stand where a type is declared: the members of a union, the catalogue of a protocol."""
    return tuple(found for member in members(hint) for found in PLUGINS.get(member, (member,)))


def _parse_tuple(plain: list[Any], inside: tuple[Any, ...], place: str) -> tuple[Any, ...]:
    if inside[1:] == (Ellipsis,):
        return tuple(parse(item, inside[0], f"{place}[{index}]") for index, item in enumerate(plain))
    if len(plain) != len(inside):
        raise InputError(f"{place} has {len(plain)} entries", f"{len(inside)} entries")
    return tuple(parse(item, hint, f"{place}[{index}]") for index, (item, hint) in enumerate(zip(plain, inside, strict=True)))


def _is_scalar(plain: Any, hint: Any) -> bool:
    """Whether a value is of a plain declared type; a float may be written as an integer."""
    if hint is types.NoneType:
        return plain is None
    if hint is float:
        return isinstance(plain, float) or (type(plain) is int and abs(plain) < LARGEST)
    return hint in (bool, int, str) and type(plain) is hint


def _shown(plain: Any) -> str:
    """A value in a message: what it is, in short."""
    if isinstance(plain, dict | list):
        return "a table" if isinstance(plain, dict) else "a list"
    text = repr(plain) if not isinstance(plain, int) or abs(plain) < LARGEST else "a huge number"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _named_function(plain: Any, place: str) -> NamedFunction:
    if isinstance(plain, str):
        file, _, name = plain.rpartition(":")
        if file.endswith(".py") and name.isidentifier():
            return NamedFunction(name, file)
    elif isinstance(plain, dict) and plain.get(KIND) == FUNCTION and isinstance(plain.get("name"), str):
        return NamedFunction(plain["name"], "")
    raise InputError(f"{place} is {_shown(plain)}", "a function as scissordyn writes it, 'my_laws.py:soft'")


def _permitted(function: NamedFunction, digest: Any, allow_code: Sequence[Path], what: str, kind: str = FUNCTION) -> str:
    """The reference to a function in a file that the user allows and that holds what the description was made with."""
    if not function.file:
        raise InputError(
            f"the run uses the Python {kind} '{function.name}' as a {what}; its source in the attributes is not executed"
            if kind == FUNCTION
            else f"the run uses the Python class '{function.name}' as a {what}, which was in no file",
            f"a {what} from the catalogue or from a file",
            f"put it in a file and give the {what} as 'mine.py:{function.name}'",
        )
    file = Path(function.file).name
    if not digest:
        raise InputError(
            f"the run uses the {what} '{function.name}' of '{file}' without the digest of that file",
            "a run that scissordyn wrote, which holds the digest",
        )
    found = {path: _digest_of(path) for path in allow_code}
    for path, now in found.items():
        if now == digest:
            return f"{path.resolve()}:{function.name}"
    if found:
        raise InputError(
            f"the run uses the {what} '{function.name}' of '{file}' with the digest {digest}, and the digest of "
            + ", of ".join(f"'{path}' is {now}" for path, now in found.items()),
            "the file as it was when the run was made",
        )
    raise InputError(
        f"the run uses the {what} '{function.name}' of '{file}', which is not executed unless you allow it",
        "naming the file after you have read it",
        f"allow_code={file!r} in Python, or {command('--allow-code', file)}",
    )


def _digest_of(path: Path) -> str:
    if not path.is_file():
        raise InputError(
            f"no file '{path}' for the functions of the run", "a Python file that exists", "--allow-code my_laws.py"
        )
    return file_digest(path)
