"""Exact derivatives of the residuals of a fit, through all contacts of its runs."""

from __future__ import annotations

import dataclasses

import numpy as np

from scissordyn.identification.problem import Free, Problem, curves
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import changed_all
from scissordyn.plan.plan import plan
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.sensitivity.curve import moved_results, moved_slopes
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.gradient import check_derivable, check_repetition
from scissordyn.sensitivity.library import DERIVATIVES
from scissordyn.sensitivity.seed import Parameter, Start, derivatives
from scissordyn.tolerance import ROUND_OFF_TOL


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
    prior_rows = np.zeros((len(problem.prior_indices), len(problem.free)))
    for row, k in enumerate(problem.prior_indices):
        prior_rows[row, k] = problem.scale[k] / problem.free[k].deviation
    return np.concatenate([*(block.reshape(-1, len(problem.free)) for block in blocks), prior_rows])


def _curve_derivatives(problem: Problem, fitted: Mechanism, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the derivatives of the curves by the scaled free parameters, shape (times, columns, parameters)."""
    options = dataclasses.replace(problem.options, until=float(times[-1]), samples=2, trust=False, events="located")
    tables, start = plan(fitted), Start(fitted, options.start, curves=True)
    check_derivable(tables)
    parameters = [_parameter(fitted, free, value) for free, value in zip(problem.free, values.tolist(), strict=True)]
    seeds = [derivatives(start, parameter) for parameter in parameters]
    slopes = []
    for first in range(0, len(seeds), DERIVATIVES):
        run = forward(tables, options, seeds[first : first + DERIVATIVES], times=times, integrals=problem.monitors)
        problem.runs += 1
        check_repetition(run.misfit)
        sizes = np.max(np.abs(curves(as_dataset(moved_results(run, 0, 0.0, fitted)), problem.columns)), axis=0)
        for k, parameter in enumerate(parameters[first : first + DERIVATIVES]):
            slopes_by_name = moved_slopes(run, k, parameter.moved, lambda path: {"": curves(as_dataset(path), problem.columns)})
            of_curves = slopes_by_name[""]
            slopes.append(np.where(np.abs(of_curves) > ROUND_OFF_TOL * sizes, of_curves, 0.0))
    return np.stack(slopes, axis=2)


def _parameter(fitted: Mechanism, free: Free, value: float) -> Parameter:
    places = {free.path: free.places}
    return Parameter(free.path, value, free.scale, free.unit, lambda value: changed_all(fitted, {free.path: value}, places))
