"""Surfaces of responses between the points of a study, by a Gaussian process."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.plot.style import SIZES
from scissordyn.studies.answer.process import Process
from scissordyn.studies.answer.trend import PREDICTED_SHARE_MIN
from scissordyn.studies.answer.verdict import slopes_of_points
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import POINTS_MIN

if TYPE_CHECKING:
    from scissordyn.plot.study import Bound, Field
    from scissordyn.studies.result import StudyResult

SURFACE_DATA_MAX = 300  # [values and derivatives] of a surface, whose computing time grows with the third power of them


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


def surfaces(result: StudyResult, colour: str, x: str = "", y: str = "", cells: int = 48) -> tuple[Field | None, list[Bound]]:
    """Return the surface of a map and those of requirements, on a grid of `cells` x `cells`; nothing if there is no surface."""
    from scissordyn.plot.study import Bound  # imports matplotlib, which answers in the terminal do not need

    names = result.study.paths
    if len(names) < 2:
        return None, []
    x = x or names[0]
    y = y or next(name for name in names if name != x)
    bounds = [
        Bound(requirement.label, field, requirement.bound)
        for requirement in result.study.requirements
        if colour in ("met", requirement.response.name)
        and (field := _field(result, requirement.response.name, x, y, cells)) is not None
    ]
    return None if colour == "met" else _field(result, colour, x, y, cells), bounds


def _field(result: StudyResult, response: str, x: str, y: str, cells: int, averaged: int = 16) -> Field | None:
    """Return a response over x and y, averaged over the other parameters of `averaged` points; None if it has no surface."""
    from scissordyn.plot.study import Field

    model, names = result.between(response), result.study.paths
    if model is None:
        return None
    table, places = np.stack([result.points[name].values for name in names], axis=1), [names.index(x), names.index(y)]

    def steps(place: int) -> np.ndarray:
        space = np.geomspace if result.study.factors[place].logarithmic else np.linspace
        low, high = float(table[:, place].min()), float(table[:, place].max())  # nothing is extrapolated
        return np.asarray(space(low, high, cells))

    across, up = map(steps, places)
    rows = table[np.unique(np.linspace(0, table.shape[0] - 1, averaged).astype(int))] if len(names) > 2 else table[:1]
    means, variances = [], []
    for row in rows:
        at = np.tile(row, (cells**2, 1))
        at[:, places[0]], at[:, places[1]] = np.tile(across, cells), np.repeat(up, cells)
        mean, deviation = model.predict(at)
        means.append(mean.reshape(cells, cells))
        variances.append(deviation.reshape(cells, cells) ** 2)
    deviation = np.sqrt(np.mean(variances, axis=0))
    return Field(across, up, np.mean(means, axis=0), deviation, float(np.nanstd(result.points[response].values)), model.error)
