"""Every controller by name: one entry for each file in the folders `tracking` and `delayed`."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from dataclasses import is_dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from scissordyn.control import delayed, tracking
from scissordyn.control.user import UserController
from scissordyn.errors import InputError, did_you_mean
from scissordyn.plugin.user_file import file_digest, split_reference

__all__ = ["CONTROLLERS", "controller", "controller_from_file"]


def _controllers() -> Mapping[str, type[Any]]:
    """The controllers defined in the modules of the folders, by name."""
    found: dict[str, type[Any]] = {}
    for folder in (tracking, delayed):
        for entry in pkgutil.iter_modules(folder.__path__):
            module = importlib.import_module(f"{folder.__name__}.{entry.name}")
            for thing in vars(module).values():
                if isinstance(thing, type) and is_dataclass(thing) and thing.__module__ == module.__name__:
                    name: str = vars(thing)["name"]
                    if name in found:
                        raise TypeError(f"two controllers named '{name}': {found[name].__module__} and {module.__name__}")
                    found[name] = thing
    return MappingProxyType(dict(sorted(found.items())))


CONTROLLERS: Mapping[str, type[Any]] = _controllers()
"""Controllers by name."""


def controller(name: str) -> type[Any]:
    """The controller of a name.

    Parameters
    ----------
    name : str

    Returns
    -------
    type
        A frozen dataclass; call it with its parameters.

    Raises
    ------
    InputError
        If there is none; names the nearest.
    """
    if name not in CONTROLLERS:
        raise InputError(
            f"no controller '{name}'{did_you_mean(name, CONTROLLERS)}", ", ".join(CONTROLLERS) + ", or 'file.py:function'"
        )
    return CONTROLLERS[name]


def controller_from_file(reference: str, folder: Path, *, delay: float = 0.0, recorded: str = "") -> UserController:
    """A controller that is a function in the user's own file.

    Parameters
    ----------
    reference : str
        ``"my_control.py:steer"``; only this file is executed.
    folder : Path
        Where a relative file name starts.
    delay : float
        Delay of the recorded signal [s].
    recorded : str
        The signal whose delayed value it uses.

    Returns
    -------
    UserController

    Raises
    ------
    InputError
        If the file, the function or its result cannot be used.
    """
    path, name = split_reference(reference, folder)
    return UserController(f"{path}:{name}", digest=file_digest(path), delay=delay, recorded=recorded)
