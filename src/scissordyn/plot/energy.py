"""The energy balance of a run."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from scissordyn.plot.scale import engineering
from scissordyn.plot.series import finish, time_scale
from scissordyn.plot.style import BLACK, BLUE, GREEN, LINE, ORANGE, PURPLE, VERMILION, Canvas, legend, panels

__all__ = ["energy"]

PANELS = (
    (
        "energy",
        (
            ("kinetic_energy", "kinetic", BLUE),
            ("potential_energy", "potential", GREEN),
            ("drive_work", "work of the drive", VERMILION),
        ),
    ),
    (
        "contacts",
        (("elastic_energy", "elastic", ORANGE), ("dissipated_energy", "dissipated", PURPLE)),
    ),
    ("residual", (("energy_residual", "residual of the balance", BLACK),)),
)
"""Panels from top to bottom; quantities of different magnitude have separate scales."""


def energy(run: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Kinetic and potential energy and work; elastic and dissipated energy of the contacts; residual of the balance.

    Parameters
    ----------
    run : Dataset
    axes : Axes or iterable of Axes, optional
        Three Axes, or two for a run in which no contact stored or dissipated energy. A new figure if not given.

    Returns
    -------
    list of Axes
    """
    shown = [(name, kept) for name, lines in PANELS if (kept := [line for line in lines if line[0] in run])]
    shown = [
        (name, lines)
        for name, lines in shown
        if name != "contacts" or any(np.any(run[variable].values) for variable, _, _ in lines)
    ]
    ratios = [1.0 if name == "residual" else 1.8 for name, _ in shown]
    drawn = panels(axes, len(shown), size=(8.5, 0.6 + 1.25 * sum(ratios)), ratios=ratios)
    time = time_scale(run)
    for one, (name, lines) in zip(drawn, shown, strict=True):
        scale = engineering("J", *(run[variable].values for variable, _, _ in lines))
        for variable, label, color in lines:
            values = scale.factor * run[variable].values
            one.plot(time.factor * run["time"].values, values, color=color, linewidth=LINE, label=label)
        one.set_ylabel(scale.label(name))
    finish(drawn, run, time)
    for one in drawn:
        legend([one])
    return drawn
