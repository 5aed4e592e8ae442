"""Draw worn joints by angle, magnified, clearances and deviations over the cycles, and films of both."""

from __future__ import annotations

import os
from itertools import cycle as repeated
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.casefile.configuration import read_configuration
from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.animation import FRAME_RATES, check_film, write_frames
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import draw_limit
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Canvas,
    figure_size,
    legend,
    literal,
    normal,
    panels,
    shades,
    small,
)

# Colours of joints or tracked points in pictures of wear, repeated in order
PART_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)


def _check(run: xr.Dataset) -> None:
    """Raise `InputError` for a Dataset that is not a result of `wear`."""
    if run.attrs.get("title") != "scissordyn wear":
        raise InputError(f"cannot draw wear from a '{run.attrs.get('title')}'", "a result of wear()", "sd.wear(mechanism, ...)")


def _chosen(run: xr.Dataset, joint: str | None) -> str:
    """Return the name of a worn surface, by default that of the deepest one."""
    names = run["joint"].values.tolist()
    chosen = str(names[int(np.argmax(run["depth_largest"].values[-1]))] if joint is None else joint)
    if chosen not in names:
        raise InputError(f"joint '{chosen}' does not wear{did_you_mean(chosen, names)}", "one of " + ", ".join(names))
    return chosen


def profile(
    run: xr.Dataset, joint: str | None = None, *, axes: Axes | None = None, contours: int = 4, depth_fraction: float = 0.3
) -> Axes:
    """Draw the worn bearing or journal of a joint by angle, with the depth magnified, at some numbers of cycles.

    Parameters
    ----------
    run : Dataset
        Result of `wear`.
    joint : str, optional
        Joint, or ``"JOINT/journal"`` for a worn journal; by default the deepest one.
    contours : int
        Number of contours, at states with about equal differences of depth.
    depth_fraction : float
        Drawn size of the largest wear depth over the radius, which determines the magnification.
    axes : Axes, optional
        Axes with polar coordinates.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the joint does not wear.
    """
    _check(run)
    chosen = _chosen(run, joint)
    if axes is None:
        figure = Figure(figsize=figure_size(5.6, 4.4), layout="constrained")
        axes = figure.add_subplot(projection="polar")
    here = run.sel(joint=chosen)
    largest, depths = here["depth_largest"].values, here["depth"].values
    angle = np.append(run["angle"].values, 2.0 * np.pi)
    deepest = float(largest[-1]) or 1.0
    at = sorted({int(np.argmin(np.abs(largest - share * deepest))) for share in np.linspace(0.0, 1.0, contours + 1)[1:]})
    side = str(here["side"].values)
    outward = depth_fraction if side == "bearing" else -depth_fraction
    axes.plot(angle, np.ones(angle.size), color=GREY, linestyle="--", linewidth=0.8, label=f"round {side}")
    for colour, k in zip(shades(len(at)), at, strict=True):
        if largest[k] == 0.0:
            continue
        radius = 1.0 + outward * np.append(depths[k], depths[k, 0]) / deepest
        axes.plot(angle, radius, color=colour, linewidth=1.1, label=f"cycle {int(run['cycle'].values[k])}")
    scale = engineering("m", deepest)
    ticks = np.array([0.0, 1.0])
    axes.set_ylim(0.0, 1.0 + 1.15 * max(outward, 0.1 * depth_fraction))
    labels = [f"{scale.factor * deepest * tick:.3g}" for tick in ticks]
    axes.set_yticks(1.0 + outward * ticks, labels, fontsize=small(), color=GREY)
    axes.tick_params(labelsize=small())
    # between the labels of the angles, where the bearing is worn least
    between = np.pi / 8.0 * np.arange(1, 16, 2)
    polar: Any = axes
    polar.set_rlabel_position(float(np.degrees(between[np.argmin(np.interp(between, angle[:-1], depths[at[-1]]))])))
    for label in axes.yaxis.get_ticklabels():
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.8})
    axes.grid(linewidth=0.4)
    factor = depth_fraction * float(here["radius"]) / deepest
    axes.set_title(
        f"joint {literal(chosen)}: wear depth [{scale.unit}], magnified {float(f'{factor:.3g}'):g} times",
        fontsize=normal(),
        color=BLACK,
    )
    legend([axes])
    return axes


