"""The contact forces of clearance joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.contact import contact_times, force_curve
from scissordyn.plot.picture import picture
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.series import Joints, chosen_joints, finish, note_more, time_scale, window
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    IDEAL,
    LINE,
    VERMILION,
    Canvas,
    legend,
    literal,
    normal,
    panels,
    small,
)

if TYPE_CHECKING:
    import xarray as xr

STRIP = 0.06  # Height of the strip of contacts, as a fraction of the panel


@picture("One per joint, followed by one for its friction if it has any.")
def force(
    run: xr.Dataset,
    ideal: xr.Dataset | None = None,
    *,
    joint: Joints = None,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Force of each clearance joint, its friction and film, its contacts, and the ideal mechanism's reaction.

    Parameters
    ----------
    ideal : Dataset, optional
        The run of the ideal mechanism; the magnitude of its reaction is drawn dashed.

    Raises
    ------
    InputError
        If no joint has clearance, or a named one has none.
    """
    run = window(run, start, end)
    chosen = chosen_joints(run, joint)
    frictional = [bool(np.any(np.nan_to_num(run["friction_force"].sel(joint=name).values))) for name in chosen]
    ratios = [ratio for has_friction in frictional for ratio in ((2.0, 1.2) if has_friction else (2.0,))]
    drawn = panels(axes, len(ratios), size=(9.0, 0.6 + 1.35 * sum(ratios)), ratios=ratios)
    time = time_scale(run)
    following = iter(drawn)
    for name, has_friction in zip(chosen, frictional, strict=True):
        _force(panel := next(following), run, ideal, name, time)
        if len(chosen) > 1:
            panel.set_title(f"joint {literal(name)}", loc="left", fontsize=normal())
        if has_friction:
            values = run["friction_force"].sel(joint=name).values
            scale = engineering("N", values)
            under = next(following)
            under.plot(time.factor * run["time"].values, scale.factor * values, color=BLUE, linewidth=LINE)
            under.set_ylabel(scale.label("friction force"))
    finish(drawn, run, time)
    legend(drawn)
    if joint is None and axes is None:
        note_more(drawn, run, chosen)
    return drawn


def _force(axes: Axes, run: xr.Dataset, ideal: xr.Dataset | None, joint: str, time: Scale) -> None:
    oiled = "film" in run.dims and joint in run["film"].values
    curve, contacts = force_curve(run, joint), contact_times(run, joint, normal=oiled)
    values, peaks = curve.values, contacts.peak
    reaction = None
    if ideal is not None and "reaction" in ideal and joint in ideal["joint"].values:
        reaction = np.hypot(*ideal["reaction"].sel(joint=joint).transpose("axis", "time").values)
    metal = force_curve(run, joint, normal=True) if oiled else None
    others = [] if reaction is None else [reaction]
    scale = engineering("N", values, peaks, *others)
    axes.plot(time.factor * curve["time"].values, scale.factor * values, color=BLUE, linewidth=LINE, label="force")
    if peaks.size:
        look: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 2.5, "color": BLACK}
        axes.plot(time.factor * contacts.peak_time, scale.factor * peaks, label="peak of a contact", **look)
    if reaction is not None and ideal is not None:
        axes.plot(time.factor * ideal["time"].values, scale.factor * reaction, label="ideal reaction", **IDEAL)
    if metal is not None:
        there, sizes = time.factor * metal["time"].values, scale.factor * metal.values
        axes.plot(there, sizes, color=GREEN, linewidth=LINE, label="normal force of the metal")
    axes.set_ylabel(scale.label("force"))
    top = scale.factor * max([0.0, *peaks.tolist(), float(np.max(values)), *(float(np.nanmax(other)) for other in others)])
    top = top or 1.0
    # sizes of forces are never negative: the region below zero is used for the strip of contacts
    axes.set_ylim(-1.5 * STRIP * top, 1.06 * top)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    if contacts.start.size:
        spans = list(zip(time.factor * contacts.start, time.factor * (contacts.end - contacts.start), strict=True))
        look = {"facecolor": VERMILION, "edgecolor": VERMILION, "linewidth": 0.5, "label": "in contact"}
        axes.broken_barh(spans, (0.0, STRIP), transform=axes.get_xaxis_transform(), **look)
    else:
        axes.text(0.5, 0.5, "no contact in this run", transform=axes.transAxes, ha="center", fontsize=small(), color=GREY)
