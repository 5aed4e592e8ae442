"""Fit numbers of a mechanism to measured curves."""

from __future__ import annotations

import dataclasses
import json
import time as clocks
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.export import TimeColumn
from scissordyn.identification.forward import FailedRunError, columns_of, motion
from scissordyn.identification.problem import Free, Problem, Segment
from scissordyn.identification.solve import Search, estimated_start, search
from scissordyn.identification.start import check_autonomous
from scissordyn.identification.uncertainty import LEVEL, Uncertainty, uncertainty
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.configuration import write_configuration
from scissordyn.run.options import Options

TIGHT = 1e-10  # Tolerance of the runs of a fit, unless the case has a smaller one: derivatives are differences of runs


def known_headings(mechanism: Mechanism, options: Options) -> dict[str, str]:
    """Units of the quantities that a run of a mechanism has over time, by heading."""
    from scissordyn.file.export import time_columns

    try:
        run = motion(mechanism, options, np.array([0.0, 1e-3 * options.until]))
    except FailedRunError as failed:
        raise InputError(f"the case of the fit does not run: {failed}", "a case that runs") from None
    return {column.heading: column.unit for column in time_columns(run)}


def prepared(
    mechanism: Mechanism, options: Options, records: Sequence[Measured], *, segment: float | None
) -> tuple[list[Segment], list[TimeColumn], Options]:
    """Segments with their estimated starts, the columns of a run that were measured, and options of its runs."""
    headings = records[0].headings
    for record in records[1:]:
        if record.headings != headings:
            raise InputError(f"'{record.name}' has other columns than '{records[0].name}'", "files of the same columns")
    tight = min(TIGHT, options.rtol), min(TIGHT, options.atol)
    options = dataclasses.replace(options, rtol=tight[0], atol=tight[1], trust=False)
    if segment is None:
        for record in records:
            if record.time[0] < 0.0:
                raise InputError(f"'{record.name}' begins at {record.time[0]:g} s", "times from the start of the case on", "0")
        run = motion(mechanism, options, np.array([0.0, 1e-3 * options.until]))
        columns = columns_of(run, headings)
        return [Segment(record, None, np.zeros(len(columns))) for record in records], columns, options
    if not segment > 0.0:
        raise InputError(f"segments of {segment:g} s", "a duration > 0 [s]", "--segment '1 s'")
    check_autonomous(mechanism)
    options = dataclasses.replace(options, start="as-placed")
    run = motion(mechanism, options, np.array([0.0, 1e-3 * options.until]))
    columns, segments = columns_of(run, headings), list[Segment]()
    for record in records:
        bodies = mechanism.bodies
        for k, part in enumerate(record.segments(segment)):
            prepared_mechanism, bodies = estimated_start(mechanism, options, part, columns, bodies)
            segments.append(dataclasses.replace(prepared_mechanism, follows=k > 0))
    return segments, columns, options