def history(run: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Draw the largest clearance of each joint and the deviation of each tracked point over the cycles.

    Bands are 95 % intervals; dotted lines are limits.

    Parameters
    ----------
    run : Dataset
        Result of `wear`.
    axes : Axes or sequence of Axes, optional
        One for the clearances, and one for the deviations if a point is tracked.

    Returns
    -------
    list of Axes
    """
    _check(run)
    mechanism = read_configuration(run).mechanism
    tracked = _is_tracked(run)
    drawn = panels(axes, 1 + tracked, size=(7.0, 2.6 * (1 + tracked)))
    bearings = run["joint"].values[run["side"].values == "bearing"]
    clearances = [(str(name), *_pair(run, "joint", name, "worn_clearance", "clearance_error")) for name in bearings]
    _curves(drawn[0], run, "largest radial clearance", clearances, _limits(run))
    if tracked:
        both = "track_deviation", "track_deviation_error"
        deviations = [(str(name), *_pair(run, "track", name, *both)) for name in run["track"].values]
        tolerances = [track.tolerance for track in mechanism.tracks if track.tolerance is not None]
        _curves(drawn[1], run, "largest deviation", deviations, tolerances)
    drawn[-1].set_xlabel("cycle", fontsize=normal())
    for panel in drawn:
        legend([panel])
    return drawn


def film(
    run: xr.Dataset,
    path: str | os.PathLike[str],
    joint: str | None = None,
    *,
    seconds: float = 6.0,
    rate: int | None = None,
) -> Path:
    """Write a film of the worn profile of a joint, magnified, next to the clearances and deviations over the cycles.

    Contours between two simulated states are interpolated.

    Parameters
    ----------
    run : Dataset
        Result of `wear`.
    path : path
        File name that ends in .gif, .mp4 (requires ffmpeg) or .html (a single-file page with a player).
    joint : str, optional
        Joint, or ``"JOINT/journal"`` for a worn journal; by default the deepest one.
    seconds : float
        Duration of the film [s].
    rate : int, optional
        Frames per second.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the joint does not wear, the format is unknown or the file cannot be written.
    """
    _check(run)
    check_film(path)
    depths, cycles, tracked = run["depth"].sel(joint=_chosen(run, joint)).values, run["cycle"].values, _is_tracked(run)
    figure = Figure(figsize=figure_size(9.6, 4.4), layout="constrained")
    grid = figure.add_gridspec(1 + tracked, 2)
    panels = [figure.add_subplot(grid[k, 1]) for k in range(1 + tracked)]
    polar = profile(run, joint, axes=figure.add_subplot(grid[:, 0], projection="polar"), contours=1)
    history(run, axes=panels)
    line, marks = polar.lines[-1], [panel.axvline(0.0, color=BLACK, linewidth=0.8) for panel in panels]
    drawn = np.asarray(line.get_ydata())
    at = int(np.argmax(depths[-1]))
    gain = (drawn[at] - 1.0) / depths[-1, at] if depths[-1, at] > 0.0 else 0.0
    if (names := polar.get_legend()) is not None:
        names.remove()  # the frames name the cycle
    polar.set_xlabel("cycle", fontsize=normal())
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the panels keep their sizes
    pace = FRAME_RATES[Path(path).suffix.lower().removeprefix(".")] if rate is None else rate
    shown = np.linspace(cycles[0], cycles[-1], max(2, round(seconds * pace)))

    def show(frame: int) -> None:
        now = float(shown[frame])
        contour = [np.interp(now, cycles, depths[:, k]) for k in range(depths.shape[1])]
        line.set_ydata(1.0 + gain * np.array([*contour, contour[0]]))
        for mark in marks:
            mark.set_xdata([now, now])
        polar.set_xlabel(f"cycle {now:.0f}", fontsize=normal())

    return write_frames(Path(path), figure, show, len(shown), pace)


def _is_tracked(run: xr.Dataset) -> bool:
    """Return whether a result has deviations of tracked points."""
    return bool(run.sizes["track"]) and bool(np.isfinite(run["track_deviation"].values).all())


def _pair(run: xr.Dataset, dim: str, name: object, curve: str, error: str) -> tuple[xr.DataArray, xr.DataArray]:
    """Return a curve of one part over the cycles, and half its interval."""
    return run[curve].sel({dim: name}), run[error].sel({dim: name})


def _limits(run: xr.Dataset) -> list[float]:
    """Return the largest clearance that the settings of the wear allow, in a list that is empty without a limit."""
    import json

    limit = json.loads(run.attrs["settings"])["most_clearance"]
    return [] if limit is None else [float(limit)]


def _curves(
    axes: Axes, run: xr.Dataset, label: str, curves: list[tuple[str, xr.DataArray, xr.DataArray]], limits: list[float]
) -> None:
    """Draw curves over the cycles with their intervals and limits."""
    scale = engineering("m", *(curve.values for _, curve, _ in curves), limits)
    cycles = run["cycle"].values
    for colour, (name, curve, error) in zip(repeated(PART_COLOURS), curves, strict=False):
        low, high = scale.factor * (curve - error).values, scale.factor * (curve + error).values
        axes.fill_between(cycles, low, high, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(cycles, scale.factor * curve.values, color=colour, marker="o", markersize=2.5, label=literal(str(name)))
    for limit in limits:
        draw_limit(axes, scale.factor * limit, "limit")
    axes.set_ylabel(f"{label} [{scale.unit}]", fontsize=normal())
