"""The paper's figures: what each shows, which runs it needs, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import xarray as xr
from matplotlib.figure import Figure

from scissordyn.errors import InputError
from scissordyn.paper.cases import PaperCase
from scissordyn.paper.figure import load, orbit, response, scatter

__all__ = ["FIGURES", "PaperFigure", "figure_of"]


@dataclass(frozen=True)
class PaperFigure:
    """One figure of the paper.

    Parameters
    ----------
    number : int
        In the paper.
    caption : str
    cases : tuple of PaperCase
        The runs it needs.
    draw : callable
        From the runs by case to a Figure.
    """

    number: int
    caption: str
    cases: tuple[PaperCase, ...]
    draw: Callable[[Mapping[PaperCase, xr.Dataset]], Figure]


FIGURES = {
    figure.number: figure
    for figure in (
        PaperFigure(
            6,
            "Response at 0.5 mm and 150 rpm beside the ideal mechanism. Left: displacement, velocity, acceleration of the "
            "slider. Right: angle, angular velocity, angular acceleration of bar 2.",
            response.CASES,
            response.draw,
        ),
        PaperFigure(7, "Contact force and driving torque at 100, 150 and 250 rpm, 0.5 mm.", load.BY_SPEED, load.draw_by_speed),
        PaperFigure(
            8,
            "Contact force and driving torque at 0.6, 0.4 and 0.2 mm, 150 rpm.",
            load.BY_CLEARANCE,
            load.draw_by_clearance,
        ),
        PaperFigure(9, "Orbits of the journal for clearances from 0.7 to 0.2 mm.", orbit.BY_CLEARANCE, orbit.draw_by_clearance),
        PaperFigure(
            10,
            "Slider velocity and acceleration for clearances from 0.7 to 0.2 mm. The paper calls these Poincaré maps; over one "
            "stroke they are scatter plots of samples.",
            scatter.CASES_BY_CLEARANCE,
            scatter.draw_by_clearance,
        ),
        PaperFigure(
            11,
            "Orbits of the journal for friction coefficients 0.01, 0.03, 0.05 and 0.1, 0.5 mm.",
            orbit.BY_FRICTION,
            orbit.draw_by_friction,
        ),
        PaperFigure(
            12,
            "Slider velocity and acceleration for friction coefficients 0.01, 0.03, 0.05 and 0.1.",
            scatter.CASES_BY_FRICTION,
            scatter.draw_by_friction,
        ),
        PaperFigure(
            13,
            "Orbits of the journal with control: contact held as a constraint, for clearances 0.7, 0.5, 0.3 and 0.1 mm.",
            orbit.HELD,
            orbit.draw_held,
        ),
    )
}
"""By number."""


def figure_of(number: int) -> PaperFigure:
    """The figure of that number.

    Parameters
    ----------
    number : int

    Returns
    -------
    PaperFigure

    Raises
    ------
    InputError
        If it shows no results or does not exist.
    """
    if number not in FIGURES:
        known = ", ".join(map(str, FIGURES))
        raise InputError(
            f"figure {number}", f"a figure with results: {known}", f"scissordyn paper --figure {next(iter(FIGURES))}"
        )
    return FIGURES[number]
