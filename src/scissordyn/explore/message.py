"""Messages between a page and its session: JSON with arrays of numbers behind it, and what may come from a browser."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from scissordyn.errors import InputError

LONGEST = 200  # Letters of a text from the browser: a number with its unit, or a name


def packed(message: Mapping[str, Any]) -> bytes:
    """A message as page.js unpacks it: the length of a head, the head, and its arrays of 64-bit floats or bytes.

    An array that stands in several places of the message is sent once. What is not finite can stand in arrays only.
    """
    arrays: list[Any] = []
    places: dict[int, int] = {}

    def place(value: Any) -> Any:
        if isinstance(value, np.generic):
            return value.item()
        if not isinstance(value, np.ndarray | bytes):
            raise TypeError(f"{type(value).__name__} in a message of the page")
        if id(value) not in places:
            places[id(value)] = len(arrays)
            arrays.append(value)  # it stays alive: the number of another one could be the same otherwise
        return {"$": places[id(value)]}

    content = json.dumps(message, default=place, allow_nan=False, separators=(",", ":"))
    parts = [value if isinstance(value, bytes) else np.ascontiguousarray(value, "<f8").tobytes() for value in arrays]
    kinds = [["bytes" if isinstance(value, bytes) else "floats", len(part)] for value, part in zip(arrays, parts, strict=True)]
    head = f'{{"arrays":{json.dumps(kinds)},"message":{content}}}'.encode()
    head += b" " * (-(4 + len(head)) % 8)  # floats begin at a multiple of their size
    return b"".join([len(head).to_bytes(4, "little"), head, *(part + bytes(-len(part) % 8) for part in parts)])


def text(message: Mapping[Any, Any], name: str) -> str:
    """A printable text of bounded length."""
    value = message.get(name)
    if not isinstance(value, str) or len(value) > LONGEST or not value.isprintable():
        raise InputError(f"a message of the page whose '{name}' is no text", f"at most {LONGEST} letters", "reload the page")
    return value


def number(message: Mapping[Any, Any], name: str) -> float:
    """A finite number."""
    value = message.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf or abs(value) > 1e300:
        raise InputError(f"a message of the page whose '{name}' is no number", "a finite number", "reload the page")
    return float(value)


def whole(message: Mapping[Any, Any], name: str) -> int:
    """A whole number."""
    value = number(message, name)
    if value != int(value):
        raise InputError(f"a message of the page whose '{name}' is no whole number", "a whole number", "reload the page")
    return int(value)
