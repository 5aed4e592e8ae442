"""Draw a scene with matplotlib, for stills and films, with artists that are updated frame by frame."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.patheffects import Normal, Stroke

from scissordyn.plot.animation_scene import Channel, ClearanceJoint, Corners, Scene, Shape, ring_size
from scissordyn.plot.bar_diagram import DIAGRAM_MAP, QUANTITIES, Diagram, ordinate_edges
from scissordyn.plot.label import Label
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    PURPLE,
    SIZES,
    SKY,
    VERMILION,
    draw_scale_bar,
    dress,
)

BAR_FRACTION, PIN_FRACTION = 0.6, 0.45  # Width of bars and diameter of pins as fractions of the ring's diameter

BAR_EDGES = BLUE, GREEN
BAR_FILLS = "#b5d3ea", "#b0dfcd"
"""Outline and fill colours of bars and plates, which alternate between two colours."""

# Style of the hatched ground below a fixed pin, as arguments of matplotlib's `Rectangle`
HATCH_STYLE: dict[str, Any] = {"facecolor": "white", "edgecolor": GREY, "hatch": "//////", "linewidth": 0.0}

# Style of filled shapes in drawings of a mechanism, by kind of the shape
AREA_STYLES: dict[str, dict[str, Any]] = {
    "block": {"facecolor": LIGHT, "edgecolor": BLACK, "linewidth": 0.9, "zorder": 1.8},
    "payload": {"facecolor": to_rgba(GREY, 0.45), "edgecolor": BLACK, "linewidth": 0.9, "zorder": 2.2},
    "panel": {"facecolor": to_rgba(PURPLE, 0.25), "edgecolor": PURPLE, "linewidth": 0.6, "zorder": 1.7},
    "plate": {"linewidth": 1.6, "zorder": 1.9},
}
LINE_STYLES: dict[str, dict[str, Any]] = {
    "bar": {"linewidth": 4.0, "zorder": 2.0, "solid_capstyle": "round", "solid_joinstyle": "round"},
    "component": {"color": PURPLE, "linewidth": 1.0, "zorder": 2.5},
    "rod": {"color": PURPLE, "linewidth": 1.4, "linestyle": (0, (4, 1.5)), "zorder": 2.5},
    "guide": {"color": GREY, "linewidth": 0.7, "linestyle": (0, (6, 2, 1, 2)), "zorder": 1.0},
}
"""Style of lines in drawings of a mechanism, by kind of the shape."""

# Colour of the printed name of a part, by kind of the part
NAME_COLOURS = {"joint": VERMILION, "guide": VERMILION, "component": PURPLE, "payload": BLACK}


class Drawing:
    """Artists of a scene on given Axes, for the scene's region or a given one."""

    def __init__(self, axes: Axes, scene: Scene, region: Corners | None = None) -> None:
        self.axes, self.scene = axes, scene
        self.region = low, high = region or (scene.low, scene.high)
        dress(axes)
        axes.set_aspect("equal", adjustable="box")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        draw_scale_bar(axes, scene.turns)
        self.shapes = [self._artist(shape) for shape in scene.shapes]
        self.diagram = _BarDiagram(axes, scene) if scene.on_bars else None
        size = 0.025 * float(np.max(scene.high - scene.low))
        for pin in scene.supports:
            corners = pin + size * np.array([[0.0, 0.0], [-1.0, -1.6], [1.0, -1.6]])
            axes.add_patch(Polygon(corners, facecolor="white", edgecolor=BLACK, linewidth=0.9, zorder=1.5))
            axes.add_patch(Rectangle(pin - size * np.array([1.6, 2.3]), 3.2 * size, 0.7 * size, zorder=1.4, **HATCH_STYLE))
        pins: dict[str, Any] = {"markersize": 4.0, "color": BLACK, "markerfacecolor": "white", "markeredgewidth": 0.9}
        (self.pins,) = axes.plot([], [], "o", zorder=4.0, **pins)
        ring: dict[str, Any] = {
            "markersize": SIZES.ring_diameter,
            "markerfacecolor": "none",
            "markeredgewidth": 1.4,
            "color": BLACK,
        }
        self.rings = [axes.plot([], [], "o", zorder=5.0, **ring)[0] for _ in scene.rings]
        self.touched = {joint.name: joint.touched for joint in scene.clearance_joints}

    def _artist(self, shape: Shape) -> Line2D | Polygon:
        tone: dict[str, Any] = {}
        if shape.kind == "plate":
            tone = {"facecolor": to_rgba(BAR_FILLS[shape.tone], 0.6), "edgecolor": BAR_EDGES[shape.tone], "joinstyle": "round"}
        elif shape.kind == "bar":
            tone = {"color": BAR_FILLS[shape.tone]}
            if self.scene.on_bars:  # neutral colours below a diagram, which has its own
                coloured = not QUANTITIES[self.scene.on_bars].tone
                tone = {"color": BLACK, "linewidth": 4.4 if coloured else 1.6} if shape.parts else {"color": GREY}
                tone = {"linewidth": 2.0} | tone
        if shape.kind in AREA_STYLES:
            area = Polygon(shape.points[0], **AREA_STYLES[shape.kind], **tone)
            self.axes.add_patch(area)
            return area
        return self.axes.plot([], [], scalex=False, scaley=False, **LINE_STYLES[shape.kind] | tone)[0]

    def fit_sizes(self) -> float:
        """Fit rings, pins and bars to the scale of the laid-out drawing; return the length of its longer side [pt]."""
        figure = self.axes.get_figure(root=True)
        assert figure is not None
        longer = 72.0 / figure.dpi * max(self.axes.bbox.width, self.axes.bbox.height)
        places = np.concatenate([self.scene.pins, *(place[:, None] for _, place in self.scene.rings)], axis=1)
        scale = longer / float(np.max(np.subtract(*self.region[::-1])))
        size = ring_size(places, scale, SIZES.ring_diameter) if places.shape[1] else SIZES.ring_diameter
        for ring in self.rings:
            ring.set(markersize=size, markeredgewidth=1.4 * math.sqrt(size / SIZES.ring_diameter))
        self.pins.set(markersize=PIN_FRACTION * size, markeredgewidth=0.9 * math.sqrt(size / SIZES.ring_diameter))
        if not self.scene.on_bars:
            for artist, shape in zip(self.shapes, self.scene.shapes, strict=True):
                if shape.kind == "bar":
                    width = BAR_FRACTION * size
                    edge = Stroke(linewidth=width + 2.0 * SIZES.bar_edge, foreground=BAR_EDGES[shape.tone])
                    artist.set(linewidth=width, path_effects=[edge, Normal()])
        return longer

    def labels(self, frame: int) -> list[Label]:
        """Return the names of clearance joints, components and payloads with their positions."""
        return [Label(name, places[frame], NAME_COLOURS[kind]) for name, kind, places in self.scene.names]

    def show(self, frame: int, diagram: Diagram | None = None) -> None:
        """Update all artists to a frame; `diagram` replaces the frame's own diagram on bars."""
        for artist, shape in zip(self.shapes, self.scene.shapes, strict=True):
            if isinstance(artist, Polygon):
                artist.set_xy(shape.points[frame])
            else:
                artist.set_data(*shape.points[frame].T)
        if self.diagram is not None:
            self.diagram.show(frame, diagram or self.diagram.diagram.at([frame]))
        self.pins.set_data(*self.scene.pins[frame].T)
        for ring, (name, places) in zip(self.rings, self.scene.rings, strict=True):
            ring.set_data(*places[frame, None].T)
            if name in self.touched:
                ring.set_color(VERMILION if self.touched[name][frame] else SKY)


