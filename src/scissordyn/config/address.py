"""Changes of a case by address, ``unit 1/bar 2.mass=6 kg``: of what its file says, and of what the file makes."""

from __future__ import annotations

from collections.abc import Iterable, Set
from difflib import get_close_matches
from typing import Any

from scissordyn.config.change import SAMPLE
from scissordyn.config.line import handle
from scissordyn.config.quantity import read_quantity
from scissordyn.errors import InputError
from scissordyn.model.address import KINDS, number
from scissordyn.model.mechanism import Mechanism


def sorted_changes(tree: dict[str, Any], changes: Iterable[str], sections: Set[str]) -> tuple[list[str], list[str]]:
    """Changes of the file's own tables, and those of parts that the file makes, such as the bars of an array."""
    of_file, of_parts = [], []
    for change in changes:
        address, equals, _ = change.partition("=")
        head, dot, _ = (word.strip() for word in address.partition("."))
        of_part = head in KINDS and not tree.get(head)  # a kind of part of which the file itself has none
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


def addressed(mechanism: Mechanism, changes: Iterable[str]) -> Mechanism:
    """The mechanism with some numbers changed."""
    for change in changes:
        address, _, text = change.partition("=")
        place = number(mechanism, address.strip())
        assert place.quantity is not None
        try:
            value = read_quantity(float(text) if place.quantity.unit == "1" else text.strip(), place.quantity)
        except (InputError, ValueError) as error:
            what = error.what if isinstance(error, InputError) else str(error)
            raise InputError(f"--set {change!r}: {what}", f"a value [{place.quantity.unit}]", SAMPLE) from None
        mechanism = mechanism.replace(address.strip(), value)
    return mechanism
