"""Every controller by name: one entry for each file in the folders `tracking` and `delayed`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scissordyn.control import delayed, tracking
from scissordyn.plugin.element import element_named, elements_in

CONTROLLERS: Mapping[str, type[Any]] = elements_in(tracking, delayed)  # Controllers by name


def controller(name: str) -> type[Any]:
    """The controller of a name.

    Parameters
    ----------
    name : str
        Of the package's, or ``"file.py:NAME"`` for one of your own; the file is executed.

    Returns
    -------
    type
        A frozen dataclass; call it with its parameters.

    Raises
    ------
    InputError
        If there is none; names the nearest.
    """
    return element_named("controller", "controller", name, CONTROLLERS)
