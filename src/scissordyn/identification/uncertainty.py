"""Uncertainty of fitted parameters: covariance, intervals, and parameters that the data cannot distinguish."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import stdtrit

from scissordyn.identification.jacobian import jacobian
from scissordyn.identification.problem import Problem
from scissordyn.tolerance import CONFIDENCE_LEVEL, DATA_TOL


@dataclass(frozen=True)
class Uncertainty:
    """Covariance, standard errors and intervals of the free parameters, and directions that the data do not determine."""

    covariance: np.ndarray  # (p, p) Covariance of the free parameters without undetermined directions, in SI units
    error: np.ndarray  # (p,) Standard errors; infinite for undetermined parameters
    half_width: np.ndarray  # (p,) Half widths of the intervals with probability `CONFIDENCE_LEVEL`
    dependence: float  # Largest ratio of the errors computed with and without dependence of neighbouring residuals
    # Undetermined directions: relative changes of parameters that leave all measured curves unchanged
    undetermined: list[dict[int, float]]
    chi_square: float  # Sum of squared weighted residuals divided by the degrees of freedom
    degrees: float  # Degrees of freedom of the standard deviations of the intervals

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the free parameters, shape (p, p)."""
        size = np.sqrt(np.diag(self.covariance))
        size = np.where(size > 0.0, size, 1.0)
        return np.asarray(self.covariance / np.outer(size, size))


def uncertainty(problem: Problem, unknowns: np.ndarray) -> Uncertainty:
    r"""Compute the errors of the free parameters at the end of a search.

    The starts of the segments are eliminated; J is the Jacobian that remains for the parameters. Two covariances are formed.
    s^2 (J'J)^-1 is valid for independent residuals. (J'J)^-1 (sum of g g') (J'J)^-1, with g = J'r for each of at least 24
    blocks of consecutive residuals (Liang and Zeger 1986, doi:10.1093/biomet/73.1.13), is valid for residuals that depend on
    each other within blocks, as they do if the model is not exact. The larger error is used, with Student's t. If the standard
    deviations of the quantities are estimated, it has the fewest degrees of freedom of one quantity.
    """
    count = len(problem.free)
    residual = problem.residuals(unknowns)
    matrix = jacobian(problem, unknowns, accurate=True)
    # a parameter that has become larger than its scale is measured by its value
    size = np.maximum(1.0, np.abs(unknowns[:count]))
    of_parameters, starts = matrix[:, :count] * size, matrix[:, count:]
    if starts.shape[1]:
        basis = np.linalg.qr(starts)[0]
        of_parameters = of_parameters - basis @ (basis.T @ of_parameters)
    _, sizes, rows = np.linalg.svd(of_parameters, full_matrices=False)
    degrees = float(max(1, residual.size - problem.unknowns))
    chi_square = float(residual @ residual / degrees)
    noise = np.sqrt(chi_square)
    # small singular values are errors of the derivatives; a standard error above the parameter's size means undetermined
    determined = (sizes > 1e-6 * sizes[0]) & (sizes > noise)
    inverse = rows[determined].T / sizes[determined] ** 2 @ rows[determined]
    if problem.estimated:  # the standard deviation of one quantity may decide
        degrees = float(np.min(column_degrees(problem, matrix)))
    scores = _scores(problem, of_parameters, residual)
    blocks = len(scores)
    robust = inverse @ (scores.T @ scores) @ inverse * (blocks / (blocks - 1.0))
    plain = chi_square * inverse
    ratio = np.sqrt(np.diag(robust) / np.maximum(np.diag(plain), 1e-300))
    width = np.maximum(
        stdtrit(degrees, 0.5 + 0.5 * CONFIDENCE_LEVEL) * np.sqrt(np.diag(plain)),
        stdtrit(max(1, blocks - 1), 0.5 + 0.5 * CONFIDENCE_LEVEL) * np.sqrt(np.diag(robust)),
    )
    scale = problem.scale * size
    lost = np.sqrt(np.sum(rows[~determined] ** 2, axis=0)) > 0.01
    factor = np.maximum(1.0, ratio)
    covariance = plain * np.outer(factor, factor)
    return Uncertainty(
        covariance=covariance * np.outer(scale, scale),
        error=np.where(lost, np.inf, scale * np.sqrt(np.diag(covariance))),
        half_width=np.where(lost, np.inf, scale * width),
        dependence=float(np.max(ratio[~lost], initial=0.0)),
        undetermined=[_direction(row) for row in rows[~determined]],
        chi_square=chi_square,
        degrees=degrees,
    )


def column_degrees(problem: Problem, jacobian: np.ndarray) -> np.ndarray:
    """Return the degrees of freedom of the residuals of each quantity: their number minus the sum of their leverages.

    `jacobian` is that of the residuals by the unknowns, at the solution.
    """
    basis, sizes, _ = np.linalg.svd(jacobian, full_matrices=False)
    leverages = np.sum(basis[:, sizes > DATA_TOL * sizes.max(initial=0.0)] ** 2, axis=1)
    rows = leverages[: problem.measured].reshape(-1, problem.deviation.size)
    return np.asarray(np.maximum(len(rows) - rows.sum(axis=0), DATA_TOL))


def _scores(problem: Problem, jacobian: np.ndarray, residual: np.ndarray, least_blocks: int = 24) -> np.ndarray:
    """Return the gradient J'r of each block of consecutive residuals, shape (blocks, p)."""
    sizes = [segment.record.values.size for segment in problem.segments]
    per_segment = max(1, -(-least_blocks // len(sizes)))
    scores, first = [], 0
    for size in sizes:
        cuts = np.linspace(first, first + size, min(per_segment, size) + 1).round().astype(int)
        scores += [jacobian[a:b].T @ residual[a:b] for a, b in pairwise(cuts.tolist())]
        first += size
    return np.array(scores)


def _direction(row: np.ndarray, least: float = 0.2) -> dict[int, float]:
    """Return the entries of a direction in parameter space by parameter index, divided by the largest entry.

    `least`: smallest entry that is returned, as a fraction of the largest.
    """
    largest = int(np.argmax(np.abs(row)))
    shares = row / row[largest]
    return {k: float(shares[k]) for k in np.argsort(-np.abs(shares), kind="stable").tolist() if abs(shares[k]) >= least}
