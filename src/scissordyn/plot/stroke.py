"""Draw the ideal kinematics over time, and static forces along the stroke."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.series import time_scale
from scissordyn.plot.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, Canvas, legend, literal, panels

if TYPE_CHECKING:
    import xarray as xr

# Colours of the curves in a panel, in order; further curves are left out
COLORS = (BLUE, VERMILION, GREEN, PURPLE, SKY, ORANGE)


# Line style of the vertical line at each kind of singular position
SINGULAR_LINE_STYLES = {"change point": (0, (5, 2)), "near change point": (0, (1, 2)), "locking position": "solid"}

OVER_EXAMPLE = "over='time'"  # Correct option for the horizontal axis, which error texts show


FORCES_OF = {"drive": "drives", "component": "components", "coupling": "couplings", "reaction": "joints"}
"""Dimension of the parts whose forces a panel of the static forces shows, by kind of force; in the order of the panels."""

NAME_PREFIXES = {
    "drive": ("drive torque", "rod force ", "coordinate drive "),
    "coupling": ("coupling ",),
    "reaction": ("reaction ", "weld "),
}
"""First words of the names of forces in each panel of the static forces; forces of components have other names."""


def kinematics(ideal: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Draw the ideal kinematics over time and mark the singular positions."""
    drawn = panels(axes, 4, size=(7.5, 8.5))
    time = time_scale(ideal)
    t = time.factor * ideal["time"].values
    _draw_output(drawn[0], ideal, t)
    _draw_transmission(drawn[1], ideal, t)
    _draw_drive(drawn[2], ideal, t)
    _draw_reactions(drawn[3], ideal, t)
    for panel in drawn:
        for kind, at in zip(ideal["singular_kind"].values, ideal["singular_time"].values, strict=True):
            panel.axvline(
                time.factor * at, color=BLACK, linewidth=0.8, linestyle=SINGULAR_LINE_STYLES[str(kind)], label=str(kind)
            )
        legend([panel])
    drawn[-1].set_xlabel(time.label("time"))
    return drawn


def _draw_curves(axes: Axes, t: np.ndarray, values: np.ndarray, names: np.ndarray) -> None:
    """Draw and name curves that differ from each other; state how many more are equal to a drawn one or left out."""
    shown: list[np.ndarray] = []
    alike = left_out = 0
    for name, column in zip(names.astype(str).tolist(), values.T, strict=True):
        if any(np.allclose(column, other, rtol=1e-6, atol=1e-9, equal_nan=True) for other in shown):
            alike += 1
            continue
        if len(shown) == len(COLORS):
            left_out += 1
            continue
        axes.plot(t, column, color=COLORS[len(shown)], linewidth=1.2, label=literal(name))
        shown.append(column)
    for count, text in ((alike, "more on these lines"), (left_out, "more left out")):
        if count:
            axes.plot([], [], color=GREY, linewidth=0.0, label=f"{count} {text}")


