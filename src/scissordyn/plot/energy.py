"""The energy balance of a run."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from scissordyn.plot.scale import engineering
from scissordyn.plot.series import finish, time_scale
from scissordyn.plot.style import BLACK, BLUE, GREEN, LINE, ORANGE, PURPLE, SKY, VERMILION, Canvas, legend, panels

__all__ = ["energy"]

PANELS = (
    (
        "energy",
        (
            ("kinetic_energy", "kinetic", BLUE),
            ("potential_energy", "potential", GREEN),
            ("drive_work", "work of drives", VERMILION),
            ("motor_work", "work of motors and actuators", ORANGE),
            ("load_work", "work of forces and torques", SKY),
        ),
    ),
    (
        "stored, dissipated",
        (
            ("elastic_energy", "elastic, in contacts", ORANGE),
            ("stored_energy", "stored in springs and other components", SKY),
            ("dissipated_energy", "dissipated", PURPLE),
        ),
    ),
    ("residual", (("energy_residual", "residual of the balance", BLACK),)),
)
"""Panels from top to bottom; quantities of different magnitude have separate scales."""

ALWAYS = ("kinetic_energy", "potential_energy", "energy_residual")
"""Drawn in every picture; the others if they are not zero throughout."""


def energy(run: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Kinetic and potential energy and work; stored and dissipated energy; residual of the balance.

    Parameters
    ----------
    run : Dataset
    axes : Axes or iterable of Axes, optional
        Three Axes, or two for a run in which nothing stored or dissipated energy. A new figure if not given.

    Returns
    -------
    list of Axes
    """
    shown = [(name, kept) for name, lines in PANELS if (kept := [line for line in lines if _is_drawn(run, line[0])])]
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


def _is_drawn(run: xr.Dataset, name: str) -> bool:
    """Whether a run has an energy that is to be seen."""
    return name in run and (name in ALWAYS or bool(np.any(run[name].values)))
