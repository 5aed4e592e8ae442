"""Export the decorator of laws and controllers, and the base classes whose import defines its slots."""

from __future__ import annotations

from scissordyn.control.controller import Controller as Controller
from scissordyn.laws.contact import Damping as Damping
from scissordyn.laws.contact import Elastic as Elastic
from scissordyn.laws.contact import Friction as Friction
from scissordyn.plugin.element import element as element
