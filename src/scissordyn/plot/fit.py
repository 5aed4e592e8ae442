"""Measured curves beside those of a run or a fit, with what is left between them, and the correlation of fitted numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.style import BLUE, GREY, LINE, VERMILION, Canvas, dress, legend, literal, panels, small

if TYPE_CHECKING:
    import xarray as xr

MOST = 4  # Segments that are drawn, from the first on: curves of more cannot be distinguished from each other


def agreement_curves(measured: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Each measured quantity with the run's, and below it their difference."""
    drawn = _panels(measured, 2.6, axes)
    time = engineering("s", measured["time"].values)
    at = time.factor * measured["time"].values
    for k, (upper, lower) in enumerate(zip(drawn[::2], drawn[1::2], strict=True)):
        values, run = (measured[name].values[:, k] for name in ("measured", "run"))
        scale, fine = _label(measured, k, (upper, lower), (values, run), run - values, "run less\nmeasured")
        upper.plot(at, scale.factor * values, color=GREY, linewidth=1.6 * LINE, label="measured")
        upper.plot(at, scale.factor * run, color=BLUE, linewidth=LINE, label="run")
        lower.plot(at, fine.factor * (run - values), color=VERMILION, linewidth=0.8 * LINE)
        lower.axhline(0.0, color=GREY, linewidth=0.5 * LINE)
        lower.margins(y=0.1)
    drawn[-1].set(xlim=(at[0], float(np.max(at))), xlabel=time.label("time"))
    legend([drawn[0]], above=axes is None)
    return drawn


def fit_curves(fit: xr.Dataset, *, segments: int = MOST, axes: Canvas = None) -> list[Axes]:
    """Measured and fitted curves of the first segments, and below each the residuals of all."""
    drawn = _panels(fit, 2.4, axes, share=False)
    time, owner = fit["time"].values, fit["segment"].values
    some = owner < segments
    for k, (upper, lower) in enumerate(zip(drawn[::2], drawn[1::2], strict=True)):
        measured, fitted, residual = (fit[name].values[:, k] for name in ("measured", "fitted", "residual"))
        scale, fine = _label(fit, k, (upper, lower), (measured[some],), residual, "residual")
        for part in np.unique(owner):
            rows, first = owner == part, part == owner[0]
            lower.plot(time[rows], fine.factor * residual[rows], color=VERMILION, linewidth=0.6 * LINE)
            if part < segments:
                dots: dict[str, Any] = {"linestyle": "", "marker": ".", "markersize": 2.0, "color": GREY}
                upper.plot(time[rows], scale.factor * measured[rows], label="measured" if first else None, **dots)
                look: dict[str, Any] = {"color": BLUE, "linewidth": LINE, "label": "fitted" if first else None}
                upper.plot(time[rows], scale.factor * fitted[rows], **look)
    drawn[-1].set_xlabel("time [s]")
    legend([drawn[0]], above=axes is None)
    return drawn


def _panels(table: xr.Dataset, height: float, axes: Canvas, *, share: bool = True) -> list[Axes]:
    """Two panels for each column: its curves, and below them what is left between them."""
    count = table.sizes["column"]
    return panels(axes, 2 * count, size=(7.2, height * count), ratios=[2.0, 1.0] * count, share=share)


def _label(
    table: xr.Dataset, k: int, pair: tuple[Axes, Axes], values: Sequence[np.ndarray], rest: np.ndarray, name: str
) -> tuple[Scale, Scale]:
    """Scales of a column and of what is left, written at its two panels."""
    unit = str(table["column_unit"].values[k])
    scales = [DEGREES, DEGREES] if unit == "rad" else [engineering(unit, *values), engineering(unit, rest)]
    heading = scales[0].label(literal(str(table["column"].values[k]))).replace(" of ", "\nof ")
    for panel, text in zip(pair, (heading, scales[1].label(name)), strict=True):
        panel.set_ylabel(text.replace(" [", "\n["), fontsize=small())
    return scales[0], scales[1]


def fit_correlation(fit: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Correlation of the fitted numbers, one square for each pair."""
    names = [literal(str(name)) for name in fit["parameter"].values]
    side = 1.6 + 0.55 * len(names)
    (panel,) = panels(axes, 1, size=(side + 1.6, side))
    values = fit["correlation"].values
    panel.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for row in range(len(names)):
        for column in range(len(names)):
            strong = abs(values[row, column]) > 0.6
            color = "white" if strong else "black"
            panel.text(column, row, f"{values[row, column]:.2f}", ha="center", va="center", size=small(), color=color)
    panel.set_xticks(range(len(names)), names, rotation=35, ha="right")
    panel.set_yticks(range(len(names)), names)
    dress(panel)
    panel.grid(visible=False)
    panel.tick_params(length=0)
    return [panel]
