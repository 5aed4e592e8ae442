"""Tracked points: points of bodies whose motion is recorded."""

from __future__ import annotations

from dataclasses import dataclass

from scissordyn.component.place import Point
from scissordyn.errors import InputError

__all__ = ["Track"]


@dataclass(frozen=True)
class Track:
    """A point of a body whose position, velocity, acceleration and deviation from the ideal mechanism are recorded.

    Parameters
    ----------
    name : str
        Unique among the tracked points.
    body : str
    point : str or (float, float)
        A named point of the body, or a place in its frame [m].
    """

    name: str
    body: str
    point: str | Point

    def __post_init__(self) -> None:
        if not self.name or not isinstance(self.name, str):
            raise InputError(f"tracked point {self.name!r}", "a name")
        if not isinstance(self.point, str):
            object.__setattr__(self, "point", tuple(self.point))
