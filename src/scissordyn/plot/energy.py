"""The energy balance of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.picture import picture
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import finish, time_scale, window
from scissordyn.plot.style import BLACK, BLUE, GREEN, LINE, ORANGE, PURPLE, SKY, VERMILION, Canvas, legend, panels

if TYPE_CHECKING:
    import xarray as xr

PANELS = (
    (
        "energy",
        (
            ("kinetic_energy", "kinetic", BLUE),
            ("potential_energy", "potential", GREEN),
            ("stored_energy", "springs and other components", PURPLE),
            ("drive_work", "work of the drive", VERMILION),
            ("motor_work", "work of motors and actuators", ORANGE),
            ("load_work", "work of forces and torques", SKY),
        ),
    ),
    (
        "contacts",
        (
            ("elastic_energy", "elastic", ORANGE),
            ("damping_loss", "damping of contacts", BLUE),
            ("friction_loss", "friction of contacts", GREEN),
            ("damper_loss", "dampers and other components", VERMILION),
            ("switching_loss", "latches and snapping", SKY),
            ("dissipated_energy", "dissipated", PURPLE),
        ),
    ),
    ("residual", (("energy_residual", "residual of the balance", BLACK),)),
)
"""Panels from top to bottom; quantities of different magnitude have separate scales."""

ALWAYS = ("kinetic_energy", "potential_energy", "elastic_energy", "dissipated_energy", "energy_residual")
"""Drawn also if they are zero throughout; other accounts only if something was booked on them."""

NOT_OF_CONTACTS = ("damper_loss", "switching_loss")


@picture("Three Axes, or two for a run in which no contact stored or dissipated energy.")
def energy(run: xr.Dataset, *, start: float | None = None, end: float | None = None, axes: Canvas = None) -> list[Axes]:
    """Energies and work; elastic energy and losses of contacts and components; residual of the balance."""
    run = window(run, start, end)
    shown = []
    for name, declared in PANELS:
        kept = [line for line in declared if line[0] in run and (line[0] in ALWAYS or np.any(run[line[0]].values))]
        if kept and (name != "contacts" or any(np.any(run[variable].values) for variable, _, _ in kept)):
            losses = any(variable in NOT_OF_CONTACTS for variable, _, _ in kept)
            shown.append(("losses" if losses else name, kept))
    ratios = [1.0 if name == "residual" else 1.8 for name, _ in shown]
    drawn = panels(axes, len(shown), size=(8.5, 0.6 + 1.25 * sum(ratios)), ratios=ratios)
    time = time_scale(run)
    for panel, (name, lines) in zip(drawn, shown, strict=True):
        scale = engineering("J", *(run[variable].values for variable, _, _ in lines))
        for variable, label, color in lines:
            values = scale.factor * run[variable].values
            panel.plot(time.factor * run["time"].values, values, color=color, linewidth=LINE, label=label)
        panel.set_ylabel(scale.label(name))
    finish(drawn, run, time)
    for panel in drawn:
        legend([panel])
    return drawn
