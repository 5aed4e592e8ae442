"""The pictures of one run as methods: what ``run.scissordyn.plot`` is."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Concatenate, ParamSpec

from matplotlib.axes import Axes

from scissordyn.plot.bending import bending
from scissordyn.plot.comparison import comparison
from scissordyn.plot.energy import energy
from scissordyn.plot.film import film
from scissordyn.plot.force import force
from scissordyn.plot.orbit import orbit
from scissordyn.plot.report import draw_all
from scissordyn.plot.response import response
from scissordyn.plot.series import mechanism_of
from scissordyn.plot.statics import statics
from scissordyn.plot.structure import structure
from scissordyn.plot.torque import torque
from scissordyn.plot.track import track

if TYPE_CHECKING:
    import xarray as xr

Arguments = ParamSpec("Arguments")


def _method(
    picture: Callable[Concatenate[xr.Dataset, Arguments], list[Axes]],
) -> Callable[Concatenate[Pictures, Arguments], list[Axes]]:
    """A picture of a run as a method of `Pictures`, with its other arguments."""

    @functools.wraps(picture)
    def draw(self: Pictures, /, *arguments: Arguments.args, **named: Arguments.kwargs) -> list[Axes]:
        return picture(self._run, *arguments, **named)

    return draw


class Pictures:
    """Pictures of one run, from what it has recorded; nothing is computed anew.

    ``run.scissordyn.plot.force(joint="A")`` is ``sd.plot.force(run, joint="A")``, and so on: each method is the function of
    that name with the run as its first argument, and returns the Axes.

    Parameters
    ----------
    run : Dataset
    """

    def __init__(self, run: xr.Dataset) -> None:
        self._run = run

    response = _method(response)
    force = _method(force)
    orbit = _method(orbit)
    film = _method(film)
    torque = _method(torque)
    track = _method(track)
    energy = _method(energy)
    structure = _method(structure)
    bending = _method(bending)
    statics = _method(statics)
    comparison = _method(comparison)

    def all(self, folder: str | os.PathLike[str], *, format: str = "png") -> list[Path]:
        """Write every picture into a folder; see `plot.report.draw_all`."""
        return draw_all(self._run, None, folder, mechanism_of(self._run), format)
