"""Tracked points: points of bodies whose motion is recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scissordyn.component.place import Point
from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity, check_quantities, documented


@documented
@dataclass(frozen=True)
class Track:
    """A point of a body whose position, velocity, acceleration and deviation from the commanded path are recorded."""

    name: Annotated[str, Meaning("name of the tracked point")]
    body: Annotated[str, Meaning("the body")]
    point: Annotated[str | Point, Meaning('a point of the body, or a place in its frame as "1.2, 0 m"')]
    tolerance: Annotated[float | None, Quantity("m", above=0.0, help="deviation within which the point has settled")] = None

    def __post_init__(self) -> None:
        check_quantities(self, f"tracked point {self.name!r}")
        if not self.name or not isinstance(self.name, str):
            raise InputError(f"tracked point {self.name!r}", "a name")
        if not isinstance(self.point, str):
            object.__setattr__(self, "point", tuple(self.point))
