"""Figure 6: the response of slider and bar 2, compared with the ideal mechanism."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from scissordyn.plot.file import figure_of
from scissordyn.plot.over_time import response
from scissordyn_paper.cases import PaperCase

CASES = (PaperCase(), PaperCase().ideal)


def draw(runs: Mapping[PaperCase, xr.Dataset]) -> Figure:
    """Slider at the left, bar 2 at the right; position, speed and acceleration from top to bottom."""
    run, ideal = (runs[case] for case in CASES)
    return figure_of(response(run, ideal))
