"""Common style of all pictures: colours, lines, panels and legends, and the sizes for a column, a page or slides."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from functools import cache
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from scissordyn.errors import InputError, did_you_mean, printable
from scissordyn.plot.scale import engineering
from scissordyn.units import checked

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

# Colours that remain distinguishable with common colour blindness: Wong 2011, doi:10.1038/nmeth.1618.
BLUE, VERMILION, GREEN, ORANGE, SKY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7"
BLACK, GREY, LIGHT = "#222222", "#767676", "#E4E4E4"

LINE_WIDTH = 1.0  # [pt] width of curves in all pictures

TIME_MAP = "plasma"  # Colour map for points or curves at successive instants
CLEARANCE_MAP = "viridis"  # Colour map for curves at successive clearances or other ordered values
OUTSIDE = VERMILION  # Colour of curves and points outside a tolerance or requirement


class Sizes(NamedTuple):
    """Sizes and numbers of what pictures and films show."""

    ring_diameter: float = 8.0  # [pt] largest diameter of the ring around a clearance joint
    bar_edge: float = 0.8  # [pt] width of the outline of bars
    caption_letters: int = 22  # [letters] largest number in a line below the panel of a joint
    legend_dot: float = 6.0  # [pt] size of dots in a legend, which may be larger than those in the picture
    symbol_radius: float = 0.03  # [-] radius of component symbols, as a fraction of the picture's longer side
    ordinate_length: float = 0.11  # [-] largest ordinate of a diagram, as a fraction of the mechanism's longer side
    magnified_clearance: float = 0.35  # [-] drawn clearance, as a fraction of the drawn journal radius or half block width
    channel_half_length: float = 1.7  # [half block widths] half the length of the drawn channel
    wheel_radius: float = 0.5  # [-] largest radius of a pulley over the wheel distance, and of one wheel over the symbol size
    figure_min: float = 6.0  # [inch] longer side of the figure of a mechanism without names
    names_max: int = 160  # [names] largest number in a preview; clearance joints, drives and components come first
    factors_max: int = 5  # [factors] largest number in response curves; the most important ones are drawn
    edged_points_max: int = 200  # [points] largest number of marked points that have a white edge
    bars: int = 30  # [bars] number in the histogram of a distribution
    logarithm_ratio: float = 30.0  # [-] ratio of largest to smallest value above which colours and axes are logarithmic
    png_dpi: int = 150  # [dots per inch] resolution of a PNG
    film_dpi: int = 100  # [dots per inch] resolution of a film's frames
    film_duration: float = 6.0  # [s] duration of a run at playback speed 1
    frames_max: int = 500  # [frames] largest number in the explorer; each shows contacts since the previous frame
    trail_frames: int = 12  # [frames] length of the journal's visible path in a GIF or MP4


SIZES = Sizes()  # Sizes and counts in all pictures and films

NO_BREAK_SPACE = "\u00a0"  # Blank at which a label is not wrapped to the next line

SCALE_BAR = "scale bar"  # Identifier that marks the matplotlib artists of a scale bar

IDEAL: dict[str, Any] = {"color": BLACK, "linewidth": LINE_WIDTH, "linestyle": (0, (4, 3)), "zorder": 3.0}
"""Line style of curves of the ideal mechanism: dashed and on top, so that both curves are visible where they agree."""

LATEX_ESCAPES = str.maketrans(
    {
        **{sign: f"\\{sign}" for sign in "$%&#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
    }
)
"""LaTeX commands for characters with a special meaning in LaTeX."""

STYLES = {
    "screen": ((6.4, 4.8), 10.0),
    "single-column": ((3.54, 2.6), 8.75),
    "double-column": ((7.48, 3.6), 8.75),
    "slides": ((10.0, 5.6), 18.0),
}
"""Width and height of figures [inch] and letter size [pt] of each picture style; "screen" has matplotlib's defaults.

