"""Derivatives of the variables of a run over time, from those of its samples and outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from scissordyn.mechanics.sample import Record
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system
from scissordyn.record.dataset import results
from scissordyn.record.results import Results
from scissordyn.record.trajectory import Trajectory
from scissordyn.run.advance.driver import count_steps
from scissordyn.run.trajectory import current_trajectory
from scissordyn.sensitivity.forward import SAMPLED_ARRAYS, Forward
from scissordyn.sensitivity.seed import weighted_mechanisms
from scissordyn.tolerance import ROUND_OFF_TOL

DIFFERENCE_STEP = ROUND_OFF_TOL**0.25
"""Largest relative change of samples and outputs in differences that give derivatives of a run's variables.

Variables are simple functions of these, so that the error of fourth order is round-off.
"""


def moved_results(run: Forward, parameter: int, step: float, mechanism: Mechanism) -> Results:
    """Return the variables of a run moved along its derivatives by one parameter.

    `step` is the change of the parameter, divided by its scale; `mechanism` has the changed parameter.
    """
    tables, driver = plan(mechanism), run.driver
    values, slopes = run.outputs
    record = Record(*(_moved(*pair, parameter, step) for pair in zip(values, slopes, strict=True)))
    statistics = {"method": driver.method, "reason": "", "seconds": 0.0, **count_steps(driver.state)}
    path: Trajectory = current_trajectory(driver, statistics=statistics)
    samples = {name: getattr(path.samples, name) + step * run.samples[name][..., parameter] for name in SAMPLED_ARRAYS}
    log = driver.integration.content.log[: len(run.log)] + step * run.log[..., parameter]
    path = replace(
        path,
        plan=tables,
        system=make_system(tables),
        samples=path.samples._replace(**samples),
        log=np.ascontiguousarray(log).view(path.log.dtype)[:, 0],
    )
    return results(tables, "", path, record)


def _moved(values: np.ndarray, slopes: np.ndarray, parameter: int, step: float) -> np.ndarray:
    if values.dtype.names is None:
        return np.asarray(values + step * slopes[..., parameter])
    changed = values.copy()
    for name in values.dtype.names:
        changed[name] += step * slopes[name][..., parameter]
    return changed


def curve_names(found: Results) -> Iterator[str]:
    """Yield the names of variables over time that have derivatives."""
    for name, variable in found.variables.items():
        if name != "time" and variable.dims and variable.dims[0] == "time" and variable.dtype.kind == "f":
            yield name


def difference_step(run: Forward, parameter: int) -> float:
    """Return the step of the differences [parameter scales], at which no sample or output changes by more than its part."""
    pairs = [(getattr(run.driver.samples, name), run.samples[name]) for name in SAMPLED_ARRAYS]
    pairs += [
        (values, slopes) if values.dtype.names is None else (values[name], slopes[name])
        for values, slopes in zip(*run.outputs, strict=True)
        for name in values.dtype.names or ("",)
    ]
    largest = 1.0
    for values, slopes in pairs:
        size, slope = (np.max(np.abs(part[np.isfinite(part)]), initial=0.0) for part in (values, slopes[..., parameter]))
        if size > 0.0:
            largest = max(largest, float(slope / size))
    return float(DIFFERENCE_STEP / largest)


def step_ladder(run: Forward, parameter: int) -> np.ndarray:
    """Return steps of differences [parameter scales], from `DIFFERENCE_STEP` down to `difference_step`, by factors near 1 %."""
    shortest = difference_step(run, parameter)
    count = 1 + int(np.ceil(np.log10(DIFFERENCE_STEP / shortest) / 2.0))
    return np.geomspace(DIFFERENCE_STEP, shortest, count)


def most_accurate(slopes: np.ndarray, steps: np.ndarray, size: float) -> np.ndarray:
    """Return for each element the difference with the smallest estimated error, of several with decreasing steps.

    The error is the round-off of values of a given size, and the change by the next shorter step. A value that is nearly zero
    makes the shortest step too short for others, as a direction that is undefined where a journal is in the centre.
    """
    errors = np.finfo(float).eps * size / steps.reshape(-1, *[1] * (slopes.ndim - 1)) + np.zeros(slopes.shape)
    errors[:-1] += np.nan_to_num(np.abs(np.diff(slopes, axis=0)), nan=np.inf)
    return np.asarray(np.take_along_axis(slopes, np.argmin(errors, axis=0)[np.newaxis], axis=0)[0])


def moved_slopes(
    run: Forward,
    parameter: int,
    mechanism: Callable[[float], Mechanism],
    values_of: Callable[[Results], Mapping[str, np.ndarray]],
) -> dict[str, np.ndarray]:
    """Return the derivatives of functions of a run's results by parameter / scale: differences along the run's derivatives.

    `mechanism` returns the mechanism with the parameter changed by a fraction of its scale, `values_of` the values by name.
    """
    steps, several, sizes = step_ladder(run, parameter), dict[str, np.ndarray](), dict[str, float]()
    for at, step in enumerate(steps.tolist()):
        for weight, change, moved in weighted_mechanisms(mechanism, step):
            for name, values in values_of(moved_results(run, parameter, change, moved)).items():
                several.setdefault(name, np.zeros((steps.size, *values.shape)))[at] += weight * values
                if at == steps.size - 1:
                    sizes[name] = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
    return {name: most_accurate(slopes, steps, sizes[name]) for name, slopes in several.items()}


def curve_derivatives(
    run: Forward, parameter: int, path: Results, mechanism: Callable[[float], Mechanism]
) -> dict[str, np.ndarray]:
    """Return the derivatives of all variables over time by parameter / scale.

    `path` has the variables of the run; `mechanism` as in `moved_slopes`. Outputs that are variables, such as positions, keep
    their derivatives, which are smaller than the round-off of differences where a parameter moves bodies little.
    """
    total = moved_slopes(run, parameter, mechanism, lambda found: {name: found[name].values for name in curve_names(found)})
    for name, values, slopes in zip(Record._fields, *run.outputs, strict=True):
        if name in total and np.array_equal(path[name].values, values, equal_nan=True):
            total[name] = slopes[..., parameter]
    return total
