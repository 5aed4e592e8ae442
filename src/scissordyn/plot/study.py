"""Draw results of studies: feasibility maps over interpolated fields, response curves, sensitivity, Pareto fronts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from scissordyn.errors import InputError
from scissordyn.plot.file import figure_of
from scissordyn.plot.scale import Scale, engineering, scale_of
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    CLEARANCE_MAP,
    GREY,
    LINE_WIDTH,
    ORANGE,
    OUTSIDE,
    SIZES,
    VERMILION,
    Canvas,
    legend,
    literal,
    number_decades,
    panels,
    signed,
    small,
)

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


# Colours of the lines in a map of a study on which requirements are just met, in order
BOUND_COLOURS = (BLACK, VERMILION, BLUE, ORANGE, GREY)


# Style of the points of a study in pictures (matplotlib): no line between them
DOTS: dict[str, Any] = {"linestyle": "", "marker": ".", "markeredgewidth": 0.0}

MET_COLOURS = LinearSegmentedColormap.from_list("met", colormaps["RdYlBu"](np.linspace(0.12, 0.88, 256)))
"""Colour map from "no requirement met" to "all met"; without the darkest ends, on which marks would be invisible."""


@dataclass(frozen=True)
class Field:
    """Interpolated response over two factors, in SI units."""

    x: np.ndarray  # (n,)
    y: np.ndarray  # (n,)
    mean: np.ndarray  # (m, n)
    deviation: np.ndarray  # (m, n) Standard deviation of the interpolation error
    spread: float  # Standard deviation of the response over all points
    error: float  # Mean leave-one-out error as a fraction of the mean response


@dataclass(frozen=True)
class Bound:
    """Requirement on a response whose values between the points of a study are interpolated."""

    label: str
    field: Field
    value: float  # Limit of the response, in SI units


def _draw_bounds(axes: Axes, bounds: Sequence[Bound], scales: tuple[Scale, Scale]) -> list[Line2D | Patch]:
    """Draw lines on which requirements are just met, hatched where the side of a point is uncertain."""
    two_sided = 1.96  # half width of a 95 % interval in standard deviations
    shown: list[Line2D | Patch] = []
    hatched = False
    for k, bound in enumerate(bounds):
        field, colour = bound.field, BOUND_COLOURS[k % len(BOUND_COLOURS)]
        x, y = field.x * scales[0].factor, field.y * scales[1].factor
        with np.errstate(divide="ignore", invalid="ignore"):
            away = np.abs(field.mean - bound.value) / (two_sided * field.deviation)
        if np.nanmin(away) < 1.0:
            axes.contourf(x, y, away, levels=[0.0, 1.0], colors="none", hatches=["////"], zorder=0.7)
            hatched = True
        if field.mean.min() < bound.value < field.mean.max():
            axes.contour(x, y, field.mean, levels=[bound.value], colors=[colour], linewidths=1.5 * LINE_WIDTH, zorder=1.5)
            shown.append(Line2D([], [], color=colour, linewidth=1.5 * LINE_WIDTH, label=literal(bound.label)))
    if hatched:
        shown.append(Patch(facecolor="none", edgecolor=GREY, hatch="////", label=literal("side of the line uncertain (95 %)")))
    return shown


def _with_role(points: xr.Dataset, role: str) -> list[str]:
    return [str(name) for name, variable in points.data_vars.items() if variable.attrs.get("role") == role]


def _ratio(values: np.ndarray) -> float:
    """Return the ratio of the largest to the smallest value; 1 unless all values are positive."""
    return float(values.max() / values.min()) if values.size and values.min() > 0.0 else 1.0


def _label(points: xr.Dataset, name: str, scale: Scale, longest: int = 44) -> str:
    """Return the label of a response or factor with its unit, wrapped to lines of `longest` characters."""
    return "\n".join(wrap(literal(scale.label(str(points[name].attrs.get("label", name)))), longest))


def _beyond_text(response: xr.DataArray) -> str:
    """Return the label of points whose value is beyond the range in which a response is computed; empty without a range."""
    return f"not reached within {response.attrs['beyond']} {response.attrs['units']}" if "beyond" in response.attrs else ""


def _legend(axes: Sequence[Axes]) -> None:
    """Add a legend in which the small dots of the plot are enlarged."""
    shown = legend(axes, above=True)
    for handle in shown.legend_handles if shown is not None else ():
        if isinstance(handle, Line2D) and handle.get_marker() == DOTS["marker"]:
            handle.set(markersize=SIZES.legend_dot, alpha=1.0)


def _is_logarithmic(values: np.ndarray) -> bool:
    """Return whether values are spaced by ratios over more than a decade."""
    levels = np.unique(values[np.isfinite(values)])
    if levels.size < 3 or levels[0] <= 0.0 or levels[-1] < 10.0 * levels[0]:
        return False
    return bool(np.median(levels) < 0.35 * (levels[0] + levels[-1]))


def feasibility_map(
    points: xr.Dataset,
    *,
    x: str = "",
    y: str = "",
    colour: str = "met",
    limit: float | None = None,
    field: Field | None = None,
    bounds: Sequence[Bound] = (),
    axes: Canvas = None,
) -> list[Axes]:
    """Draw a response, or the fraction of cases that meet the requirements, over two factors."""
    names = _with_role(points, "factor")
    if len(names) < 2:
        raise InputError(f"the study has {len(names)} factor(s)", "two factors or more for a map")
    x, y = x or names[0], y or next(name for name in names if name != (x or names[0]))
    (panel,) = drawn_axes = panels(axes, 1, size=(5.4, 4.2))
    sx, sy = scale_of(points[x]), scale_of(points[y])
    a, b, c = points[x].values * sx.factor, points[y].values * sy.factor, points[colour].values
    sc = Scale(1.0, "") if colour == "met" else scale_of(points[colour])
    c = c * sc.factor
    finite = c[np.isfinite(c)]
    norm: Normalize = (
        Normalize(0.0, 1.0) if colour == "met" else LogNorm() if _ratio(finite) > SIZES.logarithm_ratio else Normalize()
    )
    look: dict[str, Any] = {"cmap": MET_COLOURS if colour == "met" else CLEARANCE_MAP, "norm": norm, "rasterized": True}
    ua, ub = np.unique(a), np.unique(b)
    in_cell, left = divmod(points.sizes["point"], ua.size * ub.size)
    on_grid = left == 0 and ua.size > 1 and ub.size > 1
    if on_grid:
        table = _grid_means(a, b, c, ua, ub)
        drawn: Any = panel.pcolormesh(ua, ub, table, shading="nearest", **look)
        if limit is not None and not (sx.labels or sy.labels) and np.nanmin(table) < limit * sc.factor < np.nanmax(table):
            lines = panel.contour(ua, ub, table, levels=[limit * sc.factor], colors=[BLACK], linewidths=LINE_WIDTH)
            panel.clabel(lines, fmt=lambda value: signed(f"{value:g} {sc.unit}"), fontsize=small())
    else:
        drawn = _draw_scattered(panel, (a, b, c), (sx, sy, sc), look, field, bounds)
    if (unmet := np.isinf(c)).any():  # points without a value do not meet the requirement
        shown = _beyond_text(points[colour]) or "not reached: not met"
        panel.plot(a[unmet], b[unmet], "x", color=BLACK, markersize=4.0, zorder=3.0, label=shown)
    _draw_disagreement(panel, a, b, points["disagrees"].values, (ua, ub) if on_grid else None)
    if panel.lines:
        _legend([panel])
    if on_grid and in_cell > 1:
        note = f"each field: mean of {in_cell} points with other values of the other factors"
        panel.set_title(note, loc="left", fontsize=small())
    panel.set(xlabel=sx.label(literal(x)), ylabel=sy.label(literal(y)))
    _scale_axis(panel.xaxis, sx, points[x].values)
    _scale_axis(panel.yaxis, sy, points[y].values)
    label = "fraction that meets the requirements" if colour == "met" else _label(points, colour, sc)
    bar = figure_of(panel).colorbar(drawn, ax=panel)
    bar.set_label(label, fontsize=small())
    bar.ax.tick_params(labelsize=small())
    if isinstance(norm, LogNorm):
        number_decades(bar.ax.yaxis)
    elif colour != "met" and _is_whole(finite):
        bar.locator = MaxNLocator(integer=True)
    panel.grid(visible=False)
    return drawn_axes


def _draw_disagreement(
    panel: Axes, a: np.ndarray, b: np.ndarray, marked: np.ndarray, grid: tuple[np.ndarray, np.ndarray] | None
) -> None:
    """Draw dots at points whose members disagree; on a grid one dot per node."""
    places = (a[marked], b[marked])
    if grid is not None:
        at = np.argwhere(_grid_means(a, b, marked.astype(float), *grid) > 0.0)
        places = (grid[0][at[:, 1]], grid[1][at[:, 0]])
    if places[0].size:
        few = places[0].size <= SIZES.edged_points_max
        size = 8.0 if few else float(np.clip(70.0 / np.sqrt(places[0].size), 0.4, 4.0))
        edge = {"markeredgecolor": "white", "markeredgewidth": 0.8} if few else {}
        panel.plot(*places, **(DOTS | edge), markersize=size, color=BLACK, zorder=3.0, label="members disagree")


def _draw_scattered(
    panel: Axes,
    values: tuple[np.ndarray, np.ndarray, np.ndarray],
    scales: tuple[Scale, Scale, Scale],
    look: dict[str, Any],
    field: Field | None,
    bounds: Sequence[Bound],
) -> Any:
    """Draw scattered points over the interpolated field, with the lines of the requirements."""
    veil_opacity = 0.75  # where the interpolation has no information beyond the mean of all points
    a, b, c = values
    size = float(np.clip(6000.0 / a.size, 3.0, 40.0))
    if field is not None:
        shown = [field.mean * scales[2].factor, c[np.isfinite(c)]]
        look["norm"].vmin = float(min(part.min() for part in shown))
        look["norm"].vmax = float(max(part.max() for part in shown))
        x, y = field.x * scales[0].factor, field.y * scales[1].factor
        panel.pcolormesh(x, y, field.mean * scales[2].factor, shading="nearest", zorder=0.5, **look)
        veil = np.ones((*field.mean.shape, 4))  # a white overlay marks uncertain regions
        veil[..., 3] = veil_opacity * np.clip(field.deviation / max(field.spread, 1e-300), 0.0, 1.0)
        panel.pcolormesh(x, y, veil, shading="nearest", zorder=0.6, rasterized=True)
        text = literal(f"between the points interpolated: {field.error:.1%} error at points left out; pale is uncertain")
        panel.set_title(text, loc="left", fontsize=small())
    handles = _draw_bounds(panel, bounds, scales[:2])
    edge = {"edgecolors": BLACK, "linewidths": 0.6} if field is not None or bounds else {"edgecolors": "none"}
    drawn = panel.scatter(a, b, c=c, s=size, zorder=2.0, clip_on=False, **edge, **look)
    if handles:
        panel.legend(handles=handles, fontsize=small(), loc="upper left", bbox_to_anchor=(0.0, -0.16), frameon=False)
    return drawn


def _is_whole(values: np.ndarray) -> bool:
    """Return whether all values are integers, which then get integer ticks."""
    return bool(np.all(values == np.round(values)))


def _grid_means(a: np.ndarray, b: np.ndarray, c: np.ndarray, ua: np.ndarray, ub: np.ndarray) -> np.ndarray:
    """Return the means of c over a grid, shape (len(ub), len(ua))."""
    ia, ib, finite = np.searchsorted(ua, a), np.searchsorted(ub, b), np.isfinite(c)
    total, count = np.zeros((ub.size, ua.size)), np.zeros((ub.size, ua.size))
    np.add.at(total, (ib[finite], ia[finite]), c[finite])
    np.add.at(count, (ib[finite], ia[finite]), 1.0)
    return np.where(count > 0.0, total / np.maximum(count, 1.0), np.nan)


def response_curves(points: xr.Dataset, *, limits: dict[str, float] | None = None, axes: Canvas = None) -> list[Axes]:
    """Draw each response over each factor: all points, and the median and middle 80 % over the other factors."""
    every, names = (_with_role(points, role) for role in ("factor", "response"))
    if not every or not names:
        raise InputError("the study has no factor or no response", "at least one of each for response curves")
    factors = _most_important(points, every, names)
    size = (1.2 + 2.6 * len(factors), 0.8 + 2.0 * len(names))
    panels_drawn = panels(axes, len(names), len(factors), size=size, share=True)
    for row, name in enumerate(names):
        sy = scale_of(points[name])
        values, beyond = points[name].values * sy.factor, _beyond_text(points[name])
        over = np.isposinf(values) & bool(beyond)
        values = np.where(over, points[name].attrs.get("beyond", 0.0) * sy.factor, values)
        for place, factor in enumerate(factors):
            panel, sx = panels_drawn[row * len(factors) + place], scale_of(points[factor])
            x = points[factor].values * sx.factor
            dot = float(np.clip(200.0 / np.sqrt(x.size), 1.0, 6.0))
            panel.plot(x, values, **DOTS, color=GREY, alpha=0.5, markersize=dot, label="points", rasterized=True)
            middle, low, high, at = _interval_quantiles(x, values, by_level=bool(sx.labels))
            if sx.labels:
                panel.vlines(at, low, high, color=BLUE, alpha=0.4, linewidth=4.0 * LINE_WIDTH, label=literal("middle 80 %"))
                panel.plot(at, middle, linestyle="", marker="_", markersize=12.0, color=BLUE, label="median")
            elif len(factors) == 1 and np.unique(x).size == x.size:
                order = np.argsort(x)
                panel.plot(x[order], values[order], color=BLUE, linewidth=LINE_WIDTH)
            elif at.size > 1:
                panel.fill_between(at, low, high, color=BLUE, alpha=0.2, linewidth=0.0, label=literal("middle 80 %"))
                panel.plot(at, middle, color=BLUE, linewidth=1.5 * LINE_WIDTH, label="median")
            if over.any():
                panel.plot(x[over], values[over], linestyle="", marker="^", color=BLACK, markersize=5.0, label=beyond)
            marked = points["disagrees"].values
            if marked.any():
                larger = max(dot, 4.0 if np.count_nonzero(marked) <= SIZES.edged_points_max else 1.0)
                panel.plot(x[marked], values[marked], **DOTS, color=BLACK, markersize=larger, label="members disagree")
            if limits and name in limits:
                panel.axhline(limits[name] * sy.factor, color=OUTSIDE, linewidth=LINE_WIDTH, label="required")
            _scale_axis(panel.xaxis, sx, points[factor].values)
            finite = values[np.isfinite(values)]
            if _ratio(finite) > SIZES.logarithm_ratio:
                panel.set_yscale("log")
                number_decades(panel.yaxis)
            elif _is_whole(finite):
                panel.yaxis.set_major_locator(MaxNLocator(nbins="auto", steps=[1, 2, 5, 10], integer=True))
            if row == len(names) - 1:
                panel.set_xlabel(sx.label(literal(factor)))
            if place == 0:
                panel.set_ylabel(_label(points, name, sy, longest=28), fontsize=small())
    if len(factors) < len(every):
        title = f"{len(factors)} of {len(every)} factors: those with the largest rank correlations"
        panels_drawn[0].set_title(title, loc="left", fontsize=small())
    _legend(panels_drawn)
    return panels_drawn


def _most_important(points: xr.Dataset, factors: list[str], names: list[str]) -> list[str]:
    """Return the factors with the largest rank correlation to any response, in order; all if there are few."""
    if len(factors) <= SIZES.factors_max:
        return factors
    from scipy.stats import spearmanr

    largest = np.zeros(len(factors))
    for name in names:
        values = points[name].values
        finite = np.isfinite(values)
        if np.unique(values[finite]).size > 2:
            for k, factor in enumerate(factors):
                x = points[factor].values[finite]
                if np.unique(x).size > 1:
                    largest[k] = max(largest[k], abs(float(spearmanr(x, values[finite]).statistic)))
    return [factors[k] for k in sorted(np.argsort(-largest, kind="stable")[: SIZES.factors_max])]


def _scale_axis(axis: Axis, scale: Scale, values: np.ndarray) -> None:
    """Set a logarithmic scale where the values suggest it, or one tick per name; long names are rotated."""
    level = 30  # tick names are rotated if they have more characters than this in total
    across = isinstance(axis, XAxis)
    if _is_logarithmic(values):
        (axis.axes.set_xscale if across else axis.axes.set_yscale)("log")
        number_decades(axis)
    if not scale.labels:
        return
    axis.set_ticks(range(len(scale.labels)), [literal(label) for label in scale.labels])
    if across and sum(map(len, scale.labels)) > level:
        axis.set_tick_params(rotation=25)
        for label in axis.get_ticklabels():
            label.set(ha="right", rotation_mode="anchor")
    (axis.axes.set_xlim if across else axis.axes.set_ylim)(-0.5, len(scale.labels) - 0.5)


def _interval_quantiles(
    x: np.ndarray, values: np.ndarray, *, by_level: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the median, 10 % and 90 % quantiles for each interval of x, and the positions.

    With `by_level` there is one interval per value of x. Quantiles are interpolated linearly.
    """
    points_min = 6  # least number of points for a median and a middle 80 %
    most_levels = 120  # factors with at most this number of values get one median per value
    bins = 12  # largest number of intervals of a factor's range; the curve has one median for each
    finite = np.isfinite(values)
    x, values = x[finite], values[finite]
    levels = np.unique(x)
    if by_level or (levels.size <= most_levels and x.size >= points_min * levels.size):
        parts, at = [values[x == level] for level in levels], levels
    else:
        count = min(bins, x.size // points_min)
        if count < 1:
            return (np.empty(0),) * 4
        edges = np.quantile(x, np.linspace(0.0, 1.0, count + 1))
        interval_of = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, count - 1)
        parts = [values[interval_of == k] for k in range(count) if np.any(interval_of == k)]
        at = np.array([np.median(x[interval_of == k]) for k in range(count) if np.any(interval_of == k)])
    quantiles = np.array([np.quantile(part, [0.5, 0.1, 0.9]) for part in parts]).reshape(-1, 3)
    return quantiles[:, 0], quantiles[:, 1], quantiles[:, 2], at


