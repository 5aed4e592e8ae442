"""Draw the assembled mechanism with its names, before any run."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.components.actuator import Actuator
from scissordyn.components.place import GROUND
from scissordyn.kinematics.closure import Inputs
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.plot.animation_scene import scene_of, upright_turns
from scissordyn.plot.drawing import Drawing
from scissordyn.plot.file import figure_of
from scissordyn.plot.label import Label, write_labels
from scissordyn.plot.scale import engineering
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SIZES,
    VERMILION,
    Canvas,
    apply_layout,
    panels,
    small,
)
from scissordyn.plot.symbol import symbols
from scissordyn.record.placement import Placement
from scissordyn.run.simulate import simulate
from scissordyn.units import checked

if TYPE_CHECKING:
    import xarray as xr


@checked
def preview(mechanism: Mechanism, *, axes: Canvas = None, start: xr.Dataset | None = None) -> Axes:
    """Draw the assembled mechanism with the names of its bodies, joints, drives and components.

    Parameters
    ----------
    mechanism : Mechanism
    axes : Axes, optional
        New figure if not given.
    start : Dataset, optional
        Run of the mechanism with ideal joints; its first sample is drawn. It is computed if not given.

    Returns
    -------
    Axes
        The number of names without a free place is given above the drawing.

    Raises
    ------
    InputError
        If the mechanism cannot be assembled.
    """
    margin = 0.05  # margin around the scene as a fraction of its longer side
    least_ratio = 0.46  # least ratio of the region's sides, which leaves room for names next to a line of bars
    letters = 7.0  # size of the names [pt]
    instant = 1e-9  # length of the run that computes the assembled position [s]
    run = simulate(mechanism.ideal(), until=instant, samples=2) if start is None else start
    scene = scene_of(run, mechanism, np.array([0]), [])
    span = scene.high - scene.low
    aside = np.maximum(margin * np.max(span), 0.5 * (least_ratio * np.max(span) - span))
    region = low, high = scene.low - aside, scene.high + aside
    placed = Placement.at(mechanism, run, [0], turns=upright_turns(mechanism))
    shared = _shared_clearance(mechanism)
    # the name of a component at a point is written at that point, even if its symbol ends outside the picture
    acting: dict[str, Any] = {part.name: part for part in mechanism.components if hasattr(part, "point")}
    drawn = symbols(run, mechanism, placed, [0], SIZES.symbol_radius * float(np.max(span)))
    places = {part.name: placed.place(acting[part.name].point) if part.name in acting else part.anchor for part in drawn}
    names = _names(mechanism, placed, places, shared)
    if axes is None:
        size = _size(high - low, len(names))
        figure = Figure(figsize=size)
        axes = figure.add_axes((0.7 / size[0], 0.55 / size[1], 1.0 - 0.85 / size[0], 1.0 - 0.85 / size[1]))
    (chosen,) = panels(axes, 1, size=(SIZES.figure_min, SIZES.figure_min))
    drawing = Drawing(chosen, scene, region)
    drawing.show(0)
    _draw_drives(chosen, mechanism, placed, 0.05 * float(np.max(high - low)))
    _draw_gravity(chosen, mechanism, placed)
    apply_layout(figure_of(chosen))
    drawing.fit_sizes()
    left = write_labels(chosen, names[: SIZES.names_max], size=letters, crowded=False) + [
        name.text for name in names[SIZES.names_max :]
    ]
    notes = [f"{shared} at each large circle"] if shared else []
    notes += [f"{len(left)} names are left out for lack of room"] if left else []
    chosen.set_title("; ".join(notes), loc="right", fontsize=small(), color=GREY)
    return chosen


def _size(span: np.ndarray, names: int) -> tuple[float, float]:
    """Return width and height of a figure for a region [inch]."""
    per_name = 0.11  # increase of the longer side for each name [inch]
    largest = 15.0  # largest longer side of the figure [inch]
    longer = min(largest, SIZES.figure_min + per_name * min(names, SIZES.names_max))
    ratio = float(span[0] / span[1])
    width, height = (longer, longer / ratio) if ratio > 1.0 else (longer * ratio, longer)
    return max(width, 4.0) + 0.85, max(height, 2.6) + 0.85


def _names(mechanism: Mechanism, placed: Placement, parts: Mapping[str, np.ndarray], shared: str) -> list[Label]:
    """Return all names, the most important first: clearances, drives, components and couplings, bodies, ideal joints."""
    joints: list[tuple[Any, tuple[str, str], str]] = [(joint, joint.bearing, BLACK) for joint in mechanism.joints]
    joints += [(guide, guide.follower, GREY) for guide in mechanism.guides]
    labels = [
        Label(joint.name if shared else f"{joint.name} ({_clearance(joint)})", placed.place(end)[0], VERMILION)
        for joint, end, _ in joints
        if joint.clearance is not None
    ]
    labels += [Label(f"drive of {drive.body}", _pivot(placed, drive.body), ORANGE) for drive in mechanism.drives]
    labels += [Label(name, places[0], PURPLE) for name, places in parts.items()]
    bars = [body for body in mechanism.bodies if len(set(body.points.values())) > 1]
    for body in mechanism.bodies:
        color = (BLUE, GREEN)[bars.index(body) % 2] if body in bars else GREY
        labels.append(Label(body.name, _name_place(placed, body.name), color))
    return labels + [Label(joint.name, placed.place(end)[0], color) for joint, end, color in joints if joint.clearance is None]


def _shared_clearance(mechanism: Mechanism) -> str:
    """Return the clearance that all of many clearance joints share; "" otherwise."""
    many = 3  # a clearance shared by more joints than this is stated once
    joints: list[Any] = [*mechanism.joints, *mechanism.guides]
    texts = [_clearance(joint) for joint in joints if joint.clearance is not None]
    return texts[0] if len(texts) > many and len(set(texts)) == 1 else ""


def _name_place(placed: Placement, body: str) -> np.ndarray:
    """Return a place for the name of a body: on the body and away from its joints [m]."""
    points = [placed.place((body, point))[0] for point in placed.mechanism.body(body).points]
    if len(points) < 2:
        return np.asarray(points[0] if points else placed.centre(body)[0])
    first, second = max(itertools.combinations(points, 2), key=lambda pair: math.dist(*pair))
    return np.asarray(0.7 * first + 0.3 * second)


def _pivot(placed: Placement, body: str) -> np.ndarray:
    """Return the position of a body's pivot on the ground, or of its mass centre [m]."""
    for joint in placed.mechanism.joints:
        if set(joint.bodies) == {body, GROUND}:
            return np.asarray(placed.place(joint.bearing)[0])
    return np.asarray(placed.centre(body)[0])


