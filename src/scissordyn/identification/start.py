"""Divide records into segments and estimate the state at the start of each, in terms of the degrees of freedom."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import partial

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from scissordyn.analysis.agreement import Measured
from scissordyn.components.port import AXIS
from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.export import TimeColumn
from scissordyn.identification.chart import chart_of, with_start_states
from scissordyn.identification.jacobian import jacobian
from scissordyn.identification.problem import FailedRunError, Problem, Segment, columns_of, curves, motion
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.elimination import in_words
from scissordyn.studies.ask.design import POINTS_MIN


def check_autonomous(mechanism: Mechanism) -> None:
    """Raise `InputError` if the motion depends on time or contacts, and so cannot start at any instant of a record."""
    reasons = [f"the drive of '{drive.body}'" for drive in mechanism.drives]
    reasons += [f"rod '{rod.name}'" for rod in mechanism.rods if rod.motion is not None]
    reasons += [f"drive '{drive.name}'" for drive in mechanism.coordinate_drives]
    reasons += [f"'{part.name}'" for part in mechanism.components if getattr(part, "time_function", None) is not None]
    reasons += [f"the bending of '{part.name}'" for part in mechanism.components if part.declaration.port is AXIS]
    reasons += [f"clearance joint '{contact.name}'" for contact in mechanism.contacts]
    if reasons:
        raise InputError(
            f"segments: the motion of a mechanism with {in_words(reasons[:3])} cannot start at any instant",
            "records without segments, whose start the case gives; parameters of the start may be free",
            "--free crank.angle --free crank.angular_velocity",
        )


START_WINDOWS = (0.05, 0.25, 1.0)
"""Initial fractions of a segment to which its start is fitted one after another; a short first one avoids local minima."""


def prepare_segments(
    mechanism: Mechanism,
    options: Options,
    records: Sequence[Measured],
    *,
    segment: float | None,
    windows: Sequence[float] = START_WINDOWS,
) -> tuple[list[Segment], list[TimeColumn], Options]:
    """Return the segments with estimated starts, the quantities of a run that were measured, and the options of the runs."""
    headings = records[0].headings
    for record in records[1:]:
        if record.headings != headings:
            raise InputError(f"'{record.name}' has other columns than '{records[0].name}'", "files with the same columns")
    tight = min(1e-10, options.rtol), min(1e-10, options.position_tolerance)  # finite differences of runs need small errors
    options = dataclasses.replace(options, rtol=tight[0], atol=tight[1], trust=False)
    if segment is None:
        for record in records:
            if record.time[0] < 0.0:
                raise InputError(
                    f"'{record.name}' begins at {record.time[0]:g} s", "times >= 0, measured from the start of the case", "0"
                )
    else:
        if not segment > 0.0:
            raise InputError(f"segment = {segment:g} s", "a duration > 0 [s]", "--segment '1 s'")
        options = dataclasses.replace(options, start="as-placed")
    usable = columns_of(mechanism, options)
    for heading in headings:
        if heading not in usable:
            raise InputError(
                f"the run has no quantity '{heading}'{did_you_mean(heading, usable)}", "columns of a run of this case"
            )
    columns = [usable[heading] for heading in headings]
    if segment is None:
        return [Segment(record, None, np.zeros(len(columns))) for record in records], columns, options
    segments = list[Segment]()
    for record in records:
        bodies = mechanism.bodies
        for k, part in enumerate(record.segments(segment)):
            started, bodies = estimate_start(mechanism, options, part, columns, bodies, windows)
            segments.append(dataclasses.replace(started, follows=k > 0))
    return segments, columns, options


def column_deviations(record: Measured) -> np.ndarray:
    """Return the standard deviation of the values of each quantity about their mean; 1 for constant quantities."""
    deviation = np.std(record.values, axis=0)
    return np.where(deviation > 0.0, deviation, 1.0)


def estimate_start(
    mechanism: Mechanism,
    options: Options,
    record: Measured,
    columns: Sequence[TimeColumn],
    guess: tuple[Body, ...],
    windows: Sequence[float],
) -> tuple[Segment, tuple[Body, ...]]:
    """Estimate the start of a segment by least squares, with the parameters of the case.

    Parameters
    ----------
    guess : tuple of Body
        Bodies with a first estimate of the start.
    windows : sequence of float
        Initial fractions of the segment to which the start is fitted, one after another.

    Returns
    -------
    tuple
        The segment with its estimated start, and the bodies at its end.
    """
    placed, runs = with_start_states(mechanism, _measured_bodies(record, guess)), 1
    try:
        for window in windows:
            chart = chart_of(placed)
            part = record.rows(0, max(min(POINTS_MIN, record.time.size), round(window * record.time.size)))
            first = motion(chart.mechanism, options, part.time - part.time[0])
            segment = Segment(part, chart, _whole_turns(part, curves(first, columns)))
            problem = Problem(mechanism, options, (), [segment], columns, column_deviations(record))
            solution = least_squares(
                problem.residuals, np.zeros(chart.size), jac=partial(jacobian, problem), x_scale="jac", max_nfev=30
            )
            placed, runs = chart.mechanism_at(mechanism, solution.x), runs + 1 + problem.runs
        chart = chart_of(placed)
        run = motion(chart.mechanism, options, record.time - record.time[0])
    except FailedRunError as failed:
        raise InputError(
            f"'{record.name}': found no start from which a run follows the data from {record.time[0]:.6g} s on: {failed}",
            "shorter segments, or a case whose bodies are placed near the start of the data",
        ) from None
    turns = _whole_turns(record, curves(run, columns))
    return Segment(record, chart, turns, runs=runs), _bodies_at_end(chart.mechanism.bodies, run)


def _whole_turns(record: Measured, shown: np.ndarray) -> np.ndarray:
    """Return the full turns to add to the angles of a run so that they begin near the measured angles [rad], by column."""
    is_angle = np.array([unit == "rad" for unit in record.units])
    return np.where(is_angle, math.tau * np.round((record.values[0] - shown[0]) / math.tau), 0.0)


def _measured_bodies(record: Measured, guess: tuple[Body, ...]) -> tuple[Body, ...]:
    """Return bodies that start with their first measured angle and angular velocity; others start as in `guess`.

    An angular velocity that was not measured is the slope of the first measured angles.
    """
    placed = []
    some = slice(0, max(3, min(POINTS_MIN, record.time.size)))
    time = record.time[some] - record.time[0]
    for body in guess:
        heading, rate = f"angle of {body.name}", f"angular_velocity of {body.name}"
        if heading in record.headings:
            angles = record.column(heading)
            slope = float(np.polyfit(time, angles[some], 1)[0])
            speed = float(record.column(rate)[0]) if rate in record.headings else slope
            body = dataclasses.replace(body, angle=float(angles[0]), angular_velocity=speed)
        placed.append(body)
    return tuple(placed)


def _bodies_at_end(bodies: tuple[Body, ...], run: xr.Dataset) -> tuple[Body, ...]:
    """Return bodies that start with the positions and velocities at the end of a run."""
    last, placed = run.isel(time=-1), []
    for k, body in enumerate(bodies):
        angle, speed = float(last["angle"].values[k]), float(last["angular_velocity"].values[k])
        cos, sin = np.cos(angle), np.sin(angle)
        arm = np.array([cos * body.centre[0] - sin * body.centre[1], sin * body.centre[0] + cos * body.centre[1]])
        origin = last["position"].values[k] - arm
        velocity = last["velocity"].values[k] - speed * np.array([-arm[1], arm[0]])
        changes: dict[str, object] = {"position": tuple(origin.tolist()), "velocity": tuple(velocity.tolist())}
        if body.rotates:
            changes |= {"angle": angle, "angular_velocity": speed}
        placed.append(dataclasses.replace(body, **changes))  # type: ignore[arg-type]
    return tuple(placed)
