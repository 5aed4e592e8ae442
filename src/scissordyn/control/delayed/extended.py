"""Extended delayed feedback: Pyragas's feedback with a geometric sum over all previous periods."""

from __future__ import annotations

from typing import Annotated

from scissordyn.control.delayed.pyragas import DelayedFeedback
from scissordyn.control.signal import Recorded
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


@element(name="extended", source="Socolar, Sukow and Gauthier 1994, Physical Review E 50")
class ExtendedDelayedFeedback(DelayedFeedback):
    r"""Feedback of the difference between a signal and a weighted sum of its values one, two, three ... periods ago.

    .. math::
        u = \mathrm{sat}(K [(1 - R) S(t - T) - y(t)]),\quad S(t) = y(t) + R S(t - T)

    R = 0 is Pyragas's feedback. It vanishes on every orbit of period T and shares the limitation to an even number of real
    Floquet multipliers above 1.

    Before t = 0 the signal is taken as constant.
    """

    gain: Annotated[float, Quantity("N m", help="K, torque per SI unit of the signal")]
    delay: Annotated[float, Quantity("s", above=0.0, help="T, period of the desired orbit")]
    recursion_gain: Annotated[float, Quantity("1", above=-1.0, below=1.0, help="R, weight of S(t - T) in the recursion")] = 0.5
    recorded: Recorded = "speed"
    onset: Annotated[float | None, Quantity("s", minimum=0.0, help="start of the feedback; one delay without it")] = None
    ramp: Annotated[float, Quantity("s", minimum=0.0, help="time over which the gain rises from zero", zero="a jump")] = 0.0
    limit: Annotated[float | None, Quantity("N m", above=0.0, help="largest torque in either sense")] = None
