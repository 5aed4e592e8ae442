"""The elements of the package by name, from the files of their folders, and an element by its name."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, cast

from scissordyn.errors import InputError, did_you_mean
from scissordyn.plugin.element import element_class


def declared_in(module: ModuleType) -> list[type[Any]]:
    """Classes with a declaration that a module defines, in order."""
    classes = [thing for thing in vars(module).values() if isinstance(thing, type) and thing.__module__ == module.__name__]
    return [thing for thing in classes if "declaration" in vars(thing)]


def elements_in(*folders: ModuleType) -> Mapping[str, type[Any]]:
    """The elements that are defined in the modules of packages: an element has no other place than its file."""
    elements: dict[str, type[Any]] = {}
    for folder in folders:
        for entry in pkgutil.iter_modules(folder.__path__):
            module = importlib.import_module(f"{folder.__name__}.{entry.name}")
            for thing in declared_in(module):
                name: str = vars(thing)["name"]
                if name in elements:
                    raise TypeError(f"two elements named '{name}': {elements[name].__module__} and {module.__name__}")
                elements[name] = thing
    return MappingProxyType(dict(sorted(elements.items())))


def element_named(slot: str, what: str, name: str, elements: Mapping[str, type[Any]]) -> type[Any]:
    """An element of the package, or in a file of the user's, which is executed."""
    if ".py:" in name:
        return cast(type[Any], element_class(slot, name, Path.cwd()))
    if name not in elements:
        raise InputError(f"no {what} '{name}'{did_you_mean(name, elements)}", ", ".join(elements) + ", or 'file.py:NAME'")
    return elements[name]