def sensitivity_bars(indices: dict[str, xr.Dataset], *, axes: Canvas = None) -> list[Axes]:
    """Draw Sobol indices, or Morris's mean effects, of each factor with 95 % intervals."""
    if not indices:
        raise InputError("no sensitivity indices", "a study with a Saltelli or Morris design")
    factors = next(iter(indices.values()))["factor"].values
    panels_drawn = panels(axes, len(indices), size=(5.4, 0.9 + len(indices) * (0.6 + 0.34 * len(factors))), share=False)
    for panel, (name, table) in zip(panels_drawn, indices.items(), strict=True):
        places = np.arange(len(factors), dtype=float)
        if table.attrs["method"] == "morris":
            shown = [("effect", "mean absolute effect", BLUE, 0.0, 0.5)]
            scale = engineering(str(table.attrs["units"]), table["effect"].values)
        else:
            shown = [("first", "first order", BLUE, -0.19, 0.36), ("total", "total", ORANGE, 0.19, 0.36)]
            scale = Scale(1.0, "")
        for key, label, colour, shift, height in shown:
            values, width = table[key].values * scale.factor, table[f"{key}_interval"].values * scale.factor
            error = {"elinewidth": LINE_WIDTH, "ecolor": BLACK, "capsize": 2.0}
            panel.barh(places + shift, values, height, xerr=width, color=colour, label=label, error_kw=error)
        panel.set_yticks(places, [literal(str(factor)) for factor in factors])
        panel.invert_yaxis()
        what = "mean absolute effect on" if table.attrs["method"] == "morris" else "Sobol index of"
        panel.set_xlabel(scale.label(f"{what} {literal(str(table.attrs.get('label', name)))}"))
    _legend(panels_drawn)
    return panels_drawn


