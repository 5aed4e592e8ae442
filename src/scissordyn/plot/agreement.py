"""A run beside measured curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.scale import DEGREES, engineering
from scissordyn.plot.style import BLUE, GREY, LINE, VERMILION, Canvas, legend, literal, panels, small

if TYPE_CHECKING:
    import xarray as xr


def agreement_curves(found: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Each measured quantity with the run's, and below it their difference."""
    count = found.sizes["column"]
    drawn = panels(axes, 2 * count, size=(7.2, 2.6 * count), ratios=[2.0, 1.0] * count)
    time = engineering("s", found["time"].values)
    for k in range(count):
        unit, heading = str(found["column_unit"].values[k]), str(found["column"].values[k])
        measured, run = found["measured"].values[:, k], found["run"].values[:, k]
        scale = DEGREES if unit == "rad" else engineering(unit, measured, run)
        fine = DEGREES if unit == "rad" else engineering(unit, run - measured)
        upper, lower = drawn[2 * k], drawn[2 * k + 1]
        at = time.factor * found["time"].values
        upper.plot(at, scale.factor * measured, color=GREY, linewidth=1.6 * LINE, label="measured")
        upper.plot(at, scale.factor * run, color=BLUE, linewidth=LINE, label="run")
        lower.plot(at, fine.factor * (run - measured), color=VERMILION, linewidth=0.8 * LINE)
        lower.axhline(0.0, color=GREY, linewidth=0.5 * LINE)
        upper.set_ylabel(scale.label(literal(heading)).replace(" of ", "\nof ").replace(" [", "\n["), fontsize=small())
        lower.set_ylabel(fine.label("run less\nmeasured").replace(" [", "\n["), fontsize=small())
        lower.margins(y=0.1)
    drawn[-1].set_xlim(at[0], float(np.max(at)))
    drawn[-1].set_xlabel(time.label("time"))
    legend([drawn[0]], above=axes is None)
    return drawn
