"""Gaussian process through values and derivatives of a function (Rasmussen and Williams, 2006, chapters 2, 5 and 9.4).

The process has a Matern 5/2 correlation with a length for each coordinate, and noise, of largest likelihood. It is twice
differentiable, so that its derivatives are observations like its values.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize

from scissordyn.tolerance import DATA_TOL

LENGTH_BOUNDS = (0.05, 20.0)
"""[-] Bounds of a Gaussian process's correlation lengths in the unit cube.

No length between the points of a study is shorter than the first; lengths above the second one are equivalent.
"""

# [-] bounds of the noise's variance, as a fraction of the Gaussian process's variance; 1e4 is noise alone
NOISE_BOUNDS = (1e-8, 1e4)


class Process:
    """Gaussian process at points `x` (n, d) in the unit cube, with values `y` (n,) and `slopes` (n, d), NaN where unknown."""

    def __init__(self, x: np.ndarray, y: np.ndarray, slopes: np.ndarray) -> None:
        self.x, observations = x, np.vstack([y, slopes.T])
        self.is_observed = np.isfinite(observations)
        self.data = observations[self.is_observed]
        size = x.shape[1] + 2 if self.is_observed[1:].any() else x.shape[1] + 1
        bounds = [np.log(LENGTH_BOUNDS)] * x.shape[1] + [np.log(NOISE_BOUNDS)] * (size - x.shape[1])
        low, high = np.transpose(bounds)
        starts = (low + part * (high - low) for part in (0.25, 0.5))  # smooth functions begin at little noise
        options: Any = {"jac": True, "method": "L-BFGS-B", "bounds": bounds, "tol": DATA_TOL}
        fits = [minimize(self._unlikelihood, start, **options) for start in starts]
        chosen = np.exp(min(fits, key=lambda fit: float(fit.fun)).x)
        self.lengths, self.noise = chosen[: x.shape[1]], chosen[x.shape[1] :]
        self._factor = cho_factor(self._matrix(chosen), lower=True)
        self.weights = cho_solve(self._factor, self.data)
        self.variance = float(self.data @ self.weights) / self.data.size

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return values and their standard deviations with noise, shapes (m,)."""
        across = correlation(x, self.x, self.lengths)[0][:, self.is_observed]
        explained = np.sum(across * cho_solve(self._factor, across.T).T, axis=1)
        return across @ self.weights, np.sqrt(self.variance * np.maximum(1.0 + self.noise[0] - explained, 0.0))

    def left_out(self) -> np.ndarray:
        """Return the prediction of each value without the values and derivatives at its point, shape (n,), in closed form.

        With the inverse K of the covariance, it is the value minus its entry of (K_pp)^-1 (K data)_p of all data p at the point
        (Rasmussen and Williams, equation 5.12, for blocks).
        """
        inverse = cho_solve(self._factor, np.eye(self.data.size))
        point = np.nonzero(self.is_observed)[1]
        predictions = np.empty(len(self.x))
        for k in range(len(self.x)):
            data = np.flatnonzero(np.all(self.x == self.x[k], axis=1)[point])
            errors = np.linalg.solve(inverse[np.ix_(data, data)], self.weights[data])
            predictions[k] = self.data[k] - errors[np.searchsorted(data, k)]  # values come first
        return predictions

    def _matrix(self, chosen: np.ndarray) -> np.ndarray:
        """Return the covariance of the data as a fraction of the process's variance, for lengths and noises."""
        matrix = correlation(self.x, self.x, chosen[: self.x.shape[1]])[self.is_observed][:, self.is_observed]
        matrix[np.diag_indices_from(matrix)] += self._noises(chosen).sum(axis=0)
        return np.asarray(matrix)

    def _noises(self, chosen: np.ndarray) -> np.ndarray:
        """Return the variances of values, zero for derivatives, and those of derivatives, shape (2, data).

        The noise of a derivative is a fraction of the variance of the process's derivative.
        """
        d, (kind, _) = self.x.shape[1], np.nonzero(self.is_observed)
        slopes = chosen[-1] * 5.0 / 3.0 / chosen[:d] ** 2
        return np.array([np.where(kind == 0, chosen[d], 0.0), np.where(kind > 0, slopes[kind - 1], 0.0)])

    def _unlikelihood(self, logarithms: np.ndarray) -> tuple[float, np.ndarray]:
        """Return minus the logarithm of the likelihood with the most likely variance, up to a constant, and its derivatives."""
        chosen, d = np.exp(logarithms), self.x.shape[1]
        try:
            factor = cho_factor(self._matrix(chosen), lower=True)
        except LinAlgError:
            return 1e10, np.zeros(logarithms.size)
        inverse = cho_solve(factor, np.eye(self.data.size))
        weights = inverse @ self.data
        variance = float(self.data @ weights) / self.data.size
        by_matrix = 0.5 * (inverse - np.outer(weights, weights) / variance)
        noises, (kind, _) = self._noises(chosen), np.nonzero(self.is_observed)
        slopes = np.zeros(logarithms.size)
        for k in range(d):
            changes = correlation_change(self.x, chosen[:d], k)[self.is_observed][:, self.is_observed]
            slopes[k] = np.sum(by_matrix * changes) - 2.0 * np.diag(by_matrix)[kind == 1 + k] @ noises[1, kind == 1 + k]
        slopes[d:] = (noises @ np.diag(by_matrix))[: logarithms.size - d]
        return float(0.5 * self.data.size * np.log(variance) + np.sum(np.log(np.diag(factor[0])))), slopes


