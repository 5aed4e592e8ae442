"""Rigid connections without clearance: welds, rods, and latches that lock during the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scissordyn.errors import InputError
from scissordyn.model.body import GROUND
from scissordyn.model.drive import TimeFunction
from scissordyn.model.joint import BodyPoint
from scissordyn.units import Quantity, check_quantities

__all__ = ["Latch", "Rod", "Weld"]


@dataclass(frozen=True)
class Weld:
    """A rigid connection: two points coincide and the bodies keep the relative angle of the start.

    Parameters
    ----------
    name : str
    start, end : (str, str)
        Body and point; one body may be "ground".
    """

    name: str
    start: BodyPoint
    end: BodyPoint

    def __post_init__(self) -> None:
        _two_bodies(self.name, self.start[0], self.end[0])


@dataclass(frozen=True)
class Rod:
    """A massless rigid rod between two points (a distance constraint), or a drive that prescribes their distance.

    Parameters
    ----------
    name : str
    start, end : (str, str)
        Body and point; one body may be "ground".
    length : float, optional
        Distance of the points [m]; as placed if neither length nor motion is given.
    motion : TimeFunction, optional
        The prescribed distance over time [m].
    direction : float, optional
        Direction from start to end at t = 0 [rad], with zero angular velocity of the rod at t = 0; as
        placed if not given.
    tension_only : bool
        Whether the rod represents a connection that carries tension only, such as the contact of a journal in its bearing. It
        is computed as a rigid rod, and the run has a warning when it would be compressed.
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    length: Annotated[float | None, Quantity("m", above=0.0, help="distance of the points")] = None
    motion: TimeFunction | None = None
    direction: Annotated[float | None, Quantity("rad", help="direction from start to end at t = 0")] = None
    tension_only: bool = False

    def __post_init__(self) -> None:
        check_quantities(self, f"rod '{self.name}'")
        _two_bodies(self.name, self.start[0], self.end[0])
        if self.length is not None and self.motion is not None:
            raise InputError(f"rod '{self.name}' with a length and a motion", "one of them")


@dataclass(frozen=True)
class Latch:
    """A lock that engages when two bodies reach an angle; from then on it keeps them at that angle.

    Locking is a plastic impact: the relative angular velocity becomes zero, and the lost energy is `latch_loss` of the run.

    Parameters
    ----------
    name : str
    body, base : str
        The base may be "ground".
    angle : float
        Of the body against its base where it locks, within half a revolution of the start [rad].
    """

    name: str
    body: str
    angle: Annotated[float, Quantity("rad", help="angle of the body against its base where it locks")]
    base: str = GROUND

    def __post_init__(self) -> None:
        check_quantities(self, f"latch '{self.name}'")
        _two_bodies(self.name, self.body, self.base)


def _two_bodies(name: str, one: str, other: str) -> None:
    if one == other:
        raise InputError(f"'{name}' connects body '{one}' with itself", "two different bodies")
