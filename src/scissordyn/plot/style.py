"""The style of all pictures: colours, lines, panels and legends, set on the Axes and never globally."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from scissordyn.errors import InputError, printable

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.legend import Legend

__all__ = [
    "BLACK",
    "BLUE",
    "GREEN",
    "GREY",
    "IDEAL",
    "LIGHT",
    "LINE",
    "NORMAL",
    "ORANGE",
    "PURPLE",
    "SKY",
    "SMALL",
    "VERMILION",
    "Canvas",
    "dress",
    "label_axes",
    "legend",
    "literal",
    "panels",
]

# Colours that are distinguishable with common colour blindness: Wong 2011, doi:10.1038/nmeth.1618.
BLUE, VERMILION, GREEN, ORANGE, SKY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7"
BLACK, GREY, LIGHT = "#222222", "#767676", "#E4E4E4"

LINE = 1.0
"""Width of a curve [pt]."""

SMALL, NORMAL = 8.0, 9.0
"""Sizes of letters [pt]: ticks and legends, labels."""

IDEAL: dict[str, Any] = {"color": BLACK, "linewidth": LINE, "linestyle": (0, (4, 3)), "zorder": 3.0}
"""Style of curves of the ideal mechanism: dashed and on top, so that both curves are visible where they agree."""

AXES = ((("x", 1), ("y", 1)), (("y", -1), ("x", 1)), (("x", -1), ("y", -1)), (("y", 1), ("x", -1)))
"""Coordinates along and up a picture, and their signs, after 0 to 3 quarter turns."""

ENTRY = 1.45
"""Largest width of an entry of a legend [inch]."""

Canvas: TypeAlias = "Axes | Iterable[Axes] | None"
"""Target of a picture: one Axes, several, or None for a new figure."""


def literal(name: str) -> str:
    r"""A name of the user's as text of a picture: a dollar sign begins no formula, and control characters are made visible.

    Parameters
    ----------
    name : str
        May hold any character.

    Returns
    -------
    str
        With "\$" in place of "$", which matplotlib draws as "$".
    """
    return printable(name).replace("$", r"\$")


def label_axes(axes: Axes, turns: int) -> None:
    """Name the axes of a drawing that is turned, and number them in the coordinates of the mechanism."""
    (across, first), (up, second) = AXES[turns % 4]
    axes.set(xlabel=f"{across} [m]", ylabel=f"{up} [m]")
    for axis, sign in ((axes.xaxis, first), (axes.yaxis, second)):
        if sign < 0:
            axis.set_major_formatter(lambda value, place: f"{0.0 - value:.6g}".replace("-", "\N{MINUS SIGN}"))


def dress(axes: Axes) -> None:
    """Apply the style of the package to Axes.

    Parameters
    ----------
    axes : Axes
    """
    axes.grid(visible=True, color=LIGHT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=SMALL, color=GREY, labelcolor=BLACK, width=0.6, length=3.0)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set(color=GREY, linewidth=0.6)
    for label in (axes.xaxis.label, axes.yaxis.label, axes.title):
        label.set(fontsize=NORMAL, color=BLACK)


def panels(
    canvas: Canvas,
    rows: int,
    columns: int = 1,
    *,
    size: tuple[float, float],
    ratios: Sequence[float] | None = None,
    share: bool = True,
) -> list[Axes]:
    """The Axes to draw on, in the style of the package: those given, or the panels of a new figure.

    Parameters
    ----------
    canvas : Axes, iterable of Axes or None
    rows, columns : int
        Number of rows and columns; given Axes are taken row by row.
    size : (float, float)
        Width and height of a new figure [inch].
    ratios : sequence of float, optional
        Relative heights of the rows of a new figure.
    share : bool
        Whether the panels of a column of a new figure share their x axis.

    Returns
    -------
    list of Axes

    Raises
    ------
    InputError
        If Axes are given, but not as many as there are panels.
    """
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    if canvas is None:
        figure = Figure(figsize=size, layout="constrained")
        chosen = list(
            figure.subplots(rows, columns, squeeze=False, sharex="col" if share else False, height_ratios=ratios).flat
        )
    else:
        chosen = [canvas] if isinstance(canvas, Axes) else list(canvas)
    if len(chosen) != rows * columns:
        raise InputError(f"{len(chosen)} Axes for a picture of {rows * columns} panels", f"{rows * columns} Axes, or none")
    for axes in chosen:
        dress(axes)
    return chosen


def legend(axes: Sequence[Axes], *, above: bool = False) -> Legend | None:
    """A legend of all labelled artists, each label once, outside the curves.

    Parameters
    ----------
    axes : sequence of Axes
        Axes of the artists.
    above : bool
        Whether it is across the top of the figure; otherwise to the right of the first Axes.

    Returns
    -------
    Legend or None
        None if nothing has a label.
    """
    found: dict[str, Artist] = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if not found:
        return None
    look: dict[str, Any] = {"fontsize": SMALL, "frameon": False, "handlelength": 2.2}
    handles, labels = list(found.values()), list(found)
    figure = axes[0].get_figure(root=True)
    if above and figure is not None:
        columns = int(figure.get_figwidth() / ENTRY) or 1
        return figure.legend(handles, labels, loc="outside upper left", ncols=columns, **look)
    return axes[0].legend(handles, labels, loc="upper left", bbox_to_anchor=(1.0, 1.03), borderaxespad=0.0, **look)