class _BarDiagram:
    """Diagram on bending bars, drawn as colours or as ordinates."""

    def __init__(self, axes: Axes, scene: Scene) -> None:
        self.bars = [shape for shape in scene.shapes if shape.parts]
        self.diagram = next(diagram for diagram in scene.diagrams if diagram.quantity == scene.on_bars)
        self.size = float(np.max(scene.high - scene.low))
        self.lines = LineCollection([], linewidths=3.0 if self.diagram.coloured else 0.9, zorder=2.2)
        self.areas = PolyCollection([], alpha=0.25, linewidths=0.0, zorder=1.5)
        axes.add_collection(self.lines)
        axes.add_collection(self.areas)
        if self.diagram.coloured:
            self.lines.set(cmap=DIAGRAM_MAP, norm=Normalize(0.0, self.diagram.largest))
        else:
            tone = QUANTITIES[self.diagram.quantity].tone
            self.lines.set_color(tone)
            self.areas.set(facecolor=tone, label=self.diagram.label)

    def show(self, frame: int, now: Diagram) -> None:
        """Draw all samples of a diagram on the bars of a frame."""
        places = [shape.places[frame] for shape in self.bars]
        order = np.concatenate([shape.parts for shape in self.bars])
        if now.coloured:
            self.lines.set_segments([part for bar in places for part in bar])
            self.lines.set_array(now.values[:, order].max(axis=(0, 2)))
            return
        areas, lines = [], []
        for shape, bar in zip(self.bars, places, strict=True):
            of_bar = dataclasses.replace(now, values=now.values[:, list(shape.parts)])
            for outer in of_bar.ordinates(bar[None], SIZES.ordinate_length * self.size):
                between, along = ordinate_edges(bar, outer)
                areas += between
                lines += along
        self.areas.set_verts(areas)
        self.lines.set_segments(lines)


