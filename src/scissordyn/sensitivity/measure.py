"""Derivatives of the measures of a run, from the derivatives of its final state, events and peaks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from types import MappingProxyType

import numpy as np

from scissordyn.errors import InputError
from scissordyn.mechanics.monitored import POWERS
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.measure import MEASURES, Ended, parts_of
from scissordyn.run.response import Response
from scissordyn.sensitivity.forward import Forward
from scissordyn.sensitivity.seed import weighted_mechanisms
from scissordyn.tolerance import DATA_TOL, REPORTED_FRACTION

INTEGRAL_MEASURES = ("impulse", "pressure_distance", "rms_drive_torque", "rms_track_deviation", *POWERS)
"""Names of measures that integrate a quantity over time."""


DIFFERENTIABLE = (
    *("peak_force", "peak_approach_speed", "first_contact", "contact_fraction", "peak_pressure_velocity"),
    *("peak_drive_torque", "peak_indentation", "peak_track_deviation", "end_track_deviation", "deployment_time"),
    *("peak_component_force", "peak_coupling_force", "peak_coordinate_drive_force", "mass", *INTEGRAL_MEASURES),
)
"""Names of measures with derivatives. Other measures are counts, verdicts, or values at samples or ends of steps."""


def _contact_forces(ended: Ended) -> np.ndarray:
    """Return the largest located force of each joint's contacts, of those that have one; NaN for ideal joints."""
    forces = ended.per_joint(lambda contacts: np.fmax.reduce(contacts["peak_force"], initial=0.0))
    return np.append(forces, np.full(len(parts_of(ended.mechanism)["joint"]) - forces.size, math.nan))


MEASURE_FUNCTIONS: Mapping[str, Callable[[Ended], float | np.ndarray]] = MappingProxyType(
    {name: MEASURES[name].value for name in DIFFERENTIABLE} | {"peak_force": _contact_forces}
)
"""Functions that compute the differentiable measures of a finished run, by name."""


def check_measure(response: Response) -> None:
    """Raise `InputError` if a response is a measure without derivatives."""
    if response.measure not in DIFFERENTIABLE:
        kind = "a count" if response.measure in ("contact_count", "steps") else "taken at samples or ends of steps"
        raise InputError(f"'{response.name}' has no derivatives: it is {kind}", ", ".join(DIFFERENTIABLE))


def value_of_response(ended: Ended, response: Response) -> float:
    """Return the value of a response: the measure of its part, or the largest or smallest measure of all parts."""
    values = np.asarray(MEASURE_FUNCTIONS[response.measure](ended), float)
    if not values.ndim:
        return float(values)
    if response.part:
        labels = parts_of(ended.mechanism)[MEASURES[response.measure].dims[0]]
        return float(values[labels.index(response.part)])
    numbers = values[~np.isnan(values)]
    return float((np.min if response.smallest else np.max)(numbers)) if numbers.size else math.nan


@contextmanager
def _moved(run: Forward, parameter: int, change: float) -> Iterator[None]:
    """Within the block, change the run's state, events and peaks along their derivatives by `change` parameter scales."""
    state = run.driver.state
    log = run.driver.integration.content.log[: len(run.log)]
    pairs = [(state.y, run.state), (log, run.log), (state.peak, run.peak), (state.total, run.total)]
    pairs.append((state.monitored, run.monitored))
    before = [array.copy() for array, _ in pairs]
    for array, slope in pairs:
        array += change * slope[..., parameter]
    yield
    for (array, _), kept in zip(pairs, before, strict=True):
        array[...] = kept


def derivatives_of(
    run: Forward,
    parameter: int,
    responses: Sequence[Response],
    values: Sequence[float],
    mechanism: Callable[[float], Mechanism],
    change: float = 0.0,
    step: float = 1e-4,
) -> list[tuple[float, bool]]:
    """Return the derivative of each response by parameter / scale, and True if the one-sided derivatives agree.

    `values` are those of the responses. The derivative is NaN if the largest value, of all contacts and parts, has none.
    `mechanism` returns the mechanism with the parameter changed by a fraction of its scale. The one-sided derivatives agree if
    no other part has the same largest value, now or after the relative change `change` along the derivatives.

    `step`: [parameter scales] Step of the fourth-order central differences of a measure; their error is round-off only. It is
    shorter where another part or contact, whose derivative is much larger, would have the largest value within it.
    """
    moved = cache(lambda size: _moved_values(run, parameter, responses, size))

    def of_response(k: int) -> Callable[[float], float]:
        return lambda size: moved(size)[k]

    return [
        (_mass_slope(run, response, mechanism, step), True)
        if response.measure == "mass"
        else _derivative(value, of_response(k), change, step)
        for k, (response, value) in enumerate(zip(responses, values, strict=True))
    ]


def _derivative(value: float, moved: Callable[[float], float], change: float, step: float) -> tuple[float, bool]:
    """Return the derivative of a measure by the size of a move, and True if the one-sided derivatives agree.

    `moved` returns the measure after a move of the run along its derivatives.
    """
    slope, smooth = math.nan, True
    for size in (step, 1e-2 * step, 1e-4 * step):
        values = _values(moved, size)
        if values[0] != value:
            return math.nan, True
        slope = ((values[1] - values[-1]) * 8.0 - (values[2] - values[-2])) / (12.0 * size)
        if same := _sides_agree(values, size, slope):
            break
        smooth = False
    if not same and max(abs(values[place] - value) for place in values) > REPORTED_FRACTION * abs(value):
        return math.nan, False
    wide = max(step, 0.5 * change)
    return slope, smooth and (wide == step or _sides_agree(_values(moved, wide), wide, slope))


def _sides_agree(values: dict[int, float], size: float, slope: float) -> bool:
    """Return True if both one-sided derivatives agree."""
    below, above = ((values[2 * side] - 4.0 * values[side] + 3.0 * values[0]) / (-2.0 * side * size) for side in (-1, 1))
    return bool(abs(above - below) <= DATA_TOL * max(abs(slope), abs(values[0])))


def _values(moved: Callable[[float], float], step: float) -> dict[int, float]:
    """Return a measure at places in steps."""
    return {place: moved(place * step) for place in (-2, -1, 0, 1, 2)}


def _moved_values(run: Forward, parameter: int, responses: Sequence[Response], size: float) -> list[float]:
    """Return the responses after a move of a run along its derivatives by `size` parameter scales."""
    with _moved(run, parameter, size):
        ended = Ended(run.driver)
        return [value_of_response(ended, response) for response in responses]


def _mass_slope(run: Forward, response: Response, mechanism: Callable[[float], Mechanism], step: float) -> float:
    """Return the derivative of the mass, which does not depend on the run, by parameter / scale."""
    slope, tables = 0.0, run.driver.plan
    mass = value_of_response(Ended(run.driver), response)
    for weight, _, changed in weighted_mechanisms(mechanism, step):
        run.driver.plan = plan(changed)
        slope += weight * (value_of_response(Ended(run.driver), response) - mass)
    run.driver.plan = tables
    return slope
