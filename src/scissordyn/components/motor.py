"""Motor with a linear torque-speed line."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import GROUND
from scissordyn.components.port import HINGE
from scissordyn.plugin.element import numbers
from scissordyn.units import Quantity


def force(speed, stall_torque, no_load_speed, limit):
    """Return the torque [N m]."""
    return min(limit, max(-limit, stall_torque - abs(stall_torque) * speed / no_load_speed))


@component(
    port=HINGE,
    force=force,
    passive=False,
    motor=True,
    symbol="motor",
    example={"body": "crank", "stall_torque": "5 N m", "no_load_speed": "300 rpm", "limit": "4 N m"},
    source="Hughes and Drury 2013, Electric Motors and Drives, 4th edition, Newnes",
)
class Motor:
    """Motor whose torque falls with its speed: T = T_0 (1 - w/w_0), limited in both directions."""

    name: str
    body: str
    stall_torque: Annotated[float, Quantity("N m", minimum=-1e9, maximum=1e9, help="T_0 at rest, with the sense of rotation")]
    no_load_speed: Annotated[float, Quantity("rad/s", above=0.0, maximum=1e6, help="w_0 without torque; beyond, it brakes")]
    base: str = GROUND
    limit: Annotated[float | None, Quantity("N m", above=0.0, maximum=1e9, help="largest torque in either direction")] = None
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, maximum=1e9, help="moment of inertia of the rotor")] = 0.0

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters; by default the limit is infinite."""
        return numbers(self, limit=math.inf if self.limit is None else self.limit)
