"""The structure itself at several instants, with its clearance joints magnified."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import channel_of, clearance_joint, guides_of, scene_of
from scissordyn.plot.bar_diagram import colour_bar
from scissordyn.plot.drawing import Drawing, draw_magnified
from scissordyn.plot.file import figure_of
from scissordyn.plot.label import write_labels
from scissordyn.plot.picture import picture
from scissordyn.plot.place import upright
from scissordyn.plot.series import BEYOND, Joints, chosen_joints, mechanism_of, note_more, predictability_horizon, window
from scissordyn.plot.style import BLACK, LIGHT, figure_size, figure_width, in_lines, is_column, legend, literal, small
from scissordyn.run.answer.deflection import magnified_deflection
from scissordyn.run.answer.joint_force import clearance_joints
from scissordyn.run.answer.placement import Placement

if TYPE_CHECKING:
    import xarray as xr

TALL = 2.0  # Largest ratio of width to height of structures drawn side by side; wider ones are drawn one below the other

FEW, WIDE = 1, 2.0
"""Magnified joints in the column of a page, and the largest ratio of width to height of the room for a structure there."""

LARGER = 1.6  # Blocks, loads and symbols of stills, over those of films, which are larger pictures
CLOSE = 4  # With more magnified joints their panels are narrow, and their titles have one more line


@picture()
def structure(
    run: xr.Dataset,
    mechanism: Mechanism | None = None,
    *,
    joint: Joints = None,
    times: int | Sequence[float] = 4,
    magnify: float = 1.0,
    bars: str | None = None,
    start: float | None = None,
    end: float | None = None,
) -> list[Axes]:
    """The mechanism at several instants, each with its clearance joints magnified beside it, on a new figure.

    Parameters
    ----------
    joint : str or sequence of str, optional
        Clearance joints to magnify; those with the largest forces if not given.
    times : int or sequence of float
        Number of instants, equally spaced from start to end; or instants [s], each at the nearest sample.
    magnify : float
        Factor of the deflections of bars that bend, which the titles say.
    bars : {"stress", "utilisation", "bending moment", "axial force"}, optional
        What is drawn on bars that bend: a stress of the extreme fibre as their colours, moments on the side in tension.

    Returns
    -------
    list of Axes
        Instant by instant: the structure, then its joints.

    Raises
    ------
    InputError
        If no instant is asked for, a named joint has no clearance, or bars lack what is to be drawn on them.
    """
    run, mechanism = window(run, start, end), mechanism or mechanism_of(run)
    time = run["time"].values
    wanted = np.linspace(time[0], time[-1], times) if isinstance(times, int) else np.asarray(times, float)
    if wanted.size == 0:
        raise InputError(f"times = {times!r}", "a whole number >= 1, or instants [s]", "times=4")
    samples = [int(np.argmin(np.abs(time - instant))) for instant in wanted]
    if magnify != 1.0:
        run = magnified_deflection(run, mechanism, magnify, samples=samples)
    largest = chosen_joints(run, joint) if joint is not None or clearance_joints(run) else []
    chosen = guides_of(mechanism, largest)
    scene = scene_of(run, mechanism, np.array(samples), [], on_bars=bars, larger=LARGER)
    width, height = scene.high - scene.low
    tall = bool(width < TALL * height) and not is_column()
    if is_column() and joint is None:
        chosen = chosen[:FEW]
    rows = _grid(tall, float(width / height), len(samples), len(chosen))
    until, larger = predictability_horizon(run), f", deflections {magnify:g}×" if magnify != 1.0 else ""
    drawings = []
    for k, (sample, (axes, *panels)) in enumerate(zip(samples, rows, strict=True)):
        drawings.append(Drawing(axes, scene))
        drawings[-1].show(k)
        axes.set_title(f"{scene.instant(k)}{larger}", loc="left", fontsize=small())
        if until is not None and scene.time[k] > until:
            look: dict[str, Any] = {"facecolor": LIGHT, "alpha": 0.7, "zorder": 0.0, "label": BEYOND}
            axes.add_patch(Rectangle((0.0, 0.0), 1.0, 1.0, transform=axes.transAxes, **look))
        _share_labels(axes, k, len(samples), tall=tall)
        for name, panel in zip(chosen, panels, strict=True):
            magnified(run, mechanism, sample, name, axes=panel)
            if len(chosen) > CLOSE:
                panel.set_title(panel.get_title().replace("magnified ", "magnified\n"), fontsize=small(), color=BLACK)
    drawn = [axes for row in rows for axes in row]
    legend(drawn, above=True)
    if (diagram := drawings[0].diagram) is not None and diagram.diagram.coloured:
        colour_bar([row[0] for row in rows], diagram.diagram)
    if joint is None:
        drawn_points = [point.name for point in mechanism.contact_points if point.guide in chosen]
        note_more(drawn, run, [*largest, *drawn_points])
    _write_names(drawings, {joint.name for joint in mechanism.clearance_joints}.difference(chosen))
    return drawn


def _write_names(drawings: Sequence[Drawing], left_out: Set[str]) -> None:
    """Write the names, which come last: their places depend on the layout of the whole figure."""
    figure_of([drawing.axes for drawing in drawings]).draw_without_rendering()
    for k, drawing in enumerate(drawings):
        drawing.fit_rings()
        write_labels(drawing.axes, [label for label in drawing.labels(k) if label.text not in left_out])


def _share_labels(axes: Axes, k: int, count: int, *, tall: bool) -> None:
    """Label the outer ones of structures that stand beside or below each other."""
    if tall:
        axes.locator_params(axis="x", nbins=4)
    if tall and k > 0:
        axes.set_ylabel("")
        axes.tick_params(labelleft=False)
    if not tall and k < count - 1:
        axes.set_xlabel("")
        axes.tick_params(labelbottom=False)


def _grid(tall: bool, aspect: float, instants: int, joints: int) -> list[list[Axes]]:
    """Panels of a new figure, one list per instant: the structure's, then one per joint."""
    if tall:
        width = 2.6
        lengths = [1.0 / aspect + 0.25, *[0.62] * joints]
        figure = Figure(figsize=figure_size(0.6 + width * instants, 0.6 + width * sum(lengths)), layout="constrained")
        grid = figure.subplots(1 + joints, instants, squeeze=False, height_ratios=lengths).T
    else:
        lengths = [min(aspect, WIDE) if is_column() else aspect, *[1.2] * joints]
        height = min(1.6, min(11.0, figure_width() - 0.8) / sum(lengths))
        titles = 1.0 if joints > CLOSE else 0.7 if is_column() else 0.45
        size = (figure_width() if is_column() else 0.8 + height * sum(lengths), 0.7 + (titles + height) * instants)
        figure = Figure(figsize=size if is_column() else figure_size(*size), layout="constrained")
        grid = figure.subplots(instants, 1 + joints, squeeze=False, width_ratios=lengths)
    return [list(row) for row in grid]


def magnified(run: xr.Dataset, mechanism: Mechanism, sample: int, joint: str, *, axes: Axes) -> Axes:
    """A clearance joint or guide at one sample, with magnified clearance: journal and bearing, or block and channel."""
    if joint in guides_of(mechanism, (point.name for point in mechanism.contact_points)):
        channel = channel_of(run, mechanism, [sample], joint)
        draw_magnified(axes, channel).show(0)
        count, gain = int(channel.touching[0].sum()), channel.gain
        state = f"{count} corner{'s' * (count > 1)} in contact" if count else "free flight"
    else:
        chosen_joints(run, [joint])
        placed = Placement.at(mechanism, run, [sample], turns=upright(mechanism))
        bearing = clearance_joint(run, mechanism, placed, np.array([sample]), joint, between=False)
        draw_magnified(axes, bearing).show(0)
        state, gain = "contact" if bearing.touched[0] else "free flight", bearing.gain
    width, letters = figure_of(axes).get_figwidth() * axes.get_position(original=True).width, small()
    caption = (f"{literal(joint)}: {state}", f"clearance magnified {gain:.2g} times")
    axes.set_title("\n".join(in_lines(line, 1.35 * width, letters) for line in caption), fontsize=letters, color=BLACK)
    return axes
