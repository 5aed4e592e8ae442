"""What `pid` and `feed_forward` share: limit and integral of the command.

Letters: e angle error, s the sensor's vector, z integral part of the torque. Back-calculation keeps the integral from winding
up (Astrom and Hagglund 1995, PID Controllers, section 3.5).
"""

from __future__ import annotations

import math
from typing import Any

from scissordyn.control.signal import limited, ramped
from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.units import State

INTEGRAL = State("integral_torque", "N m", scale=1.0)
"""The integral part of the torque. Errors are compared with the torques of the mechanism where these are smaller."""


def feedback_numbers(described: Any) -> dict[str, float]:
    """Limit and 1/tracking time of a controller that has the fields of these."""
    name = type(described).__name__
    if described.ramp > 0.0 and described.limit is None:
        raise InputError(f"{name}: ramp = {described.ramp:g} s without a limit", "a limit, which the ramp raises from zero")
    tracking = described.tracking_time
    if tracking is None and described.integral > 0.0:
        # the integral time, which Astrom and Hagglund recommend as an upper bound
        tracking = described.proportional / described.integral or 1.0
    limit = math.inf if described.limit is None else described.limit
    return {"limit": limit, "back_calculation": 1.0 / tracking if tracking else 0.0}


@kernel
def settled(time, command, error, integral_torque, integral, limit, ramp, back_calculation):
    """Torque [N m] of a command with its integral part within the limit, and z' [N m/s]."""
    command += integral_torque
    torque = limited(command, limit if ramp == 0.0 else limit * ramped(time, 0.0, ramp))
    return torque, integral * error + back_calculation * (torque - command)
