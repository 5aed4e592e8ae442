"""Latch that locks two bodies at an angle."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.declaration import TEXTBOOK, component
from scissordyn.components.place import GROUND
from scissordyn.components.port import HINGE
from scissordyn.errors import InputError
from scissordyn.tolerance import DATA_TOL
from scissordyn.units import Quantity


def gap(angle, speed, mode, stop, side):
    """Return the angle beyond the latch [rad] and its rate [rad/s]; a locked latch never opens."""
    if mode == 1.0:
        return 1.0, 0.0
    return side * (angle - stop), side * speed


@component(
    port=HINGE,
    gap=gap,
    context=("mode",),
    passive=False,
    symbol="latch",
    events=("opened", "locked"),
    example={"body": "rod", "angle": "80 deg"},
    source=TEXTBOOK,
)
class Latch:
    """Lock that engages when two bodies reach an angle, and then holds them rigidly at that angle.

    Locking is a plastic impact: the relative angular velocity vanishes at once, and the energy balance contains the loss.
    """

    name: str
    body: str
    angle: Annotated[
        float,
        Quantity("rad", minimum=-1e4, maximum=1e4, help="angle relative to the base at which it locks, including full turns"),
    ]
    base: str = GROUND

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the angle [rad] at which the latch locks, and the sense of rotation in which it is reached (1 or -1)."""
        if abs(self.angle - start[0]) < DATA_TOL:
            raise InputError(f"latch '{self.name}' is at its angle at the start", "a weld, or another angle")
        return self.angle, math.copysign(1.0, self.angle - start[0])
