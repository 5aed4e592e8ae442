"""The paper's figures, from runs of a single stroke."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.plot.contact import force_curve, torque_sources
from scissordyn.plot.file import figure_of
from scissordyn.plot.joint import draw_orbit, write_time_bar
from scissordyn.plot.over_time import response
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.series import compare, finish_time_axes, time_scale
from scissordyn.plot.style import BLUE, GREEN, IDEAL, VERMILION, draw_scale_bar, legend, normal, panels, shades
from scissordyn_paper.cases import PaperCase
from scissordyn_paper.measures import JOINT

Runs = Mapping[PaperCase, xr.Dataset]

COLOURS = (BLUE, VERMILION, GREEN)

KILO = {"N": "kN", "N m": "kN·m"}
"""Units in figures by SI unit, because forces are tens of kilonewtons; a scale from the largest value is less readable."""


def draw_response(runs: Runs, cases: Sequence[PaperCase]) -> Figure:
    """Draw figure 6: position, speed and acceleration of the slider at the left and of bar 2 at the right."""
    (case,) = cases
    return figure_of(response(runs[case], runs[case.ideal]))


def draw_loads(runs: Runs, cases: Sequence[PaperCase]) -> Figure:
    """Draw figures 7 and 8: (a) contact force, (b) driving torque, for several speeds or clearances."""
    drawn = panels(None, 2, size=(9.0, 5.6))
    curves = (
        ("contact force", [force_curve(runs[case], JOINT, normal=True) for case in cases]),
        ("driving torque", [torque_sources(runs[case])[0].curve for case in cases]),
    )
    by_speed = len({case.speed for case in cases}) > 1
    time = time_scale(runs[cases[0]])
    for axes, letter, (name, series) in zip(drawn, "ab", curves, strict=True):
        scale = Scale(1e-3, KILO[series[0].units])
        # a larger clearance is lighter, as in all pictures
        colours = COLOURS if by_speed else shades(len(cases))[::-1]
        for case, curve, color in zip(cases, series, colours, strict=True):
            label = f"{case.rpm} rpm" if by_speed else case.words
            compare(axes, name, curve, None, scale=scale, time=time, color=color, labels=(label, ""))
        axes.set_title(f"({letter}) {name}", loc="left", fontsize=normal())
    finish_time_axes(drawn, runs[cases[0]], time)
    legend(drawn, above=True)
    return figure_of(drawn)


def draw_orbits(runs: Runs, cases: Sequence[PaperCase]) -> Figure:
    """Draw figures 9, 11 and 13: the orbit of the journal in the bearing."""

    def paint(axes: Axes, case: PaperCase) -> str:
        # a constrained contact has no indentation but round-off, which must not be magnified
        path = draw_orbit(axes, runs[case], JOINT, 1.0 if case.constrained else None)
        draw_scale_bar(axes, factor=path.scale.factor)
        return path.title.partition(", ")[2]

    figure = _panel_by_case(cases, paint)
    write_time_bar(figure.axes, runs[cases[0]])
    return figure


def draw_scatter(runs: Runs, cases: Sequence[PaperCase]) -> Figure:
    """Draw figures 10 and 12: slider acceleration over slider velocity, with the line of the ideal mechanism.

    The paper calls them Poincaré maps. Over one stroke at constant speed they are scatter plots of samples: there is no period
    for a map. All have the same axes.
    """
    scale = engineering("m/s^2", *(runs[case]["slider_acceleration"].values for case in cases))
    shown = np.concatenate([scale.factor * runs[case]["slider_acceleration"].values for case in cases])
    margin = 0.05 * float(np.ptp(shown))

    def paint(axes: Axes, case: PaperCase) -> str:
        run, ideal = runs[case], runs[case.ideal]
        touching = run["in_contact"].sel(joint=JOINT).values.astype(bool)
        speed, acceleration = run["slider_velocity"].values, scale.factor * run["slider_acceleration"].values
        # in free flight only gravity acts on the slider: all of these points are on one line, drawn over the others
        for part, color, label in ((touching, VERMILION, "contact"), (~touching, BLUE, "free flight")):
            dots: dict[str, Any] = {
                "linestyle": "",
                "marker": "o",
                "markersize": 2.2,
                "markeredgewidth": 0.0,
                "color": color,
                "label": label,
            }
            axes.plot(speed[part], acceleration[part], **dots)
        smooth = ideal["slider_velocity"].values, scale.factor * ideal["slider_acceleration"].values
        axes.plot(*smooth, label="ideal joints", **IDEAL)
        axes.set(xlabel="slider velocity [m/s]", ylabel=scale.label("slider acceleration"))
        axes.set_ylim(float(np.min(shown)) - margin, float(np.max(shown)) + margin)
        return ""

    return _panel_by_case(cases, paint)


def _panel_by_case(cases: Sequence[PaperCase], paint: Callable[[Axes, PaperCase], str]) -> Figure:
    """Draw a panel for each case with the function `paint`, lettered as in the paper, under one legend."""
    columns = 3 if len(cases) > 4 else 4
    rows = -(-len(cases) // columns)
    drawn = panels(None, rows, columns, size=(9.0, 0.5 + (9.0 / columns + 0.3) * rows), share=False)
    for axes, case, letter in zip(drawn, cases, "abcdef", strict=False):
        note = paint(axes, case)
        axes.set_title(f"({letter}) {case.words}" + (f", {note}" if note else ""), loc="left", fontsize=normal())
        place = axes.get_subplotspec()
        if place is not None:
            axes.yaxis.label.set_visible(place.is_first_col())
            axes.xaxis.label.set_visible(place.is_last_row())
    legend(drawn, above=True)
    return figure_of(drawn)
