"""Force on a point."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import TEXTBOOK, component
from scissordyn.components.place import BodyPoint, Point
from scissordyn.components.port import POINT
from scissordyn.components.time_function import Factor
from scissordyn.units import Meaning, Quantity


def force(cosine, sine, factor, force_x, force_y, follows):
    """Return both components of the force in the fixed frame [N]."""
    if follows == 0.0:
        return factor * force_x, factor * force_y
    return factor * (force_x * cosine - force_y * sine), factor * (force_x * sine + force_y * cosine)


@component(
    port=POINT,
    force=force,
    context=("factor",),
    passive=False,
    symbol="arrow",
    example={
        "point": "rod.middle",
        "force": "0, -10 N",
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}},
    },
    source=TEXTBOOK,
)
class Force:
    """Force on a point, with a fixed direction or turning with the body, constant or a function of time."""

    name: str
    point: BodyPoint
    force: Annotated[
        Point, Quantity("N", minimum=-1e12, maximum=1e12, help="its components, along the body's axes if it follows")
    ]
    follows: Annotated[bool, Meaning("whether it turns with the body")] = False
    time_function: Factor = None

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return both components [N], and 1 for a force that turns with its body."""
        return (*self.force, float(self.follows))
