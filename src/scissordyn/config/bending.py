"""Bars that bend, in a case file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scissordyn.config.table import Table
from scissordyn.model.bending import AXIAL, BENDING, ELEMENTS, with_bending
from scissordyn.model.mechanism import Mechanism

__all__ = ["BendingTable"]


class BendingTable(Table):
    """Bars that bend."""

    bars: Annotated[str, Field(description="which bars, by name or pattern", examples=["unit */bar *"])] = "all"
    section: Annotated[
        str | None,
        Field(description="tube, box, solid, angle or strip with its dimensions", examples=["tube 60x60x1.56 mm"]),
    ] = None
    material: Annotated[str | None, Field(description="steel, aluminium or titanium", examples=["steel"])] = None
    bending_stiffness: Annotated[float | None, BENDING] = None
    axial_stiffness: Annotated[float | None, AXIAL] = None
    elements: Annotated[int, ELEMENTS] = 8

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with these bars."""
        return with_bending(
            mechanism,
            self.bars,
            section=self.section,
            material=self.material,
            bending_stiffness=self.bending_stiffness,
            axial_stiffness=self.axial_stiffness,
            elements=self.elements,
        )
