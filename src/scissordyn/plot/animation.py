"""Write films of runs: GIF and MP4 files drawn by matplotlib, and HTML pages with a player."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, HTMLWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.equilibrium.deflection import magnified_deflection
from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.output_file import check_target, write_file
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import Scene, newtons, scale_in_words, scene_of
from scissordyn.plot.bar_diagram import colour_bar
from scissordyn.plot.canvas import page
from scissordyn.plot.drawing import Drawing, draw_magnified, magnified_text
from scissordyn.plot.label import Label, write_name
from scissordyn.plot.series import chosen_joints, clearance_pins, largest_forces, write_more
from scissordyn.plot.style import BLACK, SIZES, literal, small
from scissordyn.record.results import Run
from scissordyn.record.sampling import spread_samples
from scissordyn.units import checked
from scissordyn.warning import LISTED_MAX

if TYPE_CHECKING:
    import xarray as xr

FRAME_RATES = {"gif": 10, "mp4": 25, "html": 25}
"""Default frames per second of each format. A GIF has fewer because all its frames are held in memory before writing."""


LEADER = {"arrowstyle": "-", "color": BLACK, "linewidth": 0.5, "shrinkA": 1.0, "shrinkB": 0.5}
"""Line style of the leader between a joint and its name."""


def check_film(path: str | os.PathLike[str]) -> None:
    """Raise `InputError` unless a film can be written in the format that a file name ends with."""
    ending = Path(path).suffix.lower().removeprefix(".")
    if ending not in FRAME_RATES:
        raise InputError(
            f"unknown film format of '{path}'{did_you_mean(ending, FRAME_RATES)}",
            "a name that ends in .gif, .mp4 or .html",
            "film.html",
        )
    if ending == "mp4" and not FFMpegWriter.isAvailable():
        raise InputError(
            "cannot write MP4: the program ffmpeg is not installed", "ffmpeg on the PATH, or another format", "film.html"
        )


@checked
def animate(
    run: xr.Dataset,
    mechanism: Mechanism,
    path: str | os.PathLike[str],
    *,
    seconds: float = 6.0,
    rate: int | None = None,
    joints: Sequence[str] | None = None,
    magnify: float = 1.0,
    bars: str | None = None,
) -> Path:
    """Write a film of a run with magnified views of its clearance joints.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism
        Mechanism of the run.
    path : path
        File name that ends in .gif, .mp4 (requires ffmpeg) or .html (a single-file page with a player).
    seconds : float
        Duration of the film [s]; the run is slowed down or sped up accordingly.
    rate : int, optional
        Frames per second; by default 25, or 10 for a GIF. A run with fewer samples than frames has one frame per sample.
    joints : sequence of str, optional
        Revolute clearance joints to magnify. By default the joints with the largest forces and all guides with clearance.
        A page lists the other joints after these; a GIF or MP4 states how many are left out.
    magnify : float
        Factor that multiplies the deflections of bending bars; the caption shows it.
    bars : {"stress", "utilisation", "bending moment", "axial force"}, optional
        Quantity drawn on bending bars at first; a page can switch to the other quantities.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the format is unknown, the run has fewer than two samples, a named joint has no clearance, the bars lack data for
        `bars`, or the file cannot be written.
    """
    check_film(path)
    target, samples = Path(path), run.sizes["time"]
    if rate is None:
        rate = FRAME_RATES[target.suffix.lower().removeprefix(".")]
    if samples < 2:
        raise InputError("the run has fewer than two samples", "a run with two samples or more", "samples=200")
    if not (np.isfinite(seconds) and seconds > 0.0 and rate >= 1):
        raise InputError(f"a film of {seconds!r} s with {rate!r} frames per second", "seconds > 0 and rate >= 1")
    shown, every, guides = magnified_first(run, mechanism, joints)
    frames = spread_samples(run["time"].values, max(2, min(samples, round(seconds * rate))))
    if magnify != 1.0:
        run = magnified_deflection(run, mechanism, magnify, samples=frames.tolist())
    scene = scene_of(run, mechanism, frames, every, guides=guides, shown=shown, on_bars=bars)
    rate = max(1, round(len(frames) / seconds))
    slower = len(frames) / rate / float(scene.time[-1] - scene.time[0])
    if target.suffix.lower() == ".html":
        title = film_title(target, scene)
        return _write(target, lambda part: part.write_text(page(scene, run, seconds, title=title), encoding="utf-8"))
    film = Film(scene, slower)
    return write_frames(target, film.figure, film.show, len(scene.time), rate)


def write_frames(target: Path, figure: Figure, show: Callable[[int], None], frames: int, rate: int) -> Path:
    """Write a film of a figure, which `show` updates for each frame, at a rate [1/s]; a page shows pictures."""

    def draw(part: Path) -> None:
        with _writer(part, rate).saving(figure, str(part), SIZES.film_dpi) as writer:
            for frame in range(frames):
                show(frame)
                writer.grab_frame()

    return _write(target, draw)


def _write(target: Path, draw: Callable[[Path], object]) -> Path:
    """Write a film that `draw` writes to a file of its own, which matplotlib's writers require."""
    check_target(target, sample="film.html")
    try:
        with tempfile.TemporaryDirectory(prefix="scissordyn-film-") as folder:
            part = Path(folder) / f"film{target.suffix.lower()}"
            draw(part)
            film = part.read_bytes()
    except OSError as error:
        raise InputError(
            f"cannot make the film '{target}': {error.strerror or error}", "a temporary folder with free space"
        ) from None
    except subprocess.CalledProcessError as error:
        raise InputError(f"ffmpeg could not write the film (exit status {error.returncode})", "film.gif or film.html") from None
    return write_file(target, film, sample="film.html")


