"""The style of all pictures: colours, lines, panels and legends, set on the Axes; sizes for a column, a page or slides."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, ExitStack
from textwrap import wrap
from typing import TYPE_CHECKING, Any, TypeAlias

from scissordyn.errors import InputError, did_you_mean, printable

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.legend import Legend

# Colours that are distinguishable with common colour blindness: Wong 2011, doi:10.1038/nmeth.1618.
BLUE, VERMILION, GREEN, ORANGE, SKY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7"
BLACK, GREY, LIGHT = "#222222", "#767676", "#E4E4E4"

LINE = 1.0  # Width of a curve [pt]

SMALL, NORMAL = 0.8, 0.9
"""Letters of ticks and legends, and of labels, as a fraction of matplotlib's size: 8 and 9 pt of its 10 pt."""

IDEAL: dict[str, Any] = {"color": BLACK, "linewidth": LINE, "linestyle": (0, (4, 3)), "zorder": 3.0}
"""Style of curves of the ideal mechanism: dashed and on top, so that both curves are visible where they agree."""

AXES = ((("x", 1), ("y", 1)), (("y", -1), ("x", 1)), (("x", -1), ("y", -1)), (("y", 1), ("x", -1)))
"""Coordinates along and up a picture, and their signs, after 0 to 3 quarter turns."""

LETTER, SHORTEST = 0.58, 8  # Width of a letter of their size, and fewest letters of a line that is broken
ENTRY = 0.18  # Largest width of an entry of a legend, for each point of the letters' size [inch]
BESIDE, EACH = 0.072, 0.0075  # Width of an entry beside its text, and of each letter, over the size of the letters [in/pt]
COLUMN = 5.0  # Width of new figures [inch] below which few panels stand beside each other
NARROW = 4.2  # Width of Axes [inch] below which a legend does not stand beside them

