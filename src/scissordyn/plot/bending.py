"""Bars that bend: moment and axial force on the mechanism at an instant, and the stress over time."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.component.port.axis import bent_axis
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.bending import beams_of
from scissordyn.plan.flexible import flexible_bars
from scissordyn.plot.place import Corners, corners_of, upright
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import finish, mechanism_of, time_scale
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREY,
    LINE,
    VERMILION,
    dress,
    figure_size,
    figure_width,
    in_lines,
    is_column,
    small,
)
from scissordyn.plot.window import window
from scissordyn.run.bars import PARTS
from scissordyn.run.placement import Placement

__all__ = ["bending"]

ORDINATE = 0.14
"""The largest value of a diagram, as a fraction of the mechanism's longer side."""

DIAGRAMS = {
    "bending moment": ("N m", "beam_start_moment", "beam_end_moment", BLUE),
    "axial force": ("N", "beam_axial_force", "beam_axial_force", VERMILION),
}
"""Unit, values at the ends of an element, and colour."""


def bending(
    run: xr.Dataset,
    mechanism: Mechanism | None = None,
    *,
    time: float | None = None,
    start: float | None = None,
    end: float | None = None,
) -> list[Axes]:
    """Bending moment and axial force on the mechanism, on the side that is in tension, and the largest stress over time.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism, optional
        The one that was run, with bars that bend; the one that the run holds if not given.
    time : float, optional
        Instant of the diagrams [s], at the nearest sample; that with the largest strain of a fibre if not given.
    start, end : float, optional
        Part of the run to draw [s]; the whole run if not given.

    Returns
    -------
    list of Axes
        Bending moment, axial force, and stress (or strain, if the material is unknown) over time.

    Raises
    ------
    InputError
        If no bar bends.
    """
    run, mechanism = window(run, start, end), mechanism or mechanism_of(run)
    beams = _parts(mechanism)
    if not beams or "beam_fibre_strain" not in run:
        raise InputError("a picture of bending of bars that do not bend", "bars that bend", "mechanism.with_bending(...)")
    strain = run["beam_fibre_strain"].sel(beam=beams).transpose("time", "beam").values
    when = int(np.argmax(strain.max(axis=1))) if time is None else int(np.argmin(np.abs(run["time"].values - time)))
    placed = Placement.at(mechanism, run, [when], turns=upright(mechanism))
    corners = _room(corners_of(placed))
    width, height = corners[1] - corners[0]
    tall = 1.0 + min(1.6, max(0.35, 5.0 * float(height / width)))
    if is_column():  # the diagrams stand one below the other
        figure = Figure(figsize=figure_size(5.5, 2.0 * tall + 3.2), layout="constrained")
        grid = figure.add_gridspec(3, 1, height_ratios=(tall, tall, 2.2))
        drawn, below = [figure.add_subplot(grid[k, 0]) for k in range(2)], grid[2, 0]
    else:
        figure = Figure(figsize=figure_size(11.0, tall + 2.6), layout="constrained")
        grid = figure.add_gridspec(2, 2, height_ratios=(tall, 2.2))
        drawn, below = [figure.add_subplot(grid[0, k]) for k in range(2)], grid[1, :]
    scale = time_scale(run)
    now = f"t = {scale.factor * float(run['time'].values[when]):.4g} {scale.unit}"
    for axes, (title, (unit, first, last, colour)) in zip(drawn, DIAGRAMS.items(), strict=True):
        values = np.column_stack([run[name].isel(time=when).sel(beam=beams).values for name in (first, last)])
        _diagram(axes, placed, mechanism, values, corners, colour)
        k = int(np.argmax(np.max(np.abs(values), axis=1)))
        most = float(values[k, int(np.argmax(np.abs(values[k])))])
        one = engineering(unit, abs(most))
        said = f"{title}, {now}: {one.factor * most:.3g} {one.unit} in {beams[k]}"
        axes.set_title(in_lines(said, min(figure_width(), 5.5) - 1.0, small()), loc="left", fontsize=small())
    drawn.append(figure.add_subplot(below))
    _over_time(drawn[2], run, beams, when)
    return drawn


