"""What the residuals say of the numbers: covariance, intervals, and numbers that the data cannot distinguish."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import t as student

from scissordyn.identification.problem import Problem

BLOCKS = 24  # At least so many blocks of consecutive residuals, within which errors may depend on each other
LEVEL = 0.95  # Probability that an interval holds the number
UNKNOWN = 1.0  # A direction whose standard error is larger than this fraction of the numbers' scales is not determined
NUMERICAL = 1e-6  # Singular values below this fraction of the largest are errors of the derivatives
PART = 0.2  # Numbers with at least this share of the largest change in a direction are named


@dataclass(frozen=True)
class Uncertainty:
    """Errors of the free numbers."""

    covariance: np.ndarray  # (p, p) In SI; of directions that are determined
    error: np.ndarray  # (p,) Standard errors; infinite for numbers that are not determined
    half_width: np.ndarray  # (p,) Of the intervals with probability `LEVEL`
    dependence: float  # Ratio of the errors with and without regard to residuals that depend on their neighbours, the largest
    # Directions that are not determined: relative changes of numbers that together change nothing that was measured
    alike: list[dict[int, float]]
    chi_square: float  # Sum of squares of the weighted residuals over the degrees of freedom

    @property
    def correlation(self) -> np.ndarray:
        """Of the free numbers, shape (p, p)."""
        size = np.sqrt(np.diag(self.covariance))
        size = np.where(size > 0.0, size, 1.0)
        return np.asarray(self.covariance / np.outer(size, size))


def uncertainty(problem: Problem, unknowns: np.ndarray) -> Uncertainty:
    r"""Errors of the free numbers at the end of a search.

    The starts of the segments are eliminated: J is what is left of the derivatives by the numbers. Two covariances are formed:
    s^2 (J'J)^-1, for residuals that do not depend on each other, and (J'J)^-1 (sum of g g') (J'J)^-1 with g = J'r of each of at
    least `BLOCKS` blocks of consecutive residuals (Liang and Zeger 1986, doi:10.1093/biomet/73.1.13), which holds if they do
    within blocks, as where the model is not exact. The larger error of the two counts, with Student's t.
    """
    count = len(problem.free)
    residual = problem.residuals(unknowns)
    matrix = problem.jacobian(unknowns, accurate=True)
    of_parameters, starts = matrix[:, :count], matrix[:, count:]
    if starts.shape[1]:
        basis = np.linalg.qr(starts)[0]
        of_parameters = of_parameters - basis @ (basis.T @ of_parameters)
    _, sizes, rows = np.linalg.svd(of_parameters, full_matrices=False)
    degrees = max(1, residual.size - problem.unknowns)
    chi_square = float(residual @ residual / degrees)
    noise = np.sqrt(chi_square)
    determined = (sizes > NUMERICAL * sizes[0]) & (sizes * UNKNOWN > noise)
    inverse = rows[determined].T / sizes[determined] ** 2 @ rows[determined]
    scores = _scores(problem, of_parameters, residual)
    blocks = len(scores)
    robust = inverse @ (scores.T @ scores) @ inverse * (blocks / (blocks - 1.0))
    plain = chi_square * inverse
    ratio = np.sqrt(np.diag(robust) / np.maximum(np.diag(plain), 1e-300))
    width = np.maximum(
        student.ppf(0.5 + 0.5 * LEVEL, degrees) * np.sqrt(np.diag(plain)),
        student.ppf(0.5 + 0.5 * LEVEL, max(1, blocks - 1)) * np.sqrt(np.diag(robust)),
    )
    scale = problem.scale
    lost = np.sqrt(np.sum(rows[~determined] ** 2, axis=0)) > PART * 0.05
    factor = np.maximum(1.0, ratio)
    covariance = plain * np.outer(factor, factor)
    return Uncertainty(
        covariance=covariance * np.outer(scale, scale),
        error=np.where(lost, np.inf, scale * np.sqrt(np.diag(covariance))),
        half_width=np.where(lost, np.inf, scale * width),
        dependence=float(np.max(ratio[~lost], initial=0.0)),
        alike=[_direction(row) for row in rows[~determined]],
        chi_square=chi_square,
    )


def _scores(problem: Problem, own: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Gradients J'r of blocks of consecutive residuals, shape (blocks, p)."""
    sizes = [segment.record.values.size for segment in problem.segments]
    per_segment = max(1, -(-BLOCKS // len(sizes)))
    scores, first = [], 0
    for size in sizes:
        cuts = np.linspace(first, first + size, min(per_segment, size) + 1).round().astype(int)
        scores += [own[a:b].T @ residual[a:b] for a, b in pairwise(cuts.tolist())]
        first += size
    return np.array(scores)


def _direction(row: np.ndarray) -> dict[int, float]:
    """The numbers of a direction, by their relative changes; the largest changes by one."""
    largest = int(np.argmax(np.abs(row)))
    shares = row / row[largest]
    return {k: float(shares[k]) for k in np.argsort(-np.abs(shares), kind="stable").tolist() if abs(shares[k]) >= PART}
