"""The paper's figures: caption, runs and drawing of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import xarray as xr
from matplotlib.figure import Figure

from scissordyn.errors import InputError
from scissordyn_paper.cases import CLEARANCES, CONTROLLED, FRICTION, SIZES, SPEEDS, PaperCase
from scissordyn_paper.figure import further, stroke
from scissordyn_paper.figure.overview import draw_overview
from scissordyn_paper.periodic import BY_CLEARANCE, BY_FRICTION
from scissordyn_paper.results import Results


@dataclass(frozen=True)
class PaperFigure:
    """Figure of the paper that is drawn again from computed runs."""

    caption: str
    cases: tuple[PaperCase, ...]  # Cases that the figure shows, in addition to those with ideal joints
    paint: Callable[[Mapping[PaperCase, xr.Dataset], Sequence[PaperCase]], Figure]  # Function from runs and cases to a Figure

    def draw(self, runs: Mapping[PaperCase, xr.Dataset]) -> Figure:
        """Draw the figure from the runs by case."""
        return self.paint(runs, self.cases)


_BY_CLEARANCE = tuple(PaperCase(clearance) for clearance in CLEARANCES)
_BY_FRICTION = tuple(PaperCase(friction=friction) for friction in FRICTION)

FIGURES = {
    6: PaperFigure(
        "Response at 0.5 mm and 150 rpm beside the ideal mechanism. Left: displacement, velocity, acceleration of the "
        "slider. Right: angle, angular velocity, angular acceleration of bar 2.",
        (PaperCase(),),
        stroke.draw_response,
    ),
    7: PaperFigure(
        "Contact force and driving torque at 100, 150 and 250 rpm, 0.5 mm.",
        tuple(PaperCase(speed=speed) for speed in reversed(SPEEDS)),
        stroke.draw_loads,
    ),
    8: PaperFigure(
        "Contact force and driving torque at 0.6, 0.4 and 0.2 mm, 150 rpm.",
        tuple(PaperCase(clearance) for clearance in SIZES),
        stroke.draw_loads,
    ),
    9: PaperFigure("Orbits of the journal for clearances from 0.7 to 0.2 mm.", _BY_CLEARANCE, stroke.draw_orbits),
    10: PaperFigure(
        "Slider velocity and acceleration for clearances from 0.7 to 0.2 mm. The paper calls these Poincaré maps; over one "
        "stroke they are scatter plots of samples.",
        _BY_CLEARANCE,
        stroke.draw_scatter,
    ),
    11: PaperFigure(
        "Orbits of the journal for friction coefficients 0.01, 0.03, 0.05 and 0.1, 0.5 mm.", _BY_FRICTION, stroke.draw_orbits
    ),
    12: PaperFigure(
        "Slider velocity and acceleration for friction coefficients 0.01, 0.03, 0.05 and 0.1.",
        _BY_FRICTION,
        stroke.draw_scatter,
    ),
    13: PaperFigure(
        "Orbits of the journal with control: constrained contact, for clearances 0.7, 0.5, 0.3 and 0.1 mm.",
        tuple(PaperCase(clearance, constrained=True) for clearance in CONTROLLED),
        stroke.draw_orbits,
    ),
}
"""By number."""


@dataclass(frozen=True)
class FurtherFigure:
    """Figure of the report that the paper does not have."""

    title: str
    caption: str
    draw: Callable[[Results], Figure]  # Function from the results to a Figure


FURTHER = {
    "overview": FurtherFigure(
        "What was computed",
        "Left: the array at the start and, pale, at the end. Middle: path of the pin's centre in the hole, coloured by time; "
        "the dotted circle is where pin and hole touch, and thick lines are contact. Right: force in joint A, with its "
        "contacts below, and the force in an ideal joint (dashed).",
        lambda results: draw_overview(results.runs),
    ),
    "control-torque": FurtherFigure(
        "Torque of the control",
        "Driving torque against that of ideal joints. (a) The paper's scheme on its stroke. (b) Torque of constrained "
        "contact above the ideal torque, by clearance. (c) A deployment with a gust on the slider from 0.6 to 0.8 s. (d) "
        "Torque of delayed feedback in addition to a servo; it would be zero for a periodic motion.",
        lambda results: further.draw_torques(results.runs, results.controlled),
    ),
    "contact-forces": FurtherFigure(
        "Forces and impulses of the contacts",
        "Every contact of the strokes, with a horizontal offset in the order of time, and the medians.",
        lambda results: further.draw_contacts(results.runs),
    ),
    "maps-by-clearance": FurtherFigure(
        "Scatter plots of the stroke and true maps, by clearance",
        "Above: the paper's Poincaré map, every sample of a single stroke. Below: a true Poincaré map, the same two "
        "quantities once a period of the periodic drive, at the middle of its oscillation, on the same scales. "
        "Few points are a periodic motion, a closed curve a quasi-periodic one, a cloud an irregular one.",
        lambda results: further.draw_maps(results.runs, results.settled, BY_CLEARANCE),
    ),
    "maps-by-friction": FurtherFigure(
        "Scatter plots of the stroke and true maps, by friction coefficient",
        "As before, 0.5 mm.",
        lambda results: further.draw_maps(results.runs, results.settled, BY_FRICTION),
    ),
    "bifurcation": FurtherFigure(
        "Bifurcation diagram over the clearance",
        "Under the periodic drive, without friction: the asymptotic motion, once a period. Dotted lines are the "
        "clearances of the paper.",
        lambda results: further.draw_bifurcation(results.diagram),
    ),
}
"""Figures of the report that the paper does not have, by file name."""


def figure_of(number: int) -> PaperFigure:
    """Return the figure of the paper with a number; raise `InputError` if it is not one of `FIGURES`."""
    if number not in FIGURES:
        known = ", ".join(map(str, FIGURES))
        raise InputError(
            f"figure {number}", f"a figure with results: {known}", f"scissordyn paper --figure {next(iter(FIGURES))}"
        )
    return FIGURES[number]
