"""Bars that bend: moment, axial force and stress on the mechanism, at an instant or their envelope, and stress over time."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import scene_of
from scissordyn.plot.bar_diagram import AXIAL, MOMENT, ORDINATE, colour_bar, diagram_of, is_known
from scissordyn.plot.drawing import Drawing
from scissordyn.plot.file import figure_of
from scissordyn.plot.picture import picture
from scissordyn.plot.place import Corners
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import finish, mechanism_of, time_scale, window
from scissordyn.plot.style import BLUE, GREY, LINE, dress, figure_size, figure_width, in_lines, is_column, small

if TYPE_CHECKING:
    import xarray as xr


@picture()
def bending(
    run: xr.Dataset,
    mechanism: Mechanism | None = None,
    *,
    time: float | None = None,
    envelope: bool = False,
    start: float | None = None,
    end: float | None = None,
) -> list[Axes]:
    """Bending moment and axial force as ordinates, stress as colours of the bars, and the largest stress over time.

    Ordinates of the bending moment stand on the side of a bar whose fibres are in tension, those of a positive axial force on
    the side of -y of its frame.

    Parameters
    ----------
    mechanism : Mechanism, optional
        The one that was run, with bars that bend; the one that the run holds if not given.
    time : float, optional
        Instant of the diagrams [s], at the nearest sample; that with the largest strain of a fibre if not given.
    envelope : bool
        The largest and the least value at each place over all samples, on the mechanism at that instant.

    Returns
    -------
    list of Axes
        Bending moment, axial force, stress where the material of all bars is known, and stress (or strain) over time.

    Raises
    ------
    InputError
        If no bar bends.
    """
    run, mechanism = window(run, start, end), mechanism or mechanism_of(run)
    quantities = [quantity for quantity in (MOMENT, AXIAL, "stress") if is_known(quantity, mechanism)]
    beams = list(diagram_of(run, mechanism, quantities[0]).parts)
    strain = run["beam_fibre_strain"].sel(beam=beams).transpose("time", "beam").values
    when = int(np.argmax(strain.max(axis=1))) if time is None else int(np.argmin(np.abs(run["time"].values - time)))
    part = run if envelope else run.isel(time=[when])
    shown = [diagram_of(part, mechanism, quantity) for quantity in quantities]
    shown = [diagram.envelope() for diagram in shown] if envelope else shown
    scene = dataclasses.replace(scene_of(run, mechanism, np.array([when]), []), diagrams=tuple(shown))
    reach = 1.2 * ORDINATE * float(np.max(scene.high - scene.low))  # room for the diagrams around the mechanism
    corners = scene.low - reach, scene.high + reach
    drawn, below = _grid(len(shown), corners)
    title = "envelope" if envelope else scene.instant(0)
    drawings = []
    for axes, diagram in zip(drawn, shown, strict=True):
        drawings.append(Drawing(axes, dataclasses.replace(scene, on_bars=diagram.quantity), corners))
        drawings[-1].show(0, diagram)
        if diagram.coloured:
            colour_bar([axes], diagram)
        most, where = diagram.most()
        caption = f"{diagram.quantity}, {title}: {diagram.scale.with_unit(most, 3)} in {where}"
        axes.set_title(in_lines(caption, min(figure_width(), 5.5) - 1.0, small()), loc="left", fontsize=small())
    figure = figure_of(drawn)
    drawn.append(figure.add_subplot(below))
    _over_time(drawn[-1], run, beams, when)
    figure.draw_without_rendering()
    for drawing in drawings:
        drawing.fit_rings()
    return drawn


def _grid(diagrams: int, corners: Corners) -> tuple[list[Axes], SubplotSpec]:
    """Panels of a new figure for two or three diagrams, and the place of the curve."""
    width, height = corners[1] - corners[0]
    tall = 1.0 + min(1.6, max(0.35, 5.0 * float(height / width)))
    if is_column():  # the diagrams stand one below the other
        figure = Figure(figsize=figure_size(5.5, diagrams * tall + 3.2), layout="constrained")
        grid = figure.add_gridspec(diagrams + 1, 1, height_ratios=(*[tall] * diagrams, 2.2))
        return [figure.add_subplot(grid[k, 0]) for k in range(diagrams)], grid[diagrams, 0]
    lower = max(tall, 2.2) if diagrams > 2 else 2.2
    figure = Figure(figsize=figure_size(11.0, tall + lower + 0.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(tall, lower))
    places = [grid[0, 0], grid[0, 1], grid[1, 0]][:diagrams]
    return [figure.add_subplot(place) for place in places], grid[1, 1] if diagrams > 2 else grid[1, :]


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
        any_time = used > 0.0
        if np.any(any_time):
            strength = unit.factor * float(np.min(stress[any_time] / used[any_time]))
            axes.axhline(strength, color=GREY, linewidth=0.9, linestyle="--", label="yield strength")
            axes.legend(loc="best", fontsize=small())
    else:
        strain = run["beam_fibre_strain"].sel(beam=beams).transpose("time", "beam").values
        axes.plot(x, strain.max(axis=1), color=BLUE, linewidth=LINE)
        label = "largest strain [1]"
    axes.axvline(x[when], color=GREY, linewidth=0.7)
    axes.set_ylabel(label)
    axes.set_ylim(bottom=0.0)
    finish([axes], run, time)
