"""The pictures of one run as methods: what ``run.scissordyn.plot`` is."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import xarray as xr
from matplotlib.axes import Axes

from scissordyn.plot.bending import bending
from scissordyn.plot.comparison import comparison
from scissordyn.plot.energy import energy
from scissordyn.plot.film import film
from scissordyn.plot.force import force
from scissordyn.plot.orbit import orbit
from scissordyn.plot.report import draw_all
from scissordyn.plot.response import response
from scissordyn.plot.structure import structure
from scissordyn.plot.style import Canvas
from scissordyn.plot.torque import torque
from scissordyn.plot.track import track
from scissordyn.plot.window import window
from scissordyn.run.configuration import read_configuration

__all__ = ["Pictures"]

Joints = str | Sequence[str] | None


def _several(joint: Joints) -> Sequence[str] | None:
    return [joint] if isinstance(joint, str) else joint


class Pictures:
    """Pictures of one run, from what it has recorded; nothing is computed anew.

    Every method takes the part of the run from `start` to `end` [s], the whole run if not given, and returns the Axes.

    Parameters
    ----------
    run : Dataset
    """

    def __init__(self, run: xr.Dataset) -> None:
        self._run = run

    def response(
        self, body: str = "", *, start: float | None = None, end: float | None = None, axes: Canvas = None
    ) -> list[Axes]:
        """Displacement, velocity and acceleration of the slider and of a body; see `plot.response`."""
        return response(window(self._run, start, end), body=body, axes=axes)

    def force(
        self, joint: Joints = None, *, start: float | None = None, end: float | None = None, axes: Canvas = None
    ) -> list[Axes]:
        """Contact forces of one joint or of several; see `plot.force`."""
        return force(window(self._run, start, end), joints=_several(joint), axes=axes)

    def orbit(
        self,
        joint: Joints = None,
        *,
        exaggeration: float | None = None,
        start: float | None = None,
        end: float | None = None,
        axes: Canvas = None,
    ) -> list[Axes]:
        """Journal orbits of one joint or of several; see `plot.orbit`."""
        return orbit(window(self._run, start, end), joints=_several(joint), exaggeration=exaggeration, axes=axes)

    def film(
        self, joint: str | None = None, *, start: float | None = None, end: float | None = None, axes: Canvas = None
    ) -> list[Axes]:
        """The film of a lubricated joint; see `plot.film`."""
        return film(window(self._run, start, end), joints=_several(joint), axes=axes)

    def torque(self, *, start: float | None = None, end: float | None = None, axes: Canvas = None) -> list[Axes]:
        """The driving torque; see `plot.torque`."""
        return torque(window(self._run, start, end), axes=axes)

    def track(self, *, start: float | None = None, end: float | None = None, axes: Canvas = None) -> list[Axes]:
        """Deviation of the tracked points against their tolerances; see `plot.track`."""
        return track(window(self._run, start, end), axes=axes)

    def energy(self, *, start: float | None = None, end: float | None = None, axes: Canvas = None) -> list[Axes]:
        """The energy balance; see `plot.energy`."""
        return energy(window(self._run, start, end), axes=axes)

    def structure(
        self,
        joint: Joints = None,
        *,
        times: int | Sequence[float] = 4,
        magnify: float = 1.0,
        start: float | None = None,
        end: float | None = None,
    ) -> list[Axes]:
        """The mechanism at several instants; see `plot.structure`."""
        mechanism = read_configuration(self._run).build_mechanism()
        return structure(window(self._run, start, end), mechanism, times=times, joints=_several(joint), magnify=magnify)

    def bending(self, *, time: float | None = None, start: float | None = None, end: float | None = None) -> list[Axes]:
        """Bending moment, axial force and stress of bars that bend; see `plot.bending`."""
        return bending(window(self._run, start, end), read_configuration(self._run).build_mechanism(), time=time)

    def comparison(
        self, other: xr.Dataset, *, labels: tuple[str, str] = ("first run", "second run"), axes: Canvas = None
    ) -> list[Axes]:
        """The run and another one; see `plot.comparison`."""
        return comparison(self._run, other, labels=labels, axes=axes)

    def all(self, folder: str | os.PathLike[str], *, format: str = "png") -> list[Path]:
        """Write every picture into a folder; see `plot.report.draw_all`."""
        return draw_all(self._run, None, folder, read_configuration(self._run).build_mechanism(), format)
