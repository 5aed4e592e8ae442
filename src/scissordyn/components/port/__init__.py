"""Ports: attachment, coordinates and forces of an element, and their derivatives; one file defines one port.

The kernel of a component gets the coordinates of its port and their rates. Its forces do work on these coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from scissordyn.components.port.axis import AXIS as AXIS
from scissordyn.components.port.declaration import Attachment as Attachment
from scissordyn.components.port.declaration import Output as Output
from scissordyn.components.port.declaration import Port as Port
from scissordyn.components.port.frame import FRAME as FRAME
from scissordyn.components.port.hinge import ACTUATOR as ACTUATOR
from scissordyn.components.port.hinge import HINGE as HINGE
from scissordyn.components.port.line import LINE as LINE
from scissordyn.components.port.point import POINT as POINT
from scissordyn.components.port.rail import RAIL as RAIL
from scissordyn.components.port.travel import TRAVEL as TRAVEL

PORTS: Mapping[str, Port] = MappingProxyType({port.name: port for port in (LINE, HINGE, TRAVEL, POINT, FRAME)})
"""Kinds of attachment that user-defined components can have, by name."""
