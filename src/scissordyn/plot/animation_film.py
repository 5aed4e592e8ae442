"""Films drawn by matplotlib: GIF and MP4."""

from __future__ import annotations

import dataclasses
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation

from scissordyn.errors import InputError
from scissordyn.plot.animation_scene import TRAIL, ClearanceJoint, Scene, Shape, newtons, scale_in_words
from scissordyn.plot.bar_diagram import COLOURS, ORDINATE, QUANTITIES, colour_bar, edges
from scissordyn.plot.channel import surfaces
from scissordyn.plot.channel_scene import GAP, Channel
from scissordyn.plot.place import ring_size
from scissordyn.plot.series import write_more
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    dress,
    label_axes,
    literal,
    small,
)

DPI = 100

RING = 8.0
"""Diameter of the ring around a clearance joint, where there is room [pt]."""

WIDE = 1.5
"""Structures wider than this have the panels of their joints below, others beside them."""

NARROW = 0.5
"""Least ratio of width to height of the region that is drawn."""

LOADS: dict[str, dict[str, Any]] = {
    "payload": {"facecolor": to_rgba(GREY, 0.45), "edgecolor": BLACK, "linewidth": 0.9, "zorder": 2.2},
    "panel": {"facecolor": to_rgba(PURPLE, 0.25), "edgecolor": PURPLE, "linewidth": 0.6, "zorder": 1.7},
}
"""Payloads and panels."""


LEADER = {"arrowstyle": "-", "color": BLACK, "linewidth": 0.5, "shrinkA": 1.0, "shrinkB": 0.5}
"""The thin line from a name to its joint."""


class Film:
    """A figure whose artists are moved from frame to frame."""

    def __init__(self, scene: Scene, slower: float) -> None:
        self.scene, self.slower = scene, slower
        low, high = self.region = _widened(scene.low, scene.high)
        magnified = scene.magnified[: scene.shown]
        self.figure, self.axes, panels = _figure(float(np.divide(*(high - low))), len(magnified))
        dress(self.axes)
        self.axes.set_aspect("equal", adjustable="box")
        self.axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        label_axes(self.axes, scene.turns)
        self.shapes = self._shapes()
        self.diagram = _OnBars(self.axes, scene) if scene.on_bars else None
        _supports(self.axes, scene)
        (self.pins,) = self.axes.plot(
            [], [], "o", markersize=4.0, color=BLACK, markerfacecolor="white", markeredgewidth=0.9, zorder=4.0
        )
        self.rings = [
            self.axes.plot([], [], "o", markersize=RING, markerfacecolor="none", markeredgewidth=1.4, zorder=5.0)[0]
            for _ in scene.clearance_joints
        ]
        self.joints: list[_Magnified | _Block] = [
            _Block(axes, joint) if isinstance(joint, Channel) else _Magnified(axes, joint)
            for axes, joint in zip(panels, magnified, strict=True)
        ]
        self.names = [_name(self.axes, joint.name) for joint in magnified]
        self.asides = np.zeros((len(scene.time), len(magnified), 2))
        write_more(self.figure, len(scene.magnified) - len(magnified))
        self.show(0)
        for _ in range(2):  # lays the panels out, once for all frames; the first time without the room of equal scales
            self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")
        self._fit()
        self.show(0)

    def _fit(self) -> None:
        """Place the names and size the rings for the scale of the drawing, which the layout decides."""
        longer = 72.0 / self.figure.dpi * max(self.axes.bbox.width, self.axes.bbox.height)
        self.asides = self.scene.asides(len(self.names), region=self.region, longer=longer, looks=len(self.scene.time))
        if self.rings:
            places = np.stack([joint.place for joint in self.scene.clearance_joints], axis=1)
            size = ring_size(places, longer / float(np.max(self.region[1] - self.region[0])), RING)
            for ring in self.rings:
                ring.set(markersize=size, markeredgewidth=1.4 * math.sqrt(size / RING))

    def _shapes(self) -> list[Line2D | Polygon]:
        artists: list[Line2D | Polygon] = []
        for shape in self.scene.shapes:
            if shape.kind == "block":
                block = Polygon(shape.points[0], facecolor=LIGHT, edgecolor=BLACK, linewidth=0.9, zorder=1.8)
                self.axes.add_patch(block)
                artists.append(block)
            elif shape.kind in LOADS:
                load = Polygon(shape.points[0], **LOADS[shape.kind])
                self.axes.add_patch(load)
                artists.append(load)
            elif shape.kind == "plate":
                color = (BLUE, GREEN)[shape.tone]
                plate = Polygon(shape.points[0], facecolor=to_rgba(color, 0.15), edgecolor=color, linewidth=1.6, zorder=1.9)
                self.axes.add_patch(plate)
                artists.append(plate)
            else:
                look = {
                    "bar": self._bar(shape),
                    "component": {"color": PURPLE, "linewidth": 1.0, "zorder": 2.5},
                    "rod": {"color": PURPLE, "linewidth": 1.4, "linestyle": (0, (4, 1.5)), "zorder": 2.5},
                    "guide": {"color": GREY, "linewidth": 0.7, "linestyle": (0, (6, 2, 1, 2)), "zorder": 1.0},
                }[shape.kind]
                artists.append(self.axes.plot([], [], scalex=False, scaley=False, **look)[0])
        return artists

    def _bar(self, shape: Shape) -> dict[str, Any]:
        """How a bar is drawn: without a colour of its own below those of a diagram."""
        if not self.scene.on_bars:
            return {"color": (BLUE, GREEN)[shape.tone], "linewidth": 2.0, "zorder": 2.0}
        if not shape.parts:
            return {"color": GREY, "linewidth": 2.0, "zorder": 2.0}
        coloured = not QUANTITIES[self.scene.on_bars].tone
        return {"color": BLACK, "linewidth": 4.4 if coloured else 1.6, "zorder": 2.0}

    def show(self, frame: int) -> None:
        """Update all artists to a frame."""
        scene = self.scene
        for artist, shape in zip(self.shapes, scene.shapes, strict=True):
            if isinstance(artist, Polygon):
                artist.set_xy(shape.points[frame])
            else:
                artist.set_data(*shape.points[frame].T)
        if self.diagram is not None:
            self.diagram.show(frame)
        self.pins.set_data(*scene.pins[frame].T)
        for ring, joint in zip(self.rings, scene.clearance_joints, strict=True):
            ring.set_data(*joint.place[frame, None].T)
            ring.set_color(VERMILION if joint.touched[frame] else SKY)
        for magnified, name, aside in zip(self.joints, self.names, self.asides[frame], strict=True):
            magnified.show(frame)
            name.xy = tuple(magnified.joint.place[frame])
            name.set_position(tuple(aside))
        now = f"t = {scene.scale.factor * scene.time[frame]:.4g} {scene.scale.unit}"
        caption = f"{now}   ({scale_in_words(self.slower, scene.magnification)})"
        if self.diagram is not None and not self.diagram.diagram.coloured:
            caption = f"{self.diagram.diagram.label}\n{caption}"
        self.axes.set_title(caption, loc="left", fontsize=small())


