"""List the components of the package by the names of their tables in a case file; each file defines one.

User-defined components are in the user's files, for example ``my_components.py:Rubber``.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from scissordyn.components.declaration import Component, Declaration
from scissordyn.errors import InputError
from scissordyn.plugin.element import declared_in
from scissordyn.plugin.user_file import class_in

COMPONENT_FILES = (
    *("spring", "constant_force_spring", "nonlinear_spring", "gas_spring", "cable", "torsion_spring", "tape_spring"),
    *("clutch", "pin_friction", "guide_friction", "lugre", "bushing", "beam", "flexible_bar", "roller"),
    *("force", "drag", "torque", "stroke_load", "angle_load", "motor", "tabulated_motor", "linear_motor", "actuator"),
    *("angle_stop", "travel_stop", "cam", "edge_contact", "rod", "latch"),
)
"""Names of the files with component classes, in the order of their tables in a case file."""

COMPONENTS: Mapping[str, type[Component]] = MappingProxyType(
    {
        kind.declaration.section: kind
        for file in COMPONENT_FILES
        for kind in declared_in(import_module(f"scissordyn.components.{file}"))
    }
)
"""Component classes by the name of their table in a case file."""


def component_class(reference: str, folder: Path) -> Any:
    """Return the component class that ``"file.py:Class"`` names; the file is executed."""
    cls, name = class_in("component", reference, folder)
    if cls is None or not isinstance(vars(cls).get("declaration"), Declaration):
        path, _, called = name.rpartition(":")
        raise InputError(f"'{called}' in '{path}' is not a component", "a class decorated with sd.component(...)")
    return cls
