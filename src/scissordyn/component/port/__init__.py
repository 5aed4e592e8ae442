"""Ports, one a file: how an element is attached, what it senses, what it exerts, and how that changes.

The kernel of a component gets the coordinates of its port and their rates. Its forces do work on these coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from scissordyn.component.port.actuator import ACTUATOR
from scissordyn.component.port.axis import AXIS
from scissordyn.component.port.declaration import Attachment, Output, Port
from scissordyn.component.port.frame import FRAME
from scissordyn.component.port.hinge import HINGE
from scissordyn.component.port.line import LINE
from scissordyn.component.port.point import POINT
from scissordyn.component.port.rail import RAIL
from scissordyn.component.port.travel import TRAVEL

__all__ = ["ACTUATOR", "AXIS", "FRAME", "HINGE", "LINE", "POINT", "PORTS", "RAIL", "TRAVEL", "Attachment", "Output", "Port"]

PORTS: Mapping[str, Port] = MappingProxyType({port.name: port for port in (LINE, HINGE, TRAVEL, POINT, FRAME)})
"""The ports that a component of the user's own may have, by name."""
