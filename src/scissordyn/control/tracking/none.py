"""No control."""

from __future__ import annotations

from scissordyn.control.signal import CONTROL
from scissordyn.plugin.element import element

__all__ = ["NoControl"]


@element(
    slot=CONTROL,
    name="none",
    source="definition",
)
class NoControl:
    """An actuator without torque: u = 0."""
