"""The drawings of three pages: a scissor array, a clearance joint, and the result on the README."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle, Rectangle, Wedge

import scissordyn as sd
from scissordyn.config.file import read_case
from scissordyn.plot.animation_scene import Scene, scene_of
from scissordyn.plot.drawing import Drawing
from scissordyn.plot.file import write
from scissordyn.plot.joint import draw_orbit, write_time_bar
from scissordyn.plot.style import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, OUTSIDE, VERMILION, draw_scale_bar, dress, shades
from scissordyn.run.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["clearance_joint", "result", "scissor_array"]

ROOT = Path(__file__).parent.parent
BEARING, JOURNAL = 1.0, 0.62  # Radii of the drawing; the clearance of a real pin is a hundredth of its radius or less


def scissor_array(target: Path) -> Path:
    """Draw an array of two units with the names of its parts, its angle, span and height, and how it extends.

    Parameters
    ----------
    target : Path

    Returns
    -------
    Path
        The file.
    """
    figure = plt.figure(figsize=(9.2, 3.7), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(3.1, 1.0))
    axes = figure.add_subplot(grid[:, 0])
    theta = 32.0
    scene, drawing = _drawn_array(axes, theta)
    axes.set(xlim=(-1.15, 4.2), ylim=(-0.85, 1.85))
    joints = {name: places[0] for name, places in zip(scene.pin_names, scene.pins.transpose(1, 0, 2), strict=True)}
    aside = {
        "O": (-0.35, -0.1),
        "A": (-0.25, 0.32),
        "unit 1/pivot": (0.0, 0.5),
        "unit 1/upper": (-0.3, 0.22),
        "unit 1/lower": (-0.3, -0.28),
        "unit 2/pivot": (0.0, 0.5),
    }
    for name, (x, y) in aside.items():
        text = {"O": "joint O", "A": "joint A, slider"}.get(name, name)
        _named(axes, joints[name], (x, y), text, VERMILION)
    for shape in scene.shapes:
        if shape.kind == "bar":
            start, end = shape.points[0][[0, -1]]
            axes.text(
                *(0.27 * start + 0.73 * end),
                shape.name,
                fontsize=8,
                ha="center",
                va="center",
                rotation=math.degrees(math.atan2(*(end - start)[::-1])),
                zorder=7,
            )
    length, high = 2.0 * math.cos(math.radians(theta)), 2.0 * math.sin(math.radians(theta))
    _dimension(axes, (0.0, -0.62), (2.0 * length, -0.62), "span")
    _dimension(axes, (2.0 * length + 0.3, 0.0), (2.0 * length + 0.3, high), "height")
    for k in range(2):
        _dimension(axes, (k * length, 1.5), ((k + 1) * length, 1.5), f"unit {k + 1}")
    axes.plot([0.0, 1.2], [0.0, 0.0], color=GREY, linewidth=0.8, linestyle="--", zorder=1.0)
    turn = np.radians(np.linspace(0.0, theta, 30))
    axes.plot(0.85 * np.cos(turn), 0.85 * np.sin(turn), color=BLACK, linewidth=1.2, zorder=6.0)
    axes.text(0.92, 0.13, "angle", fontsize=9)
    for row, angle in enumerate((60.0, 20.0)):
        small_axes = figure.add_subplot(grid[row, 1])
        _, small_drawing = _drawn_array(small_axes, angle)
        small_axes.set(xlim=(-0.35, 4.1), ylim=(-0.5, 1.95))
        small_axes.set_title(f"angle {angle:g}°, span {4.0 * math.cos(math.radians(angle)):.2g} m", fontsize=9, loc="left")
        figure.draw_without_rendering()
        small_drawing.fit_sizes()
    drawing.fit_sizes()
    return write(figure, target)


def _drawn_array(axes: Axes, angle: float) -> tuple[Scene, Drawing]:
    """Draw an array of two units at an angle [deg]."""
    array = sd.scissor(units=2, bar_length=2.0, angle=sd.degrees(angle))
    scene = scene_of(simulate(array, until=1e-9, samples=2), array, np.array([0]), [])
    drawing = Drawing(axes, scene)
    for artist in (*axes.lines[:1], *axes.texts):  # the scale bar
        artist.remove()
    drawing.show(0)
    return scene, drawing


def _named(axes: Axes, place: np.ndarray, aside: tuple[float, float], text: str, color: str) -> None:
    """Write a name aside from its place, with a leader."""
    axes.annotate(
        text,
        place.tolist(),
        (place[0] + aside[0], place[1] + aside[1]),
        fontsize=8,
        color=color,
        va="center",
        ha="right" if aside[0] < 0.0 else "center",
        arrowprops={"arrowstyle": "-", "color": color, "lw": 0.6, "shrinkB": 4},
        zorder=7,
    )


def _dimension(axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str) -> None:
    """Draw a dimension arrow with its name at the middle."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": "<->", "color": BLACK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0})
    x, y = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
    vertical = start[0] == end[0]
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    axes.text(x, y, text, fontsize=9, ha="center", va="center", rotation=90 if vertical else 0, bbox=look)


