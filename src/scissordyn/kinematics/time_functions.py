"""The time functions of a mechanism, and whether their tables cover a run."""

from __future__ import annotations

import dataclasses

from scissordyn.component.time_function import Tabulated, TimeFunction
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism

__all__ = ["check_tables", "prescribed"]


def prescribed(mechanism: Mechanism) -> list[tuple[str, TimeFunction]]:
    """Prescribed angles and distances, each with its description."""
    angles = [(f"the drive of '{drive.body}'", drive.motion) for drive in mechanism.drives]
    return angles + [(f"the length of rod '{rod.name}'", rod.motion) for rod in mechanism.rods if rod.motion is not None]


def check_tables(mechanism: Mechanism, until: float) -> None:
    """Raise `InputError` for a tabulated time function that does not last from 0 to `until` [s]."""
    functions = prescribed(mechanism)
    for component in mechanism.components:
        given = (getattr(component, field.name) for field in dataclasses.fields(component))  # type: ignore[arg-type]
        functions += [(f"a time function of '{component.name}'", each) for each in given if isinstance(each, Tabulated)]
    for name, function in functions:
        if isinstance(function, Tabulated) and not function.times[0] <= 0.0 <= until <= function.times[-1]:
            raise InputError(
                f"{name} is tabulated until {function.times[-1]:g} s, from {function.times[0]:g} s on; "
                f"the run goes from 0 s to {until:g} s",
                "a table that covers the run",
            )
