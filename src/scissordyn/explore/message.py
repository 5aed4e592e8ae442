"""What may come from a browser: each message is looked at before anything is done with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from scissordyn.errors import InputError

LONGEST = 200
"""Letters of a text from the browser: a number with its unit, or a name."""


def text(message: Mapping[Any, Any], name: str) -> str:
    """A text of a message."""
    found = message.get(name)
    if not isinstance(found, str) or len(found) > LONGEST or not found.isprintable():
        raise InputError(f"a message of the page whose '{name}' is no text", f"at most {LONGEST} letters", "reload the page")
    return found


def number(message: Mapping[Any, Any], name: str) -> float:
    """A finite number of a message."""
    found = message.get(name)
    if isinstance(found, bool) or not isinstance(found, int | float) or not abs(found) < math.inf or abs(found) > 1e300:
        raise InputError(f"a message of the page whose '{name}' is no number", "a finite number", "reload the page")
    return float(found)


def whole(message: Mapping[Any, Any], name: str) -> int:
    """A whole number of a message, see `number`."""
    found = number(message, name)
    if found != int(found):
        raise InputError(f"a message of the page whose '{name}' is no whole number", "a whole number", "reload the page")
    return int(found)
