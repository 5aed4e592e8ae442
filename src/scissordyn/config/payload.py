"""Payloads at joints and points, and panels along bars, in a case file."""

from __future__ import annotations

from scissordyn.config.table import Call, table_of_call
from scissordyn.model.payload import with_panels, with_payload

PayloadTable = table_of_call(with_payload, (("mechanism", None),), base=Call, spelt={"place": "at"}, place="A", mass="1 kg")
"""A payload fixed to a body."""

PanelsTable = table_of_call(with_panels, (("mechanism", None),), base=Call, bodies="unit */bar 1", mass="0.5 kg")
"""A panel on each of some bars."""
