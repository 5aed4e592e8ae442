"""Massless rod between two points, or prescribed distance."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import TEXTBOOK, component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import LINE
from scissordyn.components.time_function import OverTime, TimeFunction
from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity


@component(
    port=LINE,
    passive=False,
    symbol="rod",
    example={
        "start": "ground.O",
        "end": "rod.middle",
        "length": "0.5 m",
        "motion": {"cycloidal": {"start": "0.5 m", "end": "0.8 m", "duration": "2 s"}},
    },
    source=TEXTBOOK,
)
class Rod:
    """Rigid massless rod between two points, or drive that prescribes their distance."""

    name: str
    start: BodyPoint
    end: BodyPoint
    length: Annotated[float | None, Quantity("m", above=0.0, maximum=1e4, help="distance of the points, or as placed")] = None
    motion: Annotated[TimeFunction | None, OverTime("m", "the distance over time, without a length")] = None
    direction: Annotated[
        float | None,
        Quantity("rad", minimum=-1e4, maximum=1e4, help="direction from start to end at t = 0, without rotation"),
    ] = None
    tension_only: Annotated[
        bool, Meaning("whether it replaces a part that carries tension only; a run warns if it is compressed")
    ] = False

    def check(self) -> None:
        if self.length is not None and self.motion is not None:
            raise InputError(f"rod '{self.name}' has a length and a motion", "only one of them")

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return no parameters: a rod is a constraint."""
        return ()
