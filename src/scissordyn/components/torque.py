"""Torque on a body."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import TEXTBOOK, component
from scissordyn.components.place import GROUND
from scissordyn.components.port import HINGE
from scissordyn.components.time_function import Factor
from scissordyn.units import Quantity


def force(factor, torque):
    """Return the torque [N m]."""
    return factor * torque


@component(
    port=HINGE,
    force=force,
    context=("factor",),
    passive=False,
    symbol="arc",
    example={"body": "crank", "torque": "1 N m", "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}}},
    source=TEXTBOOK,
)
class Torque:
    """Torque on a body relative to its base, constant or a function of time."""

    name: str
    body: str
    torque: Annotated[float, Quantity("N m", minimum=-1e9, maximum=1e9, help="torque")]
    base: str = GROUND
    time_function: Factor = None
