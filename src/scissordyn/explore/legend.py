"""Which numbers tell compared runs apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scissordyn.explore.case import Case
    from scissordyn.explore.field import Field

MOST_NUMBERS = 4
"""Of one run in a legend; of more the number is said."""


def differences(cases: Sequence[Case]) -> list[str]:
    """Of each of some cases the numbers that are not the same in all of them, as text."""
    known = [{field.key: field for field in case.fields} for case in cases]
    keys = dict.fromkeys(key for fields in known for key in fields)
    differing = [key for key in keys if len({_content(fields.get(key)) for fields in known}) > 1]
    found = []
    for fields in known:
        said = [f"{fields[key].label} {fields[key].text}" for key in differing if key in fields]
        more = len(said) - MOST_NUMBERS
        found.append(", ".join(said[:MOST_NUMBERS]) + (f" and {more} more" if more > 0 else "") or "the same numbers")
    return found


def _content(field: Field | None) -> object:
    """What a field holds, for comparison."""
    return field and (field.value or field.text)
