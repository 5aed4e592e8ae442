"""The assembled mechanism with its names, before any run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.component.actuator import Actuator
from scissordyn.component.place import GROUND
from scissordyn.kinematics.closure import Inputs
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.plot.animation_scene import scene_of, upright
from scissordyn.plot.drawing import Drawing
from scissordyn.plot.file import svg
from scissordyn.plot.label import Label, write_labels
from scissordyn.plot.scale import engineering
from scissordyn.plot.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION, Canvas, panels, small
from scissordyn.plot.symbol import coupling_symbols, wheel_points
from scissordyn.run.answer.placement import Placement
from scissordyn.run.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

INSTANT = 1e-9  # A run of this length gives the assembled position [s]
SMALLEST, LARGEST = 6.0, 15.0  # Longer side of the figure [inch]
PER_NAME = 0.11  # By how much a name enlarges it [inch]
MOST = 160  # So many names are written at most; names of joints with clearance, drives and components come first
LETTERS = 7.0  # Size of the names [pt]
NARROWEST = 0.55  # Shorter side of the region over the mechanism's longer side, at least: names need room beside a line of bars
MANY = 3  # If more joints than these have the same clearance, it is said once
MARGIN = 0.16  # Around the mechanism, as a fraction of its longer side


def preview(mechanism: Mechanism, *, axes: Canvas = None, start: xr.Dataset | None = None) -> Axes:
    """The assembled mechanism with the names of its bodies, joints, drives and components.

    Parameters
    ----------
    mechanism : Mechanism
    axes : Axes, optional
        A new figure if not given.
    start : Dataset, optional
        A run of the mechanism with ideal joints, whose first sample is drawn; one is made if not given.

    Returns
    -------
    Axes
        Names for which there is no room are left out, and counted below the drawing.

    Raises
    ------
    InputError
        If the mechanism cannot be assembled.
    """
    run = simulate(mechanism.ideal(), until=INSTANT, samples=2) if start is None else start
    drawing = _Drawing(mechanism, run)
    low, high = drawing.corners()
    names = drawing.names()
    if axes is None:
        size = _size(high - low, len(names))
        figure = Figure(figsize=size)
        axes = figure.add_axes((0.7 / size[0], 0.55 / size[1], 1.0 - 0.85 / size[0], 1.0 - 0.85 / size[1]))
    (chosen,) = panels(axes, 1, size=(SMALLEST, SMALLEST))
    scene = Drawing(chosen, scene_of(run, mechanism, np.array([0]), []), (low, high))
    scene.show(0)
    drawing.drives(chosen, 0.05 * float(np.max(high - low)))
    drawing.gravity(chosen)
    chosen.get_figure(root=True).draw_without_rendering()  # type: ignore[union-attr]
    scene.fit_rings()
    left = write_labels(chosen, names[:MOST], size=LETTERS, crowded=False) + [name.text for name in names[MOST:]]
    notes = [f"{drawing.shared()} at each large circle"] if drawing.shared() else []
    notes += [f"{len(left)} names are left out for lack of room"] if left else []
    chosen.set_title("; ".join(notes), loc="right", fontsize=small(), color=GREY)
    return chosen


def preview_svg(mechanism: Mechanism) -> str:
    """The preview of a mechanism as the text of an SVG file."""
    return svg(preview(mechanism))


def _size(span: np.ndarray, names: int) -> tuple[float, float]:
    """Width and height of a figure for a region [inch]."""
    longer = min(LARGEST, SMALLEST + PER_NAME * min(names, MOST))
    ratio = float(span[0] / span[1])
    width, height = (longer, longer / ratio) if ratio > 1.0 else (longer * ratio, longer)
    return max(width, 4.0) + 0.85, max(height, 2.6) + 0.85


class _Drawing:
    """What is drawn of a mechanism, and where."""

    def __init__(self, mechanism: Mechanism, run: xr.Dataset) -> None:
        self.mechanism = mechanism
        self.placed = Placement.at(mechanism, run, [0], turns=upright(mechanism))

    def place(self, body: str, point: str) -> np.ndarray:
        """A named point [m]."""
        return np.asarray(self.placed.place((body, point))[0])

    def centre(self, body: str) -> np.ndarray:
        """The mass centre of a body [m]."""
        return np.asarray(self.placed.centre(body)[0])

    def points(self, body: str) -> np.ndarray:
        """All points of a body, or its mass centre, shape (points, 2) [m]."""
        points = [self.place(body, point) for point in self.mechanism.body(body).points]
        return np.array(points or [self.centre(body)])

    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower left and upper right corner of the region to show [m]."""
        everything = np.concatenate(
            [
                *(self.points(body.name) for body in self.mechanism.bodies),
                *(self.place(GROUND, name)[None] for name, _ in self.mechanism.ground),
                wheel_points(self.placed),
            ]
        )
        low, high = everything.min(axis=0), everything.max(axis=0)
        longer = float(np.max(high - low)) or 1.0
        aside = np.maximum(MARGIN * longer, 0.5 * (NARROWEST * longer - (high - low)))
        return low - aside, high + aside

    def names(self) -> list[Label]:
        """All names, the most important ones first."""
        mechanism = self.mechanism
        labels: list[Label] = []
        loose: list[tuple[Any, Any]]
        parts: list[Any] = [*mechanism.components, *mechanism.rods, *mechanism.latches]
        loose = [(joint, joint.bearing) for joint in mechanism.joints if joint.clearance is not None]
        loose += [(guide, guide.follower) for guide in mechanism.guides if guide.clearance is not None]
        labels += [Label(self._loose(joint), self.place(*end), VERMILION) for joint, end in loose]
        labels += [Label(f"drive of {drive.body}", self._pivot(drive.body), ORANGE) for drive in mechanism.drives]
        labels += [Label(part.name, self._of(part), PURPLE) for part in parts]
        labels += [Label(symbol.name, symbol.anchor[0], PURPLE) for symbol in coupling_symbols(mechanism, self.placed, 0.0)]
        bars = [body for body in mechanism.bodies if len(set(body.points.values())) > 1]
        for body in mechanism.bodies:
            color = (BLUE, GREEN)[bars.index(body) % 2] if body in bars else GREY
            labels.append(Label(body.name, self._middle(body.name), color))
        labels += [
            Label(joint.name, self.place(*joint.bearing), BLACK) for joint in mechanism.joints if joint.clearance is None
        ]
        labels += [
            Label(guide.name, self.place(*guide.follower), GREY) for guide in mechanism.guides if guide.clearance is None
        ]
        return labels

    def _loose(self, joint: Any) -> str:
        """The name of a clearance joint or guide with its clearance, unless that is said for all."""
        return joint.name if self.shared() else f"{joint.name} ({_clearance(joint)})"

    def shared(self) -> str:
        """The clearance of all clearance joints, if it is that of many; "" otherwise."""
        joints: list[Any] = [*self.mechanism.joints, *self.mechanism.guides]
        texts = [_clearance(joint) for joint in joints if joint.clearance is not None]
        return texts[0] if len(texts) > MANY and len(set(texts)) == 1 else ""

    def _middle(self, body: str) -> np.ndarray:
        """Where the name of a body belongs: on it, away from its joints [m]."""
        points = self.points(body)
        if len(points) == 1:
            return np.asarray(points[0])
        apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
        i, j = np.unravel_index(int(np.argmax(apart)), apart.shape)
        return np.asarray(0.7 * points[i] + 0.3 * points[j])

    def _pivot(self, body: str) -> np.ndarray:
        """Where a body is pinned to the ground, or its mass centre [m]."""
        for joint in self.mechanism.joints:
            for here, there in ((joint.journal, joint.bearing), (joint.bearing, joint.journal)):
                if here[0] == body and there[0] == GROUND:
                    return self.place(*here)
        return self.centre(body)

    def _of(self, part: Any) -> np.ndarray:
        """Where the name of a component belongs [m]."""
        if hasattr(part, "start") and hasattr(part, "end"):
            return np.asarray(0.5 * (self.place(*part.start) + self.place(*part.end)))
        if hasattr(part, "point"):
            return self.place(*part.point)
        body, base = getattr(part, "body", ""), getattr(part, "base", GROUND)
        for joint in self.mechanism.joints:
            if {body, base} == set(joint.bodies):
                return self.place(*joint.bearing)
        names = [described.name for described in self.mechanism.bodies]
        return self._pivot(body) if body in names else np.mean([self.centre(name) for name in names], axis=0)

    def drives(self, axes: Axes, radius: float) -> None:
        """Arrows around the pivots of driven bodies, in the direction in which they turn at first."""
        driven = [drive.body for drive in self.mechanism.drives]
        driven += [part.body for part in self.mechanism.components if isinstance(part, Actuator)]
        for body in dict.fromkeys(driven):
            sign = _direction(self.mechanism, body)
            middle, first = self._pivot(body), float(self.placed.angle(body)[0])
            turn = first + sign * np.radians(np.linspace(15.0, 100.0, 30))
            arc = middle + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
            axes.plot(*arc[:-3].T, color=ORANGE, linewidth=1.6, zorder=4.5)
            arrow = {"arrowstyle": "-|>", "color": ORANGE, "linewidth": 1.6, "shrinkA": 0.0, "shrinkB": 0.0}
            axes.annotate("", arc[-1].tolist(), xytext=arc[-4].tolist(), arrowprops=arrow, zorder=4.5)

    def gravity(self, axes: Axes) -> None:
        """An arrow in the direction of gravity, in a corner."""
        if self.mechanism.gravity == 0.0:
            return
        turn = self.mechanism.gravity_direction + float(self.placed.angle(GROUND)[0])
        axes.annotate(
            "",
            (0.965, 0.94),
            xycoords="axes fraction",
            xytext=(-22.0 * math.cos(turn), -22.0 * math.sin(turn)),
            textcoords="offset points",
            arrowprops={"arrowstyle": "-|>", "color": GREY, "linewidth": 1.0},
        )
        axes.set_title(
            f"arrow top right: gravity {self.mechanism.gravity:.4g} m/s\u00b2", loc="left", fontsize=small(), color=GREY
        )


def _clearance(joint: Any) -> str:
    """The clearance of a joint or guide in words."""
    scale = engineering("m", joint.clearance.clearance)
    return f"clearance {scale.factor * joint.clearance.clearance:.3g} {scale.unit}"


def _direction(mechanism: Mechanism, body: str) -> float:
    """The sense in which a driven body turns at first; counter-clockwise if it does not."""
    inputs = Inputs(plan(mechanism))
    if body not in inputs.bodies:
        return 1.0
    k = inputs.bodies.index(body)
    change = inputs.at(1e-3)[k] - inputs.at(0.0)[k]
    return -1.0 if change < 0.0 else 1.0
