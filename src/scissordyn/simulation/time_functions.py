"""The time functions of a mechanism, and whether their tables cover a run."""

from __future__ import annotations

from scissordyn.component.actuator import Actuator
from scissordyn.component.time_function import Tabulated, TimeFunction
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism

__all__ = ["check_tables", "prescribed"]


def prescribed(mechanism: Mechanism) -> list[tuple[str, TimeFunction]]:
    """Prescribed angles and distances, each with its description."""
    angles = [(f"the drive of '{drive.body}'", drive.motion) for drive in mechanism.drives]
    return angles + [(f"the length of rod '{rod.name}'", rod.motion) for rod in mechanism.rods if rod.motion is not None]


def check_tables(mechanism: Mechanism, until: float) -> None:
    """Raise `InputError` for a tabulated motion, reference or feed-forward torque that does not last from 0 to `until` [s]."""
    functions = prescribed(mechanism)
    for element in mechanism.elements:
        if isinstance(element, Actuator):
            given = (element.reference, element.feed_forward)
            functions += [(f"a time function of '{element.name}'", function) for function in given if function is not None]
    for name, function in functions:
        if isinstance(function, Tabulated) and not function.times[0] <= 0.0 <= until <= function.times[-1]:
            raise InputError(
                f"{name} is tabulated until {function.times[-1]:g} s, from {function.times[0]:g} s on; "
                f"the run goes from 0 s to {until:g} s",
                "a table that covers the run",
            )
