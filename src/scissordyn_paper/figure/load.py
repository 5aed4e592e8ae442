"""Figures 7 and 8: contact force and driving torque for several speeds or clearances, one above the other."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import xarray as xr
from matplotlib.figure import Figure

from scissordyn.plot.contact import force_curve, torque_sources
from scissordyn.plot.file import figure_of
from scissordyn.plot.scale import Scale
from scissordyn.plot.series import compare, finish, time_scale
from scissordyn.plot.style import BLUE, GREEN, VERMILION, legend, normal, panels
from scissordyn_paper.cases import SIZES, SPEEDS, PaperCase
from scissordyn_paper.measures import JOINT

COLOURS = (BLUE, VERMILION, GREEN)

KILO = {"N": "kN", "N m": "kN·m"}
"""The forces of these runs are tens of kilonewtons; their largest values would give an inconvenient scale."""

BY_SPEED = tuple(PaperCase(speed=speed) for speed in reversed(SPEEDS))
BY_CLEARANCE = tuple(PaperCase(clearance) for clearance in SIZES)


def draw(runs: Mapping[PaperCase, xr.Dataset], cases: Mapping[PaperCase, str]) -> Figure:
    """Two panels: (a) contact force, (b) driving torque."""
    drawn = panels(None, 2, size=(9.0, 5.6))
    curves = (
        ("contact force", {case: force_curve(runs[case], JOINT, normal=True) for case in cases}),
        ("driving torque", {case: torque_sources(runs[case])[0].curve for case in cases}),
    )
    time = time_scale(runs[next(iter(cases))])
    for axes, letter, (name, series) in zip(drawn, "ab", curves, strict=True):
        scale = Scale(1e-3, KILO[next(iter(series.values())).attrs["units"]])
        for (case, one), color in zip(series.items(), COLOURS, strict=True):
            compare(axes, name, one, None, scale=scale, time=time, color=color, labels=(cases[case], ""))
        axes.set_title(f"({letter}) {name}", loc="left", fontsize=normal())
    finish(drawn, runs[next(iter(cases))], time)
    legend(drawn, above=True)
    return figure_of(drawn)


draw_by_speed = partial(draw, cases={case: f"{case.rpm} rpm" for case in BY_SPEED})
draw_by_clearance = partial(draw, cases={case: f"c = {1e3 * (case.clearance or 0.0):g} mm" for case in BY_CLEARANCE})
