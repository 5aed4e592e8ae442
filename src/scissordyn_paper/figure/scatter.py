"""Figures 10 and 12: slider velocity against slider acceleration, which the paper calls Poincaré maps.

Over one stroke at constant speed they are scatter plots of samples: there is no period for a map.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.plot.scale import engineering
from scissordyn.plot.style import BLUE, IDEAL, VERMILION
from scissordyn_paper.cases import PaperCase
from scissordyn_paper.figure.orbit import BY_CLEARANCE, BY_FRICTION
from scissordyn_paper.figure.panel import panel_by_case
from scissordyn_paper.measures import JOINT

CASES_BY_CLEARANCE = (*BY_CLEARANCE, PaperCase().ideal)
CASES_BY_FRICTION = (*BY_FRICTION, PaperCase().ideal)


def draw(runs: Mapping[PaperCase, xr.Dataset], cases: Sequence[PaperCase], columns: int) -> Figure:
    """One scatter plot for each case, with the line of the ideal mechanism; all with the same axes."""
    scale = engineering("m/s^2", *(runs[case]["slider_acceleration"].values for case in cases))
    shown = np.concatenate([scale.factor * runs[case]["slider_acceleration"].values for case in cases])
    margin = 0.05 * float(np.ptp(shown))

    def paint(axes: Axes, case: PaperCase) -> str:
        run, ideal = runs[case], runs[case.ideal]
        touching = run["in_contact"].sel(joint=JOINT).values.astype(bool)
        speed, acceleration = run["slider_velocity"].values, scale.factor * run["slider_acceleration"].values
        # in free flight only gravity acts on the slider: all of these points are on one line, drawn over the others
        for part, color, label in ((touching, VERMILION, "contact"), (~touching, BLUE, "free flight")):
            axes.plot(
                speed[part],
                acceleration[part],
                linestyle="",
                marker="o",
                markersize=2.2,
                color=color,
                label=label,
                markeredgewidth=0.0,
            )
        smooth = ideal["slider_velocity"].values, scale.factor * ideal["slider_acceleration"].values
        axes.plot(*smooth, label="ideal joints", **IDEAL)
        axes.set(xlabel="slider velocity [m/s]", ylabel=scale.label("slider acceleration"))
        axes.set_ylim(float(np.min(shown)) - margin, float(np.max(shown)) + margin)
        return ""

    return panel_by_case(runs, cases, paint, columns=columns)


draw_by_clearance = partial(draw, cases=BY_CLEARANCE, columns=3)
draw_by_friction = partial(draw, cases=BY_FRICTION, columns=2)
