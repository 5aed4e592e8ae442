"""The structure itself at several instants, with its clearance joints magnified."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.transforms import Affine2D

from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.bar_diagram import Diagram, colour_bar, diagram_of, draw_diagram, stations
from scissordyn.plot.channel import channel, guides_of
from scissordyn.plot.channel_scene import GAP
from scissordyn.plot.label import Label, write_labels
from scissordyn.plot.load import loads
from scissordyn.plot.place import Corners, corners_of, outlines, ring_size, upright
from scissordyn.plot.series import (
    BEYOND,
    Joints,
    chosen_joints,
    mechanism_of,
    note_more,
    predictability_horizon,
    time_scale,
)
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    PURPLE,
    SKY,
    VERMILION,
    dress,
    figure_size,
    figure_width,
    in_lines,
    is_column,
    label_axes,
    legend,
    literal,
    small,
)
from scissordyn.plot.symbol import cross_sections, symbols
from scissordyn.plot.window import window
from scissordyn.run.answer.deflection import magnified_deflection
from scissordyn.run.answer.joints import clearance_joints
from scissordyn.run.answer.placement import Placement

if TYPE_CHECKING:
    import xarray as xr

TALL = 2.0
"""Largest ratio of width to height of structures drawn side by side; wider ones are drawn one below the other."""

FEW, WIDE = 1, 2.0
"""Magnified joints in the column of a page, and the largest ratio of width to height of the room for a structure there."""

CLOSE = 4
"""With more magnified joints their panels are narrow, and their titles have one more line."""

RING, RINGED = 7.0, "ring"
"""Diameter of the ring around a clearance joint, where there is room [pt], and by what its artist is known."""

SYMBOL, WIDEST = 6.0, 0.05
"""Smallest radius of the symbol of a component [pt], and its largest as a fraction of the picture's longer side."""


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
    run : Dataset
    mechanism : Mechanism, optional
        The one that was run; the one that the run holds if not given.
    joint : str or sequence of str, optional
        Clearance joints to magnify; those with the largest forces if not given.
    times : int or sequence of float
        Number of instants, equally spaced from start to end; or instants [s], each at the nearest sample.
    magnify : float
        Factor of the deflections of bars that bend, which the titles say.
    bars : {"stress", "utilisation", "bending moment", "axial force"}, optional
        What is drawn on bars that bend: a stress of the extreme fibre as their colours, moments on the side in tension.
    start, end : float, optional
        Part of the run to draw [s]; the whole run if not given.

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
    diagram = None if bars is None else diagram_of(run, mechanism, bars)
    time = run["time"].values
    wanted = np.linspace(time[0], time[-1], times) if isinstance(times, int) else np.asarray(times, float)
    if wanted.size == 0:
        raise InputError(f"times = {times!r}", "a whole number >= 1, or instants [s]", "times=4")
    samples = [int(np.argmin(np.abs(time - instant))) for instant in wanted]
    if magnify != 1.0:
        run = magnified_deflection(run, mechanism, magnify, samples=samples)
    largest = chosen_joints(run, joint) if joint is not None or clearance_joints(run) else []
    chosen = guides_of(mechanism, largest)
    corners = corners_of(Placement.at(mechanism, run, samples, turns=upright(mechanism)))
    width, height = corners[1] - corners[0]
    tall = bool(width < TALL * height) and not is_column()
    if is_column() and joint is None:
        chosen = chosen[:FEW]
    loose = {joint.name for joint in mechanism.clearance_joints}  # those that are not magnified have no name either
    rows = _grid(tall, float(width / height), len(samples), len(chosen))
    labels = []
    for k, (sample, row) in enumerate(zip(samples, rows, strict=True)):
        named = draw_mechanism(run, mechanism, sample, axes=row[0], corners=corners, diagram=diagram)
        labels.append([label for label in named if label.text in chosen or label.text not in loose])
        if tall:
            row[0].locator_params(axis="x", nbins=4)
        if tall and k > 0:
            row[0].set_ylabel("")
            row[0].tick_params(labelleft=False)
        if not tall and k < len(samples) - 1:
            row[0].set_xlabel("")
            row[0].tick_params(labelbottom=False)
        for name, panel in zip(chosen, row[1:], strict=True):
            magnified(run, mechanism, sample, name, axes=panel)
            if len(chosen) > CLOSE:
                panel.set_title(panel.get_title().replace("magnified ", "magnified\n"), fontsize=small(), color=BLACK)
    drawn = [axes for row in rows for axes in row]
    legend(drawn, above=True)
    if diagram is not None and diagram.coloured:
        colour_bar([row[0] for row in rows], diagram)
    if joint is None:
        drawn_points = [point.name for point in mechanism.contact_points if point.guide in chosen]
        note_more(drawn, run, [*largest, *drawn_points])
    fit_rings([row[0] for row in rows])
    # names come last: their places depend on the layout of the whole figure
    for row, named in zip(rows, labels, strict=True):
        write_labels(row[0], named)
    return drawn


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


