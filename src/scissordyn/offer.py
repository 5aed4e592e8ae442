"""What upper rooms offer to objects of lower ones, such as the picture of a mechanism: the package hands it down.

A mechanism can draw itself, but the room of mechanisms does not know that of pictures. What it calls is looked up among the
public names of the package, which hands that look-up to this module when it is imported.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_LOOK_UP: list[Callable[[str], Any]] = []


def hand_down(look_up: Callable[[str], Any]) -> None:
    """Let a function find what is offered by its public name."""
    _LOOK_UP[:] = [look_up]


def offered(name: str) -> Any:
    """What the package offers under a public name."""
    return _LOOK_UP[0](name)