Columns are 90 and 190 mm wide, as in most journals of mechanics; printed letters are then 7 pt (ticks, legends) and 8 pt
(labels).
"""

Canvas: TypeAlias = "Axes | Iterable[Axes] | None"  # Target of a picture: one Axes, several, or None for a new figure


@checked
def style(name: str = "screen", **parameters: Any) -> AbstractContextManager[object]:
    """Set the size of new pictures and their letters, for the rest of a program or within a ``with`` block.

    Pictures follow matplotlib's rcParams: font.size, font.family, axes.labelsize, xtick.labelsize, text.usetex, and
    figure.figsize. A picture with several rows of panels uses only the width of figure.figsize.

    Parameters
    ----------
    name : str
        "screen", "single-column" (90 mm), "double-column" (190 mm) or "slides".
    **parameters
        Further rcParams, with underscores instead of dots: ``font_family="serif"``, ``text_usetex=True``.

    Returns
    -------
    context manager
        Restores the previous parameters when it exits.

    Raises
    ------
    InputError
        If the style or parameter is unknown, or matplotlib rejects a value.
    """
    import matplotlib as mpl

    if name not in STYLES:
        raise InputError(f"unknown style '{name}'{did_you_mean(name, STYLES)}", ", ".join(STYLES), 'sd.style("single-column")')
    current: Any = mpl.rcParams  # its keys are annotated one by one
    by_word = {parameter.replace(".", "_"): parameter for parameter in current}
    chosen = dict(zip(("figure.figsize", "font.size"), STYLES[name], strict=True))
    for word, value in parameters.items():
        if word not in by_word:
            raise InputError(
                f"style: unknown parameter {word}{did_you_mean(word, by_word)}", "rcParams of matplotlib", 'font_family="serif"'
            )
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


@cache
def dark_map(name: str, part: float = 0.65) -> Colormap:
    """Return the part of a sequential colour map that is readable on white paper.

    `part`: part of the map that is used: the rest is too light on white paper, and too dark on dark pages.
    """
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    levels = 256
    return ListedColormap(colormaps[name](part * np.arange(levels) / (levels - 1)), name=f"dark {name}")


def shades(count: int) -> list[str]:
    """Return colours for curves in the order of a growing parameter, for example the clearance; the last is the lightest."""
    from matplotlib.colors import to_hex

    chosen = dark_map(CLEARANCE_MAP)
    return [to_hex(chosen(k / max(count - 1, 1))) for k in range(count)]


def literal(name: str) -> str:
    """Return a user's name as literal text: no character begins a formula, and control characters are visible."""
    from matplotlib import rcParams

    shown = printable(name)
    return shown.translate(LATEX_ESCAPES) if rcParams["text.usetex"] else shown.replace("$", r"\$")


def signed(text: str) -> str:
    """Return a text whose negative numbers have the minus sign of the axes instead of a hyphen."""
    from matplotlib import rcParams

    return re.sub(r"(?<![\w.])-(?=\d)", "\N{MINUS SIGN}", text) if rcParams["axes.unicode_minus"] else text


def use_minus_signs(drawn: Artist | Iterable[Artist]) -> None:
    """Replace hyphens before numbers by minus signs in all texts of a figure or of some Axes.

    Labels of ticks have them already, and looking for them would make all ticks anew.
    """
    from matplotlib.artist import Artist
    from matplotlib.axis import Axis
    from matplotlib.text import Text

    left = [drawn] if isinstance(drawn, Artist) else [*drawn]
    while left:
        part = left.pop()
        if isinstance(part, Text):
            part.set_text(signed(part.get_text()))
        left += (part.label, part.offsetText) if isinstance(part, Axis) else part.get_children()


def apply_layout(figure: Figure) -> None:
    """Apply the layout and the equal scales of a figure without drawing it."""
    for axes in figure.axes:
        axes.apply_aspect()
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        for axes in figure.axes:
            axes.apply_aspect()


def number_decades(axis: Axis) -> None:
    """Number a logarithmic axis at powers of ten, and also at 2 and 5 times them where it has fewer than two decades."""
    from matplotlib.ticker import LogFormatterMathtext, LogLocator, NullFormatter, StrMethodFormatter

    two_decades = 100.0  # ratio of the ends of the axis
    plain = 1e-3, 1e4  # range of numbers that are written without powers of ten
    most = 5  # largest number of powers of ten; more would touch each other in a narrow panel
    low, high = sorted(axis.get_view_interval())
    fine = high < two_decades * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if fine else (1.0,), numticks=None if fine else most))
    in_words = low >= plain[0] and high <= plain[1]
    axis.set_major_formatter(StrMethodFormatter("{x:g}") if fine or in_words else LogFormatterMathtext())
    axis.set_minor_formatter(NullFormatter())


def small() -> float:
    """Return the letter size of ticks and legends [pt], from matplotlib's rcParams."""
    return _letters("xtick.labelsize", 0.8)  # 8 pt of 10 pt


def normal() -> float:
    """Return the letter size of labels and titles [pt], from matplotlib's rcParams."""
    return _letters("axes.labelsize", 0.9)  # 9 pt of 10 pt