TEX = str.maketrans(
    {
        **{sign: f"\\{sign}" for sign in "$%&#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
    }
)
"""How LaTeX writes signs that mean something to it."""

STYLES = {
    "screen": ((6.4, 4.8), 10.0),
    "single-column": ((3.54, 2.6), 8.75),
    "double-column": ((7.48, 3.6), 8.75),
    "slides": ((10.0, 5.6), 18.0),
}
"""Width and height of figures [inch] and size of letters [pt]; those of a screen are matplotlib's own. Columns are 90 and
190 mm wide, as most journals of mechanics have them; letters are then 7 pt (ticks, legends) and 8 pt (labels) in print."""

Canvas: TypeAlias = "Axes | Iterable[Axes] | None"  # Target of a picture: one Axes, several, or None for a new figure


def style(name: str = "screen", **parameters: Any) -> AbstractContextManager[object]:
    """Set the size of new pictures and of their letters, for the rest of a program or in a ``with`` block.

    ``with sd.style("single-column"): sd.plot.force(run)``. Pictures follow matplotlib's rcParams: figure.figsize (of pictures
    with several rows of panels its width), font.size, font.family, axes.labelsize, xtick.labelsize, text.usetex.

    Parameters
    ----------
    name : str
        "screen", "single-column" (90 mm), "double-column" (190 mm) or "slides".
    **parameters
        Further rcParams, with underscores in place of dots: ``font_family="serif"``, ``text_usetex=True``.

    Returns
    -------
    context manager
        At its end the parameters are as before.

    Raises
    ------
    InputError
        For an unknown style or parameter, or a value that matplotlib refuses.
    """
    import matplotlib as mpl

    if name not in STYLES:
        raise InputError(f"style '{name}'{did_you_mean(name, STYLES)}", ", ".join(STYLES), 'sd.style("single-column")')
    current: Any = mpl.rcParams  # its keys are annotated one by one
    by_word = {parameter.replace(".", "_"): parameter for parameter in current}
    chosen = dict(zip(("figure.figsize", "font.size"), STYLES[name], strict=True))
    for word, value in parameters.items():
        if word not in by_word:
            raise InputError(f"style: {word}{did_you_mean(word, by_word)}", "rcParams of matplotlib", 'font_family="serif"')
        chosen[by_word[word]] = value
    before = {parameter: current[parameter] for parameter in chosen}
    try:
        mpl.RcParams(chosen)
    except ValueError as error:
        raise InputError(f"style: {error}", "what matplotlib allows", 'sd.style("single-column")') from None
    current.update(chosen)
    restoring = ExitStack()
    restoring.callback(current.update, before)
    return restoring


def literal(name: str) -> str:
    r"""A name of the user's as text of a picture: no sign of it begins a formula, and control characters are made visible."""
    from matplotlib import rcParams

    shown = printable(name)
    return shown.translate(TEX) if rcParams["text.usetex"] else shown.replace("$", r"\$")


def small() -> float:
    """Size of the letters of ticks and legends [pt], from matplotlib's rcParams."""
    return _letters("xtick.labelsize", SMALL)


def normal() -> float:
    """Size of the letters of labels and titles [pt], from matplotlib's rcParams."""
    return _letters("axes.labelsize", NORMAL)


def _letters(parameter: str, fraction: float) -> float:
    """The size that a user gives, or else a fraction of the size of all letters."""
    from matplotlib import rcParams, rcParamsDefault
    from matplotlib.font_manager import FontProperties

    chosen: Any = rcParams  # its keys are annotated one by one
    usual: Any = rcParamsDefault
    value = chosen[parameter]
    if value == usual[parameter]:
        return float(fraction * rcParams["font.size"])
    return float(FontProperties(size=value).get_size_in_points())


def in_lines(text: str, inches: float, letters: float) -> str:
    """A text in as many lines as it takes to keep within a width."""
    fitting = int(inches * 72.0 / (LETTER * letters))
    return text if len(text) <= fitting else "\n".join(wrap(text, max(fitting, SHORTEST), break_long_words=False))


def figure_size(width: float, height: float, rows: int = 2) -> tuple[float, float]:
    """Width and height of a new figure: those of matplotlib's rcParams, where the user has changed them."""
    from matplotlib import rcParams, rcParamsDefault

    size = list(rcParams["figure.figsize"])
    if size == list(rcParamsDefault["figure.figsize"]):
        return width, height
    return (size[0], size[1]) if rows == 1 else (size[0], height * (size[0] / width) ** 0.6)


def figure_width() -> float:
    """Width of a new figure that the user has chosen [inch]; infinite without a choice."""
    return figure_size(math.inf, 1.0, 1)[0]


def is_column() -> bool:
    """Whether new figures are as narrow as the column of a page."""
    return figure_width() < COLUMN


def label_axes(axes: Axes, turns: int) -> None:
    """Name the axes of a drawing that is turned, and number them in the coordinates of the mechanism."""
    (across, first), (up, second) = AXES[turns % 4]
    axes.set(xlabel=f"{across} [m]", ylabel=f"{up} [m]")
    for axis, sign in ((axes.xaxis, first), (axes.yaxis, second)):
        if sign < 0:
            axis.set_major_formatter(lambda value, place: f"{0.0 - value:.6g}".replace("-", "\N{MINUS SIGN}"))


def dress(axes: Axes) -> None:
    axes.grid(visible=True, color=LIGHT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=small(), color=GREY, labelcolor=BLACK, width=0.6, length=3.0)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set(color=GREY, linewidth=0.6)
    for label in (axes.xaxis.label, axes.yaxis.label, axes.title):
        label.set(fontsize=normal(), color=BLACK)


def panels(
    canvas: Canvas,
    rows: int,
    columns: int = 1,
    *,
    size: tuple[float, float],
    ratios: Sequence[float] | None = None,
    share: bool = True,
) -> list[Axes]:
    """The Axes to draw on, in the style of the package: those given, or the panels of a new figure."""
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    if canvas is None:
        figure = Figure(figsize=figure_size(*size, rows), layout="constrained")
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
    """A legend of all labelled artists, each label once."""
    entries: dict[str, Artist] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if not entries:
        return None
    letters = small()
    look: dict[str, Any] = {"fontsize": letters, "frameon": False, "handlelength": 2.2}
    handles, labels = list(entries.values()), list(entries)
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    narrow = figure.get_figwidth() * axes[0].get_position().width < NARROW
    alone = {id(panel) for panel in figure.axes} <= {id(panel) for parent in axes for panel in (parent, *parent.child_axes)}
    if narrow and not alone and figure.get_layout_engine():  # its room is taken from the panel, not from the curves
        columns = int(figure.get_figwidth() * axes[0].get_position().width / (ENTRY * letters)) or 1
        look |= {"borderaxespad": 0.2, "columnspacing": 1.2}
        return axes[0].legend(handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, **look)
    if (above or narrow) and not (alone and figure.get_layout_engine()):
        return axes[0].legend(handles, labels, loc="best", **{**look, "frameon": True, "framealpha": 0.8, "edgecolor": "none"})
    if above or narrow:
        longest = max(map(len, labels))
        columns = int(figure.get_figwidth() / (max(ENTRY, BESIDE + EACH * longest) * letters)) or 1
        return figure.legend(handles, labels, loc="outside upper left", ncols=columns, **look)
    return axes[0].legend(handles, labels, loc="upper left", bbox_to_anchor=(1.0, 1.03), borderaxespad=0.0, **look)