def snapshot(run: xr.Dataset, mechanism: Mechanism, sample: int, *, axes: Axes, corners: Corners | None = None) -> Axes:
    """The mechanism at one sample: bars, pins, guides, components by their symbols, and ground; clearance joints ringed."""
    labels = draw_mechanism(run, mechanism, sample, axes=axes, corners=corners)
    fit_rings([axes])
    write_labels(axes, labels)
    return axes


def draw_mechanism(
    run: xr.Dataset,
    mechanism: Mechanism,
    sample: int,
    *,
    axes: Axes,
    corners: Corners | None = None,
    diagram: Diagram | None = None,
) -> list[Label]:
    """Draw the mechanism at one sample without names."""
    dress(axes)
    axes.set_aspect("equal", adjustable="box")
    placed = Placement.at(mechanism, run, [sample], turns=upright(mechanism))
    low, high = corners_of(placed) if corners is None else corners
    size = min(0.03 * float(np.max(high - low)), 0.05 * float(np.min(high - low)))
    _bodies(axes, mechanism, placed, size, plain=diagram is not None)
    if diagram is not None:
        draw_diagram(axes, diagram.at([sample]), stations(mechanism, placed), float(np.max(high - low)))
    labels = _loads(axes, mechanism, placed, size)
    for guide in mechanism.guides:
        along = np.array([math.cos(guide.direction), math.sin(guide.direction)])
        first, further = placed.points(guide.body, np.array(guide.through) + np.array([[0.0], [1.0]]) * along)[0]
        axes.axline(tuple(first), tuple(further), color=GREY, linewidth=0.7, linestyle=(0, (6, 2, 1, 2)), zorder=1.0)
        if guide.clearance is not None:
            labels.append(Label(guide.name, placed.place(guide.follower)[0], VERMILION))
    radius = max(size, min(SYMBOL / _points_per_metre(axes, (low, high)), WIDEST * float(np.max(high - low))))
    tones: dict[str, str] = {}
    for symbol in symbols(run, mechanism, placed, [sample], radius):
        if diagram is not None and symbol.kind == "beam":
            continue
        if symbol.bar:  # which has no name in a picture
            tone = tones.setdefault(symbol.bar, (BLUE, GREEN)[len(tones) % 2])
            axes.plot(*symbol.strokes[0][0].T, color=tone, linewidth=1.8, solid_capstyle="round", zorder=2.0)
            continue
        for stroke in symbol.strokes:
            axes.plot(*stroke[0].T, color=PURPLE, zorder=2.5, **_look(symbol.kind))
        labels.append(Label(symbol.name, symbol.anchor[0], PURPLE))
    labels += _joints(axes, mechanism, placed, size)
    now, scale, until = float(run["time"].values[sample]), time_scale(run), predictability_horizon(run)
    if until is not None and now > until:
        late = Rectangle((0.0, 0.0), 1.0, 1.0, facecolor=LIGHT, alpha=0.7, transform=axes.transAxes, zorder=0.0, label=BEYOND)
        axes.add_patch(late)
    larger = f", deflections {run.attrs['magnified']:g}×" if "magnified" in run.attrs else ""
    axes.set_title(f"t = {scale.factor * now:.4g} {scale.unit}{larger}", loc="left", fontsize=small())
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    label_axes(axes, placed.turns)
    return labels