def fitted(
    mechanism: Mechanism,
    options: Options,
    records: Sequence[Measured],
    free: Sequence[Free],
    *,
    segment: float | None = None,
    deviations: Mapping[str, float] | None = None,
    jump: float | None = None,
    most: int = 100,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Numbers of a mechanism by least squares, see `config.fits.fit`."""
    began = clocks.perf_counter()
    if not free:
        raise InputError("no free number", "at least one parameter", "--free 'arm.inertia'")
    names = [parameter.path for parameter in free]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"'{name}' is free twice", "each parameter once")
    segments, columns, options = prepared(mechanism, options, records, segment=segment)
    problem = Problem(mechanism, options, free, segments, columns, _given(records[0], deviations), _jumps(segments, jump))
    rows = sum(piece.record.values.size for piece in segments)
    if rows <= problem.unknowns:
        raise InputError(f"{rows} measured values for {problem.unknowns} unknown numbers", "more data, fewer free numbers")
    result: Search = search(problem, weights=not deviations, most=most, progress=progress)
    errors = uncertainty(result.problem, result.unknowns)
    return fit_dataset(result, errors, clocks.perf_counter() - began)


def _given(record: Measured, deviations: Mapping[str, float] | None) -> np.ndarray:
    """Standard deviations of the columns; the spread of each where they are to be estimated."""
    if not deviations:
        spread = np.std(record.values, axis=0)
        return np.where(spread > 0.0, spread, 1.0)
    for heading, value in deviations.items():
        if heading not in record.headings:
            raise InputError(
                f"standard deviation of '{heading}'{did_you_mean(heading, record.headings)}", "measured quantities"
            )
        if not value > 0.0:
            raise InputError(f"a standard deviation of {value:g} of '{heading}'", "a number > 0")
    missing = [heading for heading in record.headings if heading not in deviations]
    if missing:
        raise InputError(f"no standard deviation of '{missing[0]}'", "one for each column, or none: then they are estimated")
    return np.array([deviations[heading] for heading in record.headings])


def _jumps(segments: Sequence[Segment], jump: float | None) -> np.ndarray | None:
    """Standard deviations of the jumps of a state between segments."""
    if jump is None or not any(segment.follows for segment in segments):
        return None
    if not jump > 0.0:
        raise InputError(f"jumps with a standard deviation of {jump:g}", "a fraction > 0 of the range of the motion", "1e-3")
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
    # where a body's frame stands still its mass centre does not: the radius times the angle takes its place
    angle = np.repeat(spread[:count], 2)
    rate = np.repeat(spread[count : 2 * count], 2)
    reach = np.repeat([body.extent for body in starts[0].bodies], 2)
    places = np.hypot(spread[2 * count : 4 * count], reach * angle)
    speeds = np.hypot(spread[4 * count :], reach * rate)
    sizes = np.concatenate([spread[: 2 * count], places, speeds])
    return np.asarray(jump * np.where(sizes > 0.0, sizes, 1.0))


TITLE = "scissordyn fit"

ALIKE = 0.98  # Numbers whose correlation is larger are hardly distinguished
DEPENDENT = 2.0  # Errors that grow by more than this factor by the dependence of residuals show that they are no noise
AT_BOUND = 1e-6  # A number within this fraction of its scale of a bound is at the bound


def fit_dataset(found: Search, errors: Uncertainty, seconds: float) -> xr.Dataset:
    """Numbers, their errors and correlations, and measured and fitted curves."""
    problem, unknowns = found.problem, found.unknowns
    values, curves = problem.values(unknowns), problem.every_curve(unknowns)
    records = [segment.record for segment in problem.segments]
    shown = [
        curve.ravel()[: record.values.size].reshape(record.values.shape) for curve, record in zip(curves, records, strict=True)
    ]
    measured, fitted = np.concatenate([record.values for record in records]), np.concatenate(shown)
    headings = list(records[0].headings)

    def of_parameters(numbers: Any, about: str) -> tuple[str, Any, dict[str, str]]:
        return "parameter", numbers, {"long_name": about}

    data = xr.Dataset(
        {
            "value": of_parameters(values, "fitted value, in the unit of the number"),
            "start_value": of_parameters([parameter.start for parameter in problem.free], "value that the search started from"),
            "standard_error": of_parameters(errors.error, "standard error; infinite where the data do not determine it"),
            "low": of_parameters(values - errors.half_width, f"lower end of the interval with probability {LEVEL:g}"),
            "high": of_parameters(values + errors.half_width, f"upper end of the interval with probability {LEVEL:g}"),
            "lower_bound": of_parameters([parameter.low for parameter in problem.free], "lower bound of the search"),
            "upper_bound": of_parameters([parameter.high for parameter in problem.free], "upper bound of the search"),
            "unit": of_parameters(np.array([parameter.unit for parameter in problem.free], dtype=str), "unit"),
            "correlation": (("parameter", "other"), errors.correlation, {"units": "1", "long_name": "correlation"}),
            "covariance": (("parameter", "other"), errors.covariance, {"long_name": "covariance, in SI units"}),
            "time": ("row", np.concatenate([record.time for record in records]), {"units": "s", "long_name": "time"}),
            "segment": (
                "row",
                np.repeat(np.arange(len(records)), [record.time.size for record in records]),
                {"long_name": "segment"},
            ),
            "measured": (("row", "column"), measured, {"long_name": "measured value, in the unit of its column"}),
            "fitted": (("row", "column"), fitted, {"long_name": "value of the fitted mechanism"}),
            "residual": (("row", "column"), fitted - measured, {"long_name": "fitted less measured"}),
            "column_unit": ("column", np.array(list(records[0].units), dtype=str), {"long_name": "unit"}),
            "deviation": ("column", problem.deviation, {"long_name": "standard deviation that weights the residuals"}),
            "rms": ("column", np.sqrt(np.mean((fitted - measured) ** 2, axis=0)), {"long_name": "root mean square residual"}),
        },
        coords={
            "parameter": np.array([parameter.path for parameter in problem.free], dtype=str),
            "other": np.array([parameter.path for parameter in problem.free], dtype=str),
            "column": np.array(headings, dtype=str),
        },
    )
    data.attrs = {
        "title": TITLE,
        "status": "complete" if found.status == "complete" else "failed",
        "cause": "" if found.status == "complete" else found.status,
        "configuration": write_configuration(problem.fitted(unknowns), problem.options),
        "statistics": json.dumps(
            {"seconds": seconds, "runs": problem.runs, "evaluations": found.evaluations, "unknowns": problem.unknowns}
        ),
        "chi_square": errors.chi_square,
        "dependence": errors.dependence,
        "warnings": json.dumps(_warnings(found, errors, values)),
    }
    return data


def _warnings(found: Search, errors: Uncertainty, values: np.ndarray) -> list[str]:
    """What the user has to know of the numbers."""
    free, warnings = found.problem.free, list[str]()
    if found.status != "complete":
        warnings.append(f"the search did not end: {found.status}")
    for direction in errors.alike:
        names = [f"'{free[k].path}'" for k in direction]
        if len(names) == 1:
            warnings.append(f"{names[0]} cannot be determined: the data do not depend on it beyond their errors")
        else:
            together = ", ".join(f"{free[k].path} {share:+.3g} %" for k, share in direction.items())
            warnings.append(
                f"{' and '.join(names)} cannot be distinguished: with {together} the measured curves stay the same; keep one "
                "of them fixed at a value that was measured otherwise"
            )
    if errors.dependence > DEPENDENT:
        warnings.append(
            f"neighbouring residuals depend on each other, which makes the intervals {errors.dependence:.1f} times as wide "
            "as noise would: the mechanism or its start differs from what was measured"
        )
    correlation = errors.correlation
    for i in range(len(free)):
        for j in range(i):
            both = np.isfinite(errors.error[[i, j]]).all()
            if both and abs(correlation[i, j]) > ALIKE:
                warnings.append(
                    f"'{free[j].path}' and '{free[i].path}' are hardly distinguished: correlation {correlation[i, j]:.4f}"
                )
    for parameter, value in zip(free, values.tolist(), strict=True):
        for bound in (parameter.low, parameter.high):
            if abs(value - bound) <= AT_BOUND * parameter.scale:
                warnings.append(f"'{parameter.path}' is at its bound {bound:g} {parameter.unit}: its interval does not hold")
    return warnings