def _letters(parameter: str, fraction: float) -> float:
    """Return the user's value of a size parameter, or else a fraction of the font size [pt]."""
    from matplotlib import rcParams, rcParamsDefault
    from matplotlib.font_manager import FontProperties

    chosen: Any = rcParams  # its keys are annotated one by one
    usual: Any = rcParamsDefault
    value = chosen[parameter]
    if value == usual[parameter]:
        return float(fraction * rcParams["font.size"])
    return float(FontProperties(size=value).get_size_in_points())


def wrap_text(text: str, inches: float, letters: float) -> str:
    """Break a text into lines that fit a width [inch] at a letter size `letters` [pt]."""
    shortest = 8  # least number of letters in a line
    letter_width = 0.58  # as a fraction of its size
    fitting = int(inches * 72.0 / (letter_width * letters))
    return text if len(text) <= fitting else "\n".join(wrap(text, max(fitting, shortest), break_long_words=False))


def wrap_label(label: str, inches: float, letters: float) -> str:
    """Break the label of an axis into lines as `wrap_text` does, but never within the brackets of its unit."""
    name, bracket, unit = label.partition(" [")
    together = name + bracket + unit.replace(" ", NO_BREAK_SPACE)
    return wrap_text(together, inches, letters).replace(NO_BREAK_SPACE, " ")


def figure_size(width: float, height: float, rows: int = 2) -> tuple[float, float]:
    """Return width and height of a new figure; a figure.figsize that the user changed takes precedence."""
    from matplotlib import rcParams, rcParamsDefault

    size = list(rcParams["figure.figsize"])
    if size == list(rcParamsDefault["figure.figsize"]):
        return width, height
    return (size[0], size[1]) if rows == 1 else (size[0], height * (size[0] / width) ** 0.6)


def figure_width() -> float:
    """Return the user's width of new figures [inch]; infinite if not set."""
    return figure_size(math.inf, 1.0, 1)[0]


def is_column() -> bool:
    """Return whether new figures are as narrow as the column of a page."""
    column = 5.0  # [inch]
    return figure_width() < column


def draw_scale_bar(axes: Axes, turns: int = 0, *, factor: float = 1.0) -> None:
    """Replace the axes of a drawing by a scale bar below it; in a rotated drawing its text shows where x and y point.

    `factor` is the displayed length divided by the length in metres.
    """
    from matplotlib.transforms import ScaledTranslation, Transform, blended_transform_factory

    part = 0.25  # largest length of the bar as a fraction of the drawing's width
    below = 7.0 / 72.0  # distance of the bar from the drawing [inch]
    figure = axes.get_figure(root=True)
    assert figure is not None
    if not len(axes.get_xticks()):  # another drawing on the same Axes has one
        return
    axes.set(xticks=[], yticks=[], xlabel="", ylabel="")
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    low, high = axes.get_xlim()
    length = factor * _round_length(part * (high - low) / factor)
    lower_edge: Transform = blended_transform_factory(axes.transData, axes.transAxes)
    place = lower_edge + ScaledTranslation(0.0, -below, figure.dpi_scale_trans)
    look: dict[str, Any] = {"color": BLACK, "linewidth": 1.2, "marker": "|", "markersize": 5.0, "markeredgewidth": 1.0}
    look |= {"gid": SCALE_BAR}
    axes.plot([low, low + length], [0.0, 0.0], transform=place, clip_on=False, scalex=False, scaley=False, **look)
    text = engineering("m", length / factor).with_unit(length / factor)
    if turns % 4:
        text += "   " + ", ".join(f"{name} {_ARROWS[turns % 4, name]}" for name in "xy")
    axes.annotate(
        text,
        (low + length, 0.0),
        xycoords=place,
        xytext=(5.0, 0.0),
        textcoords="offset points",
        va="center",
        fontsize=small(),
        color=BLACK,
        annotation_clip=False,
        gid=SCALE_BAR,
    )


# Arrow along axis x or y of a rotated picture, by its number of quarter turns and the axis
_ARROWS = {
    (turns, name): "→↑←↓"[(turns + (name == "y")) % 4]  # quarter turns are counter-clockwise
    for turns in range(4)
    for name in "xy"
}


