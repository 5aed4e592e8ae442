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
"""[-] Correlation lengths in the unit cube: nothing between the points of a study is shorter, and longer ones are the same."""

NOISE_BOUNDS = (1e-8, 1e4)  # [-] variance of the noise as a fraction of the process's variance; 1e4 is noise alone


class Process:
    """Gaussian process at points `x` (n, d) in the unit cube, with values `y` (n,) and `slopes` (n, d), NaN where unknown."""

    def __init__(self, x: np.ndarray, y: np.ndarray, slopes: np.ndarray) -> None:
        self.x, every = x, np.vstack([y, slopes.T])
        self.known = np.isfinite(every)
        self.data = every[self.known]
        size = x.shape[1] + 2 if self.known[1:].any() else x.shape[1] + 1
        bounds = [np.log(LENGTH_BOUNDS)] * x.shape[1] + [np.log(NOISE_BOUNDS)] * (size - x.shape[1])
        low, high = np.transpose(bounds)
        starts = (low + part * (high - low) for part in (0.25, 0.5))  # smooth functions begin at little noise
        how: Any = {"jac": True, "method": "L-BFGS-B", "bounds": bounds, "tol": DATA_TOL}
        found = [minimize(self._unlikelihood, start, **how) for start in starts]
        chosen = np.exp(min(found, key=lambda one: float(one.fun)).x)
        self.lengths, self.noise = chosen[: x.shape[1]], chosen[x.shape[1] :]
        self._factor = cho_factor(self._matrix(chosen), lower=True)
        self.weights = cho_solve(self._factor, self.data)
        self.variance = float(self.data @ self.weights) / self.data.size

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return values and their standard deviations with noise, shapes (m,)."""
        across = correlation(x, self.x, self.lengths)[0][:, self.known]
        explained = np.sum(across * cho_solve(self._factor, across.T).T, axis=1)
        return across @ self.weights, np.sqrt(self.variance * np.maximum(1.0 + self.noise[0] - explained, 0.0))

    def left_out(self) -> np.ndarray:
        """Return the prediction of each point's value without its value and derivatives, shape (n,), in closed form.

        With the inverse K of the covariance, it is the value minus the first entry of (K_pp)^-1 (K data)_p of the point's
        data p (Rasmussen and Williams, equation 5.12, for blocks).
        """
        inverse = cho_solve(self._factor, np.eye(self.data.size))
        point = np.nonzero(self.known)[1]
        found = np.empty(len(self.x))
        for k in range(len(self.x)):
            own = np.flatnonzero(point == k)
            found[k] = self.data[own[0]] - np.linalg.solve(inverse[np.ix_(own, own)], self.weights[own])[0]
        return found

    def _matrix(self, chosen: np.ndarray) -> np.ndarray:
        """Return the covariance of the data as a fraction of the process's variance, for lengths and noises."""
        matrix = correlation(self.x, self.x, chosen[: self.x.shape[1]])[self.known][:, self.known]
        matrix[np.diag_indices_from(matrix)] += self._noises(chosen).sum(axis=0)
        return np.asarray(matrix)

    def _noises(self, chosen: np.ndarray) -> np.ndarray:
        """Return the variances of values, zero for derivatives, and those of derivatives, shape (2, data).

        The noise of a derivative is a fraction of the variance of the process's derivative.
        """
        d, (kind, _) = self.x.shape[1], np.nonzero(self.known)
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
        noises, (kind, _) = self._noises(chosen), np.nonzero(self.known)
        slopes = np.zeros(logarithms.size)
        for k in range(d):
            changes = correlation_change(self.x, chosen[:d], k)[self.known][:, self.known]
            slopes[k] = np.sum(by_matrix * changes) - 2.0 * np.diag(by_matrix)[kind == 1 + k] @ noises[1, kind == 1 + k]
        slopes[d:] = (noises @ np.diag(by_matrix))[: logarithms.size - d]
        return float(0.5 * self.data.size * np.log(variance) + np.sum(np.log(np.diag(factor[0])))), slopes


def correlation(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return the correlations (1 + d, n, 1 + d, m) of values, index 0, and derivatives, 1 to d, at points (n, d) and (m, d)."""
    (n, d), m = a.shape, len(b)
    apart = (a[:, None] - b) / lengths
    r = np.sqrt(5.0 * np.sum(apart**2, axis=-1))
    decay = np.exp(-r)
    slope = 5.0 / 3.0 * (1.0 + r) * decay
    found = np.empty((1 + d, n, 1 + d, m))
    found[0, :, 0] = (1.0 + r + r**2 / 3.0) * decay
    for i in range(d):
        found[1 + i, :, 0] = -slope * apart[..., i] / lengths[i]
        found[0, :, 1 + i] = slope * apart[..., i] / lengths[i]
        for j in range(d):
            own = slope if i == j else 0.0
            found[1 + i, :, 1 + j] = (own - 25.0 / 3.0 * decay * apart[..., i] * apart[..., j]) / (lengths[i] * lengths[j])
    return found


def correlation_change(x: np.ndarray, lengths: np.ndarray, k: int) -> np.ndarray:
    """Return the derivatives of the correlations between points by the logarithm of one length."""
    n, d = x.shape
    apart = (x[:, None] - x) / lengths
    r = np.sqrt(5.0 * np.sum(apart**2, axis=-1))
    decay = 25.0 / 3.0 * np.exp(-r)
    slope, square = 0.2 * (1.0 + r) * decay, apart[..., k] ** 2
    steeper = np.divide(5.0 * square, r, out=np.zeros_like(r), where=r > 0.0)
    found = np.empty((1 + d, n, 1 + d, n))
    found[0, :, 0] = slope * square
    for i in range(d):
        mixed = apart[..., i] / lengths[i] * (decay * square - 2.0 * slope * (i == k))
        found[1 + i, :, 0], found[0, :, 1 + i] = -mixed, mixed
        for j in range(d):
            both = (i == k) + (j == k)
            own = (decay * square - both * slope) if i == j else 0.0
            product = decay * apart[..., i] * apart[..., j]
            found[1 + i, :, 1 + j] = (own - product * (steeper - 2.0 * both)) / (lengths[i] * lengths[j])
    return found
