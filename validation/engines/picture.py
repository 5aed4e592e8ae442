"""Pictures of the comparison of engines, drawn from the tables of its page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from scissordyn.plot.file import figure_of
from scissordyn.plot.label import Label, write_labels
from scissordyn.plot.style import BLACK, BLUE, GREY, LINE_WIDTH, VERMILION, apply_layout, number_decades, panels, small

OURS = "scissordyn"
CODES = ("siconos", "scissordyn, located", "scissordyn, crossed")
# Order of the dotted line of a code, and its error at the longest step as a fraction of the code's
ORDERS = {"siconos": (1, 0.3), "scissordyn, located": (2, 0.1)}


def sections(page: str) -> dict[str, str]:
    """Return the sections of a page by heading; the text before the first heading is left out."""
    parts = [part.partition("\n") for part in page.split("\n## ")[1:]]
    return {heading.strip(): text for heading, _, text in parts}


def table_rows(section: str) -> list[list[str]]:
    """Return the cells of each line of the tables of a section, with their heads."""
    return [[cell.strip() for cell in line[1:-1].split("|")] for line in section.splitlines() if line.startswith("| ")]


def draw(page: str, folder: Path) -> None:
    """Draw engines.png and engines-order.png in a folder, from the tables of the page of measurements."""
    *mechanisms, order = sections(page).items()
    errors = draw_errors({heading: table_rows(text) for heading, text in mechanisms})
    for figure, name in ((errors, "engines"), (draw_order(table_rows(order[1])), "engines-order")):
        figure.savefig(folder / f"{name}.png", dpi=110, metadata={"Software": ""})


def marks(rows: list[list[str]]) -> dict[str, dict[str, tuple[float, float]]]:
    """Return time [s] and angle error [rad] by engine and setting, without the rows that have no numbers."""
    found: dict[str, dict[str, tuple[float, float]]] = {}
    for engine, setting, _, _, angle, seconds, _ in rows[2:]:  # below the head and its rule
        if angle and seconds:
            found.setdefault(engine, {})[setting] = float(seconds), float(angle)
    return found


def draw_errors(tables: dict[str, list[list[str]]]) -> Figure:
    """Draw the angle error over the computing time of each engine, in a panel for each mechanism."""
    drawn = panels(None, 2, 2, size=(11.0, 12.0), share=False)
    figure = figure_of(drawn)
    known = {heading: marks(rows) for heading, rows in tables.items()}
    # an engine without energies computes positions only
    positions = {row[0] for rows in tables.values() for row in rows[2:] if row[4] and not row[3]}
    for axes, (heading, found) in zip(drawn, known.items(), strict=True):
        _draw_marks(axes, found, positions)
        axes.set_title(heading)
        axes.set(xlabel="computing time [s]", ylabel="largest error of an angle [rad]")
    look = {"linestyle": "", "markersize": 6.0, "color": BLACK}
    handles = [
        Line2D([], [], marker="o", label="careful settings", **look),
        Line2D([], [], marker="o", alpha=0.3, label="default settings", **look),
        Line2D([], [], marker="s", label="positions only: the motion of the first body is given", **look),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=3, frameon=False, fontsize=small())
    apply_layout(figure)
    for axes, found in zip(drawn, known.values(), strict=True):
        last = {name: np.array(list(settings.values())[-1]) for name, settings in found.items()}  # careful, if there is one
        places = sorted(last.items(), key=lambda item: -item[1][1])
        write_labels(axes, [Label(name, place, _colour(name)) for name, place in places])
    return figure


def _colour(name: str) -> str:
    return VERMILION if name == OURS else BLACK


def _draw_marks(axes: Axes, found: dict[str, dict[str, tuple[float, float]]], positions: set[str]) -> None:
    """Draw the marks of the settings of each engine with the line between them, and set the limits."""
    for name, settings in found.items():
        look = {"color": _colour(name), "linestyle": "", "marker": "s" if name in positions else "o", "markersize": 5.0}
        look |= {"markersize": 8.0, "zorder": 5.0} if name == OURS else {}
        axes.plot(*zip(*settings.values(), strict=True), color=_colour(name), linewidth=0.6, alpha=0.3)
        for setting, place in settings.items():
            faint = setting == "default" and "careful" in settings
            axes.plot(*place, **{**look, "alpha": 0.3 if faint else 1.0})
    axes.set(xscale="log", yscale="log")
    axes.margins(0.08)
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    for axis in (axes.xaxis, axes.yaxis):
        number_decades(axis)
    axes.minorticks_off()


def draw_order(rows: list[list[str]]) -> Figure:
    """Draw the angle error of the pendulum with rigid contact over the step size, with lines of order 1 and 2."""
    (axes,) = drawn = panels(None, 1, size=(6.8, 4.4))
    beside: dict[str, Any] = {"textcoords": "offset points", "fontsize": small()}
    for name, colour, marker in zip(CODES, (BLACK, VERMILION, BLUE), "so^", strict=True):
        points = [[float(row[1]), float(row[2])] for row in rows if row[0] == name and row[2]]
        if not points:  # not installed
            continue
        steps, errors = np.array(points).T
        axes.plot(steps, errors, marker=marker, markersize=5.0, color=colour, linewidth=LINE_WIDTH)
        axes.annotate(name, (steps[-1], errors[-1]), (8.0, -2.0), va="top", color=colour, **beside)
        if name in ORDERS:
            order, part = ORDERS[name]
            line = part * errors[0] * (steps / steps[0]) ** order
            axes.plot(steps, line, color=GREY, linewidth=LINE_WIDTH, linestyle=":")
            axes.annotate(f"order {order}", (steps[1], line[1]), (6.0, -4.0), va="top", color=GREY, **beside)
    axes.set(xscale="log", yscale="log", xlabel="step size [s]", ylabel="error of the angle after 0.5 s [rad]")
    return figure_of(drawn)