def _round_length(length: float) -> float:
    """Return the largest of 1, 2, 5, 10, ... times a power of ten that does not exceed a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length * (1.0 + 1e-9))


def dress(axes: Axes) -> None:
    """Give Axes the common style: grid, ticks, spines, and sizes of labels."""
    axes.grid(visible=True, color=LIGHT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=small(), color=GREY, labelcolor=BLACK, width=0.6, length=3.0)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set(color=GREY, linewidth=0.6)
    for label in (axes.xaxis.label, axes.yaxis.label, axes.title):
        label.set(fontsize=normal(), color=BLACK)


class PictureAxes(list[Any]):
    """Axes of a picture; notebooks show them as the picture."""

    def _repr_png_(self) -> bytes:
        """Return the picture as PNG, at the resolution of its figure."""
        content = io.BytesIO()
        use_minus_signs(self)
        self[0].get_figure(root=True).savefig(content, format="png", dpi="figure")
        return content.getvalue()


def panels(
    canvas: Canvas,
    rows: int,
    columns: int = 1,
    *,
    size: tuple[float, float],
    ratios: Sequence[float] | None = None,
    share: bool = True,
) -> list[Axes]:
    """Return the Axes to draw on, in the common style: the given ones, or the panels of a new figure."""
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
        raise InputError(f"got {len(chosen)} Axes", f"{rows * columns} Axes for this picture, or None", "axes=None")
    for axes in chosen:
        dress(axes)
    return PictureAxes(chosen)


def legend(axes: Sequence[Axes], *, above: bool = False) -> Legend | None:
    """Add a legend of all labelled artists, with each label once."""
    narrow_width = 4.2  # narrower Axes have their legend above instead of on the right [inch]
    entry_width = 0.18  # largest width of a legend entry, per point of letter size [inch]
    per_letter = 0.0075  # width of each letter of a legend entry, per point of letter size [inch]
    entry_base = 0.072  # width of a legend entry without its text, per point of letter size [inch]
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
    narrow = figure.get_figwidth() * axes[0].get_position().width < narrow_width
    alone = {id(panel) for panel in figure.axes} <= {id(panel) for parent in axes for panel in (parent, *parent.child_axes)}
    # the legend takes its room from the panel's surroundings, not from the curves
    if narrow and not alone and figure.get_layout_engine():
        columns = int(figure.get_figwidth() * axes[0].get_position().width / (entry_width * letters)) or 1
        look |= {"borderaxespad": 0.2, "columnspacing": 1.2}
        return axes[0].legend(handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, **look)
    if (above or narrow) and not (alone and figure.get_layout_engine()):
        return axes[0].legend(handles, labels, loc="best", **{**look, "frameon": True, "framealpha": 0.8, "edgecolor": "none"})
    if above or narrow:
        longest = max(map(len, labels))
        columns = int(figure.get_figwidth() / (max(entry_width, entry_base + per_letter * longest) * letters)) or 1
        return figure.legend(handles, labels, loc="outside upper left", ncols=columns, **look)
    if len(axes) == 1:
        named = label_curves(axes[0], entries)
        left = {name: artist for name, artist in entries.items() if name not in named}
        handles, labels = list(left.values()), list(left)
        if not labels:
            return None
        if named:
            return axes[0].legend(handles, labels, loc="best", **look)
    return axes[0].legend(handles, labels, loc="upper left", bbox_to_anchor=(1.0, 1.03), borderaxespad=0.0, **look)


def label_curves(axes: Axes, entries: Mapping[str, Artist]) -> list[str]:
    """Write the names of curves at their right ends, in their colours and apart from each other; return these names."""
    from matplotlib.lines import Line2D

    few = 2  # lines with at most this number of points are marks, not curves
    spacing = 1.35  # distance of two names in letter sizes
    figure = axes.get_figure(root=True)
    assert figure is not None
    letters, (low, high) = small(), axes.get_ylim()
    height = 72.0 * figure.get_figheight() * axes.get_position(original=True).height  # [pt]
    ends = []
    for name, artist in entries.items():
        if isinstance(artist, Line2D) and artist.get_linestyle() != "None":
            x, y = (np.asarray(values, float) for values in (artist.get_xdata(), artist.get_ydata()))
            shown = np.isfinite(x) & np.isfinite(y)
            if len(y) > few and shown.any():
                end = float(y[shown][np.argmax(x[shown])])
                ends.append((float(np.clip((end - low) / (high - low), 0.0, 1.0)) * height, name, artist))
    apart = spacing * letters
    if axes.get_yscale() != "linear" or not ends or apart * len(ends) > height:
        return []
    ends.sort(key=lambda end: end[0])
    wanted = np.array([end[0] for end in ends])
    steps = apart * np.arange(len(ends))
    lowest = np.maximum.accumulate(wanted - steps)  # of each name if those below it are as near as they may be
    lowest -= 0.5 * np.mean(lowest + steps - wanted)
    places = np.clip(lowest, 0.0, height - steps[-1]) + steps
    for place, (_, name, artist) in zip(places, ends, strict=True):
        axes.annotate(
            name,
            (1.0, place / height),
            xycoords="axes fraction",
            xytext=(4.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=letters,
            color=artist.get_color(),
            annotation_clip=False,
        )
    return [name for _, name, _ in ends]