def _joints(axes: Axes, mechanism: Mechanism, placed: Placement, size: float) -> list[Label]:
    """Draw pins, rings of clearance joints and supports; returns the names of clearance joints."""
    labels = []
    for joint in mechanism.joints:
        point = placed.place(joint.bearing)[0]
        x, y = point.tolist()
        for name, end in (joint.journal, joint.bearing):
            if name == GROUND:
                _support(axes, placed.place((name, end))[0], size)
        if joint.clearance is None:
            axes.plot(x, y, marker="o", markersize=3.6, color=BLACK, markerfacecolor="white", markeredgewidth=0.8, zorder=4.0)
            continue
        ring: dict[str, Any] = {"marker": "o", "markersize": RING, "markeredgewidth": 1.2, "markerfacecolor": "none"}
        axes.plot(x, y, color=VERMILION, zorder=4.0, gid=RINGED, **ring)
        labels.append(Label(joint.name, point, VERMILION))
    return labels


def magnified(run: xr.Dataset, mechanism: Mechanism, sample: int, joint: str, *, axes: Axes) -> Axes:
    """A clearance joint or guide at one sample, with magnified clearance: journal and bearing, or block and channel."""
    if joint in guides_of(mechanism, (point.name for point in mechanism.contact_points)):
        return channel(run, mechanism, sample, joint, axes=axes)
    chosen_joints(run, [joint])
    now = run.isel(time=sample).sel(joint=joint)
    clearance = float(now["clearance"])
    described = mechanism.joint(joint).clearance
    if described is None:
        raise InputError(
            f"joint '{joint}' has clearance in the run and is ideal in the mechanism", "the mechanism that was run"
        )
    gain = GAP * described.journal_radius / clearance
    placed = Placement.at(mechanism, run, [sample], turns=upright(mechanism))
    x, y = (GAP / clearance * placed.vectors(now["eccentricity"].transpose("axis").values)).tolist()
    touching = bool(now["in_contact"])
    color = VERMILION if touching else SKY
    axes.add_patch(Circle((0.0, 0.0), 1.0 + GAP, facecolor="white", edgecolor=BLACK, linewidth=1.2))
    axes.add_patch(Circle((x, y), 1.0, facecolor=LIGHT, edgecolor=color, linewidth=1.4))
    axes.plot(x, y, marker="+", markersize=6.0, color=color, markeredgewidth=1.0)
    axes.plot(0.0, 0.0, marker=".", markersize=3.0, color=BLACK)
    axes.set_aspect("equal", adjustable="box")
    reach = max(1.5, 1.05 + max(abs(x), abs(y)))  # the journal of a deep contact
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)
    state = "contact" if touching else "free flight"
    figure = axes.get_figure(root=True)
    assert figure is not None
    width, letters = figure.get_figwidth() * axes.get_position(original=True).width, small()
    caption = (f"{literal(joint)}: {state}", f"clearance magnified {gain:.2g} times")
    axes.set_title("\n".join(in_lines(line, 1.35 * width, letters) for line in caption), fontsize=letters, color=BLACK)
    return axes


def _look(symbol: str) -> dict[str, Any]:
    """How the strokes of a symbol are drawn."""
    return {"linewidth": 1.4, "linestyle": (0, (4, 1.5))} if symbol == "rod" else {"linewidth": 1.0}


