"""A rod without mass between two points, or a prescribed distance."""

from __future__ import annotations

from typing import Annotated

from scissordyn.component.declaration import check_attachment, component
from scissordyn.component.place import BodyPoint
from scissordyn.component.port import LINE
from scissordyn.component.time_function import TimeFunction
from scissordyn.errors import InputError
from scissordyn.units import Quantity, check_quantities


@component(
    port=LINE,
    section="rod",
    passive=False,
    symbol="rod",
    example={
        "start": "ground.O",
        "end": "rod.middle",
        "length": "0.5 m",
        "motion": {"cycloidal": {"start": "0.5 m", "end": "0.8 m", "duration": "2 s"}},
    },
)
class Rod:
    """A rigid rod without mass between two points, or a drive that prescribes their distance.

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
        Direction from start to end at t = 0 [rad], with zero angular velocity of the rod at t = 0; as placed if not given.
    tension_only : bool
        Whether the rod represents a connection that carries tension only, such as the contact of a journal in its bearing. It
        is computed as a rigid rod, and the run has a warning when it would be compressed.

    References
    ----------
    García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    length: Annotated[float | None, Quantity("m", above=0.0, maximum=1e4, help="distance of the points")] = None
    motion: TimeFunction | None = None
    direction: Annotated[
        float | None, Quantity("rad", minimum=-1e4, maximum=1e4, help="direction from start to end at t = 0")
    ] = None
    tension_only: bool = False

    def __post_init__(self) -> None:
        check_quantities(self, f"rod '{self.name}'")
        check_attachment(self)
        if self.length is not None and self.motion is not None:
            raise InputError(f"rod '{self.name}' with a length and a motion", "one of them")

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """None: a rod is a constraint."""
        return ()
