"""The components of the package, by the names of their tables in a case file. A new component is one more file here."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType

from scissordyn.component.declaration import Component
from scissordyn.plugin.catalogue import declared_in

FILES = (
    *("spring", "constant_force_spring", "nonlinear_spring", "gas_spring", "cable", "torsion_spring", "tape_spring"),
    *("clutch", "pin_friction", "guide_friction", "lugre", "bushing", "beam", "flexible_bar", "roller"),
    *("force", "torque", "stroke_load", "angle_load", "motor", "tabulated_motor", "linear_motor", "actuator"),
    *("angle_stop", "travel_stop", "cam", "rod", "latch"),
)
"""Of this room, in the order in which a case file has their tables."""

COMPONENTS: Mapping[str, type[Component]] = MappingProxyType(
    {kind.declaration.section: kind for file in FILES for kind in declared_in(import_module(f"scissordyn.component.{file}"))}
)
"""Component classes by section."""