def _points_per_metre(axes: Axes, corners: Corners) -> float:
    """About the scale [pt/m] at which a region is drawn with equal scales, before the figure is laid out."""
    figure, box = axes.get_figure(root=True), axes.get_position()
    assert figure is not None
    panel = 72.0 * np.array([figure.get_figwidth() * box.width, figure.get_figheight() * box.height])
    return float(np.min(panel / (corners[1] - corners[0])))


def fit_rings(drawn: Sequence[Axes]) -> None:
    """Size the rings around clearance joints, alike in all drawings of a figure, for the scale that its layout gives them."""
    rings = [[line for line in axes.lines if line.get_gid() == RINGED] for axes in drawn]
    figure = drawn[0].get_figure(root=True)
    if not any(rings) or figure is None:
        return
    figure.draw_without_rendering()
    scale = 72.0 / figure.dpi * drawn[0].bbox.width / float(np.diff(drawn[0].get_xlim())[0])
    size = ring_size(np.array([[np.asarray(line.get_xydata())[0] for line in lines] for lines in rings]), scale, RING)
    for line in itertools.chain.from_iterable(rings):
        line.set(markersize=size, markeredgewidth=1.2 * math.sqrt(size / RING))


def _bodies(axes: Axes, mechanism: Mechanism, placed: Placement, size: float, *, plain: bool) -> None:
    """Draw the bodies, without colours if bars have those of a diagram."""
    direction = {guide.follower[0]: guide.direction + float(placed.angle(guide.body)[0]) for guide in mechanism.guides}
    bars, bent = 0, cross_sections(mechanism)
    for body, shapes in zip(mechanism.bodies, outlines(placed), strict=True):
        shape = shapes[0]
        if body.name in bent:
            continue
        if len(shape) == 1:
            _block(axes, shape[0], 1.3 * size, direction.get(body.name, 0.0))
            continue
        closed = shape[[*range(len(shape)), 0]]
        axes.plot(
            closed[:, 0],
            closed[:, 1],
            color=GREY if plain else (BLUE, GREEN)[bars % 2],
            linewidth=1.8,
            solid_capstyle="round",
            zorder=2.0,
        )
        bars += 1


def _loads(axes: Axes, mechanism: Mechanism, placed: Placement, size: float) -> list[Label]:
    """Draw payloads and panels; the names of payloads."""
    labels = []
    for load in loads(mechanism, placed, 0.8 * size):
        corners = load.corners[0]
        if load.kind == "panel":
            axes.add_patch(Polygon(corners, facecolor=PURPLE, edgecolor="none", alpha=0.25, zorder=1.7))
        else:
            axes.add_patch(Polygon(corners, facecolor=to_rgba(GREY, 0.45), edgecolor=BLACK, linewidth=0.8, zorder=2.2))
            labels.append(Label(load.name, corners.mean(axis=0), BLACK))
    return labels


def _support(axes: Axes, pin: np.ndarray, size: float) -> None:
    """A ground pin: a triangle on a hatched strip."""
    corners = pin + np.array([[0.0, 0.0], [-size, -1.6 * size], [size, -1.6 * size]])
    axes.add_patch(Polygon(corners, facecolor="white", edgecolor=BLACK, linewidth=0.8, zorder=1.5))
    corner = float(pin[0]) - 1.6 * size, float(pin[1]) - 2.3 * size
    strip = Rectangle(
        corner, 3.2 * size, 0.7 * size, facecolor="white", edgecolor=GREY, hatch="//////", linewidth=0.0, zorder=1.4
    )
    axes.add_patch(strip)


def _block(axes: Axes, middle: np.ndarray, size: float, tilt: float) -> None:
    """A slider or point mass, long in the direction of its guide."""
    turned = Affine2D().rotate(tilt).translate(float(middle[0]), float(middle[1])) + axes.transData
    block = Rectangle((-size, -0.6 * size), 2.0 * size, 1.2 * size, facecolor=LIGHT, edgecolor=BLACK, linewidth=0.8, zorder=1.8)
    block.set_transform(turned)
    axes.add_patch(block)
