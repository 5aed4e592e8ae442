"""Feed-forward torque of the reference motion, with feedback of the tracking error."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.control.tracking.pid import INTEGRAL_TORQUE, PID, add_integral
from scissordyn.kernel import equals
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def torque(
    time,
    error,
    reference_speed,
    speed,
    feed_forward,
    sensor_x,
    sensor_y,
    sensor_rate_x,
    sensor_rate_y,
    integral_torque,
    proportional,
    derivative,
    integral,
    limit,
    ramp,
    back_calculation,
    eccentricity_rate_damping,
    regularisation_length,
):
    """Return the torque [N m] and the rate of its integral part z [N m/s]."""
    command = proportional * error + derivative * (reference_speed - speed) + feed_forward
    if not equals(eccentricity_rate_damping, 0.0):
        square = sensor_x * sensor_x + sensor_y * sensor_y + regularisation_length * regularisation_length
        command -= eccentricity_rate_damping * (sensor_x * sensor_rate_x + sensor_y * sensor_rate_y) / math.sqrt(square)
    return add_integral(time, command, error, integral_torque, integral, limit, ramp, back_calculation)


@element(
    name="feed-forward",
    torque=torque,
    states=(INTEGRAL_TORQUE,),
    source="Astrom and Hagglund 1995, PID Controllers, ISBN 1-55617-516-7",
)
class FeedForward(PID):
    r"""A torque over time with feedback of the angle error and of the rate of a distance, within a limit.

    .. math::
        u = \mathrm{sat}(u_f(t) + k_p e + k_d \dot e + z - k_s\, s \cdot \dot s/\sqrt{|s|^2 + s_0^2}),\quad
        \dot z = k_i e + (u - u_\mathrm{command})/T_t

    s is the vector of the actuator's sensor, such as the eccentricity of a clearance joint; k_s then damps the rate of the
    eccentricity.
    """

    proportional: Annotated[float, Quantity("N m/rad", minimum=0.0, help="k_p")] = 0.0
    eccentricity_rate_damping: Annotated[
        float, Quantity("N s", help="k_s, torque per rate of the sensor's distance; either sign")
    ] = 0.0
    regularisation_length: Annotated[
        float, Quantity("m", above=0.0, help="s_0, which regularises the direction of small distances")
    ] = 1e-5

    @property
    def uses_sensor(self) -> bool:
        """True if k_s, the gain of the rate of the sensor's distance, is not zero."""
        return self.eccentricity_rate_damping != 0.0
