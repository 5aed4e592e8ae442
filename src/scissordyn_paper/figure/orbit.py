"""Figures 9, 11 and 13: the journal's orbit in the bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.plot.joint import orbit
from scissordyn_paper.cases import CLEARANCES, CONTROLLED, FRICTION, PaperCase
from scissordyn_paper.figure.panel import panel_by_case

BY_CLEARANCE = tuple(PaperCase(clearance) for clearance in CLEARANCES)
BY_FRICTION = tuple(PaperCase(friction=friction) for friction in FRICTION)
CONSTRAINED = tuple(PaperCase(clearance, constrained=True) for clearance in CONTROLLED)


def draw(runs: Mapping[PaperCase, xr.Dataset], cases: Sequence[PaperCase], columns: int) -> Figure:
    """One orbit for each case."""

    def paint(axes: Axes, case: PaperCase) -> str:
        # a constrained contact has no indentation but round-off, which must not be magnified
        orbit(runs[case], axes=axes, exaggeration=1.0 if case.constrained else None)
        own = axes.get_legend()
        assert own is not None
        own.remove()  # one legend for all panels
        return axes.get_title(loc="left").partition(", ")[2]

    return panel_by_case(runs, cases, paint, columns=columns)


draw_by_clearance = partial(draw, cases=BY_CLEARANCE, columns=3)
draw_by_friction = partial(draw, cases=BY_FRICTION, columns=2)
draw_constrained = partial(draw, cases=CONSTRAINED, columns=2)
