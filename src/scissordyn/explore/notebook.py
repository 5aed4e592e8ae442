"""A run in a notebook: the canvas of the explorer as a widget of Jupyter and marimo."""

from __future__ import annotations

from typing import Any

import xarray as xr

from scissordyn.errors import InputError
from scissordyn.extra import library
from scissordyn.plot.canvas import CANVAS, packed_scene
from scissordyn.run.configuration import read_configuration


def view(run: xr.Dataset, *, ghost: xr.Dataset | None = None) -> Any:
    """The motion of a run as a widget, with its clearance joints magnified.

    Parameters
    ----------
    run : Dataset
    ghost : Dataset, optional
        Another run, drawn dashed at the same times.

    Returns
    -------
    anywidget.AnyWidget
        Its trait `selected` is the joint that was clicked.

    Raises
    ------
    InputError
        If the run has fewer than two samples, or anywidget is not installed.
    """
    anywidget, traitlets = (library(name, "explore", "a widget") for name in ("anywidget", "traitlets"))
    if run.sizes.get("time", 0) < 2:
        raise InputError("a run of fewer than two samples", "a longer run")

    class RunView(anywidget.AnyWidget):  # type: ignore[misc, name-defined]
        """The mechanism on a canvas."""

        _esm = CANVAS
        _css = ".sd-stage { height: 420px }"
        scene = traitlets.Unicode().tag(sync=True)
        ghost = traitlets.Unicode().tag(sync=True)
        draft = traitlets.Unicode().tag(sync=True)
        selected = traitlets.Unicode().tag(sync=True)
        theme = traitlets.Unicode().tag(sync=True)
        movable = traitlets.Bool(default_value=False).tag(sync=True)  # there is no case that a drag would change

    def packed(of: xr.Dataset) -> str:
        return packed_scene(of, read_configuration(of).build_mechanism())

    return RunView(scene=packed(run), ghost="" if ghost is None else packed(ghost))
