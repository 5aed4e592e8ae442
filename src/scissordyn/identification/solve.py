"""The search: first the starts of the segments over growing windows, then everything at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError
from scissordyn.file.export import TimeColumn
from scissordyn.identification.forward import FailedRunError, curves, motion, whole_turns
from scissordyn.identification.problem import Problem, Segment
from scissordyn.identification.start import chart_of, placed_at
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.options import Options

WINDOWS = (0.05, 0.25, 1.0)
"""Parts of a segment over which its start is estimated, one after the other: a short one has no second minimum."""

FEW = 8  # Instants of a window, at least
ROUNDS = 3  # Most rounds of weights
SETTLED = 0.05  # Standard deviations that change by less than this fraction are final
SMALLEST = 1e-9  # A standard deviation is at least this fraction of the range of its quantity
ENOUGH = 1e-8  # Relative change of the sum of squares, or of the unknowns, at which the search ends


@dataclass(frozen=True)
class Search:
    problem: Problem  # With the last weights
    unknowns: np.ndarray
    status: str  # "complete", or why it ended before
    evaluations: int  # Of the residuals in the last round


def search(problem: Problem, *, weights: bool, most: int, progress: Callable[[str], None] | None = None) -> Search:
    """Solve a problem, with weights from its own residuals unless they are given."""
    unknowns = problem.start()
    try:
        problem.every_curve(unknowns)
    except FailedRunError as failed:
        raise InputError(
            f"the run that the fit starts from fails: {failed}", "a case that runs over the time of the data"
        ) from None
    if weights:
        problem = replace(problem, deviation=_deviations(problem, unknowns))
    for round_ in range(ROUNDS if weights else 1):
        solution = least_squares(
            problem.residuals,
            unknowns,
            jac=problem.jacobian,
            bounds=problem.bounds(),
            x_scale="jac",
            ftol=ENOUGH,
            xtol=ENOUGH,
            gtol=None,
            max_nfev=most,
        )
        unknowns = solution.x
        if progress is not None:
            progress(f"round {round_ + 1}: {solution.nfev} evaluations, {problem.runs} runs, chi^2 = {2.0 * solution.cost:.6g}")
        if not weights:
            break
        new = _deviations(problem, unknowns)
        settled = bool(np.all(np.abs(new / problem.deviation - 1.0) < SETTLED))
        if settled:
            break
        problem = replace(problem, deviation=new)
    ended = "complete" if solution.status > 0 else f"{most} evaluations were not enough"
    return Search(problem, unknowns, ended, int(solution.nfev))


def _deviations(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """Root mean square of the residuals of each quantity."""
    curves_found = problem.every_curve(unknowns)
    residuals = np.concatenate(
        [problem.misfit(curve, k).reshape(-1, len(problem.columns)) for k, curve in enumerate(curves_found)]
    )
    values = np.concatenate([segment.record.values for segment in problem.segments])
    span = np.ptp(values, axis=0)
    least = SMALLEST * np.where(span > 0.0, span, 1.0)
    return np.asarray(np.maximum(np.sqrt(np.mean(residuals**2, axis=0)) * problem.deviation, least))


def estimated_start(
    mechanism: Mechanism,
    options: Options,
    record: Measured,
    columns: Sequence[TimeColumn],
    guess: tuple[Body, ...],
    windows: Sequence[float] = WINDOWS,
) -> tuple[Segment, tuple[Body, ...]]:
    """The start of a segment by least squares, the free numbers as they are."""
    placed, deviation = placed_at(mechanism, _measured_bodies(record, guess)), np.ones(record.values.shape[1])
    spread = np.std(record.values, axis=0)
    deviation = np.where(spread > 0.0, spread, 1.0)
    try:
        for window in windows:
            chart = chart_of(placed)
            part = record.rows(0, max(min(FEW, record.time.size), round(window * record.time.size)))
            first = motion(chart.mechanism, options, part.time - part.time[0])
            segment = Segment(part, chart, whole_turns(part, curves(first, columns)))
            problem = Problem(mechanism, options, (), [segment], columns, deviation)
            solution = least_squares(problem.residuals, np.zeros(chart.size), jac=problem.jacobian, x_scale="jac", max_nfev=30)
            placed = placed_at(mechanism, chart.bodies(solution.x))
        chart = chart_of(placed)
        run = motion(chart.mechanism, options, record.time - record.time[0])
    except FailedRunError as failed:
        raise InputError(
            f"'{record.name}': no start from which a run follows the data from {record.time[0]:.6g} s on: {failed}",
            "shorter segments, or a case whose bodies are placed near the start of the data",
        ) from None
    turns = whole_turns(record, curves(run, columns))
    return Segment(record, chart, turns), _at_end(chart.mechanism.bodies, run)


def _measured_bodies(record: Measured, guess: tuple[Body, ...]) -> tuple[Body, ...]:
    """Bodies at the angles that were measured first, rotating as was measured or as the first angles change."""
    placed = []
    some = slice(0, max(3, min(FEW, record.time.size)))
    time = record.time[some] - record.time[0]
    for body in guess:
        heading, rate = f"angle of {body.name}", f"angular_velocity of {body.name}"
        if heading in record.headings:
            angles = record.column(heading)
            slope = float(np.polyfit(time, angles[some], 1)[0])
            speed = float(record.column(rate)[0]) if rate in record.headings else slope
            body = replace(body, angle=float(angles[0]), angular_velocity=speed)
        placed.append(body)
    return tuple(placed)


def _at_end(bodies: tuple[Body, ...], run: xr.Dataset) -> tuple[Body, ...]:
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
        placed.append(replace(body, **changes))  # type: ignore[arg-type]
    return tuple(placed)
