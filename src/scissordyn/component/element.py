"""The decorator of laws and controllers, where all its slots are known."""

from __future__ import annotations

from scissordyn.control.controller import Controller
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.plugin.element import element

__all__ = ["Controller", "Damping", "Elastic", "Friction", "element"]
