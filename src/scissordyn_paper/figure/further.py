"""Figures beyond the paper: true maps, a bifurcation diagram, torques of control, distributions over contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from scissordyn.analysis.scatter import velocity_acceleration
from scissordyn.plot.file import figure_of
from scissordyn.plot.regularity import bifurcation, stroboscopic_map
from scissordyn.plot.regularity import velocity_acceleration as scatter
from scissordyn.plot.style import (
    BLUE,
    GREEN,
    GREY,
    IDEAL,
    LINE_WIDTH,
    ORANGE,
    VERMILION,
    legend,
    normal,
    number_decades,
    panels,
    small,
)
from scissordyn_paper.cases import ARRAY_CLEARANCE, CLEARANCES, CONTROLLED, FRICTION, PaperCase
from scissordyn_paper.controlled import MANOEUVRES, ControlledRun
from scissordyn_paper.measures import JOINT
from scissordyn_paper.periodic import regularity_of

COLOURS = (VERMILION, BLUE, GREEN, ORANGE)


def draw_maps(
    runs: Mapping[PaperCase, xr.Dataset], settled: Mapping[PaperCase, xr.Dataset], cases: Sequence[PaperCase]
) -> Figure:
    """Draw the paper's picture of the stroke of each case, and below it the map once in each period of the drive."""
    columns = 3 if len(cases) > 4 else 4
    rows = 2 * -(-len(cases) // columns)
    drawn = panels(None, rows, columns, size=(9.0, 2.6 * rows), share=False)
    strokes, maps = [], []
    for k, case in enumerate(cases):
        row, column = divmod(k, columns)
        above, below = (drawn[(2 * row + place) * columns + column] for place in (0, 1))
        stroke = PaperCase(case.clearance, friction=case.friction)
        ideal = velocity_acceleration(runs[stroke.ideal])
        scatter(velocity_acceleration(runs[stroke]), ideal, axes=above)
        own = above.get_legend()
        if own is not None:
            own.remove()
        above.set_title(f"{case.words}: stroke", loc="left", fontsize=normal())
        stroboscopic_map(settled[case], x="slider_velocity", y="slider_acceleration", axes=below)
        below.set(xlabel="velocity [m/s]", ylabel="acceleration [m/s²]")
        below.set_title(_sentence(regularity_of(settled[case]).name), loc="left", fontsize=normal())
        for axes in (above, below):
            axes.xaxis.set_major_locator(MaxNLocator(3))
            if column:
                axes.set_ylabel("")
        strokes.append(above)
        maps.append(below)
    for alike in (strokes, maps):
        _share_limits(alike, margin=0.05)
    # the same range for all, otherwise the round-off of a periodic motion would fill its panel
    widths = [axes.get_xlim() for axes in maps]
    half = 0.55 * max(high - low for low, high in widths)
    for axes, (low, high) in zip(maps, widths, strict=True):
        axes.set_xlim(0.5 * (low + high) - half, 0.5 * (low + high) + half)
    legend(drawn, above=True)
    return figure_of(drawn)


def draw_bifurcation(diagram: xr.Dataset) -> Figure:
    """Draw the speed of the slider and the position of the journal once a period, over the clearance."""
    drawn = panels(None, 2, size=(9.0, 6.4))
    # in clearances, which removes the proportionality to the clearance
    relative = diagram["eccentricity"] / diagram["value"]
    relative.attrs = {"units": "1", "long_name": "eccentricity over clearance"}
    bifurcation(diagram, variable="slider_velocity", axes=drawn[0])
    bifurcation(
        diagram.assign(eccentricity=relative.transpose(*diagram["eccentricity"].dims)), variable="eccentricity", axes=drawn[1]
    )
    drawn[0].set_xlabel("")
    drawn[1].set_xlabel("radial clearance [mm]")
    drawn[1].set_ylabel("x of the journal over the clearance")
    for axes in drawn:
        for clearance in CLEARANCES:
            axes.axvline(1e3 * clearance, color=GREY, linewidth=0.6, linestyle=":", zorder=0.5)
    return figure_of(drawn)


def draw_torques(runs: Mapping[PaperCase, xr.Dataset], controlled: Mapping[ControlledRun, xr.Dataset]) -> Figure:
    """Draw torques with the paper's control and other control schemes, without control, and of the ideal mechanism."""
    drawn = panels(None, 4, size=(9.0, 10.0), share=False)
    ideal = runs[PaperCase(None)]
    stroke, difference, deployment, delayed = drawn

    milli = 1e3 * ideal["time"].values
    for label, case, color in (
        ("concentric start, no control", PaperCase(ARRAY_CLEARANCE), BLUE),
        ("constrained contact", PaperCase(ARRAY_CLEARANCE, constrained=True), VERMILION),
    ):
        stroke.plot(milli, 1e-3 * runs[case]["drive_torque"].values, color=color, linewidth=LINE_WIDTH, label=label)
    stroke.plot(milli, 1e-3 * ideal["drive_torque"].values, label="ideal joints", **IDEAL)
    stroke.set(ylabel="torque [kN·m]", xlabel="time [ms]")
    stroke.set_title(f"(a) stroke, {1e3 * ARRAY_CLEARANCE:g} mm", loc="left", fontsize=normal())

    for size, color in zip(CONTROLLED, COLOURS, strict=True):
        more = runs[PaperCase(size, constrained=True)]["drive_torque"].values - ideal["drive_torque"].values
        difference.plot(milli, more, color=color, linewidth=LINE_WIDTH, label=f"{1e3 * size:g} mm")
    difference.set(ylabel="torque [N·m]", xlabel="time [ms]")
    difference.set_title("(b) constrained contact: torque above that of ideal joints", loc="left", fontsize=normal())

    wanted = controlled[ControlledRun("deployment", "ideal")]
    driven = controlled[ControlledRun("deployment", "prescribed")]
    steered = controlled[ControlledRun("deployment", "feed-forward, feedback")]
    for label, run, name, color in (
        ("prescribed", driven, "drive_torque", BLUE),
        ("feed-forward, feedback", steered, "control_torque", VERMILION),
    ):
        torque = run[name].values.reshape(run.sizes["time"], -1).sum(axis=1)
        deployment.plot(run["time"].values, torque, color=color, linewidth=LINE_WIDTH, label=label)
    deployment.plot(wanted["time"].values, wanted["drive_torque"].values, label="ideal joints", **IDEAL)
    deployment.set(ylabel="torque [N·m]", xlabel="time [s]")
    deployment.set_title(f"(c) {MANOEUVRES['deployment'].title}", loc="left", fontsize=normal())

    for label, scheme, color in (("pyragas", "pyragas", BLUE), ("extended", "extended", VERMILION)):
        run = controlled[ControlledRun("periodic", scheme)]  # type: ignore[arg-type]
        delayed.plot(run["time"].values, run["control_torque"].values[:, 1], color=color, linewidth=0.7, label=label)
    delayed.set(ylabel="torque [N·m]", xlabel="time [s]")
    delayed.set_title("(d) periodic drive: torque of the delayed feedback alone", loc="left", fontsize=normal())
    for axes in drawn:
        axes.margins(x=0.0)
        legend([axes])
    figure = figure_of(drawn)
    figure.align_ylabels(drawn)
    return figure


def draw_contacts(runs: Mapping[PaperCase, xr.Dataset]) -> Figure:
    """Draw the peak force and the impulse of every contact, by clearance and by friction coefficient."""
    drawn = panels(None, 2, 2, size=(9.0, 6.0), share=False)
    groups = (
        ("clearance [mm]", [(f"{1e3 * size:g}", PaperCase(size)) for size in CLEARANCES]),
        ("friction coefficient", [(f"{friction:g}", PaperCase(friction=friction)) for friction in FRICTION]),
    )
    shown = (("peak_force", 1e-3, "peak force of a contact [kN]"), ("impulse", 1.0, "impulse of a contact [N·s]"))
    for row, (variable, factor, label) in enumerate(shown):
        for column, (title, cases) in enumerate(groups):
            axes = drawn[2 * row + column]
            for k, (_, case) in enumerate(cases):
                run = runs[case]
                values = factor * run[variable].values[run["contact_joint"].values.astype(str) == JOINT]
                values = values[np.isfinite(values) & (values > 0.0)]
                # horizontal offset in the order of time, so that equal values do not overlap
                across = k + np.linspace(-0.25, 0.25, values.size)
                axes.plot(
                    across,
                    values,
                    linestyle="",
                    marker="o",
                    markersize=3.2,
                    markeredgewidth=0.0,
                    color=BLUE,
                    label="one contact, in the order of time",
                )
                axes.plot([k - 0.35, k + 0.35], [np.median(values)] * 2, color=VERMILION, linewidth=1.6, label="median")
            axes.set_yscale("log")
            number_decades(axes.yaxis)
            axes.set_xticks(range(len(cases)), [name for name, _ in cases], fontsize=small())
            axes.grid(visible=False, axis="x")
            axes.set_xlabel(title if row else "")
            axes.set_ylabel("" if column else label)
        _share_limits(drawn[2 * row : 2 * row + 2])
    legend(drawn, above=True)
    return figure_of(drawn)


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:]


def _share_limits(axes: Sequence[Axes], *, margin: float = 0.0) -> None:
    low, high = (choose(one.get_ylim()[side] for one in axes) for side, choose in ((0, min), (1, max)))
    for one in axes:
        one.set_ylim(low - margin * (high - low), high + margin * (high - low))
