"""Feed-forward torque of the reference motion with feedback of the tracking error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.control.tracking.feedback import INTEGRAL, feedback_numbers
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["FeedForward"]


@dataclass(frozen=True)
class FeedForward:
    r"""A torque over time with feedback of the angle error and of the rate of a distance, within a limit.

    .. math::
        u = \mathrm{sat}(u_f(t) + k_p e + k_d \dot e + z - k_s\, s \cdot \dot s/\sqrt{|s|^2 + s_0^2}),\quad
        \dot z = k_i e + (u - u_\mathrm{command})/T_t

    s is the vector of the actuator's sensor, such as the eccentricity of a clearance joint; k_s then damps the rate of the
    eccentricity.
    """

    proportional: Annotated[float, Quantity("N m/rad", minimum=0.0, help="k_p")] = 0.0
    derivative: Annotated[float, Quantity("N m s/rad", minimum=0.0, help="k_d")] = 0.0
    integral: Annotated[float, Quantity("N m/(rad s)", minimum=0.0, help="k_i")] = 0.0
    limit: Annotated[float | None, Quantity("N m", above=0.0, help="largest torque in either sense")] = None
    ramp: Annotated[float, Quantity("s", minimum=0.0, help="time over which the limit rises from zero")] = 0.0
    tracking_time: Annotated[float | None, Quantity("s", above=0.0, help="T_t of the back-calculation; k_p/k_i without it")] = (
        None
    )
    eccentricity_rate_damping: Annotated[
        float, Quantity("N s", help="k_s, torque per rate of the sensor's distance; either sign")
    ] = 0.0
    regularisation_length: Annotated[
        float, Quantity("m", above=0.0, help="s_0, which regularises the direction of small distances")
    ] = 1e-5

    name: ClassVar[str] = "feed-forward"
    kernel_kind: ClassVar[int] = 1
    source: ClassVar[str] = "Astrom and Hagglund 1995, PID Controllers, ISBN 1-55617-516-7"
    uses_feed_forward: ClassVar[bool] = True
    delay: ClassVar[float] = 0.0
    recorded: ClassVar[str] = ""
    recursion_gain: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self)
        feedback_numbers(self)

    @property
    def states(self) -> tuple[State, ...]:
        """The integral part of the torque, if there is one."""
        return (INTEGRAL,) if self.integral > 0.0 else ()

    @property
    def uses_sensor(self) -> bool:
        """Whether the rate damping is not zero."""
        return self.eccentricity_rate_damping != 0.0

    def parameters(self) -> tuple[float, ...]:
        """k_p, k_d, k_i, limit, ramp, 1/T_t, factor of the feed-forward, k_s, s_0."""
        return (*feedback_numbers(self), 1.0, self.eccentricity_rate_damping, self.regularisation_length)
