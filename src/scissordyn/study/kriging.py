"""Kriging of a response over the numbers that are chosen: prediction, its uncertainty, and its error by cross-validation.

Ordinary kriging with an anisotropic Matern 5/2 correlation and a nugget; lengths and nugget by maximum likelihood (Rasmussen
and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5); points left out in closed
form (Dubrule, Math. Geol. 15, 687 (1983)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize

__all__ = ["LEAST", "MOST", "Kriging"]

LEAST = 8
"""Points from which a response is interpolated."""

MOST = 300
"""Points up to which it is: the effort grows with their third power."""

STARTS = (0.3, 1.0)
"""Correlation lengths of the unit cube from which the likelihood is climbed."""

LENGTHS = (0.05, 20.0)
NUGGETS = (1e-8, 1.0)

FACTOR = 5.0
"""Ratio of largest to smallest of positive values from which their logarithm is interpolated."""


@dataclass(frozen=True)
class _Model:
    """What predictions need: factor of the correlations, the weights, the mean and the variance."""

    factor: np.ndarray
    weights: np.ndarray
    ones: np.ndarray
    mean: float
    variance: float
    fit: float


class Kriging:
    """A response as a function of numbers, interpolated between points.

    Parameters
    ----------
    x : ndarray, shape (n, numbers)
    values : ndarray, shape (n,)
        Finite.
    logarithmic : ndarray of bool, shape (numbers,)
        Numbers that enter by their logarithm.

    Attributes
    ----------
    predicted : float
        Share of the variance that is predicted, each point by the others.
    error : float
        Root mean square of the errors of these predictions, as a fraction of the mean response.
    left_out : ndarray, shape (n, 2)
        Predictions of each point by the others and their standard deviations: of the logarithm, where that is interpolated.
    """

    def __init__(self, x: np.ndarray, values: np.ndarray, logarithmic: np.ndarray) -> None:
        self._log = np.asarray(logarithmic, bool)
        terms = self._terms(x)
        self._low, self._width = terms.min(axis=0), np.maximum(np.ptp(terms, axis=0), 1e-300)
        self._x = (terms - self._low) / self._width
        self.of_logarithm = bool(values.min() > 0.0 and values.max() > FACTOR * values.min())
        y = np.log(values) if self.of_logarithm else np.asarray(values, float)
        self._shift, self._scale = float(y.mean()), float(y.std()) or 1.0
        self._y = (y - self._shift) / self._scale
        self._parameters = self._likely()
        self._model = self._solved(self._parameters)
        self._leave_out(values)

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Response and standard deviation of the prediction.

        Parameters
        ----------
        x : ndarray, shape (m, numbers)

        Returns
        -------
        mean, deviation : ndarray, shape (m,)
        """
        at = (self._terms(x) - self._low) / self._width
        near, model = self._correlation(at, self._x, self._parameters[:-1]), self._model
        mean = model.mean + near @ model.weights
        solved = linalg.solve_triangular(model.factor, near.T, lower=True)
        trend = 1.0 - near @ linalg.cho_solve((model.factor, True), model.ones)
        total = model.ones @ linalg.cho_solve((model.factor, True), model.ones)
        variance = model.variance * np.maximum(1.0 - np.sum(solved**2, axis=0) + trend**2 / total, 0.0)
        y, deviation = self._shift + self._scale * mean, self._scale * np.sqrt(variance)
        return (np.exp(y), np.exp(y) * deviation) if self.of_logarithm else (y, deviation)

    def _terms(self, x: np.ndarray) -> np.ndarray:
        return np.where(self._log, np.log(np.where(self._log, x, 1.0)), x)

    @staticmethod
    def _correlation(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        difference = (a[:, None, :] - b[None, :, :]) / np.exp(lengths)
        distance = np.sqrt(5.0 * np.sum(difference**2, axis=-1))
        return np.asarray((1.0 + distance + distance**2 / 3.0) * np.exp(-distance))

    def _solved(self, parameters: np.ndarray) -> _Model:
        """With logarithms of the lengths and of the nugget."""
        count, ones = self._y.size, np.ones(self._y.size)
        matrix = self._correlation(self._x, self._x, parameters[:-1]) + np.exp(parameters[-1]) * np.eye(count)
        factor = linalg.cholesky(matrix, lower=True)
        inverse_ones = linalg.cho_solve((factor, True), ones)
        mean = float(inverse_ones @ self._y / (ones @ inverse_ones))
        weights = linalg.cho_solve((factor, True), self._y - mean)
        variance = float(max((self._y - mean) @ weights / count, 1e-300))
        fit = 0.5 * count * np.log(variance) + float(np.sum(np.log(np.diag(factor))))
        return _Model(factor, weights, ones, mean, variance, fit)

    def _likely(self) -> np.ndarray:
        low, high = (np.log([LENGTHS[end]] * self._x.shape[1] + [NUGGETS[end]]) for end in (0, 1))

        def fit(parameters: np.ndarray) -> float:
            return self._solved(parameters).fit

        found = [
            optimize.minimize(
                fit,
                np.array([np.log(start)] * self._x.shape[1] + [np.log(1e-4)]),
                method="L-BFGS-B",
                bounds=optimize.Bounds(low, high),
                options={"maxiter": 60},
            )
            for start in STARTS
        ]
        return np.asarray(min(found, key=lambda one: one.fun).x)

    def _leave_out(self, values: np.ndarray) -> None:
        model, count = self._model, self._y.size
        inverse = linalg.cho_solve((model.factor, True), np.eye(count))
        rows = inverse.sum(axis=1)
        reduced = inverse - np.outer(rows, rows) / rows.sum()
        y = self._y - (reduced @ self._y) / np.diag(reduced)
        deviation = np.sqrt(model.variance / np.diag(reduced))
        self.left_out = np.stack([self._shift + self._scale * y, self._scale * deviation], axis=1)
        guessed = np.exp(self.left_out[:, 0]) if self.of_logarithm else self.left_out[:, 0]
        wrong = values - guessed
        spread = float(np.sum((values - values.mean()) ** 2))
        self.predicted = 1.0 - float(np.sum(wrong**2)) / spread if spread > 0.0 else 0.0
        self.error = float(np.sqrt(np.mean(wrong**2)) / max(float(np.mean(np.abs(values))), 1e-300))
