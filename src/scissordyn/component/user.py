"""Component classes in files of the user's own: ``my_components.py:Rubber``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scissordyn.component.declaration import Declaration
from scissordyn.errors import InputError
from scissordyn.plugin.origin import class_in


def component_class(reference: str, folder: Path) -> Any:
    """The component class that ``"file.py:Class"`` names; the file is executed."""
    cls, name = class_in("component", reference, folder)
    if cls is None or not isinstance(vars(cls).get("declaration"), Declaration):
        path, _, called = name.rpartition(":")
        raise InputError(f"'{called}' in '{path}' is not a component", "a class under the decorator sd.component(...)")
    return cls