class MagnifiedBlock:
    """Magnified view of a clearance guide: the block in its channel."""

    def __init__(self, axes: Axes, joint: Channel) -> None:
        self.joint = joint
        edge = SIZES.channel_half_length
        if joint.hollow:  # the block is a ring around a solid pole
            low, high = sorted(joint.surfaces.values())
            axes.add_patch(Rectangle((-edge, low), 2.0 * edge, high - low, facecolor=LIGHT, linewidth=0.0))
        for face, height in joint.surfaces.items():
            if not joint.hollow:
                axes.add_patch(Rectangle((-edge, min(height, height + 0.25 * face)), 2.0 * edge, 0.25, **HATCH_STYLE))
            axes.plot([-edge, edge], [height, height], color=BLACK, linewidth=1.2)
        axes.plot([-edge, edge], [0.0, 0.0], **LINE_STYLES["guide"])
        _frame(axes, 1.75)
        self.block = Polygon(joint.block[0], facecolor="none" if joint.hollow else LIGHT, linewidth=1.6)
        axes.add_patch(self.block)
        self.walls = [axes.plot([], [], linewidth=2.6, solid_capstyle="butt")[0] for _ in joint.surfaces if joint.hollow]
        (self.corners,) = axes.plot([], [], "o", markersize=4.5, color=VERMILION)

    def show(self, frame: int) -> None:
        touching = self.joint.touching[frame]
        color = VERMILION if self.joint.touched[frame] else SKY
        self.block.set_xy(self.joint.block[frame])
        self.block.set_edgecolor("none" if self.joint.hollow else color)
        for wall, points in zip(self.walls, block_walls(self.joint, frame), strict=False):
            wall.set_data(*points.T)
            wall.set_color(color)
        self.corners.set_data(*self.joint.block[frame][touching].T)


def block_walls(joint: Channel, frame: int) -> list[np.ndarray]:
    """Return the outline of a block, or the inner sides of a ring around its pole, each of shape (points, 2)."""
    short = 0.5  # half the length of a side with a single corner, in half widths of the block
    block = joint.block[frame]
    if not joint.hollow:
        return [np.concatenate([block, block[:1]])]
    middle = 0.5 * sum(joint.surfaces.values())
    sides = [block[np.sign(block[:, 1] - middle) == side] for side in (1.0, -1.0)]
    return [side if len(side) > 1 else side + np.array([[-short, 0.0], [short, 0.0]]) for side in sides if len(side)]


def magnified_text(gain: float) -> str:
    """Return the caption of a magnified joint, which tells how much its clearance is magnified or reduced."""
    return f"clearance magnified {gain:.2g} times" if gain >= 1.0 else f"clearance reduced to {gain:.2g} of its size"


class MagnifiedJournal:
    """Magnified view of a clearance joint: the journal in its bearing and its recent path."""

    def __init__(self, axes: Axes, joint: ClearanceJoint) -> None:
        self.joint = joint
        axes.add_patch(Circle((0.0, 0.0), 1.0 + SIZES.magnified_clearance, facecolor="white", edgecolor=BLACK, linewidth=1.2))
        self.journal = Circle((0.0, 0.0), 1.0, facecolor=LIGHT, linewidth=1.6)
        axes.add_patch(self.journal)
        (self.path,) = axes.plot([], [], color=ORANGE, linewidth=0.9)
        (self.centre,) = axes.plot([], [], "+", markersize=6.0, markeredgewidth=1.0)
        axes.plot(0.0, 0.0, ".", markersize=3.0, color=BLACK)
        _frame(axes, max(1.5, 1.05 + float(np.max(np.abs(joint.journal)))))  # large enough for the journal of a deep contact

    def show(self, frame: int) -> None:
        joint = self.joint
        color = VERMILION if joint.touched[frame] else SKY
        self.journal.set_center(tuple(joint.journal[frame]))
        self.journal.set_edgecolor(color)
        self.centre.set_data(*joint.journal[frame, None].T)
        self.centre.set_color(color)
        first = max(0, joint.reached[max(0, frame - SIZES.trail_frames)] - 1)
        self.path.set_data(*joint.path[first : joint.reached[frame]].T)


def draw_magnified(axes: Axes, joint: Channel | ClearanceJoint) -> MagnifiedBlock | MagnifiedJournal:
    return MagnifiedBlock(axes, joint) if isinstance(joint, Channel) else MagnifiedJournal(axes, joint)


def _frame(axes: Axes, reach: float) -> None:
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)
