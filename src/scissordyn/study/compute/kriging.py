"""Kriging of a response over the numbers that are chosen: prediction, its uncertainty, and its error by cross-validation.

Gaussian process of scikit-learn: anisotropic Matern 5/2 correlation and noise, with the lengths and variances of largest
likelihood (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5).
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

LEAST = 8  # Points from which a response is interpolated
MOST = 300  # Points up to which it is: the effort grows with their third power
STARTS = (0.3, 1.0)  # Correlation lengths of the unit cube from which the likelihood is climbed
PART = 4096  # Points that are predicted at once

LENGTHS = (0.05, 20.0)
NOISE = (1e-8, 1.0)
VARIANCES = (1e-2, 1e4)

FACTOR = 5.0  # Ratio of largest to smallest of positive values from which their logarithm is interpolated


class Kriging:
    """A response as a function of numbers, interpolated between points.

    Shapes: `x` (n, numbers), `values` (n,), `logarithmic` (numbers,), `left_out` (n, 2).
    """

    def __init__(self, x: np.ndarray, values: np.ndarray, logarithmic: np.ndarray) -> None:
        self._log = np.asarray(logarithmic, bool)
        terms = self._terms(x)
        self._low, self._width = terms.min(axis=0), np.maximum(np.ptp(terms, axis=0), 1e-300)
        self.of_logarithm = bool(values.min() > 0.0 and values.max() > FACTOR * values.min())
        y = np.log(values) if self.of_logarithm else np.asarray(values, float)
        self._shift, self._scale = float(y.mean()), float(y.std()) or 1.0
        self.process = _likeliest(self._unit(x), (y - self._shift) / self._scale)
        self._leave_out(values)

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Response and standard deviation of the prediction.

        Shapes: `x` (m, numbers); returns `mean, deviation` (m,).
        """
        mean, deviation = self.process.predict(self._unit(x), return_std=True)
        y, deviation = self._shift + self._scale * mean, self._scale * deviation
        return (np.exp(y), np.exp(y) * deviation) if self.of_logarithm else (y, deviation)

    def expected(self, x: np.ndarray) -> np.ndarray:
        """Response at many points, without its uncertainty.

        Shapes: `x` (m, numbers).
        """
        parts = [self.process.predict(self._unit(part)) for part in np.array_split(x, max(1, x.shape[0] // PART))]
        y = self._shift + self._scale * np.concatenate(parts)
        return np.exp(y) if self.of_logarithm else y

    def _terms(self, x: np.ndarray) -> np.ndarray:
        return np.where(self._log, np.log(np.where(self._log, x, 1.0)), x)

    def _unit(self, x: np.ndarray) -> np.ndarray:
        return np.asarray((self._terms(x) - self._low) / self._width)

    def _leave_out(self, values: np.ndarray) -> None:
        """Predictions of each point by the others, in closed form (Rasmussen and Williams, equations 5.10 to 5.12)."""
        inverse = np.linalg.inv(self.process.L_ @ self.process.L_.T)
        y = self.process.y_train_ - self.process.alpha_ / np.diag(inverse)
        deviation = 1.0 / np.sqrt(np.diag(inverse))
        self.left_out = np.stack([self._shift + self._scale * y, self._scale * deviation], axis=1)
        predictions = np.exp(self.left_out[:, 0]) if self.of_logarithm else self.left_out[:, 0]
        errors = values - predictions
        spread = float(np.sum((values - values.mean()) ** 2))
        self.predicted = 1.0 - float(np.sum(errors**2)) / spread if spread > 0.0 else 0.0
        self.error = float(np.sqrt(np.mean(errors**2)) / max(float(np.mean(np.abs(values))), 1e-300))


def _likeliest(x: np.ndarray, y: np.ndarray) -> Any:
    """The process of the largest likelihood."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    processes = []
    for start in STARTS:
        correlation = Matern([start] * x.shape[1], LENGTHS, nu=2.5)
        kernel = ConstantKernel(1.0, VARIANCES) * correlation + WhiteKernel(1e-4, NOISE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a number at its bound: a length without influence
            processes.append(GaussianProcessRegressor(kernel, alpha=1e-10).fit(x, y))
    return max(processes, key=lambda process: process.log_marginal_likelihood_value_)
