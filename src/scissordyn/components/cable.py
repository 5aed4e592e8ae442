"""Cable, which carries tension only."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import LINE, Output
from scissordyn.units import Quantity


def gap(length, rate, free_length):
    """Return the stretch of the cable [m] and its rate; the cable is taut above zero."""
    return length - free_length, rate


def force(length, rate, mode, stiffness, free_length, damping):
    """Return tension [N], stored energy [J], dissipated power [W], and 1 while the cable is taut."""
    stretch = length - free_length
    if mode == 0.0 or stretch <= 0.0:
        return 0.0, 0.0, 0.0, mode
    stored = 0.5 * stiffness * stretch * stretch
    # the sum of spring and damper must not push
    tension = stiffness * stretch + damping * rate
    if tension <= 0.0:
        return 0.0, stored, -stiffness * stretch * rate, mode
    return tension, stored, damping * rate * rate, mode


@component(
    port=LINE,
    force=force,
    gap=gap,
    outputs=(Output("taut", "1", "1 while the cable is taut, 0 while it is slack"),),
    context=("mode",),
    symbol="cable",
    events=("slack", "taut"),
    example={"start": "ground.O", "end": "rod.end", "stiffness": "50 kN/m", "free_length": "0.4 m", "damping": "5 N s/m"},
    source="Irvine 1981, Cable Structures, MIT Press: a taut cable with negligible weight",
)
class Cable:
    r"""Cable between two points, which carries tension only. The instants at which it becomes taut and slack are located.

    .. math:: T = \max(0,\; k\,(l - l_0) + d\,\dot l) \quad\text{for}\quad l > l_0
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    stiffness: Annotated[float, Quantity("N/m", above=0.0, maximum=1e12, help="stiffness of the taut cable, k = E A / l_0")]
    free_length: Annotated[float, Quantity("m", minimum=0.0, maximum=1e4, help="length l_0 at which it becomes taut")]
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping d of the taut cable")] = 0.0
