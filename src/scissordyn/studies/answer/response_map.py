"""Maps of a response over two parameters, from the surface between the points of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scissordyn.studies.answer.answers import Answers

if TYPE_CHECKING:
    from scissordyn.plot.study import Bound, Field


def surfaces(answers: Answers, colour: str, x: str = "", y: str = "", cells: int = 48) -> tuple[Field | None, list[Bound]]:
    """Return the surface of a map and those of requirements, on a grid of `cells` x `cells`; nothing if there is no surface."""
    from scissordyn.plot.study import Bound  # imports matplotlib, which answers in the terminal do not need

    names = answers.study.paths
    if len(names) < 2:
        return None, []
    x = x or names[0]
    y = y or next(name for name in names if name != x)
    bounds = [
        Bound(requirement.label, field, requirement.bound)
        for requirement in answers.study.requirements
        if colour in ("met", requirement.response.name)
        and (field := _field(answers, requirement.response.name, x, y, cells)) is not None
    ]
    return None if colour == "met" else _field(answers, colour, x, y, cells), bounds


def _field(answers: Answers, response: str, x: str, y: str, cells: int, averaged: int = 16) -> Field | None:
    """Return a response over x and y, averaged over the other parameters of `averaged` points; None if it has no surface."""
    from scissordyn.plot.study import Field

    model, names = answers.between(response), answers.study.paths
    if model is None:
        return None
    table, places = np.stack([answers.points[name].values for name in names], axis=1), [names.index(x), names.index(y)]

    def steps(place: int) -> np.ndarray:
        space = np.geomspace if answers.study.factors[place].logarithmic else np.linspace
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
    return Field(across, up, np.mean(means, axis=0), deviation, float(np.nanstd(answers.points[response].values)), model.error)
