"""Bars that bend, in a case file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scissordyn.config.table import Call, table_of_call
from scissordyn.model.bending import with_bending

__all__ = ["BendingTable"]

BendingTable = table_of_call(
    with_bending,
    (
        ("mechanism", None),
        ("bodies", Annotated[str, Field(description="which bars, by name or pattern", examples=["unit */bar *"])]),
        ("section", Annotated[str | None, Field(description="tube, box, solid, angle or strip with its dimensions")]),
        ("material", Annotated[str | None, Field(description="steel, aluminium or titanium")]),
    ),
    base=Call,
    spelt={"bodies": "bars"},
    section="tube 60x60x1.56 mm",
    material="steel",
)
"""Bars that bend."""
