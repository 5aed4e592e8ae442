"""The orbit of the journal in its bearing."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.picture import picture
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import BEYOND, Joints, chosen_joints, clearance_pins, note_more, predictability_horizon, window
from scissordyn.plot.style import (
    BLACK,
    GREY,
    LINE,
    SKY,
    VERMILION,
    Canvas,
    figure_width,
    in_lines,
    legend,
    literal,
    normal,
    panels,
)

if TYPE_CHECKING:
    import xarray as xr

COLUMNS, LEAST = 3, 1.7  # Orbits in a row, and their least width in a figure of a width that the user has chosen [inch]
VISIBLE = 0.1  # Drawn depth of the largest indentation, as a fraction of the clearance


@picture("One per joint.")
def orbit(
    run: xr.Dataset,
    *,
    joint: Joints = None,
    exaggeration: float | None = None,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Journal centre relative to the bearing centre, with the clearance circle; free flight and contact in two colours.

    Parameters
    ----------
    exaggeration : float, optional
        Magnification of indentations, noted in the picture; chosen for each joint if not given.

    Raises
    ------
    InputError
        If no revolute joint has clearance, or a named one has none.
    """
    run = window(run, start, end)
    pins = run.sel(joint=clearance_pins(run)) if "plane_contact" in run else run
    chosen = chosen_joints(pins, joint)
    columns = max(1, min(len(chosen), COLUMNS, int(min(figure_width() / LEAST, COLUMNS)))) if axes is None else 1
    rows = math.ceil(len(chosen) / columns)
    width = 5.4 if columns == 1 else 3.8 * columns
    if axes is None:
        drawn = panels(None, rows, columns, size=(width, 0.8 + (4.6 if columns == 1 else 3.9) * rows), share=False)
        for spare in drawn[len(chosen) :]:
            spare.remove()
        drawn = drawn[: len(chosen)]
    else:
        drawn = panels(axes, len(chosen), size=(width, width))
    room = min(figure_width(), width) / columns - 0.5
    for panel, name in zip(drawn, chosen, strict=True):
        _orbit(panel, run, name, exaggeration, room)
    legend(drawn, above=axes is None)
    if joint is None and axes is None:
        note_more(drawn, pins, chosen)
    return drawn


def _orbit(axes: Axes, run: xr.Dataset, joint: str, exaggeration: float | None, room: float) -> None:
    place = run["eccentricity"].sel(joint=joint).transpose("time", "axis").values
    clearance = float(run["clearance"].sel(joint=joint))
    touching = run["in_contact"].sel(joint=joint).values.astype(bool)
    distance = np.hypot(place[:, 0], place[:, 1])
    depth = np.maximum(distance - clearance, 0.0)
    gain = _round_gain(VISIBLE * clearance / np.max(depth)) if exaggeration is None and np.any(depth) else exaggeration or 1.0
    stretch = np.ones_like(distance)
    np.divide(distance + (gain - 1.0) * depth, distance, out=stretch, where=distance > 0.0)
    scale = engineering("m", clearance)
    drawn = scale.factor * place * stretch[:, None]

    axes.set_aspect("equal", adjustable="box")
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    circle = scale.factor * clearance * np.stack([np.cos(around), np.sin(around)])
    axes.plot(*circle, color=GREY, linewidth=0.8, linestyle=(0, (2, 2)), label="clearance circle")
    until = predictability_horizon(run)
    before = run["time"].values <= (math.inf if until is None else until)
    # a flight is drawn from the last sample before it to the first one after it, so that the orbit is continuous
    flying = ~touching
    flying[:-1] |= ~touching[1:]
    flying[1:] |= ~touching[:-1]
    for part, color, label in ((flying, SKY, "free flight"), (touching, VERMILION, "contact")):
        for when, alpha in ((before, 1.0), (~before, 0.3)):
            if np.any(part & when):
                curve = np.where((part & when)[:, None], drawn, np.nan)
                shown = label if alpha == 1.0 else f"pale: {BEYOND}"
                axes.plot(curve[:, 0], curve[:, 1], color=color, linewidth=LINE, alpha=alpha, label=shown)
    axes.plot(*drawn[0], linestyle="", marker="o", markersize=4.0, color=BLACK, label="start")
    axes.set_xlabel(scale.label("x of the journal"))
    axes.set_ylabel(scale.label("y of the journal"))
    title = f"joint {literal(joint)}" + (f", indentation magnified {gain:g} times" if gain != 1.0 else "")
    title = in_lines(title, room, normal())
    axes.set_title(title, loc="left", fontsize=normal())
    reach = 1.08 * scale.factor * max(clearance, float(np.max(distance * stretch)))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach))


def _round_gain(gain: float) -> float:
    """The largest of 1, 2, 5, 10, 20, ... that is not above `gain`."""
    if gain < 2.0 - 1e-9:
        return 1.0
    almost = gain * (1.0 + 1e-9)  # 49.999999 is 50 after round-off
    power = 10.0 ** math.floor(math.log10(almost))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= almost)
