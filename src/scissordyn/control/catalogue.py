"""List every controller by name; each file in the folders `tracking` and `delayed` defines one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scissordyn.control import delayed, tracking
from scissordyn.plugin.element import element_named, elements_in
from scissordyn.units import checked

CONTROLLERS: Mapping[str, type[Any]] = elements_in(tracking, delayed)  # Controllers by name


@checked
def controller(name: str) -> type[Any]:
    """Return the controller class of a given name.

    Parameters
    ----------
    name : str
        Name in the catalogue, or ``"file.py:NAME"`` for a user-defined controller; the file is executed.

    Returns
    -------
    type
        Frozen dataclass; call it with its parameters.

    Raises
    ------
    InputError
        If no such controller exists; the message suggests the nearest name.
    """
    return element_named("controller", "controller", name, CONTROLLERS)
