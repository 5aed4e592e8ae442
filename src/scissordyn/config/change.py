"""Changes to a case: of what its file says, ``drive.speed=250 rpm``, and of what the file makes, ``unit 1/bar 2.mass=6 kg``."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Iterable, Set
from difflib import get_close_matches
from typing import Any

from scissordyn.config.quantity import read_quantity
from scissordyn.config.text import handle
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import KINDS, number
from scissordyn.model.section import with_dimension
from scissordyn.units import Quantity

SAMPLE = "--set drive.speed='250 rpm'"
DIMENSION = Quantity("m", above=0.0, help="dimension of a section")
OF_PINS = ("pin_friction", "pin_lugre")
LAW_KEYS = ("stiffness", "damping", "friction")


def changed(tree: dict[str, Any], changes: Iterable[str]) -> dict[str, Any]:
    """Parsed TOML with some values changed by ``path=value``.

    Tables of a list go by index, name or joint (``clearance.A.friction``), or all of them (``clearance.all.friction``).
    """
    new = copy.deepcopy(tree)
    for change in changes:
        path, equals, value = change.partition("=")
        keys = [key.strip() for key in path.split(".")]
        if not equals or not all(keys):
            raise InputError(f"--set {change!r}", "a path of keys, an equals sign and a value", SAMPLE)
        for path_of_one in _of_all(new, keys):
            _put(new, path_of_one, _parsed(value.strip()), change)
    return new


def _of_all(tree: dict[str, Any], keys: list[str]) -> list[list[str]]:
    """The path, or that of each table of a list for ``clearance.all.friction``, unless one is called so."""
    tables = tree.get(keys[0])
    if len(keys) < 3 or keys[1] != "all" or not isinstance(tables, list) or "all" in map(handle, tables):
        return [keys]
    return [[keys[0], str(index), *keys[2:]] for index in range(len(tables))]


def _parsed(text: str) -> Any:
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):  # not TOML, or numbers and nesting beyond reason: the reader says what is wrong
        return text
    return table["value"] if len(table) == 1 else text


def _put(tree: dict[str, Any], keys: list[str], value: Any, change: str) -> None:
    place: Any = tree
    for depth, key in enumerate(keys[:-1]):
        if isinstance(place, list) and not (_alone(place, key) and (key in place[0] or key in LAW_KEYS)):
            place = _item(place, key, change)
            continue
        place = place[0] if isinstance(place, list) else place
        inner = place.setdefault(key, {})
        if key == "section" and isinstance(inner, str) and depth == len(keys) - 2:
            place[key] = with_dimension(inner, keys[-1], read_quantity(value, DIMENSION, f"--set {change!r}"))
            return
        if key in LAW_KEYS and isinstance(inner, str):  # "lugre" and { law = "lugre" } are the same
            inner = place[key] = {"law": inner}
        if not isinstance(inner, dict | list):
            raise InputError(
                f"--set {change!r}: '{'.'.join(keys[: depth + 1])}' has no keys below it", "a path of keys", SAMPLE
            )
        place = inner
    if isinstance(place, list) and len(keys) > 1 and _alone(place, keys[-1]):
        place = place[0]
    if isinstance(place, list):
        names = [handle(entry) or str(number) for number, entry in enumerate(place)]
        which = keys[-1] in names or keys[-1].isdecimal()
        path = ".".join([*keys, "KEY"] if which else [*keys[:-1], names[0], keys[-1]]) if names else ""
        what = f"'{'.'.join(keys)}' is a whole table" if which else f"which [[{keys[-2]}]] is not said"
        raise InputError(
            f"--set {change!r}: {what}",
            "a key below it" if which else "one of " + ", ".join(names),
            command("--set", f"{path}=VALUE") if path else "",
        )
    place[keys[-1]] = value


def _alone(items: list[Any], key: str) -> bool:
    """Whether a table is the only one of its kind and a key is none of its names: it need not be named."""
    return len(items) == 1 and isinstance(items[0], dict) and key != handle(items[0]) and not key.isdecimal()


def _item(items: list[Any], key: str, change: str) -> Any:
    handles = list(map(handle, items))
    if key.isdecimal() and int(key) < len(items):
        return items[int(key)]
    if key in handles:
        return items[handles.index(key)]
    names = [name for name in handles if name] + [str(index) for index in range(len(items))]
    raise InputError(f"--set {change!r}: no '{key}' there{did_you_mean(key, names)}", "one of " + ", ".join(names))


def sorted_changes(tree: dict[str, Any], changes: Iterable[str], sections: Set[str]) -> tuple[list[str], list[str]]:
    """Changes of the file's own tables, and those of parts that the file makes, such as the bars of an array."""
    of_file, of_parts = [], []
    for change in changes:
        parameter, equals, _ = change.partition("=")
        head, dot, _ = (word.strip() for word in parameter.partition("."))
        # a kind of part of which the file itself has none
        of_part = not tree.get(head) and (head in KINDS or (head in OF_PINS and "joint_friction" in tree))
        of_table = not of_part and bool(get_close_matches(head, sections, n=1, cutoff=0.75))
        if not (equals and dot) or of_table:  # also a misspelt one, which is named there
            of_file.append(change)
            continue
        listed = [section for section, items in tree.items() if isinstance(items, list) and head in map(handle, items)]
        if listed:
            of_file.append(f"{'clearance' if 'clearance' in listed else listed[0]}.{change}")
        else:
            of_parts.append(change)
    return of_file, of_parts


def with_numbers(mechanism: Mechanism, changes: Iterable[str]) -> Mechanism:
    for change in changes:
        parameter, _, text = change.partition("=")
        place = number(mechanism, parameter.strip())
        assert place.quantity is not None
        try:
            value = read_quantity(float(text) if place.quantity.unit == "1" else text.strip(), place.quantity)
        except (InputError, ValueError) as error:
            what = error.what if isinstance(error, InputError) else str(error)
            raise InputError(f"--set {change!r}: {what}", f"a value [{place.quantity.unit}]", SAMPLE) from None
        mechanism = mechanism.replace(parameter.strip(), value)
    return mechanism
