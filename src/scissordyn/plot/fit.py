"""Draw measured curves with simulated or fitted ones, their differences, and the correlation of fitted parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.style import (
    BLUE,
    GREY,
    LINE_WIDTH,
    VERMILION,
    Canvas,
    dress,
    legend,
    literal,
    panels,
    signed,
    small,
)

if TYPE_CHECKING:
    import xarray as xr


def agreement_curves(measured: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Draw each measured quantity with the simulated one, and their difference below."""
    drawn = _panels(measured, 2.6, axes)
    time = engineering("s", measured["time"].values)
    at = time.factor * measured["time"].values
    for k, (upper, lower) in enumerate(zip(drawn[::2], drawn[1::2], strict=True)):
        values, run = (measured[name].values[:, k] for name in ("measured", "run"))
        scale, fine = _label_panels(measured, k, (upper, lower), (values, run), run - values, "run less\nmeasured")
        upper.plot(at, scale.factor * values, color=GREY, linewidth=1.6 * LINE_WIDTH, label="measured")
        upper.plot(at, scale.factor * run, color=BLUE, linewidth=LINE_WIDTH, label="run")
        lower.plot(at, fine.factor * (run - values), color=VERMILION, linewidth=0.8 * LINE_WIDTH)
        lower.axhline(0.0, color=GREY, linewidth=0.5 * LINE_WIDTH)
        lower.margins(y=0.1)
    drawn[-1].set(xlim=(at[0], float(np.max(at))), xlabel=time.label("time"))
    legend([drawn[0]], above=axes is None)
    return drawn


def fit_curves(fit: xr.Dataset, *, segments: int = 4, axes: Canvas = None) -> list[Axes]:
    """Draw measured and fitted curves of the first segments, and below each the residuals of all segments."""
    drawn = _panels(fit, 2.4, axes, share=False)
    time, owner = fit["time"].values, fit["segment"].values
    some = owner < segments
    for k, (upper, lower) in enumerate(zip(drawn[::2], drawn[1::2], strict=True)):
        measured, fitted, residual = (fit[name].values[:, k] for name in ("measured", "fitted", "residual"))
        scale, fine = _label_panels(fit, k, (upper, lower), (measured[some],), residual, "residual")
        for part in np.unique(owner):
            rows, first = owner == part, part == owner[0]
            lower.plot(time[rows], fine.factor * residual[rows], color=VERMILION, linewidth=0.6 * LINE_WIDTH)
            if part < segments:
                dots: dict[str, Any] = {"linestyle": "", "marker": ".", "markersize": 2.0, "color": GREY}
                upper.plot(time[rows], scale.factor * measured[rows], label="measured" if first else None, **dots)
                look: dict[str, Any] = {"color": BLUE, "linewidth": LINE_WIDTH, "label": "fitted" if first else None}
                upper.plot(time[rows], scale.factor * fitted[rows], **look)
    drawn[-1].set_xlabel("time [s]")
    legend([drawn[0]], above=axes is None)
    return drawn


def _panels(table: xr.Dataset, height: float, axes: Canvas, *, share: bool = True) -> list[Axes]:
    """Return two panels for each column: one for its curves, and one for their difference."""
    count = table.sizes["column"]
    return panels(axes, 2 * count, size=(7.2, height * count), ratios=[2.0, 1.0] * count, share=share)


def _label_panels(
    table: xr.Dataset, k: int, pair: tuple[Axes, Axes], values: Sequence[np.ndarray], rest: np.ndarray, name: str
) -> tuple[Scale, Scale]:
    """Label the two panels of a column; return the scales of its values and of its differences."""
    unit = str(table["column_unit"].values[k])
    scales = [DEGREES, DEGREES] if unit == "rad" else [engineering(unit, *values), engineering(unit, rest)]
    heading = scales[0].label(literal(str(table["column"].values[k]))).replace(" of ", "\nof ")
    for panel, text in zip(pair, (heading, scales[1].label(name)), strict=True):
        panel.set_ylabel(text.replace(" [", "\n["), fontsize=small())
    return scales[0], scales[1]


def fit_correlation(fit: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Draw the correlation matrix of the fitted parameters."""
    names = [literal(str(name)) for name in fit["parameter"].values]
    side = 1.6 + 0.55 * len(names)
    (panel,) = drawn = panels(axes, 1, size=(side + 1.6, side))
    values = fit["correlation"].values
    panel.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for row in range(len(names)):
        for column in range(len(names)):
            strong = abs(values[row, column]) > 0.6
            color = "white" if strong else "black"
            panel.text(column, row, signed(f"{values[row, column]:.2f}"), ha="center", va="center", size=small(), color=color)
    panel.set_xticks(range(len(names)), names, rotation=35, ha="right")
    panel.set_yticks(range(len(names)), names)
    dress(panel)
    panel.grid(visible=False)
    panel.tick_params(length=0)
    return drawn
