"""The pictures of a study as methods: what ``result.plot`` is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.study import feasibility_map, pareto_front, requirement_bars, response_curves, sensitivity_bars
from scissordyn.plot.style import Canvas
from scissordyn.study.answer.surface import Surfaces
from scissordyn.study.answer.verdict import feasible_fraction

if TYPE_CHECKING:
    from scissordyn.study.result import StudyResult


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
