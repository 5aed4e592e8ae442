"""Component classes in files of the user's own: ``my_components.py:Rubber``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scissordyn.component.declaration import Component, Declaration
from scissordyn.errors import InputError
from scissordyn.plugin.user_file import file_digest, load_function, split_reference

__all__ = ["component_class"]


def component_class(reference: str, folder: Path) -> Any:
    """The component class that ``"file.py:Class"`` names; the file is executed.

    Parameters
    ----------
    reference : str
    folder : Path
        Where a relative file name starts.

    Returns
    -------
    type
        With the attribute `origin`: the file and the class, and the digest of the file.

    Raises
    ------
    InputError
        If there is no such file or class, or the class is no component.
    """
    path, name = split_reference("component", reference, folder)
    found: Any = load_function("component", f"{path}:{name}")
    if not isinstance(found, type) or not isinstance(vars(found).get("declaration"), Declaration):
        raise InputError(f"'{name}' in '{path}' is not a component", "a class under the decorator sd.component(...)")
    made: type[Component] = found
    made.origin = (f"{path}:{name}", file_digest(path))  # type: ignore[attr-defined]
    return made
