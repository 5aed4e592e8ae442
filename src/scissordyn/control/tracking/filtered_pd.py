"""Feedback of the angle error and its filtered rate."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.control.controller import Controller
from scissordyn.control.signal import limited
from scissordyn.plugin.element import element, numbers
from scissordyn.units import Quantity, State


def torque(error, reference_speed, speed, filtered_rate, proportional, derivative, filter_time, limit):
    """Return the torque [N m] and z' [rad/s^2], the rate of the filtered error rate."""
    command = proportional * error + derivative * filtered_rate
    return limited(command, limit), (reference_speed - speed - filtered_rate) / filter_time


@element(
    name="filtered-pd",
    torque=torque,
    states=(State("filtered_rate", "rad/s", scale=1.0),),
    source="Astrom and Hagglund 1995, PID Controllers, ISBN 1-55617-516-7",
)
class FilteredPD(Controller):
    r"""Feedback of the angle error and its rate after a first-order filter, within a limit.

    .. math::
        u = \mathrm{sat}(k_p e + k_d z),\quad T_f z' = \dot e - z

    The filter limits the gain at high frequencies to k_p + k_d/T_f, as a measured speed needs it.
    """

    proportional: Annotated[float, Quantity("N m/rad", minimum=0.0, help="k_p")]
    derivative: Annotated[float, Quantity("N m s/rad", minimum=0.0, help="k_d")]
    filter_time: Annotated[float, Quantity("s", above=0.0, help="T_f, time constant of the filter")] = 1e-3
    limit: Annotated[float | None, Quantity("N m", above=0.0, help="largest torque in either sense")] = None

    def parameters(self) -> tuple[float, ...]:
        """Return the kernel's parameters; by default the torque has no limit."""
        return numbers(self, limit=math.inf if self.limit is None else self.limit)
