"""Forces without inertia over the stroke."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.kinematics import curves
from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.style import Canvas, legend, panels

if TYPE_CHECKING:
    import xarray as xr

SAMPLE = "over='time'"

CONSTANT = 1e-6  # Forces that vary by less than this part of the largest are constant but for round-off, and drawn from zero on
ROUND_OFF = 1e-12  # Forces below this part of the largest number are round-off; a panel of such is left out

PANELS = {
    "drive": ("drive torque", "rod force ", "coordinate drive "),
    "coupling": ("coupling ",),
    "reaction": ("reaction ",),
}
"""Panels, and how the names of their forces begin; those of components have other names."""


def statics(forces: xr.Dataset, *, over: str = "input", axes: Canvas = None) -> list[Axes]:
    """Forces of drives and rods, of components, of couplings and of joints over the stroke.

    Parameters
    ----------
    forces : Dataset
        What `sd.statics` returns.
    over : str
        "time", "input", what the first drive holds, or a coordinate of a tracked point, as "table.x".
    axes : Axes or sequence of Axes, optional
        One for each panel.

    Returns
    -------
    list of Axes
    """
    names, units = forces["quantity"].values.astype(str), forces["quantity_unit"].values.astype(str)
    panel_of = np.array(
        [next((kind for kind, starts in PANELS.items() if name.startswith(starts)), "component") for name in names.tolist()]
    )
    sizes = np.nan_to_num(np.abs(forces["quantity_value"].values)).max(axis=0)
    loaded = sizes >= ROUND_OFF * sizes.max(initial=0.0)
    groups = [
        (kind, np.flatnonzero((panel_of == kind) & (units == unit)), unit)
        for kind in ("drive", "component", "coupling", "reaction")
        for unit in ("N", "N m")
        if np.any((panel_of == kind) & (units == unit) & np.isfinite(forces["quantity_value"].values).any(axis=0) & loaded)
    ]
    drawn = panels(axes, len(groups), size=(7.5, 2.2 * len(groups) + 0.8))
    values, label = _over(forces, over)
    for panel, (kind, chosen, unit) in zip(drawn, groups, strict=True):
        force = forces["quantity_value"].values[:, chosen]
        order = np.argsort(-np.nanmax(np.abs(force), axis=0), kind="stable")
        scale = engineering(unit, force)
        curves(panel, values, scale.factor * force[:, order], [name.removeprefix("reaction ") for name in names[chosen][order]])
        if np.nanmax(np.ptp(force, axis=0)) <= CONSTANT * np.nanmax(np.abs(force)):
            ends = 0.0, *(1.2 * scale.factor * force[0])
            panel.set_ylim(np.nanmin(ends), np.nanmax(ends))
        panel.set_ylabel(scale.label(kind))
        legend([panel])
    drawn[-1].set_xlabel(label)
    return drawn


def _over(forces: xr.Dataset, over: str) -> tuple[np.ndarray, str]:
    """What the forces are drawn over, and its label."""
    track, _, axis = over.rpartition(".")
    tracks = forces["track"].values.tolist() if "track" in forces else []
    if over == "time":
        scale, values, name = engineering("s", forces["time"].values), forces["time"].values, "time"
    elif over == "input":
        values, name = forces["input"].values[:, 0], str(forces["prescribed"].values[0])
        scale = DEGREES if str(forces["prescribed_unit"].values[0]) == "rad" else Scale(1e3, "mm")
    elif track in tracks and axis in ("x", "y"):
        values, name = forces["track_position"].sel(track=track, axis=axis).values, over
        scale = engineering("m", values)
    else:
        allowed = ["time", "input", *(f"{name}.{axis}" for name in tracks for axis in "xy")]
        raise InputError(f"forces over {over!r}", ", ".join(allowed), SAMPLE)
    return scale.factor * values, scale.label(name)
