"""A spring and damper between two points."""

from __future__ import annotations

from typing import Annotated

from scissordyn.component.declaration import component
from scissordyn.component.place import BodyPoint
from scissordyn.component.port import LINE
from scissordyn.units import Quantity


def force(length, rate, stiffness, free_length, damping):
    """Tension [N], stored energy [J], dissipated power [W]."""
    stretch = length - free_length
    return stiffness * stretch + damping * rate, 0.5 * stiffness * stretch * stretch, damping * rate * rate


@component(
    port=LINE,
    force=force,
    section="spring",
    symbol="spring",
    example={"start": "rod.middle", "end": "ground.O", "stiffness": "200 N/m", "free_length": "0.1 m", "damping": "2 N s/m"},
)
class Spring:
    """A spring and damper between two points: tension k (l - l_0) + d l' along the line between them.

    Parameters
    ----------
    name : str
    start, end : (str, str)
        Body and point; the body may be "ground".
    stiffness : float
        k [N/m].
    free_length : float
        l_0 [m].
    damping : float
        d [N s/m].

    References
    ----------
    García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    stiffness: Annotated[float, Quantity("N/m", minimum=0.0, maximum=1e12, help="stiffness")] = 0.0
    free_length: Annotated[float, Quantity("m", minimum=0.0, maximum=1e4, help="length without force")] = 0.0
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping")] = 0.0
