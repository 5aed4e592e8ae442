"""The torque of `pid` and `feed_forward`: command, limit and integral.

Letters: e angle error, s the sensor's vector, z integral part of the torque. Back-calculation keeps the integral from winding
up (Astrom and Hagglund 1995, PID Controllers, section 3.5).
"""

from __future__ import annotations

import math
from typing import Any

from scissordyn.control.signal import ERROR, FEED_FORWARD, REFERENCE, SENSOR, SPEED, limited, ramped
from scissordyn.errors import InputError
from scissordyn.jit import kernel
from scissordyn.units import State

__all__ = ["INTEGRAL", "feedback_numbers", "torque"]

INTEGRAL = State("integral_torque", "N m", scale=1.0)
"""The integral part of the torque. Errors are compared with the torques of the mechanism where these are smaller."""

_limited, _ramped = limited, ramped


def feedback_numbers(described: Any) -> tuple[float, ...]:
    """k_p, k_d, k_i, limit, ramp and 1/tracking time of a controller that has these fields.

    Raises
    ------
    InputError
        If there is a ramp without a limit.
    """
    name = type(described).__name__
    if described.ramp > 0.0 and described.limit is None:
        raise InputError(f"{name}: ramp = {described.ramp:g} s without a limit", "a limit, which the ramp raises from zero")
    tracking = described.tracking_time
    if tracking is None and described.integral > 0.0:
        # the integral time, which Astrom and Hagglund recommend as an upper bound
        tracking = described.proportional / described.integral or 1.0
    limit = math.inf if described.limit is None else described.limit
    back = 1.0 / tracking if tracking else 0.0
    return described.proportional, described.derivative, described.integral, limit, described.ramp, back


@kernel()
def torque(t, q, z, dz, p):
    """Torque [N m] at signals q; writes z' [N m/s] into dz[0] if there is an integral."""
    command = p[0] * q[ERROR] + p[1] * (q[REFERENCE + 1] - q[SPEED]) + p[6] * q[FEED_FORWARD]
    if p[7] != 0.0:
        sx, sy, distance = q[SENSOR], q[SENSOR + 1], p[8]
        command -= p[7] * (sx * q[SENSOR + 2] + sy * q[SENSOR + 3]) / math.sqrt(sx * sx + sy * sy + distance * distance)
    if z.size > 0:
        command += z[0]
    given = _limited(command, p[3] if p[4] == 0.0 else p[3] * _ramped(t, 0.0, p[4]))
    if z.size > 0:
        dz[0] = p[2] * q[ERROR] + p[5] * (given - command)
    return given
