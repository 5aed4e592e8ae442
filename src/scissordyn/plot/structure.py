"""The structure itself at several instants, with its loose joints magnified."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.transforms import Affine2D

from scissordyn.model.body import GROUND
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.place import Placement, outline
from scissordyn.plot.series import BEYOND, chosen_joints, horizon, loose_joints, time_scale
from scissordyn.plot.style import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, PURPLE, SKY, SMALL, VERMILION, dress

__all__ = ["magnified", "snapshot", "structure"]

GAP = 0.35
"""The clearance of a magnified joint as a fraction of the drawn journal's radius."""

BAR_COLORS = (BLUE, GREEN, ORANGE, PURPLE, SKY)


def structure(
    run: xr.Dataset, mechanism: Mechanism, *, times: int | Sequence[float] = 4, joints: Sequence[str] | None = None
) -> list[Axes]:
    """The mechanism at several instants, each with its loose joints magnified beside it, on a new figure.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism
        The one that was run.
    times : int or sequence of float
        How many instants, equally spaced from start to end; or which ones [s], each the nearest sample.
    joints : sequence of str, optional
        Which loose joints to magnify; those with the largest forces if not given.

    Returns
    -------
    list of Axes
        Instant by instant: the structure, then its joints.
    """
    time = run["time"].values
    wanted = np.linspace(time[0], time[-1], times) if isinstance(times, int) else np.asarray(times, float)
    samples = [int(np.argmin(np.abs(time - instant))) for instant in wanted]
    chosen = chosen_joints(run, joints) if joints is not None or loose_joints(run) else []
    low, high = _extent(run, mechanism, samples)
    aspect = (high[0] - low[0]) / (high[1] - low[1])

    # tall structures stand side by side with their joints below; long ones lie one below the other with their joints at the right
    tall = aspect < 2.0
    lengths = [1.0] + [0.55] * len(chosen)
    if tall:
        width = 2.5
        lengths[0] = 1.0 / aspect
        size = (0.6 + width * len(samples), 1.0 + width * sum(lengths))
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(1 + len(chosen), len(samples), squeeze=False, height_ratios=lengths).T
    else:
        height = 1.6
        lengths = [aspect] + [1.1] * len(chosen)
        fit = min(1.0, 12.0 / (height * sum(lengths)))
        size = (0.8 + fit * height * sum(lengths), 0.6 + (0.5 + fit * height) * len(samples))
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(len(samples), 1 + len(chosen), squeeze=False, width_ratios=lengths)
    for k, (sample, row) in enumerate(zip(samples, grid, strict=True)):
        snapshot(run, mechanism, sample, axes=row[0])
        row[0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        inner_y, inner_x = tall and k > 0, not tall and k < len(samples) - 1
        if inner_y:
            row[0].set_ylabel("")
            row[0].tick_params(labelleft=False)
        if inner_x:
            row[0].set_xlabel("")
            row[0].tick_params(labelbottom=False)
        for joint, one in zip(chosen, row[1:], strict=True):
            magnified(run, mechanism, sample, joint, axes=one)
    return list(grid.flat)


def snapshot(run: xr.Dataset, mechanism: Mechanism, sample: int, *, axes: Axes) -> Axes:
    """The mechanism at one sample of a run: bars, pins, guides and ground; loose joints ringed and named.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism
    sample : int
        Index along "time".
    axes : Axes

    Returns
    -------
    Axes
    """
    dress(axes)
    axes.set_aspect("equal", adjustable="box")
    placed = Placement.at(mechanism, run, sample)
    low, high = _extent(run, mechanism, [sample])
    size = 0.035 * float(np.max(high - low))
    guided = {guide.follower[0]: guide for guide in mechanism.guides}
    colored = 0
    for body in mechanism.bodies:
        shape = placed.points(body, outline(body))
        if len(shape) == 1:
            tilt = guided[body.name].direction if body.name in guided else 0.0
            _block(axes, shape[0], 1.3 * size, tilt)
            continue
        color, colored = BAR_COLORS[colored % 2 if len(mechanism.bodies) > 5 else colored % len(BAR_COLORS)], colored + 1
        axes.plot(*shape[[*range(len(shape)), 0]].T, color=color, linewidth=1.8, solid_capstyle="round", zorder=2.0)
    for guide in mechanism.guides:
        through, along = np.array(guide.through), np.array([math.cos(guide.direction), math.sin(guide.direction)])
        axes.axline(through, through + along, color=GREY, linewidth=0.7, linestyle=(0, (6, 2, 1, 2)), zorder=1.0)
    for joint in mechanism.joints:
        where = placed.place(joint.bearing)
        if GROUND in joint.bodies:
            _support(axes, placed.place(joint.bearing if joint.bearing[0] == GROUND else joint.journal), size)
        if joint.clearance is None:
            axes.plot(*where, marker="o", markersize=3.6, color=BLACK, markerfacecolor="white", markeredgewidth=0.8, zorder=4.0)
        else:
            axes.plot(
                *where, marker="o", markersize=7.0, color=VERMILION, markerfacecolor="none", markeredgewidth=1.2, zorder=4.0
            )
            axes.annotate(
                joint.name, where, xytext=(7.0, 5.0), textcoords="offset points", fontsize=SMALL, color=VERMILION, zorder=5.0
            )
    now, scale, until = float(run["time"].values[sample]), time_scale(run), horizon(run)
    late = f"\n{BEYOND}" if until is not None and now > until else ""
    axes.set_title(f"t = {scale.factor * now:.4g} {scale.unit}{late}", loc="left", fontsize=SMALL)
    axes.set(xlabel="x [m]", ylabel="y [m]")
    return axes


def magnified(run: xr.Dataset, mechanism: Mechanism, sample: int, joint: str, *, axes: Axes) -> Axes:
    """A loose joint at one sample: the journal in its bearing, the gap between them drawn larger than it is.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism
    sample : int
        Index along "time".
    joint : str
    axes : Axes

    Returns
    -------
    Axes
    """
    clearance = mechanism.joint(joint).clearance
    assert clearance is not None
    now = run.isel(time=sample).sel(joint=joint)
    gain = GAP * clearance.journal_radius / clearance.clearance
    offset = GAP * now["eccentricity"].transpose("axis").values / clearance.clearance
    touching = bool(now["in_contact"])
    color = VERMILION if touching else SKY
    axes.add_patch(Circle((0.0, 0.0), 1.0 + GAP, facecolor="white", edgecolor=BLACK, linewidth=1.2))
    axes.add_patch(Circle((float(offset[0]), float(offset[1])), 1.0, facecolor=LIGHT, edgecolor=color, linewidth=1.4))
    axes.plot(*offset, marker="+", markersize=6.0, color=color, markeredgewidth=1.0)
    axes.plot(0.0, 0.0, marker=".", markersize=3.0, color=BLACK)
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-1.5, 1.5), ylim=(-1.5, 1.5), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)
    state = "contact" if touching else "free flight"
    axes.set_title(f"{joint}: {state}\ngap drawn {gain:.2g}×", fontsize=SMALL, color=BLACK)
    return axes


