"""Delayed feedback of Pyragas."""

from __future__ import annotations

from typing import Annotated

from scissordyn.control.controller import Controller
from scissordyn.control.delayed.difference import difference_numbers, torque
from scissordyn.plugin.element import element, numbers
from scissordyn.units import Quantity, check_quantities


@element(
    name="pyragas",
    torque=torque,
    source=("Pyragas 1992, doi:10.1016/0375-9601(92)90745-8; limitation: Nakajima 1997, doi:10.1016/S0375-9601(97)00362-9"),
)
class Pyragas(Controller):
    r"""Feedback of the difference between a signal and its value one period ago.

    .. math::
        u = \mathrm{sat}(K [y(t - T) - y(t)])

    It vanishes on every orbit of period T. It cannot stabilise an orbit with an odd number of real Floquet multipliers above 1
    in a system driven with that period.

    Parameters
    ----------
    gain : float
        K [N m per unit of the signal].
    delay : float
        T [s].
    recorded : str
        The signal y: "error" (reference less angle [rad]), "speed" [rad/s], "sensor_x", "sensor_y" [m] or their rates
        "sensor_rate_x", "sensor_rate_y" [m/s].
    onset : float, optional
        Start of the feedback [s]; one delay if not given. Before t = 0 the signal is taken as constant.
    ramp : float
        Time over which the gain rises from zero after the onset [s].
    limit : float, optional
        Largest torque in either sense [N m].
    """

    gain: Annotated[float, Quantity("N m", help="K, torque per SI unit of the signal")]
    delay: Annotated[float, Quantity("s", above=0.0, help="T, period of the desired orbit")]
    recorded: str = "speed"
    onset: Annotated[float | None, Quantity("s", minimum=0.0, help="start of the feedback; one delay without it")] = None
    ramp: Annotated[float, Quantity("s", minimum=0.0, help="time over which the gain rises from zero")] = 0.0
    limit: Annotated[float | None, Quantity("N m", above=0.0, help="largest torque in either sense")] = None

    def __post_init__(self) -> None:
        check_quantities(self)
        difference_numbers(self)

    def parameters(self) -> tuple[float, ...]:
        """The limit is infinite unless given, the onset one delay."""
        return numbers(self, **difference_numbers(self))
