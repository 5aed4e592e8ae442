"""Whether the tables of time functions cover a run."""

from __future__ import annotations

import dataclasses

from scissordyn.component.time_function import Tabulated
from scissordyn.errors import InputError
from scissordyn.plan.plan import Plan


def check_tables(plan: Plan, until: float) -> None:
    """Raise `InputError` for a tabulated time function that does not last from 0 to `until` [s]."""
    functions = plan.motions
    for component in plan.components:
        fields = (getattr(component, field.name) for field in dataclasses.fields(component))  # type: ignore[arg-type]
        functions += [(f"a time function of '{component.name}'", value) for value in fields if isinstance(value, Tabulated)]
    for name, function in functions:
        if isinstance(function, Tabulated) and not function.times[0] <= 0.0 <= until <= function.times[-1]:
            raise InputError(
                f"{name} is tabulated until {function.times[-1]:g} s, from {function.times[0]:g} s on; "
                f"the run goes from 0 s to {until:g} s",
                "a table that covers the run",
            )
