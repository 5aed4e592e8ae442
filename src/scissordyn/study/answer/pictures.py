"""The pictures of a study as methods, what ``result.plot`` is, and the fields between its points that maps show."""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.study import (
    Bound,
    Field,
    feasibility_map,
    pareto_front,
    requirement_bars,
    response_curves,
    sensitivity_bars,
)
from scissordyn.plot.style import Canvas
from scissordyn.study.answer.verdict import feasible_fraction
from scissordyn.study.ask.description import Study
from scissordyn.study.compute.interpolation import between_points

if TYPE_CHECKING:
    from scissordyn.study.result import StudyResult


CELLS = 48  # Cells of a field along each number
OTHERS = 16  # Points whose other numbers a field is averaged over


class StudyPictures:
    """Pictures of a study; each is drawn on given Axes or on a new Figure, and returns its Axes.

    Parameters
    ----------
    result : StudyResult
    """

    def __init__(self, result: StudyResult) -> None:
        self._result = result
        self._surfaces = Surfaces(result.study, result.points)

    def map(self, colour: str = "met", *, x: str = "", y: str = "", axes: Canvas = None) -> list[Axes]:
        """A response, or "met", the fraction of cases that meet the requirements, over two numbers; see `feasibility_map`.

        A response with a requirement has a contour at its bound. Between few points that are no grid the response is
        interpolated by kriging, where points left out are predicted; it is paler where it is uncertain.
        """
        points = self._result.points
        responses = [str(name) for name, variable in points.data_vars.items() if variable.attrs.get("role") == "response"]
        if colour not in ("met", *points):
            raise InputError(f"a map of '{colour}'", ", ".join(["met", *responses]), f"result.plot.map('{responses[0]}')")
        field, bounds = self._surfaces.of_map(colour, x, y)
        limit = self._limits().get(colour)
        return feasibility_map(points, x=x, y=y, colour=colour, limit=limit, field=field, bounds=bounds, axes=axes)

    def curves(self, *, axes: Canvas = None) -> list[Axes]:
        """Each response over each number that is chosen; see `response_curves`."""
        return response_curves(self._result.points, limits=self._limits(), axes=axes)

    def requirements(self, *, axes: Canvas = None) -> list[Axes]:
        """The fraction of the range that meets each requirement, and all of them; see `requirement_bars`."""
        fractions_met = feasible_fraction(self._result.study, self._result.dataset)
        intervals = np.array([(fraction.low, fraction.high) for fraction in fractions_met])
        fractions = np.array([fraction.fraction for fraction in fractions_met])
        return requirement_bars([fraction.label for fraction in fractions_met], fractions, intervals, axes=axes)

    def sensitivity(self, response: str = "", *, axes: Canvas = None) -> list[Axes]:
        """What each response depends on, or one of them; see `sensitivity_bars`."""
        indices = self._result.sensitivity(response)
        return sensitivity_bars(indices if isinstance(indices, dict) else {response: indices}, axes=axes)

    def front(self, x: int = 0, y: int = 1, *, axes: Canvas = None) -> list[Axes]:
        """All points that an optimisation has tried, over two of its goals by number, and the front; see `pareto_front`.

        Points of cheap runs that were run accurately too are shown with both values.
        """
        search = self._result.study.optimisation
        tried, goals = self._result.optimum.points, search.goals if search is not None else ()
        if not max(x, y) < len(goals) or min(x, y) < 0:
            raise InputError(f"the front of goals {x} and {y} of {len(goals)}", "two goals, from 0")
        there = None if self._result.verified is None else self._result.confirmed
        return pareto_front(tried, (goals[x].label, goals[y].label), confirmed=there, axes=axes)

    def _limits(self) -> dict[str, float]:
        return {requirement.response.name: requirement.bound for requirement in self._result.study.requirements}


class Surfaces:
    """Responses of a study of few points, interpolated by kriging."""

    def __init__(self, study: Study, points: xr.Dataset) -> None:
        self._study, self._points = study, points
        self._names: list[str] = [factor.path for factor in study.factors]
        self._model = cache(partial(between_points, study, points))  # By response

    def field(self, response: str, x: str, y: str) -> Field | None:
        """The mean of a response over the numbers other than x and y; None where points do not predict each other."""
        model = self._model(response)
        if model is None:
            return None
        places = [self._names.index(name) for name in (x, y)]
        table = np.stack([self._points[name].values for name in self._names], axis=1)
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

    def _steps(self, place: int, values: np.ndarray) -> np.ndarray:
        """Within the data: nothing is extrapolated along an axis."""
        space = np.geomspace if self._study.factors[place].logarithmic else np.linspace
        return np.asarray(space(float(values.min()), float(values.max()), CELLS))

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
