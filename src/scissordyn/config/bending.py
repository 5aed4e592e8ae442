"""Bars that bend, in a case file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scissordyn.component.time_function import TimeFunction
from scissordyn.config.table import Call, table_of_call
from scissordyn.config.time_function import TIME_FUNCTION
from scissordyn.model.bending import with_bending

__all__ = ["BendingTable"]

BendingTable = table_of_call(
    with_bending,
    (
        ("mechanism", None),
        ("bodies", Annotated[str, Field(description="which bars, by name or pattern", examples=["unit */bar *"])]),
        ("section", Annotated[str | None, Field(description="tube, box, solid, angle or strip with its dimensions")]),
        ("material", Annotated[str | None, Field(description="steel, aluminium or titanium")]),
        (
            "time_function",
            Annotated[TimeFunction | None, TIME_FUNCTION, Field(description="a factor of temperatures over time")],
        ),
    ),
    base=Call,
    spelt={"bodies": "bars"},
    section="tube 60x60x1.56 mm",
    material="steel",
)
"""Bars that bend."""