def clearance_joint(target: Path) -> Path:
    """Draw the parts of a joint, free flight, contact, and how to read an orbit.

    Parameters
    ----------
    target : Path

    Returns
    -------
    Path
        The file.
    """
    figure, axes = plt.subplots(1, 4, figsize=(11.5, 3.3), layout="constrained", width_ratios=(1.0, 1.0, 1.0, 1.15))
    _parts(axes[0])
    _free(axes[1])
    _contact(axes[2])
    _orbit(axes[3])
    titles = "parts", "free flight: e < c", "contact: e > c", "an orbit, from a run of 12 ms"
    for one, title in zip(axes, titles, strict=True):
        one.set_title(title, fontsize=10)
    return write(figure, target)


def _joint(axes: Axes, journal: tuple[float, float]) -> None:
    """The bearing in its bar, the journal of the other bar, and the clearance circle."""
    axes.add_patch(Wedge((0, 0), 1.35, 0, 360, width=1.35 - BEARING, facecolor=LIGHT, edgecolor=BLACK, linewidth=1.0))
    axes.add_patch(Circle(journal, JOURNAL, facecolor="#cfe3f1", edgecolor=BLUE, linewidth=1.4))
    axes.add_patch(Circle((0, 0), BEARING - JOURNAL, fill=False, edgecolor=GREY, linestyle=(0, (2, 2)), linewidth=0.9))
    axes.plot(0, 0, "+", color=BLACK, markersize=8)
    axes.plot(*journal, ".", color=BLUE, markersize=6)
    axes.set(xlim=(-2.0, 2.0), ylim=(-1.9, 1.6), aspect="equal")
    axes.axis("off")


def _arrow(axes: Axes, start: Any, end: Any, color: str, both: bool = False, width: float = 1.4) -> None:
    look = {"arrowstyle": "<->" if both else "->", "color": color, "lw": width, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(end), tuple(start), arrowprops=look, zorder=6)


def _parts(axes: Axes) -> None:
    axes.add_patch(Rectangle((-2.0, -0.45), 0.72, 0.9, zorder=0, facecolor=LIGHT, edgecolor=BLACK, linewidth=1.0))
    _joint(axes, (0.0, 0.0))
    along = math.radians(35.0)
    _arrow(axes, (0, 0), (BEARING * math.cos(along), BEARING * math.sin(along)), BLACK)
    axes.text(0.42, 0.62, "$R_B$", fontsize=10)
    _arrow(axes, (0, 0), (0, -JOURNAL), BLUE)
    axes.text(0.07, -0.5, "$R_J$", color=BLUE, fontsize=10)
    _arrow(axes, (-JOURNAL, 0), (-BEARING, 0), VERMILION, both=True)
    axes.text(-0.88, 0.1, "$c$", color=VERMILION, fontsize=11)
    axes.text(-1.98, -1.02, "bar with\nthe bearing", fontsize=8, va="top")
    axes.text(0.0, -1.85, "journal: the pin of the other bar", color=BLUE, fontsize=8, ha="center")


def _free(axes: Axes) -> None:
    place = 0.22, 0.13
    _joint(axes, place)
    _arrow(axes, (0, 0), place, VERMILION)
    axes.text(0.0, 0.14, "$\\mathbf{e}$", color=VERMILION, fontsize=11, ha="center")
    axes.text(0.0, -1.85, "the journal's centre is inside\nthe dotted circle of radius $c$: no force", fontsize=8, ha="center")


