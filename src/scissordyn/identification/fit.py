"""Fit numbers of a mechanism to measured curves."""

from __future__ import annotations

import dataclasses
import time as clocks
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import xarray as xr

from scissordyn.analysis.measured import Measured
from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.export import TimeColumn
from scissordyn.identification.forward import FailedRunError, columns_of, motion
from scissordyn.identification.free import Free
from scissordyn.identification.problem import Problem, Segment
from scissordyn.identification.result import fit_dataset
from scissordyn.identification.solve import Search, estimated_start, search
from scissordyn.identification.start import check_autonomous
from scissordyn.identification.uncertainty import uncertainty
from scissordyn.model.mechanism import Mechanism
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