def _parts(mechanism: Mechanism) -> list[str]:
    """Names of the beam elements and of the parts of flexible bars."""
    return [beam.name for beam in beams_of(mechanism)] + [
        f"{bar.name} {k + 1}" for bar in flexible_bars(mechanism) for k in range(PARTS * (len(bar.sections) - 1))
    ]


def _ends(mechanism: Mechanism, placed: Placement) -> list[np.ndarray]:
    """Where each of them begins and ends, shape (2, 2) [m]."""
    found = [np.array([placed.place(end)[0] for end in (beam.start, beam.end)]) for beam in beams_of(mechanism)]
    for bar in flexible_bars(mechanism):
        axis = bent_axis(bar, placed, np.linspace(0.0, 1.0, PARTS + 1))[0].reshape(-1, PARTS + 1, 2)
        found += [span[k : k + 2] for span in axis for k in range(PARTS)]
    return found


def _room(corners: Corners) -> Corners:
    """With room for the diagrams around the mechanism."""
    low, high = corners
    reach = 1.2 * ORDINATE * float(np.max(high - low))
    return low - reach, high + reach


def _diagram(axes: Axes, placed: Placement, mechanism: Mechanism, values: np.ndarray, corners: Corners, colour: Any) -> None:
    """Fill between each element and its values, drawn across it."""
    dress(axes)
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(corners[0][0], corners[1][0]), ylim=(corners[0][1], corners[1][1]), xlabel="x [m]", ylabel="y [m]")
    largest = float(np.max(np.abs(values))) or 1.0
    reach = ORDINATE * float(np.max(corners[1] - corners[0])) / 1.3
    for ends, (first, last) in zip(_ends(mechanism, placed), values, strict=True):
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        # a positive moment curves towards +y of the bar: its fibres at -y are in tension
        across = np.array([along[1], -along[0]])
        outer = ends + np.array([[first], [last]]) / largest * reach * across
        axes.fill(*np.vstack([ends, outer[::-1]]).T, color=colour, alpha=0.25, linewidth=0.0, zorder=1.5)
        axes.plot(*outer.T, color=colour, linewidth=0.9, zorder=1.8)
        axes.plot(*ends.T, color=BLACK, linewidth=1.4, solid_capstyle="round", zorder=2.0)
    for joint in mechanism.joints:
        axes.plot(*placed.place(joint.bearing)[0], "o", ms=3.2, color=BLACK, mfc="white", mew=0.8, zorder=3.0)


def _over_time(axes: Axes, run: xr.Dataset, beams: list[str], when: int) -> None:
    """The largest stress of all bars over time, with the yield strength where it is known."""
    stress, used = (run[name].sel(beam=beams).transpose("time", "beam").values for name in ("beam_stress", "beam_utilisation"))
    dress(axes)
    time = time_scale(run)
    x = time.factor * run["time"].values
    if np.max(stress) > 0.0:
        unit = engineering("Pa", float(np.max(stress)))
        axes.plot(x, unit.factor * stress.max(axis=1), color=BLUE, linewidth=LINE)
        label = f"largest stress [{unit.unit}]"
        known = used > 0.0
        if np.any(known):
            strength = unit.factor * float(np.min(stress[known] / used[known]))
            axes.axhline(strength, color=GREY, linewidth=0.9, linestyle="--", label="yield strength")
            axes.legend(loc="lower right", fontsize=small())
    else:
        strain = run["beam_fibre_strain"].sel(beam=beams).transpose("time", "beam").values
        axes.plot(x, strain.max(axis=1), color=BLUE, linewidth=LINE)
        label = "largest strain [1]"
    axes.axvline(x[when], color=GREY, linewidth=0.7)
    axes.set_ylabel(label)
    axes.set_ylim(bottom=0.0)
    finish([axes], run, time)
