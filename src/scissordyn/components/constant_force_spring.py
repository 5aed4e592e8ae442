"""Constant-force spring between two points."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import LINE
from scissordyn.units import Quantity


def force(length, rate, tension, uncoiling_length, damping):
    """Return tension [N], stored energy [J] and dissipated power [W]."""
    part = min(1.0, length / uncoiling_length)
    stored = tension * (length - 0.5 * uncoiling_length) if part == 1.0 else 0.5 * tension * part * length
    return tension * part + damping * rate, stored, damping * rate * rate


@component(
    port=LINE,
    force=force,
    symbol="coil",
    example={"start": "ground.O", "end": "slider.centre", "tension": "20 N"},
    source="Votta 1952, The theory and design of long-deflection constant-force spring elements, Trans. ASME 74, 439-450",
)
class ConstantForceSpring:
    r"""Strip coiled on a drum that pulls its ends together with a force that hardly depends on their distance.

    .. math:: T = T_0 \min(1, l/l_1) + d\,\dot l

    The full tension T_0 is reached once a length l_1 of the strip, 1.25 times the diameter of the drum by usual practice, has
    left the drum; below it the tension is taken proportional to the length.
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    tension: Annotated[float, Quantity("N", minimum=0.0, maximum=1e9, help="tension T_0 beyond the uncoiling length")]
    uncoiling_length: Annotated[
        float, Quantity("m", above=0.0, maximum=1e3, help="length l_1 at which the full tension is reached")
    ] = 0.02
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping d")] = 0.0