def _contact(axes: Axes) -> None:
    along, depth = math.radians(-40.0), 0.14
    normal = np.array([math.cos(along), math.sin(along)])
    tangent = np.array([-normal[1], normal[0]])
    place = (BEARING - JOURNAL + depth) * normal
    _joint(axes, tuple(place.tolist()))
    _arrow(axes, (0, 0), place, VERMILION)
    axes.text(*(0.45 * place - 0.17 * tangent), "$\\mathbf{e}$", color=VERMILION, fontsize=11, ha="center", va="center")
    edge, side = (BEARING - JOURNAL) * normal, 0.16 * tangent
    for point in (edge, place):
        axes.plot(*np.stack([point, point + 1.4 * side]).T, color=BLACK, linewidth=0.6, zorder=6)
    _arrow(axes, edge + side, place + side, BLACK, both=True, width=0.9)
    axes.text(*(0.5 * (edge + place) + 2.2 * side), "$\\delta$", fontsize=10, ha="center", va="center")
    touch = (BEARING + 0.5 * depth) * normal
    _arrow(axes, touch, touch - 0.62 * normal + 0.0 * tangent, GREEN)
    axes.text(*(touch - 0.42 * normal - 0.2 * tangent), "$F_n$", color=GREEN, fontsize=11, ha="center", va="center")
    _arrow(axes, touch, touch + 0.7 * tangent, ORANGE)
    axes.text(*(touch + 0.85 * tangent), "$F_t$", color=ORANGE, fontsize=11, ha="center", va="center")
    _arrow(axes, touch + 0.08 * normal, touch + 0.72 * normal, GREY)
    axes.text(*(touch + 0.8 * normal + 0.14 * tangent), "$\\mathbf{n}$", color=GREY, fontsize=11, ha="center", va="center")
    axes.text(
        0.0, -1.85, "indentation $\\delta = e - c$; $\\mathbf{n}$ is the direction of $\\mathbf{e}$", fontsize=8, ha="center"
    )


def _orbit(axes: Axes) -> None:
    """Draw the orbit of a run, and write what its parts are."""
    case = read_case(ROOT / "examples" / "paper.toml")
    run = simulate(case.mechanism, **case.run.keywords | {"samples": "auto", "until": 0.012})
    path = draw_orbit(axes, run, "A")
    write_time_bar([axes], run)
    contacts = [run["contact_start"].values, (run["contact_start"] + run["contact_duration"]).values]
    first = path.points[np.searchsorted(run["time"].values, contacts[0][0])]
    during = slice(*np.searchsorted(run["time"].values, [contacts[0][1], contacts[1][1]]))
    deepest = path.points[during][np.argmax(np.hypot(*path.points[during].T))]
    reach = axes.get_xlim()[1]
    notes: tuple[tuple[Any, tuple[float, float], str], ...] = (
        (path.points[0], (0.1, 0.55), "start"),
        (0.5 * (path.points[0] + first), (0.45, -0.1), "free flight (thin)"),
        (first, (0.3, -0.75), "impact and rebound"),
        (deepest, (-0.75, 0.9), "contact (thick), outside\nthe circle by $\\delta$"),
    )
    for place, aside, text in notes:
        axes.annotate(
            text,
            place.tolist(),
            (reach * aside[0], reach * aside[1]),
            fontsize=8,
            va="center",
            arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.6},
        )
    dress(axes)
    draw_scale_bar(axes, factor=path.scale.factor)


CLEARANCES = 0.01e-3, 0.03e-3, 0.1e-3  # Of all joints of the solar array in the result [m]
ALLOWED = 2.0  # Deviation of the tip that is allowed [mm]
BINS = 150  # Intervals of the envelope of the joint forces


