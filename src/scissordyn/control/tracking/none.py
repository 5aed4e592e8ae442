"""No control."""

from __future__ import annotations

from scissordyn.control.controller import Controller
from scissordyn.plugin.element import element


@element(name="none", source="definition")
class NoControl(Controller):
    """An actuator without torque: u = 0."""
