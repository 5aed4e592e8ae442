"""A run as a film: GIF, MP4, or a page with a player."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.output_file import check_target, write_file
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_film import write_film
from scissordyn.plot.animation_scene import scene_of
from scissordyn.plot.canvas import write_page
from scissordyn.plot.series import MOST_JOINTS, chosen_joints, clearance_pins, largest_forces
from scissordyn.run.advance.instants import spread_samples
from scissordyn.run.answer.deflection import magnified_deflection
from scissordyn.run.answer.joint_force import clearance_joints

if TYPE_CHECKING:
    import xarray as xr

RATES = {"gif": 10, "mp4": 25, "html": 25}  # Frames per second by format. A GIF is composed in memory before it is written

FILMS = tuple(RATES)


def check_film(path: str | os.PathLike[str]) -> None:
    """Raise `InputError` unless a film can be written in the format that a file name ends with."""
    ending = Path(path).suffix.lower().removeprefix(".")
    if ending not in FILMS:
        raise InputError(f"film '{path}'{did_you_mean(ending, FILMS)}", "a name that ends in .gif, .mp4 or .html", "film.html")
    if ending == "mp4":
        from matplotlib.animation import FFMpegWriter

        if not FFMpegWriter.isAvailable():
            raise InputError("an MP4 needs the program ffmpeg, which is not installed", "film.gif or film.html")


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
    """Write a film of a run, with its clearance joints magnified beside the structure.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism
        The one that was run.
    path : path
        Ends in .gif, .mp4 (where there is ffmpeg) or .html (a page with a player, in one file).
    seconds : float
        Duration of the film [s]; the run is slowed down or sped up accordingly.
    rate : int, optional
        Frames per second, 25 if not given, of a GIF 10; a run with fewer samples than frames is shown with fewer.
    joints : sequence of str, optional
        Which revolute clearance joints to magnify; those with the largest forces if not given, and all guides with clearance.
        A page shows the others after them; a GIF or MP4 says how many more there are.
    magnify : float
        Factor of the deflections of bars that bend, which the film says.
    bars : {"stress", "utilisation", "bending moment", "axial force"}, optional
        What is drawn on bars that bend at first; a page can show each that is known.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the format is another one, the run too short, a named joint has no clearance, bars lack what is to be drawn on
        them, or the file cannot be written.
    """
    check_film(path)
    target, samples = Path(path), run.sizes["time"]
    if rate is None:
        rate = RATES[target.suffix.lower().removeprefix(".")]
    if samples < 2:
        raise InputError("a run of fewer than two samples", "a longer run")
    if not (np.isfinite(seconds) and seconds > 0.0 and rate >= 1):
        raise InputError(f"a film of {seconds!r} s with {rate!r} frames per second", "seconds > 0 and rate >= 1")
    shown, every, guides = magnified_first(run, mechanism, joints)
    frames = spread_samples(run["time"].values, max(2, min(samples, round(seconds * rate))))
    if magnify != 1.0:
        run = magnified_deflection(run, mechanism, magnify, samples=frames.tolist())
    scene = scene_of(run, mechanism, frames, every, guides=guides, shown=shown, on_bars=bars)
    rate = max(1, round(len(frames) / seconds))
    slower = len(frames) / rate / float(scene.time[-1] - scene.time[0])
    check_target(target, sample="film.html")
    try:
        # the writers of films want a file of their own
        with tempfile.TemporaryDirectory(prefix="scissordyn-film-") as folder:
            part = Path(folder) / f"film{target.suffix.lower()}"
            if target.suffix.lower() == ".html":
                write_page(scene, run, part, seconds)
            else:
                write_film(scene, part, rate, slower)
            film = part.read_bytes()
    except OSError as error:
        raise InputError(
            f"cannot make the film '{target}': {error.strerror or error}", "a temporary folder with room"
        ) from None
    return write_file(target, film, sample="film.html")


def magnified_first(run: xr.Dataset, mechanism: Mechanism, joints: Sequence[str] | None) -> tuple[int, list[str], list[str]]:
    pins = run.sel(joint=clearance_pins(run)) if "plane_contact" in run else run
    chosen = chosen_joints(pins, joints) if joints is not None or clearance_joints(pins) else []
    others = [name for name in clearance_joints(pins) if name not in chosen]
    largest = largest_forces(pins)
    guides = [guide.name for guide in mechanism.guides if guide.clearance is not None] if joints is None else []
    shown = len(joints) if joints is not None else MOST_JOINTS
    return shown, chosen + sorted(others, key=lambda name: -largest[name]), guides