def result(target: Path) -> Path:
    """Draw the solar array, how far its tip is off with three clearances, and the largest force of its joints.

    Parameters
    ----------
    target : Path

    Returns
    -------
    Path
        The file.
    """
    case = read_case(ROOT / "examples" / "solar_array.toml")
    names = [joint.name for joint in case.mechanism.clearance_joints]
    figure = plt.figure(figsize=(10.0, 5.0), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.0, 1.15), height_ratios=(1.0, 0.8, 0.62, 0.48))
    deviation, force = figure.add_subplot(grid[:2, 1]), figure.add_subplot(grid[2:, 1])
    shown: list[tuple[Any, Any]] = []
    for clearance, color in zip(CLEARANCES, shades(len(CLEARANCES)), strict=True):
        mechanism = case.mechanism
        for name in names:
            mechanism = mechanism.replace(f"{name}.clearance", clearance)
        run = simulate(mechanism, **case.run.keywords)
        shown.append((run, mechanism))
        _draw_deviation(deviation, run, f"{1e3 * clearance:g} mm", color)
        _draw_forces(force, run, color, up=clearance == CLEARANCES[-1])
        print(
            f"clearance {1e3 * clearance:g} mm: tip {1e3 * float(run['peak_track_deviation'][0]):.3g} mm, "
            f"{float(run['peak_force'].max()):.4g} N",
            flush=True,
        )
    until = float(shown[0][0]["time"][-1])
    deviation.axhspan(ALLOWED, 100.0, color=OUTSIDE, alpha=0.08, linewidth=0.0)
    deviation.axhline(ALLOWED, color=OUTSIDE, linewidth=0.8)
    deviation.text(0.98 * until, 19.5, f"shaded: outside the allowed {ALLOWED:g} mm", color=OUTSIDE, fontsize=8, ha="right")
    deviation.set(ylabel="tip off by [mm]", ylim=(0.0, 21.0), xlim=(0.0, until))
    force.set(ylabel="largest joint\nforce [N]", xlabel="time [s]", ylim=(0.0, 600.0), xlim=(0.0, until))
    for one in (deviation, force):
        dress(one)
    deviation.set_title("curves: clearance of all pins", fontsize=9, loc="left")
    _deployment(figure, grid, *shown[-1])
    return write(figure, target)


def _draw_deviation(axes: Axes, run: Any, name: str, color: str) -> None:
    """Draw how far the tip is off, with the name of the clearance and the largest value at the peak."""
    values = 1e3 * run["track_deviation"].sel(track="tip").values
    axes.plot(run["time"], values, color=color, linewidth=1.4)
    at = int(np.argmax(values))
    place = float(run["time"][at]), float(values[at])
    text = f"{name}: {1e3 * float(run['peak_track_deviation'][0]):.3g} mm"
    if smallest := name.startswith(f"{1e3 * CLEARANCES[0]:g} "):  # its name is below its narrow peak
        text = text.replace(": ", ":\n")
    look: dict[str, Any] = {"fontsize": 8, "color": color, "ha": "center", "va": "top" if smallest else "bottom"}
    axes.annotate(text, place, (0, -9 if smallest else 3), textcoords="offset points", **look)


def _draw_forces(axes: Axes, run: Any, color: str, *, up: bool) -> None:
    """Draw the envelope of the joint forces, and the peaks of the contacts."""
    time, force = run["time"].values, run["normal_force"].max("joint").values
    edges = np.linspace(time[0], time[-1], BINS + 1)
    inside = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, BINS - 1)
    largest = np.array([force[inside == k].max(initial=0.0) for k in range(BINS)])
    axes.plot(0.5 * (edges[:-1] + edges[1:]), largest, color=color, linewidth=1.1)
    at = int(np.argmax(run["peak_force"].values))
    when, peak = float(run["contact_start"][at] + run["peak_time"][at]), float(run["peak_force"][at])
    axes.plot(when, peak, "o", color=color, markersize=4.0)
    if up:
        text = f"{peak:.3g} N in joint {run['contact_joint'].values[at]!s}"
        axes.annotate(text, (when, peak), (-6, 3), textcoords="offset points", fontsize=8, color=color, ha="right")


def _deployment(figure: Any, grid: Any, run: Any, mechanism: Any) -> None:
    """Draw the array at four instants, one above the other."""
    parts = 0.0, 0.4, 0.55, 1.0
    samples = np.array([round(part * (run.sizes["time"] - 1)) for part in parts])
    scene = scene_of(run, mechanism, samples, [], larger=1.8)
    drawings = []
    for row in range(len(parts)):
        axes = figure.add_subplot(grid[row, 0])
        high = np.concatenate([shape.points[row] for shape in scene.shapes if shape.kind == "bar"])[:, 1]
        region = scene.low * [1.0, 0.0] + [0.0, high.min() - 0.17], scene.high * [1.0, 0.0] + [0.0, high.max() + 0.12]
        drawings.append(Drawing(axes, scene, region))
        drawings[-1].show(row)
        if row < len(parts) - 1:
            for artist in (axes.lines[0], axes.texts[0]):  # one scale bar is enough
                artist.remove()
        axes.set_title(f"{float(scene.time[row]):.2g} s", fontsize=9, loc="left")
        axes.set_anchor("W")
        if row == 0:  # names of the joints would cover each other
            for text, kind, places in scene.names:
                if kind == "payload":
                    axes.annotate(text, places[0].tolist(), (16, 0), textcoords="offset points", fontsize=8, va="center")
    figure.draw_without_rendering()
    for drawing in drawings:
        drawing.fit_sizes()
