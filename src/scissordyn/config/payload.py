"""Payloads at joints and points, and panels along bars, in a case file."""

from __future__ import annotations

from typing import Annotated

from scissordyn.config.shape import About
from scissordyn.config.table import Call, table_of_call
from scissordyn.model.payload import with_panels, with_payload

_AT = Annotated[str, About('a joint (at the body of its journal), or a point as "BODY.POINT"', examples=["A"])]
_BODIES = Annotated[str, About("which bars, by name or pattern", examples=["unit */bar 1"])]

PayloadTable = table_of_call(with_payload, (("mechanism", None), ("place", _AT)), base=Call, spelt={"place": "at"}, mass="1 kg")
"""A payload fixed to a body."""

PanelsTable = table_of_call(with_panels, (("mechanism", None), ("bodies", _BODIES)), base=Call, mass="0.5 kg")
"""A panel on each of some bars."""