def requirement_bars(labels: Sequence[str], fractions: np.ndarray, intervals: np.ndarray, *, axes: Canvas = None) -> list[Axes]:
    """Draw the fraction of a study's points that meets each requirement, with its 95 % interval.

    Shapes: `fractions` (n,), `intervals` (n, 2).
    """
    longest = 84  # characters per line of a label; longer labels are wrapped
    lines = [wrap(label, longest) or [""] for label in labels]
    # width of the bars and of the characters next to them [inch]
    width = 3.6 + 0.062 * max((len(line) for label in lines for line in label), default=0)
    high = max(0.24, 0.02 + 0.14 * max(map(len, lines), default=0))
    (panel,) = drawn = panels(axes, 1, size=(width, 0.9 + high * len(labels)))
    places = np.arange(len(labels), dtype=float)
    panel.barh(places, 100.0 * fractions, 0.62, color=BLUE, alpha=0.75)
    finite = np.isfinite(intervals).all(axis=1)
    panel.hlines(places[finite], *(100.0 * intervals[finite]).T, color=BLACK, linewidth=2.0 * LINE_WIDTH)
    panel.set_yticks(places, ["\n".join(map(literal, label)) for label in lines], linespacing=1.0)
    heading = literal("met by [%]" + (", line: 95 % interval" if finite.any() else ""))
    panel.set(xlim=(0.0, 100.0), ylim=(len(labels) - 0.4, -0.6), xlabel=heading)
    return drawn


