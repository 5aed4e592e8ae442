"""Curves of the ideal kinematics: output, transmission angles, torque and reactions along the stroke."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.scale import DEGREES, engineering
from scissordyn.plot.series import time_scale
from scissordyn.plot.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, Canvas, legend, literal, panels

if TYPE_CHECKING:
    import xarray as xr

COLORS = (BLUE, VERMILION, GREEN, PURPLE, SKY, ORANGE)

STEEPEST = 4.0
"""Forces grow without limit towards a singular position: axes end at this multiple of their 90th percentile there."""

HIGH = 90.0

MARKS = {"change point": (0, (5, 2)), "near change point": (0, (1, 2)), "locking position": "solid"}


def kinematics(ideal: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """The ideal kinematics over time, with the singular positions marked."""
    drawn = panels(axes, 4, size=(7.5, 8.5))
    time = time_scale(ideal)
    t = time.factor * ideal["time"].values
    _output(drawn[0], ideal, t)
    _transmission(drawn[1], ideal, t)
    _drive(drawn[2], ideal, t)
    _reactions(drawn[3], ideal, t)
    for panel in drawn:
        for kind, at in zip(ideal["singular_kind"].values, ideal["singular_time"].values, strict=True):
            panel.axvline(time.factor * at, color=BLACK, linewidth=0.8, linestyle=MARKS[str(kind)], label=str(kind))
        legend([panel])
    drawn[-1].set_xlabel(f"time [{time.unit}]")
    return drawn


def curves(axes: Axes, t: np.ndarray, values: np.ndarray, names: list[str]) -> None:
    """Curves with the names of the first and of those that differ from it; the rest are counted."""
    shown: list[np.ndarray] = []
    alike = 0
    for name, column in zip(names, values.T, strict=True):
        if any(np.allclose(column, other, rtol=1e-6, atol=1e-9, equal_nan=True) for other in shown):
            alike += 1
            continue
        if len(shown) == len(COLORS):
            break
        axes.plot(t, column, color=COLORS[len(shown)], linewidth=1.2, label=literal(name))
        shown.append(column)
    if alike:
        axes.plot([], [], color=GREY, linewidth=0.0, label=f"{alike} more alike")


def _output(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    if "slider_position" in ideal:
        values = ideal["slider_position"].values
        scale = engineering("m", values)
        axes.plot(t, scale.factor * values, color=BLUE, linewidth=1.2)
        axes.set_ylabel(scale.label("slider position"))
        return
    angle = np.degrees(ideal["angle"].transpose("time", "body").values)
    moving = np.flatnonzero(np.ptp(angle, axis=0) > 0.0)
    curves(axes, t, angle[:, moving], [str(name) for name in ideal["body"].values[moving]])
    axes.set_ylabel("angle [deg]")


def _transmission(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    """Transmission angles, the smallest first."""
    values = DEGREES.factor * ideal["transmission_angle"].values
    order = np.argsort(values.min(axis=0), kind="stable")
    curves(axes, t, values[:, order], [str(name) for name in ideal["dyad"].values[order]])
    axes.set(ylim=(0.0, 90.0), yticks=[0.0, 30.0, 60.0, 90.0])
    axes.set_ylabel("transmission angle [deg]")
    if not values.size:
        axes.text(0.5, 0.5, "no dyads behind a drive", transform=axes.transAxes, ha="center", color=GREY)


def _drive(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    """Torques of the drives, or forces of the driven rods."""
    coordinates = ideal["coordinate_drive_unit"].values if "coordinate_drive_unit" in ideal else ["m"]
    of_coordinate = ("coordinate_drive_force", "coordinate_drive", "N m" if coordinates[0] == "rad" else "N")
    for variable, name, unit in (("drive_torque", "drive", "N m"), of_coordinate, ("rod_force", "rod", "N")):
        if variable in ideal and ideal[variable].size:
            array = ideal[variable]
            names = [str(driven) for driven in ideal[name].values] if name in array.dims else [variable.replace("_", " ")]
            values = array.values.reshape(len(t), -1)
            _scaled(axes, ideal, t, values, names, unit, variable.replace("_", " "))
            return
    axes.text(0.5, 0.5, "no drive", transform=axes.transAxes, ha="center", color=GREY)
    axes.set_ylabel("drive")


def _reactions(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    """Reactions, the largest first."""
    force = np.linalg.norm(ideal["reaction"].transpose("time", "joint", "axis").values, axis=2)
    determined = np.flatnonzero(np.isfinite(force).any(axis=0))
    if not determined.size:
        axes.text(0.5, 0.5, "not determined: redundant joints", transform=axes.transAxes, ha="center", color=GREY)
        axes.set_ylabel("reaction")
        return
    order = determined[np.argsort(-np.nanmax(force[:, determined], axis=0), kind="stable")]
    _scaled(axes, ideal, t, force[:, order], [str(name) for name in ideal["joint"].values[order]], "N", "reaction")


def _scaled(axes: Axes, ideal: xr.Dataset, t: np.ndarray, values: np.ndarray, names: list[str], unit: str, label: str) -> None:
    """Curves in a suitable unit, on an axis that singular positions do not stretch."""
    large = float(np.nanpercentile(np.abs(values), HIGH)) if np.isfinite(values).any() else 0.0
    steep = ideal.sizes["singular"] > 0 and float(np.nanmax(np.abs(values))) > STEEPEST * large > 0.0
    shown = np.clip(values, -STEEPEST * large, STEEPEST * large) if steep else values
    scale = engineering(unit, shown[np.isfinite(shown)])
    curves(axes, t, scale.factor * values, names)
    axes.set_ylabel(scale.label(label))
    if steep:
        low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
        margin = 0.05 * (high - low)
        axes.set_ylim(scale.factor * (low - margin), scale.factor * (high + margin))
