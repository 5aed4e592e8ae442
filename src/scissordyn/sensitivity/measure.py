"""Derivatives of measures, which are smooth functions of what a run accumulates."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType

import numpy as np

from scissordyn.errors import InputError
from scissordyn.mechanics.monitored import POWERS
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.measure import MEASURES, Ended, parts_of
from scissordyn.sensitivity.forward import Forward
from scissordyn.studies.ask.requirement import Response
from scissordyn.tolerance import DATA_TOL

STEP = 1e-4
"""Step along the derivatives, as a fraction of a parameter's scale; a difference of fourth order has no error but round-off."""


WITH_INTEGRALS = ("impulse", "pressure_distance", "rms_drive_torque", "rms_track_deviation", *POWERS)

SMOOTH = (
    *("peak_force", "peak_approach_speed", "first_contact", "contact_fraction", "peak_pressure_velocity"),
    *("peak_drive_torque", "peak_indentation", "peak_track_deviation", "end_track_deviation", "deployment_time"),
    *("peak_component_force", "peak_coupling_force", "peak_coordinate_drive_force", "mass", *WITH_INTEGRALS),
)
"""Measures with derivatives. The others are counts, verdicts, or values at samples or ends of steps."""


def _contact_forces(ended: Ended) -> np.ndarray:
    """Return the located largest force of each contact; NaN for joints that are ideal, whose forces are not located."""
    forces = ended.per_joint(lambda contacts: np.max(contacts["peak_force"], initial=0.0))
    return np.append(forces, np.full(len(parts_of(ended.mechanism)["joint"]) - forces.size, math.nan))


VALUES: Mapping[str, Callable[[Ended], float | np.ndarray]] = MappingProxyType(
    {name: MEASURES[name].value for name in SMOOTH} | {"peak_force": _contact_forces}
)


def check_measure(response: Response) -> None:
    """Raise `InputError` for a measure without derivatives."""
    if response.measure not in SMOOTH:
        kind = "a count" if response.measure in ("contact_count", "steps") else "not located to the last digit in a run"
        raise InputError(f"'{response.name}' has no derivatives: it is {kind}", ", ".join(SMOOTH))


def value_of_response(ended: Ended, response: Response) -> float:
    """Return a response of a run: that of a part, or the largest or smallest of all parts."""
    values = np.asarray(VALUES[response.measure](ended), float)
    if not values.ndim:
        return float(values)
    if response.part:
        labels = parts_of(ended.mechanism)[MEASURES[response.measure].dims[0]]
        return float(values[labels.index(response.part)])
    known = values[~np.isnan(values)]
    return float((np.min if response.smallest else np.max)(known)) if known.size else math.nan


@contextmanager
def _moved(run: Forward, parameter: int, change: float) -> Iterator[None]:
    """Move what a run has accumulated along its derivatives, for the time of a block."""
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


def derivative_of(
    run: Forward, parameter: int, response: Response, mechanism: Callable[[float], Mechanism]
) -> tuple[float, bool]:
    """Return the derivative of a response by parameter / scale, and whether it is the same to both sides.

    `mechanism` returns the mechanism with the parameter changed by a fraction of its scale.
    """
    made, values = run.driver.plan, {}
    for place in (-2, -1, 0, 1, 2):
        with _moved(run, parameter, place * STEP):
            if response.measure == "mass":
                run.driver.plan = plan(mechanism(place * STEP))
            values[place] = value_of_response(Ended(run.driver), response)
            run.driver.plan = made
    slope = ((values[1] - values[-1]) * 8.0 - (values[2] - values[-2])) / (12.0 * STEP)
    sides = [(values[2 * side] - 4.0 * values[side] + 3.0 * values[0]) / (-2.0 * side * STEP) for side in (-1, 1)]
    scale = max(abs(slope), abs(values[0]))
    return slope, bool(abs(sides[1] - sides[0]) <= DATA_TOL * scale)
