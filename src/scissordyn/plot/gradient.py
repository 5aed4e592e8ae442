"""Draw elasticities of measures as bars."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.style import BLACK, BLUE, GREY, VERMILION, Canvas, literal, panels

if TYPE_CHECKING:
    import xarray as xr


def elasticities(found: xr.Dataset, *, axes: Canvas = None, most: int = 20) -> list[Axes]:
    """Draw the elasticities of each measure of `gradient`, the largest at the top.

    Bars to the left are parameters whose growth lowers the measure. A grey bar is valid for a part of the run only.

    `most`: largest number of bars of a measure; those with the smallest elasticities are left out.
    """
    measures = found["measure"].values.tolist()
    count = min(most, found.sizes["parameter"])
    drawn = panels(axes, len(measures), size=(7.5, 0.9 + 0.28 * count), share=False)
    for panel, name in zip(drawn, measures, strict=True):
        here = found.sel(measure=name)
        values = np.nan_to_num(here["elasticity"].values)
        order = np.argsort(np.abs(values))[-count:]
        limited = here["limit"].values[order] != ""
        colours = np.where(limited, GREY, np.where(values[order] < 0.0, VERMILION, BLUE))
        panel.barh(np.arange(count), values[order], color=colours.tolist())
        panel.set_yticks(np.arange(count), [literal(str(text)) for text in here["parameter"].values[order]])
        panel.axvline(0.0, color=BLACK, linewidth=0.8)
        panel.set_xlabel(literal(f"change of {name} [% per %]"))
    return drawn
