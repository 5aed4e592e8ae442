"""A force on a point."""

from __future__ import annotations

from typing import Annotated

from scissordyn.component.declaration import check_attachment, component
from scissordyn.component.place import BodyPoint, Point
from scissordyn.component.port import POINT
from scissordyn.component.time_function import TimeFunction
from scissordyn.units import Quantity, check_quantities


def force(x, y, cosine, sine, x_rate, y_rate, cosine_rate, sine_rate, factor, force_x, force_y, follows):
    """Both components of the force in the fixed frame [N]."""
    if follows == 0.0:
        return factor * force_x, factor * force_y
    return factor * (force_x * cosine - force_y * sine), factor * (force_x * sine + force_y * cosine)


@component(
    port=POINT,
    force=force,
    section="force",
    context=("factor",),
    passive=False,
    symbol="arrow",
    example={
        "point": "rod.middle",
        "force": "0, -10 N",
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}},
    },
)
class Force:
    """A force on a point, fixed in direction or following the body, constant or a function of time.

    Parameters
    ----------
    name : str
    point : (str, str)
        Body and point.
    force : (float, float)
        Components [N]; along the body's axes if the force follows it.
    follows : bool
        Whether it turns with the body.
    time_function : TimeFunction, optional
        A factor over time; 1 if not given.

    References
    ----------
    García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0
    """

    name: str
    point: BodyPoint
    force: Annotated[Point, Quantity("N", minimum=-1e12, maximum=1e12, help="its components")]
    follows: bool = False
    time_function: TimeFunction | None = None

    def __post_init__(self) -> None:
        check_quantities(self, f"force '{self.name}'")
        check_attachment(self)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Both components [N], and 1 for a force that follows its body."""
        return (*self.force, float(self.follows))
