"""Payloads at joints and points, and panels along bars, in a case file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scissordyn.config.table import Table
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.payload import with_panels, with_payload
from scissordyn.units import Quantity

__all__ = ["PanelsTable", "PayloadTable"]


class PayloadTable(Table):
    """A payload fixed to a body."""

    at: Annotated[
        str,
        Field(description='a joint (at the body of its journal), or a point as "BODY.POINT"', examples=["A"]),
    ]
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass"), Field(examples=["1 kg"])]
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, help="about the payload's own mass centre")] = 0.0

    def carried(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with the payload."""
        return with_payload(mechanism, self.at, self.mass, inertia=self.inertia)


class PanelsTable(Table):
    """A panel on each of some bars."""

    bodies: Annotated[str, Field(description="which bars, by name or pattern", examples=["unit */bar 1"])]
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass of one panel"), Field(examples=["0.5 kg"])]
    start: Annotated[str, Field(description="point of the bar where the panel begins")] = "start"
    end: Annotated[str, Field(description="point of the bar where it ends")] = "end"

    def carried(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with the panels."""
        return with_panels(mechanism, self.bodies, self.mass, start=self.start, end=self.end)