def _extent(run: xr.Dataset, mechanism: Mechanism, samples: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner around the mechanism at some samples, with a margin [m]."""
    found = [
        placed.points(body, outline(body))
        for placed in (Placement.at(mechanism, run, sample) for sample in samples)
        for body in mechanism.bodies
    ]
    found.extend(np.array([place]) for _, place in mechanism.ground)
    everything = np.concatenate(found)
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = 0.1 * (float(np.max(high - low)) or 1.0)
    return low - margin, high + margin


def _support(axes: Axes, pin: np.ndarray, size: float) -> None:
    """A ground pin: a triangle that stands on a hatched strip."""
    corners = np.array([[0.0, 0.0], [-size, -1.6 * size], [size, -1.6 * size]])
    axes.add_patch(Polygon(pin + corners, facecolor="white", edgecolor=BLACK, linewidth=0.8, zorder=1.5))
    axes.add_patch(
        Rectangle(
            (pin[0] - 1.6 * size, pin[1] - 2.3 * size),
            3.2 * size,
            0.7 * size,
            facecolor="white",
            edgecolor=GREY,
            hatch="//////",
            linewidth=0.0,
            zorder=1.4,
        )
    )


def _block(axes: Axes, middle: np.ndarray, size: float, tilt: float) -> None:
    """A slider or point mass, long in the direction of its guide."""
    turned = Affine2D().rotate(tilt).translate(*middle) + axes.transData
    axes.add_patch(
        Rectangle(
            (-size, -0.6 * size),
            2.0 * size,
            1.2 * size,
            transform=turned,
            facecolor=LIGHT,
            edgecolor=BLACK,
            linewidth=0.8,
            zorder=1.8,
        )
    )
