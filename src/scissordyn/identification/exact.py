"""Exact derivatives of the residuals of a fit, through all contacts of its runs."""

from __future__ import annotations

import dataclasses

import numpy as np

from scissordyn.identification.problem import Free, Problem, curves
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import changed_all
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system
from scissordyn.record.dataset import results
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.advance.driver import count_steps
from scissordyn.run.trajectory import current_trajectory
from scissordyn.sensitivity.forward import SAMPLED_ARRAYS, Forward, forward
from scissordyn.sensitivity.gradient import check_derivable
from scissordyn.sensitivity.library import DERIVATIVES
from scissordyn.sensitivity.seed import Parameter, Start, derivatives
from scissordyn.tolerance import DIFFERENCE_FRACTION


def has_events(problem: Problem) -> bool:
    """Return True for a fit with contacts, stops or latches, whose segments all start as the case says."""
    guards = plan(problem.mechanism).model.guard_component.size
    return guards > 0 and all(segment.chart is None for segment in problem.segments)


def exact_jacobian(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """Return the derivatives of the residuals by the free parameters; raise `ScissordynError` if they do not exist."""
    fitted, values = problem.fitted_mechanism(unknowns), problem.values(unknowns)
    blocks = [
        _curve_derivatives(problem, fitted, values, segment.record.time) / problem.deviation[:, None]
        for segment in problem.segments
    ]
    known = np.zeros((len(problem.known), len(problem.free)))
    for row, k in enumerate(problem.known):
        known[row, k] = problem.scale[k] / problem.free[k].deviation
    return np.concatenate([*(block.reshape(-1, len(problem.free)) for block in blocks), known])


def _curve_derivatives(problem: Problem, fitted: Mechanism, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the derivatives of the curves by the scaled free parameters, shape (times, columns, parameters)."""
    options = dataclasses.replace(problem.options, until=float(times[-1]), samples=2, trust=False, events="located")
    tables, start = plan(fitted), Start(fitted, options.start)
    check_derivable(tables)
    pairs = zip(problem.free, values.tolist(), strict=True)
    seeds = [derivatives(start, Parameter(free.path, value, free.scale, free.unit)) for free, value in pairs]
    slopes = []
    for first in range(0, len(seeds), DERIVATIVES):
        run = forward(tables, options, seeds[first : first + DERIVATIVES], times=times)
        problem.runs += 1
        for k, free in enumerate(problem.free[first : first + DERIVATIVES]):
            value = float(values[first + k])
            ends = [
                _moved_curves(problem, run, k, fitted, free, value, sign * DIFFERENCE_FRACTION, options) for sign in (1.0, -1.0)
            ]
            slopes.append((ends[0] - ends[1]) / (2.0 * DIFFERENCE_FRACTION))
    return np.stack(slopes, axis=2)


def _moved_curves(
    problem: Problem,
    run: Forward,
    parameter: int,
    fitted: Mechanism,
    free: Free,
    value: float,
    step: float,
    options: Options,
) -> np.ndarray:
    """Return the curves of a run after a small change of one parameter, by linear extrapolation of its states.

    `parameter` is the index of the derivative in `run`, `value` the parameter in the run, and `step` its change, divided by
    its scale.
    """
    mechanism = changed_all(fitted, {free.path: value + step * free.scale}, {free.path: free.places})
    tables, samples = plan(mechanism), run.driver.samples
    moved = {name: getattr(samples, name) + step * run.samples[name][..., parameter] for name in SAMPLED_ARRAYS}
    statistics = {"method": options.method, "reason": "", "seconds": 0.0, **count_steps(run.driver.state)}
    path = dataclasses.replace(
        current_trajectory(run.driver, statistics=statistics),
        plan=tables,
        system=make_system(tables),
        samples=samples._replace(**{name: np.ascontiguousarray(array) for name, array in moved.items()}),
    )
    return curves(as_dataset(results(tables, "", path, path.record())), problem.columns)
