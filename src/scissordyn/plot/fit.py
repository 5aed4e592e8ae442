"""A fit in pictures: measured and fitted curves with their residuals, and the correlation of the numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.scale import DEGREES, engineering
from scissordyn.plot.style import BLUE, GREY, LINE, VERMILION, Canvas, dress, legend, literal, panels, small

if TYPE_CHECKING:
    import xarray as xr

MOST = 4
"""Segments that are drawn, from the first on: curves of more cannot be distinguished from each other."""


def fit_curves(found: xr.Dataset, *, segments: int = MOST, axes: Canvas = None) -> list[Axes]:
    """Measured and fitted curves of the first segments, and below each the residuals of all."""
    count = found.sizes["column"]
    ratios = [2.0, 1.0] * count
    drawn = panels(axes, 2 * count, size=(7.2, 2.4 * count), ratios=ratios, share=False)
    time, owner = found["time"].values, found["segment"].values
    some = owner < segments
    for k in range(count):
        unit, heading = str(found["column_unit"].values[k]), str(found["column"].values[k])
        measured, fitted, residual = (found[name].values[:, k] for name in ("measured", "fitted", "residual"))
        upper, lower = drawn[2 * k], drawn[2 * k + 1]
        scale = DEGREES if unit == "rad" else engineering(unit, measured[some])
        fine = DEGREES if unit == "rad" else engineering(unit, residual)
        for part in np.unique(owner[some]):
            rows = owner == part
            first = part == owner[0]
            upper.plot(
                time[rows],
                scale.factor * measured[rows],
                linestyle="",
                marker=".",
                markersize=2.0,
                color=GREY,
                label="measured" if first else None,
            )
            upper.plot(time[rows], scale.factor * fitted[rows], color=BLUE, linewidth=LINE, label="fitted" if first else None)
        for part in np.unique(owner):
            rows = owner == part
            lower.plot(time[rows], fine.factor * residual[rows], color=VERMILION, linewidth=0.6 * LINE)
        upper.set_ylabel(scale.label(literal(heading)).replace(" of ", "\nof ").replace(" [", "\n["), fontsize=small())
        lower.set_ylabel(fine.label("residual").replace(" [", "\n["), fontsize=small())
    drawn[-1].set_xlabel("time [s]")
    legend([drawn[0]], above=axes is None)
    return drawn


def fit_correlation(found: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Correlation of the fitted numbers, one square for each pair."""
    names = [literal(str(name)) for name in found["parameter"].values]
    side = 1.6 + 0.55 * len(names)
    (panel,) = panels(axes, 1, size=(side + 1.6, side))
    values = found["correlation"].values
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