def correlation(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return the correlations (1 + d, n, 1 + d, m) of values, index 0, and derivatives, 1 to d, at points (n, d) and (m, d)."""
    (n, d), m = a.shape, len(b)
    delta = (a[:, None] - b) / lengths
    r = np.sqrt(5.0 * np.sum(delta**2, axis=-1))
    decay = np.exp(-r)
    slope = 5.0 / 3.0 * (1.0 + r) * decay
    correlations = np.empty((1 + d, n, 1 + d, m))
    correlations[0, :, 0] = (1.0 + r + r**2 / 3.0) * decay
    for i in range(d):
        correlations[1 + i, :, 0] = -slope * delta[..., i] / lengths[i]
        correlations[0, :, 1 + i] = slope * delta[..., i] / lengths[i]
        for j in range(d):
            diagonal = slope if i == j else 0.0
            correlations[1 + i, :, 1 + j] = (diagonal - 25.0 / 3.0 * decay * delta[..., i] * delta[..., j]) / (
                lengths[i] * lengths[j]
            )
    return correlations


def correlation_change(x: np.ndarray, lengths: np.ndarray, k: int) -> np.ndarray:
    """Return the derivatives of the correlations between points by the logarithm of one length."""
    n, d = x.shape
    delta = (x[:, None] - x) / lengths
    r = np.sqrt(5.0 * np.sum(delta**2, axis=-1))
    decay = 25.0 / 3.0 * np.exp(-r)
    slope, square = 0.2 * (1.0 + r) * decay, delta[..., k] ** 2
    steeper = np.divide(5.0 * square, r, out=np.zeros_like(r), where=r > 0.0)
    changes = np.empty((1 + d, n, 1 + d, n))
    changes[0, :, 0] = slope * square
    for i in range(d):
        mixed = delta[..., i] / lengths[i] * (decay * square - 2.0 * slope * (i == k))
        changes[1 + i, :, 0], changes[0, :, 1 + i] = -mixed, mixed
        for j in range(d):
            both = (i == k) + (j == k)
            diagonal = (decay * square - both * slope) if i == j else 0.0
            product = decay * delta[..., i] * delta[..., j]
            changes[1 + i, :, 1 + j] = (diagonal - product * (steeper - 2.0 * both)) / (lengths[i] * lengths[j])
    return changes
