"""Surfaces of responses between the points of a study, by a Gaussian process."""

from __future__ import annotations

import numpy as np
import xarray as xr

from scissordyn.plot.style import SIZES
from scissordyn.studies.answer.process import Process
from scissordyn.studies.answer.trend import PREDICTED_SHARE_MIN
from scissordyn.studies.answer.verdict import slopes_of_points
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import POINTS_MIN

SURFACE_DATA_MAX = 300  # [values and derivatives] largest number in a response surface; its computing time grows with the cube


class Surface:
    """A response as a function of the parameters, interpolated between the points of a study.

    Shapes: `x` (n, numbers), `values` (n,), `logarithmic` (numbers,), `slopes` (n, numbers), NaN where they are not known;
    `left_out` (n,).
    """

    def __init__(self, x: np.ndarray, values: np.ndarray, logarithmic: np.ndarray, slopes: np.ndarray | None = None) -> None:
        self._log = np.asarray(logarithmic, bool)
        terms = self._terms(x)
        self._low, self._width = terms.min(axis=0), np.ptp(terms, axis=0)
        self.of_logarithm = bool(values.min() > 0.0 and values.max() > SIZES.logarithm_ratio * values.min())
        y = np.log(values) if self.of_logarithm else np.asarray(values, float)
        self._shift, self._scale = float(y.mean()), float(y.std())
        inner = np.full(x.shape, np.nan)
        if slopes is not None:
            inner = slopes * np.where(self._log, x, 1.0) * self._width / self._scale
            inner = inner / values[:, None] if self.of_logarithm else inner
            inner[np.cumsum(np.isfinite(inner)).reshape(inner.shape) > SURFACE_DATA_MAX - len(x)] = np.nan
        self.process = Process(self._unit(x), (y - self._shift) / self._scale, inner)
        y = self._shift + self._scale * self.process.left_out()
        self.left_out = np.exp(y) if self.of_logarithm else y
        errors = values - self.left_out
        self.predicted = 1.0 - float(np.sum(errors**2) / np.sum((values - values.mean()) ** 2))
        self.error = float(np.sqrt(np.mean(errors**2)) / np.mean(np.abs(values)))

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the predicted response and its standard deviation (m,) at the parameters `x` (m, numbers)."""
        mean, deviation = self.process.predict(self._unit(x))
        y, deviation = self._shift + self._scale * mean, self._scale * deviation
        return (np.exp(y), np.exp(y) * deviation) if self.of_logarithm else (y, deviation)

    def _terms(self, x: np.ndarray) -> np.ndarray:
        return np.where(self._log, np.log(np.where(self._log, x, 1.0)), x)

    def _unit(self, x: np.ndarray) -> np.ndarray:
        return np.asarray((self._terms(x) - self._low) / self._width)


def between_points(study: Study, points: xr.Dataset, response: str) -> Surface | None:
    """Return the surface of a response, or None if the points of the study do not predict each other, or names vary."""
    names = study.paths
    if not names or any(factor.labels for factor in study.factors):
        return None
    x, values = np.stack([points[name].values for name in names], axis=1), points[response].values
    if np.isinf(values).any():  # a surface of the points with a number would hide those without one
        return None
    is_finite = np.isfinite(values) & np.all(np.isfinite(x), axis=1)
    slopes = slopes_of_points(points, response, names)[is_finite]
    sizes = [np.unique(column_of[is_finite]).size for column_of in x.T]
    points_apart = len(np.unique(x[is_finite], axis=0))
    data_count = points_apart + np.isfinite(slopes).sum()
    if (
        not max(POINTS_MIN, 2 * len(names) + 2) <= data_count
        or points_apart < POINTS_MIN // 2
        or is_finite.sum() > SURFACE_DATA_MAX
        or min(sizes) < 2
        or np.ptp(values[is_finite]) == 0.0
    ):
        return None
    logarithmic = np.array([factor.logarithmic for factor in study.factors])
    candidates = [Surface(x[is_finite], values[is_finite], logarithmic)]
    if np.isfinite(slopes).any():  # derivatives do not help where the response jumps between points
        candidates.append(Surface(x[is_finite], values[is_finite], logarithmic, slopes))
    surface = max(candidates, key=lambda candidate: candidate.predicted)
    return surface if surface.predicted >= PREDICTED_SHARE_MIN else None
