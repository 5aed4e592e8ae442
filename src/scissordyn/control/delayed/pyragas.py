"""Delayed feedback of Pyragas, and the torque kernel and base class that it shares with extended delayed feedback."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

from scissordyn.control.controller import Controller
from scissordyn.control.signal import Recorded, check_signal, limited, ramped
from scissordyn.plugin.element import Kernel, element, numbers
from scissordyn.units import Quantity, check_quantities


def torque(time, recorded, delayed, gain, recursion_gain, limit, onset, ramp):
    """Return the torque [N m] K [(1-R) S(t-T) - y(t)], zero before the onset, ramped and limited."""
    if time < onset:
        return 0.0
    command = gain * ((1.0 - recursion_gain) * delayed - recorded)
    return limited(command if ramp == 0.0 else ramped(time, onset, ramp) * command, limit)


class DelayedFeedback(Controller):
    """Base of controllers with delayed feedback: a limited torque from the change of a recorded signal over a delay."""

    kernels: ClassVar[Mapping[str, Kernel]] = {"torque": torque}
    onset: float | None
    limit: float | None

    def __post_init__(self) -> None:
        check_quantities(self)
        check_signal(type(self).__name__, self.recorded)

    def parameters(self) -> tuple[float, ...]:
        """Return the kernel's parameters; by default the torque has no limit and the feedback begins after one delay."""
        onset = self.delay if self.onset is None else self.onset
        return numbers(self, limit=math.inf if self.limit is None else self.limit, onset=onset)


@element(
    name="pyragas",
    source="Pyragas 1992, doi:10.1016/0375-9601(92)90745-8; limitation: Nakajima 1997, doi:10.1016/S0375-9601(97)00362-9",
)
class Pyragas(DelayedFeedback):
    r"""Feedback of the difference between a signal and its value one period ago.

    .. math::
        u = \mathrm{sat}(K [y(t - T) - y(t)])

    It vanishes on every orbit of period T. It cannot stabilise an orbit with an odd number of real Floquet multipliers above 1
    in a system driven with that period.

    Before t = 0 the signal is taken as constant.
    """

    gain: Annotated[float, Quantity("N m", help="K, torque per SI unit of the signal")]
    delay: Annotated[float, Quantity("s", above=0.0, help="T, period of the desired orbit")]
    recorded: Recorded = "speed"
    onset: Annotated[float | None, Quantity("s", minimum=0.0, help="start of the feedback; one delay without it")] = None
    ramp: Annotated[float, Quantity("s", minimum=0.0, help="time over which the gain rises from zero", zero="a jump")] = 0.0
    limit: Annotated[float | None, Quantity("N m", above=0.0, help="largest torque in either sense")] = None
