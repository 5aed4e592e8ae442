"""Derivatives of the variables of a run over time, from those of its samples and outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
"""Largest relative change of samples and outputs in the differences of variables along their derivatives.

Variables are simple functions of these, so that the error of fourth order is round-off there.
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
    found = values.copy()
    for name in values.dtype.names:
        found[name] += step * slopes[name][..., parameter]
    return found


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


def weighted_results(run: Forward, parameter: int, mechanism: Callable[[float], Mechanism]) -> Iterator[tuple[float, Results]]:
    """Yield the terms of the derivatives by parameter / scale: weights, and variables of runs moved along the derivatives.

    `mechanism` returns the mechanism with the parameter changed by a fraction of its scale.
    """
    for weight, change, moved in weighted_mechanisms(mechanism, difference_step(run, parameter)):
        yield weight, moved_results(run, parameter, change, moved)


def curve_derivatives(
    run: Forward, parameter: int, path: Results, mechanism: Callable[[float], Mechanism]
) -> dict[str, np.ndarray]:
    """Return the derivatives of all variables over time by parameter / scale.

    `path` has the variables of the run; `mechanism` as in `weighted_results`. Outputs that are variables, such as positions,
    keep their derivatives, which are smaller than the round-off of differences where a parameter moves bodies little.
    """
    total: dict[str, np.ndarray] = {}
    for weight, found in weighted_results(run, parameter, mechanism):
        for name in curve_names(found):
            part = weight * found[name].values
            total[name] = total[name] + part if name in total else part
    for name, values, slopes in zip(Record._fields, *run.outputs, strict=True):
        if name in total and np.array_equal(path[name].values, values, equal_nan=True):
            total[name] = slopes[..., parameter]
    return total