class _OnBars:
    """A diagram on bars that bend: their colours with a colour bar, or ordinates with what the longest is."""

    def __init__(self, axes: Axes, scene: Scene) -> None:
        self.bars = [shape for shape in scene.shapes if shape.parts]
        self.diagram = next(diagram for diagram in scene.diagrams if diagram.quantity == scene.on_bars)
        self.size = float(np.max(scene.high - scene.low))
        self.lines = LineCollection([], linewidths=3.0 if self.diagram.coloured else 0.9, zorder=2.2)
        self.areas = PolyCollection([], alpha=0.25, linewidths=0.0, zorder=1.5)
        axes.add_collection(self.lines)
        axes.add_collection(self.areas)
        if self.diagram.coloured:
            self.lines.set(cmap=COLOURS, norm=Normalize(0.0, self.diagram.largest))
            colour_bar([axes], self.diagram)
        else:
            tone = QUANTITIES[self.diagram.quantity].tone
            self.lines.set_color(tone)
            self.areas.set_facecolor(tone)

    def show(self, frame: int) -> None:
        """Update the diagram to a frame."""
        places = [shape.places[frame] for shape in self.bars]
        order = np.concatenate([shape.parts for shape in self.bars])
        now = self.diagram.at([frame])
        if now.coloured:
            self.lines.set_segments([part for bar in places for part in bar])
            self.lines.set_array(now.values[0, order].max(axis=-1))
            return
        outer = [
            dataclasses.replace(now, values=now.values[:, list(shape.parts)]).ordinates(bar[None], ORDINATE * self.size)[0]
            for shape, bar in zip(self.bars, places, strict=True)
        ]
        drawn = [edges(bar, ends) for bar, ends in zip(places, outer, strict=True)]
        self.areas.set_verts([area for areas, _ in drawn for area in areas])
        self.lines.set_segments([line for _, lines in drawn for line in lines])


def _gain(axes: Axes, gain: float) -> None:
    """Say below a panel how much larger its clearance is drawn; in two lines, for panels stand close to each other."""
    axes.set_xlabel(f"clearance magnified\n{gain:.2g} times", fontsize=small())


def _name(axes: Axes, text: str) -> Annotation:
    """A name beside its joint, readable over bars."""
    annotation = axes.annotate(
        literal(text),
        (0.0, 0.0),
        xytext=(0.0, 0.0),
        textcoords="offset points",
        fontsize=small(),
        zorder=6.0,
        arrowprops=LEADER,
    )
    annotation.set(ha="center", va="center")
    annotation.set_color(BLACK)
    annotation.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    annotation.set_in_layout(False)
    return annotation


