"""Ports, one a file: how an element is attached, what it senses, what it exerts, and how that changes.

The kernel of a component gets the coordinates of its port and their rates. Its forces do work on these coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from scissordyn.component.port.axis import AXIS as AXIS
from scissordyn.component.port.declaration import Attachment as Attachment
from scissordyn.component.port.declaration import Output as Output
from scissordyn.component.port.declaration import Port as Port
from scissordyn.component.port.frame import FRAME as FRAME
from scissordyn.component.port.hinge import ACTUATOR as ACTUATOR
from scissordyn.component.port.hinge import HINGE as HINGE
from scissordyn.component.port.line import LINE as LINE
from scissordyn.component.port.point import POINT as POINT
from scissordyn.component.port.rail import RAIL as RAIL
from scissordyn.component.port.travel import TRAVEL as TRAVEL

PORTS: Mapping[str, Port] = MappingProxyType({port.name: port for port in (LINE, HINGE, TRAVEL, POINT, FRAME)})
"""The ports that a component of the user's own may have, by name."""
