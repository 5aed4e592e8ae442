"""A number of a mechanism that a fit may change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scissordyn.errors import InputError, command
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import Place, changed_all, find, number
from scissordyn.study.ask.distribution import Interval, Normal, Variation


@dataclass(frozen=True)
class Free:
    """A number that a fit may change, and what is known of it before."""

    path: str
    unit: str  # In SI
    start: float  # Where the search starts
    scale: float  # Size of changes that matter; the unknown of the search is the number over its scale
    low: float  # Bounds
    high: float
    mean: float  # Of what was measured otherwise, such as by weighing; an infinite deviation if nothing was
    deviation: float
    places: Sequence[Place]  # What `find` has found for the parameter path


def free_parameter(mechanism: Mechanism, parameter: str, variation: Variation | None = None) -> Free:
    """A number that a fit may change."""
    first = number(mechanism, parameter)
    quantity, value = first.quantity, float(first.value)
    assert quantity is not None, "number() gives one with a unit"
    low = max((bound for bound in (quantity.minimum, quantity.above) if bound is not None), default=-math.inf)
    high = min((bound for bound in (quantity.maximum, quantity.below) if bound is not None), default=math.inf)
    mean, deviation, scale = value, math.inf, abs(value)
    if isinstance(variation, Interval):
        low, high = max(low, variation.low), min(high, variation.high)
        scale = scale or high - low
    elif isinstance(variation, Normal):
        mean, deviation = variation.mean, variation.deviation
        low, high = max(low, variation.low), min(high, variation.high)
        value, scale = mean, abs(mean) or deviation
    elif variation is not None:
        raise InputError(
            f"'{parameter}' free over a {variation.kind} distribution",
            "a range, or a value with its standard deviation",
            command("--free", f"{parameter}=normal(0.1, 0.01) {quantity.unit}"),
        )
    if not scale > 0.0:
        raise InputError(
            f"'{parameter}' starts at zero and has no range, so that the size of its changes is unknown",
            "a range, or another value in the case",
            command("--free", f"{parameter}=0..1 {quantity.unit}"),
        )
    if not low <= value <= high:
        raise InputError(
            f"'{parameter}' starts at {value:g}, outside its range from {low:g} to {high:g}", "a range around its value"
        )
    return Free(parameter, quantity.unit, value, scale, low, high, mean, deviation, find(mechanism, parameter))


def with_values(mechanism: Mechanism, free: Sequence[Free], values: Sequence[float]) -> Mechanism:
    changes = {parameter.path: float(value) for parameter, value in zip(free, values, strict=True)}
    return changed_all(mechanism, changes, {parameter.path: parameter.places for parameter in free})
