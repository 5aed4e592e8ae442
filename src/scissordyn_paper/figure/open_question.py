"""Figures on the open question: effects of flexible bars and of oil in the joint, and orbits of the journal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from scissordyn.plot.file import figure_of
from scissordyn.plot.style import normal, number_decades, panels
from scissordyn_paper.open_change import Change
from scissordyn_paper.open_question import BARS, COMPARED, OILS, OpenCase

COLOURS = {"stroke": "#0072b2", "deployment": "#d55e00"}  # Colour of each manoeuvre

DRAWN_RATIO_MIN = 1e-3  # Smallest ratio on the axis; smaller and negative ratios are drawn there, with another marker


def draw_ratios(answers: Sequence[Change]) -> Figure:
    """Draw the ratios of measures with and without each change: a row per change, a panel per measure, a dot per pair."""
    names = list(dict.fromkeys(one.what for one in answers))
    columns = 3
    rows = -(-len(COMPARED) // columns)
    drawn = panels(None, rows, columns, size=(10.0, (1.2 + 0.32 * len(names)) * rows), share=False)
    for spare in drawn[len(COMPARED) :]:
        spare.remove()
    for column, (axes, (measure, title)) in enumerate(zip(drawn, COMPARED.items(), strict=False)):
        for one in answers:
            if one.measure != measure or not one.ratios:
                continue
            up = names.index(one.what) + (0.16 if one.manoeuvre == "stroke" else -0.16)
            ratios = np.maximum(np.array(one.ratios), DRAWN_RATIO_MIN)
            below = np.array(one.ratios) < DRAWN_RATIO_MIN
            colour = COLOURS[one.manoeuvre]
            axes.plot(ratios[~below], np.full(int(np.sum(~below)), up), "o", ms=3.0, alpha=0.5, mew=0.0, color=colour)
            axes.plot(ratios[below], np.full(int(np.sum(below)), up), "<", ms=4.0, mew=0.0, color=colour)
            axes.plot([max(float(np.median(one.ratios)), DRAWN_RATIO_MIN)] * 2, [up - 0.13, up + 0.13], color=colour, lw=1.5)
        axes.axvline(1.0, color="0.6", lw=0.8)
        axes.set_xscale("log")
        axes.set_title(title, loc="left", fontsize=normal())
        axes.set_yticks(range(len(names)), [] if column % columns else names)
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_xlabel("ratio to rigid and dry")
        number_decades(axes.xaxis)
    for name, colour in COLOURS.items():
        drawn[0].plot([], [], "o", color=colour, ms=4.0, label=name)
    figure = figure_of(drawn)
    figure.legend(*drawn[0].get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False)
    return figure


def draw_orbits(found: Mapping[OpenCase, xr.Dataset]) -> Figure:
    """Draw the orbits of the journal during the stroke, one panel for each kind of bars and joint, in clearances."""
    joints = None, *OILS
    drawn = panels(None, len(joints), len(BARS), size=(2.6 * len(BARS), 0.4 + 2.75 * len(joints)), share=False)
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    for k, axes in enumerate(drawn):
        case = OpenCase(bars=tuple(BARS)[k % len(BARS)], oil=joints[k // len(BARS)])
        place = found[case]["eccentricity"].values / case.clearance
        axes.plot(np.cos(turn), np.sin(turn), color="0.7", lw=0.8)
        axes.plot(place[:, 0], place[:, 1], color=COLOURS["stroke"], lw=0.7)
        axes.set_aspect("equal")
        axes.set(xlim=(-1.25, 1.25), ylim=(-1.25, 1.25), xticks=(-1, 0, 1), yticks=(-1, 0, 1))
        axes.set_title(f"{case.bars}, {case.joint}", loc="left", fontsize=normal())
    return figure_of(drawn)
