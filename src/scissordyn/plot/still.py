"""Draw stills of the mechanism with magnified clearance joints, and diagrams of bending bars."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence, Set
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.patches import Rectangle

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import Channel, Corners, Scene, guides_for_contacts, scene_of
from scissordyn.plot.bar_diagram import AXIAL, MOMENT, colour_bar, diagram_of, is_known
from scissordyn.plot.drawing import Drawing, MagnifiedBlock, block_walls, draw_magnified, magnified_text
from scissordyn.plot.file import figure_of
from scissordyn.plot.joint import draw_orbit, write_time_bar
from scissordyn.plot.label import write_labels
from scissordyn.plot.series import (
    BEYOND_HORIZON,
    Joints,
    chosen_joints,
    clearance_pins,
    draw_curves,
    finish_time_axes,
    mechanism_of,
    note_more,
    picture,
    predictability_horizon,
    select_window,
    time_scale,
)
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    SIZES,
    SKY,
    TIME_MAP,
    VERMILION,
    apply_layout,
    dark_map,
    draw_scale_bar,
    dress,
    figure_size,
    figure_width,
    is_column,
    legend,
    literal,
    signed,
    small,
    wrap_text,
)
from scissordyn.record.joint_force import clearance_joints
from scissordyn.record.results import Curve, Run, values_at


@picture()
def structure(
    run: Run,
    mechanism: Mechanism | None = None,
    *,
    joint: Joints = None,
    times: int | Sequence[float] = 4,
    magnify: float = 1.0,
    bars: str | None = None,
    start: float | None = None,
    end: float | None = None,
) -> list[Axes]:
    """Draw the mechanism at several instants on a new figure, and the orbit of each clearance joint with these instants.

    For a guide with clearance, its block is drawn at each instant instead of an orbit.

    Parameters
    ----------
    joint : str or sequence of str, optional
        Clearance joints to magnify; by default those with the largest forces.
    times : int or sequence of float
        Number of instants, equally spaced from start to end; or instants [s], each replaced by the nearest sample.
    magnify : float
        Factor that multiplies the deflections of bending bars; the titles show it.
    bars : {"stress", "utilisation", "bending moment", "axial force"}, optional
        Quantity drawn on bending bars: extreme-fibre stress as colours, or moments on the side in tension.

    Returns
    -------
    list of Axes
        The structure at each instant, then one for each magnified joint.

    Raises
    ------
    InputError
        If `times` is empty, a named joint has no clearance, or the bars lack data for `bars`.
    """
    larger_symbols = 1.6  # size of blocks, loads and symbols relative to films, whose pictures are larger
    side_by_side = 2.0  # structures narrower than this ratio of width to height are drawn side by side
    run, mechanism = select_window(run, start, end), mechanism or mechanism_of(run)
    time = run["time"].values
    wanted = np.linspace(time[0], time[-1], times) if isinstance(times, int) else np.asarray(times, float)
    if wanted.size == 0:
        raise InputError(f"times = {times!r}", "an integer >= 1, or instants [s]", "times=4")
    samples = [int(np.argmin(np.abs(time - instant))) for instant in wanted]
    whole = run
    if magnify != 1.0:
        # imported here because they import xarray
        from scissordyn.equilibrium.deflection import magnified_deflection
        from scissordyn.record.xarray_dataset import as_dataset

        run = magnified_deflection(as_dataset(run), mechanism, magnify, samples=samples)
    largest = chosen_joints(run, joint) if joint is not None or clearance_joints(run) else []
    chosen = guides_for_contacts(mechanism, largest)
    if is_column() and joint is None:  # a narrow figure magnifies one joint
        chosen = chosen[:1]
    guides = [guide.name for guide in mechanism.guides if guide.name in chosen]
    look: dict[str, Any] = {"guides": guides, "on_bars": bars, "larger": larger_symbols, "between": False}
    scene = scene_of(run, mechanism, np.array(samples), clearance_pins(run), **look)
    width, height = scene.high - scene.low
    tall = bool(width < side_by_side * height) and not is_column()
    stills, panels = _structure_panels(tall, float(width / height), len(samples), len(chosen))
    larger = f", deflections {magnify:g}×" if magnify != 1.0 else ""
    # orbits have an entry of their own in the legend
    beyond = None if set(chosen) - set(guides) else BEYOND_HORIZON
    drawings = _draw_instants(
        stills, scene, larger, predictability_horizon(run), beyond, numbered=len(samples) > 1 and bool(chosen)
    )
    _explain_rings(stills[0], drawings)
    channels = {view.name: view for view in scene.channels}
    for name, panel in zip(chosen, panels, strict=True):
        if name in channels:
            _draw_channel(panel, channels[name], scene)
        else:
            _draw_marked_orbit(panel, whole, name, samples, scene.turns)
    drawn = [*stills, *panels]
    legend(drawn, above=True)
    if orbits := [panel for name, panel in zip(chosen, panels, strict=True) if name not in channels]:
        write_time_bar(orbits, whole)
    if (diagram := drawings[0].diagram) is not None and diagram.diagram.coloured:
        colour_bar(stills, diagram.diagram)
    if joint is None:
        drawn_points = [point.name for point in mechanism.contact_points if point.guide in chosen]
        note_more(drawn, clearance_joints(run), [*largest, *drawn_points])
    _write_names(drawings, {joint.name for joint in mechanism.clearance_joints}.difference(chosen))
    return drawn


def _draw_instants(
    stills: Sequence[Axes], scene: Scene, larger: str, until: float | None, beyond: str | None, *, numbered: bool
) -> list[Drawing]:
    """Draw the structure at each instant, with its title, on a grey ground beyond the predictability horizon `until`."""
    drawings = []
    for k, axes in enumerate(stills):
        drawings.append(Drawing(axes, scene))
        drawings[-1].show(k)
        number = f"{k + 1}: " if numbered else ""
        axes.set_title(f"{number}{scene.instant(k, digits=3)}{larger}", loc="left", fontsize=small())
        if until is not None and scene.time[k] > until:
            shade: dict[str, Any] = {"facecolor": LIGHT, "alpha": 0.7, "zorder": 0.0, "label": beyond}
            axes.add_patch(Rectangle((0.0, 0.0), 1.0, 1.0, transform=axes.transAxes, **shade))
    return drawings


def _explain_rings(axes: Axes, drawings: Sequence[Drawing]) -> None:
    """Add entries for the colours of the rings around clearance joints to the legend."""
    colours = {ring.get_color() for drawing in drawings for ring in drawing.rings}
    for color, label in ((VERMILION, "joint in contact"), (SKY, "joint in free flight")):
        if color in colours:
            look: dict[str, Any] = {"marker": "o", "markersize": SIZES.legend_dot, "markerfacecolor": "none"}
            axes.plot([], [], color=color, linestyle="", markeredgewidth=1.4, label=label, **look)


def _write_names(drawings: Sequence[Drawing], left_out: Set[str]) -> None:
    """Write the names after everything else, because their places depend on the layout of the whole figure."""
    apply_layout(figure_of([drawing.axes for drawing in drawings]))
    for k, drawing in enumerate(drawings):
        drawing.fit_sizes()
        write_labels(drawing.axes, [label for label in drawing.labels(k) if label.text not in left_out])


def _structure_panels(tall: bool, aspect: float, instants: int, joints: int) -> tuple[list[Axes], list[Axes]]:
    """Return the panels of a new figure: one for each instant, and one for each joint."""
    widest = 2.0  # largest ratio of width to height of a structure in a one-column figure
    side = 2.1  # side of the panel of a joint [inch]
    highest = 7.0  # largest height of structures side by side [inch]
    column = is_column()
    if tall or column:  # joints below the structures
        still_width = min(2.6, max(1.7, highest * aspect))
        width = figure_width() if column else still_width * instants
        height = instants * (width / min(aspect, widest) + 0.3) if column else min(still_width / aspect, highest) + 0.5
        columns = max(1, int(width / side))
        rows = -(-joints // columns)
        size = (width if column else 0.4 + width, 0.6 + height + (side + 0.4) * rows)
        outer: tuple[int, int] = (1 + bool(rows), 1)
        ratios: dict[str, Any] = {"height_ratios": [height, side * rows][: 1 + bool(rows)]}
        inner = (instants, 1) if column else (1, instants)
    else:  # structures below each other, with their joints next to them
        still_height = min(1.6, highest / aspect)
        height = (still_height + 0.45) * instants
        rows = max(1, int(height / side))
        columns = -(-joints // rows)
        size = (0.4 + aspect * still_height + (side + 0.3) * columns, 0.5 + height)
        outer = (1, 1 + bool(joints))
        ratios = {"width_ratios": [aspect * still_height, side * columns][: 1 + bool(joints)]}
        inner = (instants, 1)
    figure = Figure(figsize=size if column else figure_size(*size), layout="constrained")
    grid = figure.add_gridspec(*outer, **ratios)
    upper = grid[0].subgridspec(*inner)
    stills = [figure.add_subplot(upper[k]) for k in range(instants)]
    if not joints:
        return stills, []
    lower = grid[-1].subgridspec(rows, columns)
    return stills, [figure.add_subplot(lower[k]) for k in range(joints)]


def _draw_marked_orbit(axes: Axes, run: Run, name: str, samples: Sequence[int], turns: int) -> None:
    """Draw the orbit of a journal with the numbers of the instants of the stills."""
    dress(axes)
    path = draw_orbit(axes, run, name, turns=turns)
    if len(samples) > 1:
        axes.lines[-1].remove()  # the first instant has its own mark
        _number_points(axes, path.points[list(samples)])
    draw_scale_bar(axes, factor=path.scale.factor)
    _write_caption(axes, path.title.replace(", ", "\n"))


def _number_points(axes: Axes, points: np.ndarray) -> None:
    """Mark points of an orbit, and write their numbers around it."""
    around, apart = 1.22, 0.3  # radius of the numbers over that of the circle, least angle between two of them [rad]
    reach = axes.get_xlim()[1]
    order = np.argsort(np.arctan2(points[:, 1], points[:, 0]))
    angle = np.arctan2(points[order, 1], points[order, 0])
    spread = np.maximum.accumulate(angle - apart * np.arange(len(angle))) + apart * np.arange(len(angle))
    spread += 0.5 * np.mean(angle - spread)
    for at, k in zip(spread, order.tolist(), strict=True):
        place = around * reach * np.array([np.cos(at), np.sin(at)])
        axes.plot(*np.stack([points[k], 0.93 * place]).T, color=GREY, linewidth=0.5, zorder=3.5)
        mark: dict[str, Any] = {"marker": "o", "markersize": 4.0, "color": "white", "markeredgecolor": BLACK}
        axes.plot(*points[k], **mark, markeredgewidth=0.8, zorder=5.0)
        axes.annotate(f"{k + 1}", place.tolist(), ha="center", va="center", fontsize=small(), color=BLACK, zorder=6.0)
    axes.set(xlim=(-1.12 * around * reach, 1.12 * around * reach), ylim=(-1.12 * around * reach, 1.12 * around * reach))


def _draw_channel(axes: Axes, channel: Channel, scene: Scene) -> None:
    """Draw the block of a clearance guide at each instant, with a magnified clearance."""
    magnified = draw_magnified(axes, channel)
    assert isinstance(magnified, MagnifiedBlock)
    magnified.show(0)
    magnified.block.set_edgecolor("none")
    for line in magnified.walls:
        line.remove()
    colours, last = dark_map(TIME_MAP), max(len(scene.time) - 1, 1)
    for k in range(len(scene.time)):
        for points in block_walls(channel, k):
            axes.plot(*points.T, color=colours(k / last), linewidth=1.4, zorder=2.5)
    _write_caption(axes, f"{literal(channel.name)}\n{magnified_text(channel.gain)}")


def _write_caption(axes: Axes, text: str) -> None:
    width, letters = figure_of(axes).get_figwidth() * axes.get_position(original=True).width, small()
    lines = [wrap_text(line, 1.1 * width, letters) for line in text.split("\n")]
    axes.set_title("\n".join(lines), fontsize=letters, color=BLACK)


@picture()
def bending(
    run: Run,
    mechanism: Mechanism | None = None,
    *,
    time: float | None = None,
    envelope: bool = False,
    start: float | None = None,
    end: float | None = None,
) -> list[Axes]:
    """Draw bending moment and axial force as ordinates, stress as colours of the bars, and the largest stress over time.

    Ordinates of the bending moment are drawn on the side in tension, those of a positive axial force on the side of -y of the
    bar's frame.

    Parameters
    ----------
    mechanism : Mechanism, optional
        Mechanism of the run, with bending bars; by default the one stored in the run.
    time : float, optional
        Instant of the diagrams [s], replaced by the nearest sample; by default the instant of the largest fibre strain.
    envelope : bool
        Draw the largest and the smallest value at each place over all samples, on the mechanism at that instant.

    Returns
    -------
    list of Axes
        Bending moment, axial force, stress if the material of all bars is known, and stress (or strain) over time.

    Raises
    ------
    InputError
        If the mechanism has no bending bar.
    """
    run, mechanism = select_window(run, start, end), mechanism or mechanism_of(run)
    quantities = [quantity for quantity in (MOMENT, AXIAL, "stress") if is_known(quantity, mechanism)]
    beams = list(diagram_of(run, mechanism, quantities[0]).parts)
    strain = values_at(run, "beam_fibre_strain", "time", "beam", beam=beams)
    when = int(np.argmax(strain.max(axis=1))) if time is None else int(np.argmin(np.abs(run["time"].values - time)))
    samples = slice(None) if envelope else slice(when, when + 1)
    shown = [diagram_of(run, mechanism, quantity, samples) for quantity in quantities]
    shown = [diagram.envelope() for diagram in shown] if envelope else shown
    scene = scene_of(run, mechanism, np.array([when]), clearance_pins(run), between=False)
    scene = dataclasses.replace(scene, diagrams=tuple(shown))
    reach = 1.2 * SIZES.ordinate_length * float(np.max(scene.high - scene.low))  # room for the diagrams around the mechanism
    corners = scene.low - reach, scene.high + reach
    drawn, below = _diagram_panels(len(shown), corners)
    title = "envelope" if envelope else scene.instant(0)
    drawings = []
    for axes, diagram in zip(drawn, shown, strict=True):
        drawings.append(Drawing(axes, dataclasses.replace(scene, on_bars=diagram.quantity), corners))
        drawings[-1].show(0, diagram)
        if diagram.coloured:
            colour_bar([axes], diagram)
        most, where = diagram.largest_value()
        caption = f"{diagram.quantity}, {title}: {signed(diagram.scale.with_unit(most, 3))} in {where}"
        axes.set_title(wrap_text(caption, min(figure_width(), 5.5) - 1.0, small()), loc="left", fontsize=small())
    figure = figure_of(drawn)
    drawn.append(figure.add_subplot(below))
    _draw_stress(drawn[-1], run, beams, when)
    apply_layout(figure)
    for drawing in drawings:
        drawing.fit_sizes()
    return drawn


def _diagram_panels(diagrams: int, corners: Corners) -> tuple[list[Axes], SubplotSpec]:
    """Return the panels of a new figure for two or three diagrams, and the place of the curve over time."""
    width, height = corners[1] - corners[0]
    tall = 1.0 + min(1.6, max(0.35, 5.0 * float(height / width)))
    if is_column():  # one diagram below the other
        figure = Figure(figsize=figure_size(5.5, diagrams * tall + 3.2), layout="constrained")
        grid = figure.add_gridspec(diagrams + 1, 1, height_ratios=(*[tall] * diagrams, 2.2))
        return [figure.add_subplot(grid[k, 0]) for k in range(diagrams)], grid[diagrams, 0]
    lower = max(tall, 2.2) if diagrams > 2 else 2.2
    figure = Figure(figsize=figure_size(11.0, tall + lower + 0.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(tall, lower))
    places = [grid[0, 0], grid[0, 1], grid[1, 0]][:diagrams]
    return [figure.add_subplot(place) for place in places], grid[1, 1] if diagrams > 2 else grid[1, :]


def _draw_stress(axes: Axes, run: Run, beams: list[str], when: int) -> None:
    """Draw the largest stress of all bars over time, with the yield strength if it is known; or the largest strain."""
    stress, used = (values_at(run, f"beam_{name}", "time", "beam", beam=beams) for name in ("stress", "utilisation"))
    has_stress = bool(np.nanmax(stress, initial=0.0) > 0.0)
    dress(axes)
    name = "beam_stress" if has_stress else "beam_fibre_strain"
    largest = np.fmax.reduce(values_at(run, name, "beam", "time", beam=beams))
    time, shown = time_scale(run), Curve(run["time"].values, largest, run[name].attrs["units"])
    scale = draw_curves(axes, "largest stress" if has_stress else "largest strain", [(shown, {"color": BLUE})], time)
    if np.any(used > 0.0):
        strength = scale.factor * float(np.min(stress[used > 0.0] / used[used > 0.0]))
        axes.axhline(strength, color=GREY, linewidth=0.9, linestyle="--", label="yield strength")
        axes.legend(loc="best", fontsize=small())
    axes.axvline(time.factor * run["time"].values[when], color=GREY, linewidth=0.7)
    axes.set_ylim(bottom=0.0)
    finish_time_axes([axes], run, time)
