"""Common parts of figures with one panel per run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.plot.file import figure_of
from scissordyn.plot.style import legend, normal, panels
from scissordyn_paper.cases import PaperCase


def in_words(case: PaperCase) -> str:
    """Label of a case within its figure."""
    return f"c = {1e3 * (case.clearance or 0.0):g} mm" if case.friction is None else f"friction {case.friction:g}"


def panel_by_case(
    runs: Mapping[PaperCase, xr.Dataset], cases: Sequence[PaperCase], paint: Callable[[Axes, PaperCase], str], *, columns: int
) -> Figure:
    """A panel for each case, lettered as in the paper, under one legend."""
    rows = -(-len(cases) // columns)
    drawn = panels(None, rows, columns, size=(3.5 * columns, 0.5 + 3.3 * rows), share=False)
    for axes, case, letter in zip(drawn, cases, "abcdef", strict=False):
        note = paint(axes, case)
        title = f"({letter}) {in_words(case)}" + (f", {note}" if note else "")
        axes.set_title(title, loc="left", fontsize=normal())
        for side, label in (("left", axes.yaxis), ("bottom", axes.xaxis)):
            place = axes.get_subplotspec()
            if place is not None and not (place.is_first_col() if side == "left" else place.is_last_row()):
                label.label.set_visible(False)
    legend(drawn, above=True)
    return figure_of(drawn)
