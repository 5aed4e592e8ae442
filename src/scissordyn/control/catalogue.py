"""Every controller by name: one entry for each file in the folders `tracking` and `delayed`."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from scissordyn.control import delayed, tracking
from scissordyn.errors import InputError, did_you_mean
from scissordyn.plugin.element import element_class


def _controllers() -> Mapping[str, type[Any]]:
    """The controllers defined in the modules of the folders, by name."""
    controllers: dict[str, type[Any]] = {}
    for folder in (tracking, delayed):
        for entry in pkgutil.iter_modules(folder.__path__):
            module = importlib.import_module(f"{folder.__name__}.{entry.name}")
            for thing in vars(module).values():
                if isinstance(thing, type) and "declaration" in vars(thing) and thing.__module__ == module.__name__:
                    name: str = vars(thing)["name"]
                    if name in controllers:
                        raise TypeError(f"two controllers named '{name}': {controllers[name].__module__} and {module.__name__}")
                    controllers[name] = thing
    return MappingProxyType(dict(sorted(controllers.items())))


CONTROLLERS: Mapping[str, type[Any]] = _controllers()
"""Controllers by name."""


def controller(name: str) -> type[Any]:
    """The controller of a name.

    Parameters
    ----------
    name : str
        Of the package's, or ``"file.py:Class"`` for one of your own; the file is executed.

    Returns
    -------
    type
        A frozen dataclass; call it with its parameters.

    Raises
    ------
    InputError
        If there is none; names the nearest.
    """
    if ".py:" in name:
        user_class, name_in_file = element_class("controller", name, Path.cwd())
        if user_class is None:
            raise InputError(
                f"the function '{name}' as a class", "a class", f"sd.UserController({name_in_file!r}, (CONSTANTS,))"
            )
        return user_class
    if name not in CONTROLLERS:
        raise InputError(
            f"no controller '{name}'{did_you_mean(name, CONTROLLERS)}", ", ".join(CONTROLLERS) + ", or 'file.py:Class'"
        )
    return CONTROLLERS[name]
