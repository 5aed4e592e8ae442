"""Spring and damper between two points."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import TEXTBOOK, component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import LINE
from scissordyn.units import Quantity


def force(length, rate, stiffness, free_length, damping):
    """Return tension [N], stored energy [J] and dissipated power [W]."""
    stretch = length - free_length
    return stiffness * stretch + damping * rate, 0.5 * stiffness * stretch * stretch, damping * rate * rate


@component(
    port=LINE,
    force=force,
    symbol="spring",
    example={"start": "rod.middle", "end": "ground.O", "stiffness": "200 N/m", "free_length": "0.1 m", "damping": "2 N s/m"},
    source=TEXTBOOK,
)
class Spring:
    """Spring and damper between two points: tension k (l - l_0) + d l' along the line between them."""

    name: str
    start: BodyPoint
    end: BodyPoint
    stiffness: Annotated[float, Quantity("N/m", minimum=0.0, maximum=1e12, help="stiffness k")] = 0.0
    free_length: Annotated[float, Quantity("m", minimum=0.0, maximum=1e4, help="length l_0 without force")] = 0.0
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping d")] = 0.0
