"""Derivatives of the residuals of a fit, exact or by finite differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scissordyn.errors import ScissordynError
from scissordyn.identification.exact import exact_jacobian, has_events
from scissordyn.identification.problem import Problem, SegmentRun
from scissordyn.model.mechanism import Mechanism
from scissordyn.tolerance import DIFFERENCE_FRACTION


def jacobian(problem: Problem, unknowns: np.ndarray, *, accurate: bool = False) -> np.ndarray:
    """Return the Jacobian of the residuals by the unknowns.

    Runs with contacts have exact derivatives if possible, because their finite differences are noisy. Other runs have
    finite differences. The start of a segment affects the residuals of that segment only.
    """
    if not problem.derivatives:
        problem.derivatives = "exact" if has_events(problem) else "differences"
    if problem.derivatives == "exact":
        try:
            if problem.last_jacobian[0] != unknowns.tobytes():
                problem.last_jacobian = unknowns.tobytes(), exact_jacobian(problem, unknowns)
            return problem.last_jacobian[1]
        except ScissordynError as error:
            problem.derivatives, problem.exact_derivatives_failure = "differences", str(error)
    low, high = problem.bounds()
    fitted = problem.fitted_mechanism(unknowns)
    base = problem.run_segments(unknowns, fitted)
    reference = problem.join_residuals(base, unknowns)
    matrix = np.zeros((reference.size, problem.unknowns))
    for column in range(problem.unknowns):
        width = 1e-4 if accurate else DIFFERENCE_FRACTION  # accurate: the error of central differences is quadratic in it
        width *= max(1.0, abs(unknowns[column]))  # the step is absolute for a small unknown, relative for a large one
        ends: list[tuple[float, np.ndarray]] = []
        for sense in (1.0, -1.0):
            moved = unknowns.copy()
            moved[column] = np.clip(unknowns[column] + sense * width, low[column], high[column])
            if sense < 0.0 and not accurate and ends[0][0] != unknowns[column]:
                ends.append((unknowns[column], reference))
            else:
                ends.append((moved[column], _residuals_after_change(problem, moved, column, base, fitted)))
        (first, above), (second, below) = ends
        matrix[:, column] = (above - below) / (first - second)
    return matrix


def _residuals_after_change(
    problem: Problem, unknowns: np.ndarray, column: int, base: Sequence[SegmentRun], fitted: Mechanism
) -> np.ndarray:
    """Return the residuals after a change of the unknown `column`; runs that do not depend on it are reused from `base`."""
    if column < len(problem.free):
        return problem.join_residuals(problem.run_segments(unknowns), unknowns)
    k = int(np.searchsorted(problem.offsets, column, side="right")) - 1
    return problem.join_residuals([*base[:k], problem.run_segment(fitted, k, unknowns), *base[k + 1 :]], unknowns)
