"""The least value of a number with which a case still meets its requirements, such as the torque limit of a servo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.config.case import Case
from scissordyn.config.studies import study
from scissordyn.errors import InputError
from scissordyn.model.parameter_path import number
from scissordyn.study.ask.distribution import Levels

VALUES = 8  # Values that are tried at a time


@dataclass(frozen=True)
class LeastValue:
    """Between which values a case begins to meet its requirements."""

    path: str
    value: float  # The least value tried above which, itself included, all values tried meet the requirements, in SI
    fails_at: float  # The largest value tried that does not
    tried: dict[float, bool]  # Whether the requirements are met, by value


def least_value(
    case: Case,
    parameter: str,
    low: float,
    high: float,
    requirements: Sequence[str],
    *,
    tolerance: float = 0.01,
    engine: Any = None,
) -> LeastValue:
    """The least value of a number with which requirements are met.

    Eight values at a time are simulated between one that fails and one above which all that were tried do not; requirements
    that are met, not met and met again below the value are seen where a value was tried there.

    Parameters
    ----------
    case : Case
    parameter : str
        Of the number.
    low, high : float
        Values between which it is searched for, in SI.
    requirements : sequence of str
        Such as ``"tip.error < 5 mm"``.
    tolerance : float
        Width of the interval at the end, as a fraction of its value.
    engine : Executor or int, optional
        As for `study`.

    Returns
    -------
    LeastValue

    Raises
    ------
    InputError
        If the requirements are not met at the high end, or are at the low one.
    """
    if not low < high:
        raise InputError(f"'{parameter}' from {low:g} to {high:g}", "a smaller value, then a larger one", "--from 1 --to 2")
    if not 1e-6 <= tolerance < 1.0:
        raise InputError(f"a tolerance of {tolerance:g}", "a number >= 1e-6 and < 1", "0.01")
    quantity = number(case.mechanism, parameter).quantity
    unit = "" if quantity is None or quantity.unit == "1" else f" {quantity.unit}"
    tried: dict[float, bool] = {}
    while True:
        values = np.linspace(low, high, VALUES + 2) if not tried else np.linspace(low, high, VALUES + 2)[1:-1]
        result = study(case, {parameter: Levels(tuple(values.tolist()))}, requirements=list(requirements), engine=engine)
        met = result.points["met"].values == 1.0
        tried |= dict(zip(values.tolist(), met.tolist(), strict=True))
        order = sorted(tried)
        failing = [value for value in order if not tried[value]]
        if not tried[order[-1]]:
            what = ", ".join(requirements)
            raise InputError(f"{what}: not met at '{parameter}' = {order[-1]:g}{unit}, the largest value", "a larger --to")
        if not failing:
            raise InputError(f"all requirements are met at '{parameter}' = {order[0]:g}{unit} already", "a smaller --from")
        low = failing[-1]
        high = min(value for value in order if value > low)
        if high - low <= tolerance * max(abs(low), abs(high)):
            return LeastValue(parameter, high, low, {value: tried[value] for value in order})
