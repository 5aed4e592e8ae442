"""The drawings of two pages: what a clearance joint is, and the result on the README."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle, Rectangle, Wedge

from scissordyn.config.file import read_case
from scissordyn.plot.animation_scene import outline
from scissordyn.plot.file import write
from scissordyn.plot.style import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, VERMILION, dress
from scissordyn.record.placement import Placement
from scissordyn.run.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["clearance_joint", "result"]

ROOT = Path(__file__).parent.parent
BEARING, JOURNAL = 1.0, 0.72  # Radii of the drawing; the clearance of a real pin is a hundredth of its radius or less


def clearance_joint(target: Path) -> Path:
    """Draw journal and bearing, free flight, contact, and the orbit of a run.

    Parameters
    ----------
    target : Path

    Returns
    -------
    Path
        The file.
    """
    figure, axes = plt.subplots(1, 4, figsize=(11.0, 3.1), layout="constrained")
    _parts(axes[0])
    _free(axes[1])
    _contact(axes[2])
    _orbit(axes[3])
    for one, title in zip(axes, ("the parts", "free flight: e < c", "contact: e > c", "an orbit"), strict=True):
        one.set_title(title, fontsize=10)
    return write(figure, target)


def _joint(axes: Axes, journal: tuple[float, float]) -> None:
    """The bearing in its bar, and the journal of the other bar."""
    axes.add_patch(Wedge((0, 0), 1.35, 0, 360, width=1.35 - BEARING, facecolor=LIGHT, edgecolor=BLACK, linewidth=1.0))
    axes.add_patch(Circle(journal, JOURNAL, facecolor="#cfe3f1", edgecolor=BLUE, linewidth=1.4))
    axes.plot(0, 0, "+", color=BLACK, markersize=8)
    axes.plot(*journal, ".", color=BLUE, markersize=6)
    axes.set(xlim=(-2.0, 2.0), ylim=(-1.75, 1.75), aspect="equal")
    axes.axis("off")


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], color: str, both: bool = False) -> None:
    axes.annotate(
        "",
        end,
        start,
        arrowprops={"arrowstyle": "<->" if both else "->", "color": color, "lw": 1.4, "shrinkA": 0, "shrinkB": 0},
    )


def _parts(axes: Axes) -> None:
    axes.add_patch(Rectangle((-2.0, -0.45), 0.72, 0.9, zorder=0, facecolor=LIGHT, edgecolor=BLACK, linewidth=1.0))
    _joint(axes, (0.0, 0.0))
    along = math.radians(35.0)
    _arrow(axes, (0, 0), (BEARING * math.cos(along), BEARING * math.sin(along)), BLACK)
    axes.text(0.12, 0.3, "$R_B$", fontsize=10)
    _arrow(axes, (0, 0), (0, -JOURNAL), BLUE)
    axes.text(0.07, -0.45, "$R_J$", color=BLUE, fontsize=10)
    _arrow(axes, (-JOURNAL, 0), (-BEARING, 0), VERMILION, both=True)
    axes.text(-0.95, 0.14, "$c$", color=VERMILION, fontsize=11)
    axes.text(-1.95, -0.75, "bar with\nthe bearing", fontsize=8, va="top")
    axes.text(0.0, -1.68, "journal: the pin of the other bar", color=BLUE, fontsize=8, ha="center")


def _free(axes: Axes) -> None:
    place = 0.16, 0.09
    _joint(axes, place)
    _arrow(axes, (0, 0), (2.4 * place[0], 2.4 * place[1]), VERMILION)
    axes.text(0.42, 0.18, "$\\mathbf{e}$", color=VERMILION, fontsize=11)
    axes.text(0.0, -1.68, "no force", fontsize=8, ha="center")


def _contact(axes: Axes) -> None:
    along, depth = math.radians(-40.0), 0.07
    normal = np.array([math.cos(along), math.sin(along)])
    tangent = np.array([-normal[1], normal[0]])
    place = (BEARING - JOURNAL + depth) * normal
    _joint(axes, tuple(place.tolist()))
    touch = (BEARING + depth) * normal
    _arrow(axes, tuple(touch), tuple(touch - 0.95 * normal), VERMILION)
    _arrow(axes, tuple(touch), tuple(touch + 0.65 * tangent), ORANGE)
    axes.text(0.2, -0.16, "$F_n$", color=VERMILION, fontsize=11)
    axes.text(1.42, 0.0, "$F_t$", color=ORANGE, fontsize=11)
    _arrow(axes, tuple(touch + 0.05 * normal), tuple(touch + 0.75 * normal), GREY)
    axes.text(1.45, -1.3, "$\\mathbf{n}$", color=GREY, fontsize=11)
    axes.text(0.0, -1.68, "indentation $\\delta = e - c$", fontsize=8, ha="center")


def _orbit(axes: Axes) -> None:
    case = read_case(ROOT / "examples" / "paper.toml")
    run = simulate(case.mechanism, **case.run.keywords | {"samples": "auto", "until": 0.012})
    x, y = 1e3 * run["eccentricity"].sel(joint="A").transpose("axis", "time").values
    c = 1e3 * float(run["clearance"].sel(joint="A"))
    axes.add_patch(Circle((0, 0), c, fill=False, edgecolor=GREY, linestyle=":"))
    axes.plot(x, y, color=BLUE, linewidth=0.9)
    axes.plot(0, 0, "+", color=BLACK, markersize=8)
    axes.set(xlim=(-1.25 * c, 1.25 * c), ylim=(-1.25 * c, 1.25 * c), aspect="equal", xlabel="$e_x$ [mm]", ylabel="$e_y$ [mm]")
    dress(axes)


CLEARANCES: tuple[tuple[float, str], ...] = ((0.1e-3, VERMILION), (0.03e-3, ORANGE), (0.01e-3, GREEN))
"""Of all joints of the solar array in the result [m], and their colours."""


def result(target: Path) -> Path:
    """Draw the solar array, and how far its tip is off with three clearances.

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
    figure = plt.figure(figsize=(10.0, 4.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.1, 1.0))
    deviation, force = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    drawn: Any = None
    for clearance, color in CLEARANCES:
        mechanism = case.mechanism
        for name in names:
            mechanism = mechanism.replace(f"{name}.clearance", clearance)
        run = simulate(mechanism, **case.run.keywords)
        drawn = drawn or (run, mechanism)
        label = f"clearance {1e3 * clearance:g} mm"
        deviation.plot(run["time"], 1e3 * run["track_deviation"].sel(track="tip"), color=color, linewidth=1.1, label=label)
        force.plot(run["time"], run["normal_force"].max("joint"), color=color, linewidth=0.7)
        print(
            f"{label}: tip {1e3 * float(run['peak_track_deviation'][0]):.3g} mm, {float(run['peak_force'].max()):.4g} N",
            flush=True,
        )
    deviation.axhline(2.0, color=GREY, linestyle="--", linewidth=1.0, label="allowed 2 mm")
    deviation.set(ylabel="tip off by [mm]", yscale="log", ylim=(0.02, 40.0))
    force.set(ylabel="largest joint force [N]", xlabel="time [s]", yscale="log", ylim=(3.0, 2000.0))
    for one in (deviation, force):
        dress(one)
    deviation.legend(fontsize=8, frameon=False, loc="lower right", ncols=1)
    _deployment(figure.add_subplot(grid[:, 0]), *drawn)
    return write(figure, target)


def _deployment(axes: Axes, run: Any, mechanism: Any) -> None:
    """The array at four instants, one above the other."""
    length = 0.0
    for row, part in enumerate((0.0, 0.4, 0.55, 1.0)):
        at = round(part * (run.sizes["time"] - 1))
        now, placement = run.isel(time=at), Placement.at(mechanism, run, [at])
        for body in (name for name in now["body"].values.astype(str) if "/bar " in name):
            ends = placement.points(body, outline(mechanism.body(body))[[0, -1]])[0]
            length = length or float(np.linalg.norm(ends[1] - ends[0]))
            color = BLUE if body.endswith("bar 1") else GREEN
            axes.plot(ends[:, 0], ends[:, 1] - 1.1 * length * row, color=color, linewidth=2.2, solid_capstyle="round")
        tip = now["track_position"].sel(track="tip").values
        axes.plot(tip[0], tip[1] - 1.1 * length * row, "s", color=BLACK, markersize=7)
        axes.text(-0.1, (0.2 - 1.1 * row) * length, f"{float(now['time']):.2g} s", fontsize=9, ha="right")
    axes.set(aspect="equal")
    axes.axis("off")
    axes.set_title("four units, a servo and a payload", fontsize=10)
