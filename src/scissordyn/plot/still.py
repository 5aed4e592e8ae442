"""Stills of the mechanism: at several instants with its clearance joints magnified, and what bars that bend carry."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence, Set
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.patches import Rectangle

from scissordyn.equilibrium.deflection import magnified_deflection
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import Channel, ClearanceJoint, Corners, guides_of, scene_of
from scissordyn.plot.bar_diagram import AXIAL, MOMENT, ORDINATE, colour_bar, diagram_of, is_known
from scissordyn.plot.drawing import Drawing, draw_magnified
from scissordyn.plot.file import figure_of
from scissordyn.plot.label import write_labels
from scissordyn.plot.series import (
    BEYOND,
    Joints,
    chosen_joints,
    clearance_pins,
    draw_curves,
    finish,
    mechanism_of,
    note_more,
    picture,
    predictability_horizon,
    time_scale,
    window,
)
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    dress,
    figure_size,
    figure_width,
    in_lines,
    is_column,
    legend,
    literal,
    small,
)
from scissordyn.record.joint_force import clearance_joints

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
    if is_column() and joint is None:
        chosen = chosen[:FEW]
    guides = [guide.name for guide in mechanism.guides if guide.name in chosen]
    look: dict[str, Any] = {"guides": guides, "on_bars": bars, "larger": LARGER, "between": False}
    scene = scene_of(run, mechanism, np.array(samples), clearance_pins(run), **look)
    width, height = scene.high - scene.low
    tall = bool(width < TALL * height) and not is_column()
    rows = _grid(tall, float(width / height), len(samples), len(chosen))
    until, larger = predictability_horizon(run), f", deflections {magnify:g}×" if magnify != 1.0 else ""
    magnified = {view.name: view for view in scene.magnified}
    drawings = []
    for k, (axes, *panels) in enumerate(rows):
        drawings.append(Drawing(axes, scene))
        drawings[-1].show(k)
        axes.set_title(f"{scene.instant(k)}{larger}", loc="left", fontsize=small())
        if until is not None and scene.time[k] > until:
            shade: dict[str, Any] = {"facecolor": LIGHT, "alpha": 0.7, "zorder": 0.0, "label": BEYOND}
            axes.add_patch(Rectangle((0.0, 0.0), 1.0, 1.0, transform=axes.transAxes, **shade))
        _share_labels(axes, k, len(samples), tall=tall)
        for name, panel in zip(chosen, panels, strict=True):
            _magnify(panel, magnified[name], k)
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


def _magnify(axes: Axes, joint: Channel | ClearanceJoint, k: int) -> None:
    """A clearance joint or guide at one instant, with magnified clearance: journal and bearing, or block and channel."""
    draw_magnified(axes, joint).show(k)
    state = "contact" if joint.touched[k] else "free flight"
    if isinstance(joint, Channel) and joint.touched[k]:
        count = int(joint.touching[k].sum())
        state = f"{count} corner{'s' * (count > 1)} in contact"
    width, letters = figure_of(axes).get_figwidth() * axes.get_position(original=True).width, small()
    caption = (f"{literal(joint.name)}: {state}", f"clearance magnified {joint.gain:.2g} times")
    axes.set_title("\n".join(in_lines(line, 1.35 * width, letters) for line in caption), fontsize=letters, color=BLACK)


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
    scene = scene_of(run, mechanism, np.array([when]), clearance_pins(run), between=False)
    scene = dataclasses.replace(scene, diagrams=tuple(shown))
    reach = 1.2 * ORDINATE * float(np.max(scene.high - scene.low))  # room for the diagrams around the mechanism
    corners = scene.low - reach, scene.high + reach
    drawn, below = _diagrams(len(shown), corners)
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
    _stress(drawn[-1], run, beams, when)
    figure.draw_without_rendering()
    for drawing in drawings:
        drawing.fit_rings()
    return drawn


def _diagrams(diagrams: int, corners: Corners) -> tuple[list[Axes], SubplotSpec]:
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


def _stress(axes: Axes, run: xr.Dataset, beams: list[str], when: int) -> None:
    """The largest stress of all bars over time, with the yield strength where it is known; or the largest strain."""
    stress, used, strain = (run[f"beam_{name}"].sel(beam=beams) for name in ("stress", "utilisation", "fibre_strain"))
    has_stress = bool(stress.max() > 0.0)
    dress(axes)
    time, shown = time_scale(run), (stress if has_stress else strain).max("beam", keep_attrs=True)
    scale = draw_curves(axes, "largest stress" if has_stress else "largest strain", [(shown, {"color": BLUE})], time)
    if used.any():
        strength = scale.factor * float((stress / used.where(used > 0.0)).min())
        axes.axhline(strength, color=GREY, linewidth=0.9, linestyle="--", label="yield strength")
        axes.legend(loc="best", fontsize=small())
    axes.axvline(time.factor * run["time"].values[when], color=GREY, linewidth=0.7)
    axes.set_ylim(bottom=0.0)
    finish([axes], run, time)