def _write_note(axes: Axes, label: str, text: str) -> None:
    """Write a text in an empty panel."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", color=GREY)
    axes.set_ylabel(label)


def _draw_output(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    if "slider_position" in ideal:
        values = ideal["slider_position"].values
        scale = engineering("m", values)
        axes.plot(t, scale.factor * values, color=BLUE, linewidth=1.2)
        axes.set_ylabel(scale.label("slider position"))
        return
    angle = np.degrees(ideal["angle"].transpose("time", "body").values)
    moving = np.flatnonzero(np.ptp(angle, axis=0) > 0.0)
    _draw_curves(axes, t, angle[:, moving], ideal["body"].values[moving])
    axes.set_ylabel("angle [deg]")


def _draw_transmission(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    """Draw the transmission angles, the smallest first."""
    values = DEGREES.factor * ideal["transmission_angle"].values
    if not values.size:
        _write_note(axes, "", "no transmission angle: no pair of bodies is moved by a drive")
    order = np.argsort(values.min(axis=0), kind="stable")
    _draw_curves(axes, t, values[:, order], ideal["dyad"].values[order])
    axes.set(ylim=(0.0, 90.0), yticks=[0.0, 30.0, 60.0, 90.0], ylabel="transmission angle [deg]")


def _draw_drive(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    """Draw the torques of the drives, or the forces of the driven rods."""
    coordinates = ideal["coordinate_drive_unit"].values if "coordinate_drive_unit" in ideal else ["m"]
    of_coordinate = ("coordinate_drive_force", "coordinate_drive", "N m" if coordinates[0] == "rad" else "N")
    for variable, along, unit in (("drive_torque", "drive", "N m"), of_coordinate, ("rod_force", "rod", "N")):
        if variable in ideal and ideal[variable].size:
            label, array = variable.replace("_", " "), ideal[variable]
            names = ideal[along].values if along in array.dims else np.array([label])
            _draw_scaled(axes, ideal, t, array.values.reshape(len(t), -1), names, unit, label)
            return
    _write_note(axes, "drive", "no drive")


def _draw_reactions(axes: Axes, ideal: xr.Dataset, t: np.ndarray) -> None:
    """Draw the reactions, the largest first."""
    force = np.linalg.norm(ideal["reaction"].transpose("time", "joint", "axis").values, axis=2)
    determined = np.flatnonzero(np.isfinite(force).any(axis=0))
    if not determined.size:
        _write_note(axes, "reaction", "not determined: redundant joints")
        return
    order = determined[np.argsort(-np.nanmax(force[:, determined], axis=0), kind="stable")]
    _draw_scaled(axes, ideal, t, force[:, order], ideal["joint"].values[order], "N", "reaction")


def _draw_scaled(
    axes: Axes, ideal: xr.Dataset, t: np.ndarray, values: np.ndarray, names: np.ndarray, unit: str, label: str
) -> None:
    """Draw curves in a suitable unit, on an axis that singular positions do not stretch."""
    percentile = 90.0  # forces above it are near a singular position
    # axes end at this multiple of the forces' 90th percentile near singular positions, where forces are unbounded
    steepest = 4.0
    large = float(np.nanpercentile(np.abs(values), percentile)) if np.isfinite(values).any() else 0.0
    steep = ideal.sizes["singular"] > 0 and float(np.nanmax(np.abs(values))) > steepest * large > 0.0
    shown = np.clip(values, -steepest * large, steepest * large) if steep else values
    scale = engineering(unit, shown[np.isfinite(shown)])
    _draw_curves(axes, t, scale.factor * values, names)
    axes.set_ylabel(scale.label(label))
    if steep:
        low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
        margin = 0.05 * (high - low)
        axes.set_ylim(scale.factor * (low - margin), scale.factor * (high + margin))


def statics(forces: xr.Dataset, *, over: str = "input", axes: Canvas = None) -> list[Axes]:
    """Draw forces of drives, rods, components, couplings and joints over the stroke.

    Parameters
    ----------
    forces : Dataset
        Result of `sd.statics`.
    over : str
        "time", "input" (the coordinate of the first drive), or a coordinate of a tracked point, for example "table.x".
    axes : Axes or sequence of Axes, optional
        One Axes for each panel.

    Returns
    -------
    list of Axes
    """
    round_off = 1e-12  # forces below this fraction of the largest are round-off; panels with only such forces are left out
    # forces that vary by less than this fraction of the largest are drawn on an axis that includes zero
    constant_fraction = 1e-6
    names, units = forces["quantity"].values.astype(str), forces["quantity_unit"].values.astype(str)
    starts = (
        (next((kind for kind, begin in NAME_PREFIXES.items() if name.startswith(begin)), "component"))
        for name in names.tolist()
    )
    panel_of = np.array(list(starts))
    sizes = np.nan_to_num(np.abs(forces["quantity_value"].values)).max(axis=0)
    loaded = (sizes >= round_off * sizes.max(initial=0.0)) & np.isfinite(forces["quantity_value"].values).any(axis=0)
    chosen_of = {(kind, unit): (panel_of == kind) & (units == unit) for kind in FORCES_OF for unit in ("N", "N m")}
    groups = {key: np.flatnonzero(chosen) for key, chosen in chosen_of.items() if np.any(chosen & loaded)}
    drawn = panels(axes, len(groups), size=(7.5, 2.2 * len(groups) + 0.8))
    values, label = _abscissa(forces, over)
    for panel, ((kind, unit), chosen) in zip(drawn, groups.items(), strict=True):
        force = forces["quantity_value"].values[:, chosen]
        order = np.argsort(-np.nanmax(np.abs(force), axis=0), kind="stable")
        scale = engineering(unit, force)
        _draw_curves(
            panel, values, scale.factor * force[:, order], np.strings.replace(names[chosen][order], "reaction ", "", 1)
        )
        largest = np.nanmax(np.abs(force))
        if largest > 0.0 and np.nanmax(np.ptp(force, axis=0)) <= constant_fraction * largest:
            ends = 0.0, *(1.2 * scale.factor * force[0])
            panel.set_ylim(np.nanmin(ends), np.nanmax(ends))
        panel.set_ylabel(scale.label(f"{'torque' if unit == 'N m' else 'force'} of {FORCES_OF[kind]}"))
        legend([panel])
    drawn[-1].set_xlabel(label)
    return drawn


def _abscissa(forces: xr.Dataset, over: str) -> tuple[np.ndarray, str]:
    track, _, axis = over.rpartition(".")
    tracks = forces["track"].values.tolist() if "track" in forces else []
    if over == "time":
        scale, values, name = engineering("s", forces["time"].values), forces["time"].values, "time"
    elif over == "input":
        moved, turns = str(forces["prescribed"].values[0]), str(forces["prescribed_unit"].values[0]) == "rad"
        values, scale = forces["input"].values[:, 0], DEGREES if turns else Scale(1e3, "mm")
        is_rod = f"rod force {moved}" in forces["quantity"].values
        name = f"{'angle' if turns else 'length' if is_rod else 'position'} of {literal(moved)}"
    elif track in tracks and axis in ("x", "y"):
        values, name = forces["track_position"].sel(track=track, axis=axis).values, over
        scale = engineering("m", values)
    else:
        allowed = ["time", "input", *(f"{name}.{axis}" for name in tracks for axis in "xy")]
        raise InputError(f"unknown horizontal axis over={over!r}", ", ".join(allowed), OVER_EXAMPLE)
    return scale.factor * values, scale.label(name)
