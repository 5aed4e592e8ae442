"""Fields of responses between the points of a study, for its maps."""

from __future__ import annotations

from functools import cache

import numpy as np
import xarray as xr
from scipy.stats import qmc

from scissordyn.plot.study import Bound, Field
from scissordyn.study.answer.trend import CLEAR
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.design import quantiles
from scissordyn.study.compute.interpolation import LEAST, MOST, Kriging

CELLS = 48  # Cells of a field along each number
TRIED = 4096  # Points at which the interpolation is searched
OTHERS = 16  # Points whose other numbers a field is averaged over


class Surfaces:
    """Responses of a study of few points, interpolated by kriging."""

    def __init__(self, study: Study, points: xr.Dataset) -> None:
        self._study, self._points = study, points
        self._names: list[str] = [factor.path for factor in study.factors]
        self.model = cache(self._model)  # By response

    def field(self, response: str, x: str, y: str) -> Field | None:
        """The mean of a response over the numbers other than x and y; None where points do not predict each other."""
        model = self.model(response)
        if model is None:
            return None
        places = [self._names.index(name) for name in (x, y)]
        table = self._table()
        across, up = (self._steps(place, table[:, place]) for place in places)
        rows = table[np.unique(np.linspace(0, table.shape[0] - 1, OTHERS).astype(int))]
        rows = rows if len(self._names) > 2 else rows[:1]
        total, squared = np.zeros(CELLS**2), np.zeros(CELLS**2)
        for row in rows:
            at = np.tile(row, (CELLS**2, 1))
            at[:, places[0]], at[:, places[1]] = np.tile(across, CELLS), np.repeat(up, CELLS)
            mean, deviation = model.predict(at)
            total += mean
            squared += deviation**2
        mean, deviation = (values.reshape(CELLS, CELLS) for values in (total / len(rows), np.sqrt(squared / len(rows))))
        return Field(across, up, mean, deviation, float(np.nanstd(self._points[response].values)), model.error)

    def _table(self) -> np.ndarray:
        return np.stack([self._points[name].values for name in self._names], axis=1)

    def _steps(self, place: int, values: np.ndarray) -> np.ndarray:
        """Within the data: nothing is extrapolated along an axis."""
        space = np.geomspace if self._study.factors[place].logarithmic else np.linspace
        return np.asarray(space(float(values.min()), float(values.max()), CELLS))

    def _model(self, response: str) -> Kriging | None:
        """The interpolation of a response; None where points do not predict each other."""
        if any(factor.labels for factor in self._study.factors):  # between names there is nothing
            return None
        table, values = self._table(), self._points[response].values
        if np.isinf(values).any():  # points without a number would read as if the others went on there
            return None
        there = np.isfinite(values) & np.all(np.isfinite(table), axis=1)
        sizes = [np.unique(table[there, place]).size for place in range(table.shape[1])]
        if not max(LEAST, 2 * len(self._names) + 2) <= there.sum() <= MOST or min(sizes) < 2 or np.ptp(values[there]) == 0.0:
            return None
        model = Kriging(table[there], values[there], np.array([factor.logarithmic for factor in self._study.factors]))
        return model if model.predicted >= CLEAR else None

    def of_map(self, colour: str, x: str = "", y: str = "") -> tuple[Field | None, list[Bound]]:
        """The field under a map and the lines of requirements over it; nothing where nothing can be interpolated."""
        if len(self._names) < 2:
            return None, []
        x = x or self._names[0]
        y = y or next(name for name in self._names if name != x)
        bounds = [
            Bound(requirement.label, field, requirement.bound)
            for requirement in self._study.requirements
            if colour in ("met", requirement.response.name)
            and (field := self.field(requirement.response.name, x, y)) is not None
        ]
        return None if colour == "met" else self.field(colour, x, y), bounds


def predicted_point(study: Study, points: xr.Dataset) -> dict[str, float] | None:
    """Within the ranges, the point with the largest least margin by interpolation; None unless it is likely to meet all."""
    surfaces = Surfaces(study, points)
    models = [surfaces.model(requirement.response.name) for requirement in study.requirements]
    if not study.factors or None in models:
        return None
    drawn = qmc.Sobol(len(study.factors), rng=np.random.default_rng(0)).random(TRIED)
    at = quantiles([factor.variation for factor in study.factors], drawn)
    tried = np.stack([points[factor.path].values for factor in study.factors], axis=1)
    at = np.clip(at, np.nanmin(tried, axis=0), np.nanmax(tried, axis=0))  # nothing is extrapolated
    margins = [
        requirement.margin(model.predict(at)[0])
        for requirement, model in zip(study.requirements, models, strict=True)
        if model is not None
    ]
    least = np.min(margins, axis=0)
    best = int(np.argmax(least))
    if not least[best] > 0.0:
        return None
    return {factor.path: float(value) for factor, value in zip(study.factors, at[best], strict=True)}
