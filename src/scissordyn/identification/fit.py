"""Fit parameters of a mechanism to measured curves."""

from __future__ import annotations

import dataclasses
import json
import math
import time as clocks
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import ndtri

from scissordyn.analysis.agreement import Measured
from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, did_you_mean
from scissordyn.identification.jacobian import jacobian
from scissordyn.identification.problem import FailedRunError, Free, Problem, Segment, columns_of, records_of
from scissordyn.identification.start import check_autonomous, column_deviations, prepare_segments
from scissordyn.identification.uncertainty import Uncertainty, column_degrees, uncertainty
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import check_distinct
from scissordyn.tolerance import CONFIDENCE_LEVEL, DATA_TOL


def units_by_heading(mechanism: Mechanism, options: Options) -> dict[str, str]:
    """Return the SI unit of each quantity that a run of a mechanism has over time, by its column heading."""
    try:
        return {heading: column.unit for heading, column in columns_of(mechanism, options).items()}
    except FailedRunError as failed:
        raise InputError(f"the case of the fit fails: {failed}", "a case that runs") from None


def fit_parameters(
    mechanism: Mechanism,
    options: Options,
    records: Sequence[Measured],
    free: Sequence[Free],
    *,
    segment: float | None = None,
    deviations: Mapping[str, float] | None = None,
    jump: float | None = None,
    most: int = 100,
    starts: int = 1,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Fit parameters of a mechanism to records by least squares; `config.fits.fit` describes the arguments and the result."""
    began = clocks.perf_counter()
    if not free:
        raise InputError("no free parameter is given", "at least one parameter", "--free 'arm.inertia'")
    if most < 1:
        raise InputError(f"most = {most}", "at least one evaluation of the residuals", "most=100")
    check_distinct(mechanism, (parameter.path for parameter in free), disjoint=True)
    if segment is not None:
        check_autonomous(mechanism)
    segments, columns, options = prepare_segments(mechanism, options, records, segment=segment)
    problem = Problem(
        mechanism, options, free, segments, columns, _known_deviations(records[0], deviations), _jumps(segments, jump)
    )
    problem.runs = sum(piece.runs for piece in segments)
    if problem.measured <= problem.unknowns:
        raise InputError(
            f"{problem.measured} measured values for {problem.unknowns} unknowns", "more data, or fewer free parameters"
        )
    if starts > 1:
        problem = _best_start(problem, starts)
        if progress is not None:
            start_text = ", ".join(f"{parameter.path} = {parameter.start:.6g}" for parameter in problem.free)
            progress(f"{starts} starts: the best is {start_text}")
    problem, unknowns, solution, settled = _solve(problem, weights=not deviations, most=most, progress=progress)
    failure = ""
    if solution.status <= 0:
        failure = f"{most} evaluations were not enough"
    elif not settled:
        failure = "the standard deviations of the columns still change"
    data = _dataset(problem, unknowns, failure)
    counts: dict[str, Any] = {
        "runs": problem.runs,
        "evaluations": int(solution.nfev),
        "unknowns": problem.unknowns,
        "derivatives": problem.derivatives,
    }
    return data.assign_attrs(statistics=json.dumps({"seconds": clocks.perf_counter() - began} | counts))


def _best_start(problem: Problem, starts: int) -> Problem:
    """Return the problem with the best of several starts: that of the case, and points spread over the ranges (Halton)."""
    from scipy.stats.qmc import Halton  # imported here: scipy.stats is slow to import, and most fits have one start

    low, high = np.array([_range(parameter) for parameter in problem.free]).T
    points = low + Halton(len(problem.free), seed=0).random(starts - 1) * (high - low)
    rest = problem.start()[len(problem.free) :]
    trials = [problem.start(), *(np.concatenate([point / problem.scale, rest]) for point in points)]
    costs = [float(np.sum(problem.residuals(trial) ** 2)) for trial in trials]
    best = problem.values(trials[int(np.argmin(costs))])
    free = [dataclasses.replace(parameter, start=value) for parameter, value in zip(problem.free, best.tolist(), strict=True)]
    return _replace(problem, free=free)


def _range(parameter: Free) -> tuple[float, float]:
    """Return the range in which starts are tried: the bounds, or two standard deviations of an independent measurement."""
    if not math.isfinite(parameter.deviation):
        return parameter.low, parameter.high
    reach = 2.0 * parameter.deviation
    return max(parameter.low, parameter.mean - reach), min(parameter.high, parameter.mean + reach)


def _replace(problem: Problem, **changes: Any) -> Problem:
    """Return a changed problem with the count of runs so far."""
    new = dataclasses.replace(problem, **changes)
    new.runs = problem.runs
    return new


def _solve(
    problem: Problem, *, weights: bool, most: int, progress: Callable[[str], None] | None, most_rounds: int = 20
) -> tuple[Problem, np.ndarray, OptimizeResult, bool]:
    """Solve the least-squares problem with at most `most` evaluations; return the problem, the unknowns and SciPy's result.

    With `weights`, the solution is repeated with the standard deviation of each quantity estimated from its residuals, until
    they change by less than 5 %, at most `most_rounds` times. Return also whether they do.
    """
    unknowns = problem.start()
    try:
        problem.run_segments(unknowns)
    except FailedRunError as failed:
        raise InputError(f"the first run of the fit fails: {failed}", "a case that runs over the time of the data") from None
    if weights:
        problem = _replace(problem, deviation=_deviations(problem, unknowns), estimated=True)
    for round_ in range(most_rounds if weights else 1):
        solution = _search(problem, unknowns, most)
        unknowns = solution.x
        if progress is not None:
            progress(f"round {round_ + 1}: {solution.nfev} evaluations, {problem.runs} runs, chi^2 = {2.0 * solution.cost:.6g}")
        if not weights:
            return problem, unknowns, solution, True
        new = _deviations(problem, unknowns, solution.jac)
        if np.all(np.abs(new / problem.deviation - 1.0) < 0.05):  # the standard deviations have converged
            return problem, unknowns, solution, True
        problem = _replace(problem, deviation=new)
    return problem, unknowns, solution, False


def _search(problem: Problem, start: np.ndarray, most: int) -> OptimizeResult:
    """Solve the least-squares problem with given weights; a parameter that the data do not determine stays at its start."""
    holding = DATA_TOL * np.eye(len(problem.free), problem.unknowns)

    def residuals(unknowns: np.ndarray) -> np.ndarray:
        return np.append(problem.residuals(unknowns), holding @ (unknowns - start))

    def slopes(unknowns: np.ndarray) -> np.ndarray:
        return np.concatenate([jacobian(problem, unknowns), holding])

    return least_squares(residuals, start, jac=slopes, bounds=problem.bounds(), x_scale="jac", gtol=None, max_nfev=most)


def _deviations(problem: Problem, unknowns: np.ndarray, jacobian: np.ndarray | None = None) -> np.ndarray:
    """Return the standard deviation of the residuals of each quantity, in its unit, at least 1e-9 of its measured range.

    With the Jacobian at a solution, their sum of squares is divided by their degrees of freedom, otherwise by their number.
    """
    measured = np.concatenate([segment.record.values for segment in problem.segments])
    weighted = problem.residuals(unknowns)[: measured.size].reshape(measured.shape)
    span = np.ptp(measured, axis=0)
    least = 1e-9 * np.where(span > 0.0, span, 1.0)
    degrees = len(measured) if jacobian is None else column_degrees(problem, jacobian)
    return np.asarray(np.maximum(np.sqrt(np.sum(weighted**2, axis=0) / degrees) * problem.deviation, least))


def _known_deviations(record: Measured, deviations: Mapping[str, float] | None) -> np.ndarray:
    """Return the standard deviation of the errors of each column from `deviations`; if empty, the spread of its values."""
    if not deviations:
        return column_deviations(record)
    for heading, value in deviations.items():
        if heading not in record.headings:
            raise InputError(
                f"standard deviation of '{heading}'{did_you_mean(heading, record.headings)}", "measured quantities"
            )
        if not value > 0.0:
            raise InputError(f"the standard deviation of '{heading}' is {value:g}", "a number > 0")
    missing = [heading for heading in record.headings if heading not in deviations]
    if missing:
        raise InputError(
            f"the standard deviation of '{missing[0]}' is missing", "one for each column, or none to estimate all of them"
        )
    return np.array([deviations[heading] for heading in record.headings])


def _jumps(segments: Sequence[Segment], jump: float | None) -> np.ndarray | None:
    """Return the standard deviations with which jumps of the state between segments are penalised; None without a penalty.

    `jump`: standard deviation of the jumps, as a fraction of the range of the motion.
    """
    if jump is None or not any(segment.follows for segment in segments):
        return None
    if not jump > 0.0:
        raise InputError(f"the standard deviation of jumps is {jump:g}", "a fraction > 0 of the range of the motion", "1e-3")
    starts = [segment.chart.mechanism for segment in segments if segment.chart is not None]
    values = []
    for start in starts:
        bodies = start.bodies
        values.append(
            [body.placed_angle for body in bodies]
            + [body.angular_velocity or 0.0 for body in bodies]
            + [number for body in bodies for number in body.placed_position]
            + [number for body in bodies for number in body.velocity or (0.0, 0.0)]
        )
    spread = np.std(np.array(values), axis=0)
    count = len(starts[0].bodies)
    # if a body's frame does not move but its mass centre does, radius times angle replaces the displacement
    angle = np.repeat(spread[:count], 2)
    rate = np.repeat(spread[count : 2 * count], 2)
    reach = np.repeat([body.extent for body in starts[0].bodies], 2)
    places = np.hypot(spread[2 * count : 4 * count], reach * angle)
    speeds = np.hypot(spread[4 * count :], reach * rate)
    sizes = np.concatenate([spread[: 2 * count], places, speeds])
    return np.asarray(jump * np.where(sizes > 0.0, sizes, 1.0))


# Possible causes, in a warning, of a poor fit to the measured data
MISFIT_CAUSES = "the mechanism or its start differs from what was measured, or this is a local minimum (try more starts)"


def _misfits(residual: np.ndarray, headings: Sequence[str], probability: float = 1e-6, correlation: float = 0.5) -> list[str]:
    """Return a warning for each column, shape (rows, columns), whose residuals are not noise.

    `probability`: normally distributed errors have a residual as large as the largest one with a smaller probability.

    `correlation`: neighbouring residuals have a larger correlation.
    """
    warnings, limit = [], -ndtri(0.5 * probability / len(residual))
    for heading, column in zip(headings, residual.T, strict=True):
        square = max(float(np.sum(column**2)), np.finfo(float).tiny)  # residuals are zero if the record is the run itself
        ratio, neighbours = np.max(np.abs(column)) / np.sqrt(square / len(column)), np.sum(column[1:] * column[:-1]) / square
        if ratio > limit:
            warnings.append(
                f"the largest residual of '{heading}' is {ratio:.1f} times their root mean square, as where impacts of run and "
                f"record do not coincide: the intervals are not valid; {MISFIT_CAUSES}"
            )
        elif neighbours > max(correlation, 5.0 / np.sqrt(len(column))):
            warnings.append(
                f"neighbouring residuals of '{heading}' have a correlation of {neighbours:.2f}: the intervals are not valid; "
                f"{MISFIT_CAUSES}"
            )
    return warnings


TITLE = "scissordyn fit"  # attribute `title` of the Dataset with the result of a fit


def _dataset(problem: Problem, unknowns: np.ndarray, failure: str) -> xr.Dataset:
    """Return the result of a fit: parameters, their errors and correlations, and measured and fitted curves."""
    errors, values, rows = uncertainty(problem, unknowns), problem.values(unknowns), records_of(problem.segments)
    fitted = np.concatenate([run.curves for run in problem.run_segments(unknowns)])
    residual = fitted - rows["measured"][1]
    paths = np.array([parameter.path for parameter in problem.free], dtype=str)

    def of_parameters(numbers: Any, about: str) -> tuple[str, Any, dict[str, str]]:
        return "parameter", numbers, {"long_name": about}

    (low, high), at_limits = _intervals(problem, errors, values)
    warnings = _warnings(problem, failure, errors, values, residual) + at_limits
    data = xr.Dataset(
        {
            "value": of_parameters(values, "fitted value, in the unit of the parameter"),
            "start_value": of_parameters([parameter.start for parameter in problem.free], "value that the search started from"),
            "standard_error": of_parameters(
                errors.error, "standard error; infinite if the data do not determine the parameter"
            ),
            "low": of_parameters(low, f"lower end of the interval with probability {CONFIDENCE_LEVEL:g}"),
            "high": of_parameters(high, f"upper end of the interval with probability {CONFIDENCE_LEVEL:g}"),
            "lower_bound": of_parameters([parameter.low for parameter in problem.free], "lower bound of the search"),
            "upper_bound": of_parameters([parameter.high for parameter in problem.free], "upper bound of the search"),
            "unit": of_parameters(np.array([parameter.unit for parameter in problem.free], dtype=str), "unit"),
            "correlation": (("parameter", "other"), errors.correlation, {"units": "1", "long_name": "correlation"}),
            "covariance": (("parameter", "other"), errors.covariance, {"long_name": "covariance, in SI units"}),
            **rows,
            "fitted": (("row", "column"), fitted, {"long_name": "value of the fitted mechanism"}),
            "residual": (("row", "column"), residual, {"long_name": "fitted minus measured value"}),
            "deviation": ("column", problem.deviation, {"long_name": "standard deviation that weights the residuals"}),
            "rms": ("column", np.sqrt(np.mean(residual**2, axis=0)), {"long_name": "root mean square residual"}),
        },
        coords={"parameter": paths, "other": paths},
    )
    data.attrs = {
        "title": TITLE,
        "status": "failed" if failure else "complete",
        "cause": failure,
        "configuration": write_configuration(problem.fitted_mechanism(unknowns), problem.options),
        "chi_square": errors.chi_square,
        "dependence": errors.dependence,
        "warnings": json.dumps(warnings),
    }
    return data


def _intervals(problem: Problem, errors: Uncertainty, values: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Return the ends of the intervals within the possible values, shape (2, p), and warnings of ends that are such a limit."""
    ends = np.array([values - errors.half_width, values + errors.half_width])
    limits = np.array([[parameter.least, parameter.most] for parameter in problem.free]).T
    cut = np.isfinite(ends) & (np.clip(ends, *limits) != ends)
    warnings = [
        f"the interval of '{parameter.path}' ends at {limits[side, k]:g} {parameter.unit}, its {name} value: it is asymmetric"
        for k, parameter in enumerate(problem.free)
        for side, name in enumerate(("least", "largest"))
        if cut[side, k]
    ]
    return np.where(cut, limits, ends), warnings


def _warnings(
    problem: Problem,
    failure: str,
    errors: Uncertainty,
    values: np.ndarray,
    residual: np.ndarray,
    correlation_max: float = 0.98,
    dependence: float = 2.0,
    fewest_degrees: float = 5.0,
) -> list[str]:
    """Return warnings: parameters not determined or at a bound, dependent residuals, derivatives by differences.

    `residual`, shape (rows, columns), is what the fitted curves differ by from the measured values.

    `correlation_max`: two parameters with a larger correlation are reported as hardly distinguishable.

    `dependence`: ratio of errors with and without dependent residuals above which a warning is given.

    `fewest_degrees`: degrees of freedom of one of several columns below which a warning is given.
    """
    free, warnings = problem.free, [f"the search did not end: {failure}"] if failure else []
    for direction in errors.undetermined:
        names = [f"'{free[k].path}'" for k in direction]
        if len(names) == 1:
            warnings.append(f"{names[0]} cannot be determined: its effect on the data is within their errors")
        else:
            together = ", ".join(f"{free[k].path} {share:+.3g} %" for k, share in direction.items())
            warnings.append(
                f"{' and '.join(names)} cannot be distinguished: changes of {together} leave the measured curves unchanged; "
                "fix one of them at a value measured in another way"
            )
    if errors.dependence > dependence:
        warnings.append(
            f"neighbouring residuals depend on each other and widen the intervals by a factor of {errors.dependence:.1f}: "
            f"{MISFIT_CAUSES}"
        )
    if problem.estimated and problem.deviation.size > 1 and errors.degrees < fewest_degrees:
        warnings.append(
            f"the standard deviation of a column has {errors.degrees:.1f} degrees of freedom: the intervals may be too narrow; "
            "more data, or known standard deviations of the columns"
        )
    correlation = errors.correlation
    for i in range(len(free)):
        for j in range(i):
            has_errors = np.isfinite(errors.error[[i, j]]).all()
            if has_errors and abs(correlation[i, j]) > correlation_max:
                warnings.append(
                    f"'{free[j].path}' and '{free[i].path}' can hardly be distinguished: correlation {correlation[i, j]:.4f}"
                )
    warnings += [
        f"'{parameter.path}' is at its bound {bound:g} {parameter.unit}: its interval is not valid"
        for parameter, value in zip(free, values.tolist(), strict=True)
        for bound in (parameter.low, parameter.high)
        if abs(value - bound) <= 1e-6 * parameter.scale
    ]
    if problem.exact_derivatives_failure:
        warnings.append(
            f"derivatives are finite differences, which are noisy for runs with contacts: {problem.exact_derivatives_failure}"
        )
    if not errors.dependence > dependence:
        warnings += _misfits(residual, problem.segments[0].record.headings)
    return warnings