def _draw_drives(axes: Axes, mechanism: Mechanism, placed: Placement, radius: float) -> None:
    """Draw arrows around the pivots of driven bodies, in the direction of their initial rotation."""
    driven = [drive.body for drive in mechanism.drives]
    driven += [part.body for part in mechanism.components if isinstance(part, Actuator)]
    for body in dict.fromkeys(driven):
        turn = float(placed.angle(body)[0]) + _direction(mechanism, body) * np.radians(np.linspace(15.0, 100.0, 30))
        arc = _pivot(placed, body) + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        axes.plot(*arc[:-3].T, color=ORANGE, linewidth=1.6, zorder=4.5)
        arrow = {"arrowstyle": "-|>", "color": ORANGE, "linewidth": 1.6, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", arc[-1].tolist(), xytext=arc[-4].tolist(), arrowprops=arrow, zorder=4.5)


def _draw_gravity(axes: Axes, mechanism: Mechanism, placed: Placement) -> None:
    """Draw an arrow in the direction of gravity in a corner."""
    if mechanism.gravity == 0.0:
        return
    turn = mechanism.gravity_direction + float(placed.angle(GROUND)[0])
    axes.annotate(
        "",
        (0.965, 0.94),
        xycoords="axes fraction",
        xytext=(-22.0 * math.cos(turn), -22.0 * math.sin(turn)),
        textcoords="offset points",
        arrowprops={"arrowstyle": "-|>", "color": GREY, "linewidth": 1.0},
    )
    text = f"arrow top right: gravity {mechanism.gravity:.4g} m/s\u00b2"
    axes.set_title(text, loc="left", fontsize=small(), color=GREY)


def _clearance(joint: Any) -> str:
    clearance = joint.clearance.clearance
    return f"clearance {engineering('m', clearance).with_unit(clearance, 3)}"


def _direction(mechanism: Mechanism, body: str) -> float:
    """Return the sign of a driven body's initial rotation; 1.0 (counter-clockwise) if it does not rotate."""
    inputs = Inputs(plan(mechanism))
    if body not in inputs.bodies:
        return 1.0
    k = inputs.bodies.index(body)
    change = inputs.at(1e-3)[k] - inputs.at(0.0)[k]
    return -1.0 if change < 0.0 else 1.0
