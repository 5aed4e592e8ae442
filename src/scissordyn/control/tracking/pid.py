"""Feedback of the angle error, its rate and its integral.

Back-calculation prevents integral wind-up (Astrom and Hagglund 1995, PID Controllers, section 3.5).
"""

from __future__ import annotations

import math
from typing import Annotated, Any

from scissordyn.control.controller import Controller
from scissordyn.control.signal import limited, ramped
from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.plugin.element import element, numbers
from scissordyn.units import Quantity, State, check_quantities

INTEGRAL_TORQUE = State("integral_torque", "N m", scale=1.0)
"""Internal state of a controller: integral part of its torque; its scale is 1 N m, or the mechanism's torques if smaller."""


def feedback_numbers(described: Any) -> dict[str, float]:
    """Return the limit [N m] and one over the tracking time [1/s] of a PID controller or one with the same fields."""
    name = type(described).__name__
    if described.ramp > 0.0 and described.limit is None:
        raise InputError(f"{name}: ramp = {described.ramp:g} s requires a limit", "a limit that the ramp raises from zero")
    tracking = described.tracking_time
    if tracking is None and described.integral > 0.0:
        # the integral time, an upper bound recommended by Astrom and Hagglund
        tracking = described.proportional / described.integral or 1.0
    limit = math.inf if described.limit is None else described.limit
    return {"limit": limit, "back_calculation": 1.0 / tracking if tracking else 0.0}


@kernel
def add_integral(time, command, error, integral_torque, integral, limit, ramp, back_calculation):
    """Return the limited sum [N m] of a command and the integral part z, and z' [N m/s] with anti-windup."""
    command += integral_torque
    torque = limited(command, limit if ramp == 0.0 else limit * ramped(time, 0.0, ramp))
    return torque, integral * error + back_calculation * (torque - command)


def torque(
    time, error, reference_speed, speed, integral_torque, proportional, derivative, integral, limit, ramp, back_calculation
):
    """Return the torque [N m] and the rate of its integral part z [N m/s]."""
    command = proportional * error + derivative * (reference_speed - speed)
    return add_integral(time, command, error, integral_torque, integral, limit, ramp, back_calculation)


@element(
    name="pid", torque=torque, states=(INTEGRAL_TORQUE,), source="Astrom and Hagglund 1995, PID Controllers, ISBN 1-55617-516-7"
)
class PID(Controller):
    r"""Feedback of the angle error, its rate and its integral, within a limit.

    .. math::
        u = \mathrm{sat}(k_p e + k_d \dot e + z),\quad \dot z = k_i e + (u - k_p e - k_d \dot e - z)/T_t

    The limit can rise from zero linearly over a ramp.
    """

    proportional: Annotated[float, Quantity("N m/rad", minimum=0.0, help="k_p")]
    derivative: Annotated[float, Quantity("N m s/rad", minimum=0.0, help="k_d")] = 0.0
    integral: Annotated[float, Quantity("N m/(rad s)", minimum=0.0, help="k_i")] = 0.0
    limit: Annotated[float | None, Quantity("N m", above=0.0, help="largest torque in either sense")] = None
    ramp: Annotated[float, Quantity("s", minimum=0.0, help="time over which the limit rises from zero", zero="a jump")] = 0.0
    tracking_time: Annotated[float | None, Quantity("s", above=0.0, help="T_t of the back-calculation; k_p/k_i without it")] = (
        None
    )

    def __post_init__(self) -> None:
        check_quantities(self)
        feedback_numbers(self)

    @property
    def states(self) -> tuple[State, ...]:
        """Integral part of the torque; empty without integral gain."""
        return (INTEGRAL_TORQUE,) if self.integral > 0.0 else ()

    def parameters(self) -> tuple[float, ...]:
        """Return the kernel's parameters: an infinite limit by default, and the inverse tracking time."""
        return numbers(self, **feedback_numbers(self))