class _Block:
    """A clearance guide beside the structure: the block in its channel."""

    def __init__(self, axes: Axes, joint: Channel) -> None:
        self.axes, self.joint = axes, joint
        surfaces(axes, joint)
        self.block = Polygon(joint.block[0], facecolor="none" if joint.hollow else LIGHT, linewidth=1.6)
        axes.add_patch(self.block)
        (self.corners,) = axes.plot([], [], "o", markersize=4.5, color=VERMILION)
        _gain(axes, joint.gain)

    def show(self, frame: int) -> None:
        """Update the block to a frame."""
        joint, touching = self.joint, self.joint.touching[frame]
        self.block.set_xy(joint.block[frame])
        self.block.set_edgecolor(VERMILION if touching.any() else SKY)
        self.corners.set_data(*joint.block[frame][touching].T)
        state = newtons(float(joint.force[frame])) if touching.any() else "free"
        self.axes.set_title(f"{literal(joint.name)}: {state}", fontsize=small(), color=BLACK)


class _Magnified:
    """A clearance joint beside the structure: the journal in its bearing, with its recent path."""

    def __init__(self, axes: Axes, joint: ClearanceJoint) -> None:
        self.axes, self.joint = axes, joint
        axes.add_patch(Circle((0.0, 0.0), 1.0 + GAP, facecolor="white", edgecolor=BLACK, linewidth=1.2))
        self.journal = Circle((0.0, 0.0), 1.0, facecolor=LIGHT, linewidth=1.6)
        axes.add_patch(self.journal)
        (self.path,) = axes.plot([], [], color=ORANGE, linewidth=0.9)
        (self.centre,) = axes.plot([], [], "+", markersize=6.0, markeredgewidth=1.0)
        axes.plot(0.0, 0.0, ".", markersize=3.0, color=BLACK)
        axes.set_aspect("equal", adjustable="box")
        axes.set(xlim=(-1.5, 1.5), ylim=(-1.5, 1.5), xticks=[], yticks=[])
        for spine in axes.spines.values():
            spine.set_visible(False)
        _gain(axes, joint.gain)

    def show(self, frame: int) -> None:
        """Update the journal and its path to a frame."""
        joint = self.joint
        color = VERMILION if joint.touched[frame] else SKY
        self.journal.set_center(tuple(joint.journal[frame]))
        self.journal.set_edgecolor(color)
        self.centre.set_data(*joint.journal[frame, None].T)
        self.centre.set_color(color)
        first = joint.reached[max(0, frame - TRAIL)] - 1
        self.path.set_data(*joint.path[first : joint.reached[frame]].T)
        state = newtons(float(joint.force[frame])) if joint.touched[frame] else "free"
        self.axes.set_title(f"{literal(joint.name)}: {state}", fontsize=small(), color=BLACK)


def _widened(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The region of a structure, that of a narrow one with room for names at its sides."""
    width, height = high - low
    more = np.array([0.5 * max(NARROW * height - width, 0.0), 0.0])
    return np.stack([low - more, high + more])


def _figure(aspect: float, joints: int) -> tuple[Figure, Axes, list[Axes]]:
    """A figure with a panel for the structure and one for each joint."""
    if aspect > WIDE:
        width = 9.0
        heights = [min(max(width / aspect, 1.6), 5.0) + 0.7, *[1.9] * bool(joints)]
        figure = Figure(figsize=(width, sum(heights)), layout="constrained")
        grid = figure.add_gridspec(len(heights), max(joints, 1), height_ratios=heights)
        places = [grid[1, k] for k in range(joints)]
        main = grid[0, :]
    else:
        height, columns = 5.6, -(-joints // 3)
        widths = [min(max((height - 0.8) * aspect, 2.4), 7.0) + 0.8, *[1.9] * columns]
        figure = Figure(figsize=(sum(widths), height), layout="constrained")
        grid = figure.add_gridspec(min(max(joints, 1), 3), len(widths), width_ratios=widths)
        places = [grid[k % 3, 1 + k // 3] for k in range(joints)]
        main = grid[:, 0]
    return figure, figure.add_subplot(main), [figure.add_subplot(place) for place in places]


def _supports(axes: Axes, scene: Scene) -> None:
    size = 0.025 * float(np.max(scene.high - scene.low))
    for joint in scene.supports:
        corners = joint + size * np.array([[0.0, 0.0], [-1.0, -1.6], [1.0, -1.6]])
        axes.add_patch(Polygon(corners, facecolor="white", edgecolor=BLACK, linewidth=0.9, zorder=1.5))


def write_film(scene: Scene, path: Path, rate: int, slower: float) -> None:
    """Write a GIF or an MP4."""
    film = Film(scene, slower)
    writer: AbstractMovieWriter
    if path.suffix.lower() == ".mp4":
        if not FFMpegWriter.isAvailable():
            raise InputError("an MP4 needs the program ffmpeg, which is not installed", "film.gif or film.html")
        # players need even sides and this pixel format
        even = ["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p"]
        writer = FFMpegWriter(fps=rate, codec="h264", extra_args=even)
    else:
        writer = PillowWriter(fps=rate)
    try:
        with writer.saving(film.figure, str(path), DPI):
            for frame in range(len(scene.time)):
                film.show(frame)
                writer.grab_frame()
    except subprocess.CalledProcessError as error:
        raise InputError(f"ffmpeg could not write the film (exit status {error.returncode})", "film.gif or film.html") from None