def pareto_front(
    tried: xr.Dataset, goals: tuple[str, str], *, confirmed: pd.DataFrame | None = None, axes: Canvas = None
) -> list[Axes]:
    """Draw all evaluated points, and the Pareto front of points that no other point beats in both goals."""
    (panel,) = drawn = panels(axes, 1, size=(5.0, 3.8))
    scales = [scale_of(tried[goal]) for goal in goals]
    shown = [scale.factor for scale in scales]
    x, y = (tried[goal].values * factor for goal, factor in zip(goals, shown, strict=True))
    meets, front = tried["violation"].values <= 0.0, tried["front"].values
    if not meets.all():
        panel.plot(
            x[~meets], y[~meets], **DOTS, color=GREY, markersize=SIZES.legend_dot, label="does not meet the requirements"
        )
    tried_only = meets & ~front
    panel.plot(x[tried_only], y[tried_only], **DOTS, color=BLUE, alpha=0.6, markersize=SIZES.legend_dot, label="other points")
    order = np.argsort(x[front])
    cheap = "" if confirmed is None else " of cheap runs"
    look: dict[str, Any] = {"color": VERMILION, "marker": "o", "markersize": 3.5, "linewidth": LINE_WIDTH}
    panel.plot(x[front][order], y[front][order], label=f"Pareto front{cheap}", **look)
    if confirmed is not None:
        _draw_confirmed(panel, confirmed, goals, shown)
    labels = [_label(tried, goal, scale) for scale, goal in zip(scales, goals, strict=True)]
    panel.set(xlabel=labels[0], ylabel=labels[1])
    _legend([panel])
    return drawn


def _draw_confirmed(axes: Axes, confirmed: pd.DataFrame, goals: tuple[str, str], shown: Sequence[float]) -> None:
    """Draw the accurately computed points by whether they meet the requirements, with lines to their approximate values."""
    there, here = (
        np.stack([factor * confirmed[f"{kind}{goal}"].to_numpy() for goal, factor in zip(goals, shown, strict=True)], axis=1)
        for kind in ("", "accurate ")
    )
    finite = np.isfinite(here).all(axis=1)
    meets = finite & (confirmed["accurate violation"].to_numpy() <= 0.0)
    for start, end in zip(there[finite], here[finite], strict=True):
        axes.plot(*np.stack([start, end]).T, color=BLACK, linewidth=0.6, zorder=2.5)
    look: dict[str, Any] = {"linestyle": "", "marker": "D", "markersize": 4.5, "markeredgewidth": 0.8, "color": BLACK}
    for chosen, fill, label in ((meets, ORANGE, "meets"), (finite & ~meets, "white", "does not meet")):
        if chosen.any():
            axes.plot(*here[chosen].T, zorder=3.0, label=f"accurate run {label} them", markerfacecolor=fill, **look)