def film_title(path: Path, scene: Scene) -> str:
    """Return the title of a film: the name of its file, and the time that it shows."""
    begin, end = (scene.scale.with_unit(float(scene.time[k]), 3) for k in (0, -1))
    return f"{path.stem.replace('_', ' ')}: {begin} to {end}"


def magnified_first(run: Run, mechanism: Mechanism, joints: Sequence[str] | None) -> tuple[int, list[str], list[str]]:
    """Return the number of joints to magnify, all journal joints with the chosen ones first, and the guides to magnify."""
    pins = clearance_pins(run)
    chosen = chosen_joints(run, joints, pins) if joints is not None or pins else []
    others = [name for name in pins if name not in chosen]
    largest = largest_forces(run)
    guides = [guide.name for guide in mechanism.guides if guide.clearance is not None] if joints is None else []
    shown = len(joints) if joints is not None else LISTED_MAX
    return shown, chosen + sorted(others, key=lambda name: -largest[name]), guides


class Film:
    """Matplotlib figure of a scene that is updated frame by frame."""

    def __init__(self, scene: Scene, slower: float) -> None:
        self.scene, self.slower = scene, slower
        region = _widened(scene.low, scene.high)
        joints = scene.magnified[: scene.shown]
        self.figure, self.axes, self.panels = _figure(float(np.divide(*(region[1] - region[0]))), len(joints))
        self.drawing = Drawing(self.axes, scene, region)
        self.diagram = self.drawing.diagram and self.drawing.diagram.diagram
        if self.diagram and self.diagram.coloured:
            colour_bar([self.axes], self.diagram)
        self.joints = [draw_magnified(axes, joint) for axes, joint in zip(self.panels, joints, strict=True)]
        for axes, joint in zip(self.panels, joints, strict=True):  # two lines, because neighbouring panels are narrow
            axes.set_xlabel("\n".join(wrap(magnified_text(joint.gain), SIZES.caption_letters)), fontsize=small())
        named = [Label(joint.name, np.zeros(2), BLACK) for joint in joints]
        self.names = [write_name(self.axes, label, small(), in_layout=False, arrowprops=LEADER) for label in named]
        self.asides = np.zeros((len(scene.time), len(joints), 2))
        write_more(self.figure, len(scene.magnified) - len(joints))
        self.show(0)
        for _ in range(2):  # two passes: constrained layout settles equal scales only in the second one
            self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")
        longer = self.drawing.fit_sizes()
        self.asides = scene.name_offsets(len(joints), region=region, longer=longer, instants=len(scene.time))
        self.show(0)

    def show(self, frame: int) -> None:
        self.drawing.show(frame)
        for axes, magnified, name, aside in zip(self.panels, self.joints, self.names, self.asides[frame], strict=True):
            magnified.show(frame)
            joint = magnified.joint
            state = newtons(float(joint.force[frame])) if joint.touched[frame] else "free"
            axes.set_title(f"{literal(joint.name)}: {state}", fontsize=small(), color=BLACK)
            name.xy = tuple(joint.place[frame])
            name.set_position(tuple(aside))
        caption = f"{self.scene.instant(frame)}   ({scale_in_words(self.slower, self.scene.magnification)})"
        if self.diagram and not self.diagram.coloured:
            caption = f"{self.diagram.label}\n{caption}"
        self.axes.set_title(caption, loc="left", fontsize=small())


def _widened(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the drawn region; a narrow region is widened to make room for names at its sides."""
    least_aspect = 0.5  # least ratio of width to height of the drawn region
    width, height = high - low
    more = np.array([0.5 * max(least_aspect * height - width, 0.0), 0.0])
    return low - more, high + more


def _figure(aspect: float, joints: int) -> tuple[Figure, Axes, list[Axes]]:
    """Return a figure with one panel for the structure and one for each joint."""
    wide = 1.5  # aspect above which the panels of joints are below the structure instead of next to it
    if aspect > wide:
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


def _writer(path: Path, rate: int) -> AbstractMovieWriter:
    """Return matplotlib's writer for the format of a film."""
    if path.suffix.lower() == ".mp4":
        # video players require an even width and height and this pixel format
        even = ["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p"]
        return FFMpegWriter(fps=rate, codec="h264", extra_args=even)
    return HTMLWriter(fps=rate, embed_frames=True) if path.suffix.lower() == ".html" else PillowWriter(fps=rate)
