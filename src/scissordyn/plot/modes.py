"""Draw natural frequencies over the drive's motion and mode shapes, and turn a mode into a motion for films."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import picture_corners, scene_of
from scissordyn.plot.drawing import Drawing
from scissordyn.plot.style import Canvas, figure_size, legend, number_decades, panels, small
from scissordyn.record.placement import Placement


def frequencies(eigenmodes: xr.Dataset, *, axes: Canvas = None) -> Axes:
    """Draw the natural frequencies over the coordinate of the first drive."""
    if "time" not in eigenmodes.dims or eigenmodes.sizes["time"] < 2:
        raise InputError(
            "the modes belong to one position", "modes along the motion", "sd.modes(mechanism, times=[0.0, 0.1, 0.2])"
        )
    drawn = panels(axes, 1, size=(7.0, 4.5))[0]
    inputs = eigenmodes["input"].values[:, 0]
    angle = str(eigenmodes["unit"].values[0]) == "rad"
    x = np.degrees(inputs) if angle else inputs
    for mode in eigenmodes["mode"].values.tolist():
        drawn.plot(x, eigenmodes["frequency"].sel(mode=mode).values, marker=".", ms=3.0, linewidth=1.1, label=f"mode {mode}")
    drawn.set_xlabel(f"{eigenmodes['drive'].values[0]} [{'deg' if angle else 'm'}]")
    drawn.set_ylabel("natural frequency [Hz]")
    lowest = float(eigenmodes["frequency"].min())
    if lowest < 0.0:
        drawn.set_ylabel("natural frequency; below 0: growth rate / 2 pi, unstable [Hz]")
    if lowest > 0.0:
        drawn.set_yscale("log")
        number_decades(drawn.yaxis)
    legend([drawn])
    return drawn


def shapes(eigenmodes: xr.Dataset, mechanism: Mechanism, *, count: int = 6) -> list[Axes]:
    """Draw the first modes, each at both extremes of its motion."""
    here, still = eigenmodes.isel(time=0) if "time" in eigenmodes.dims else eigenmodes, mechanism.ideal()
    modes = here["mode"].values[:count].tolist()
    drawn = [oscillation(here, still, mode, frames=5, periods=1) for mode in modes]
    scenes = [scene_of(mode_run, still, np.arange(5), []) for mode_run in drawn]
    corners = np.min([scene.low for scene in scenes], axis=0), np.max([scene.high for scene in scenes], axis=0)
    aspect = float((corners[1] - corners[0])[1] / (corners[1] - corners[0])[0])
    columns = min(3, len(modes))
    rows = math.ceil(len(modes) / columns)
    figure = Figure(figsize=figure_size(3.8 * columns, (0.6 + 3.2 * min(1.5, max(0.3, aspect))) * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, mode, scene in zip(grid, modes, scenes, strict=False):
        for sample in (1, 3):
            drawing = Drawing(axes, scene, corners)
            drawing.show(sample)
            drawing.fit_sizes()
            for artist in axes.lines + axes.patches if sample == 1 else ():
                artist.set_alpha(0.3)
        value = float(here["frequency"].sel(mode=mode))
        state = f"{value:.4g} Hz" if value >= 0.0 else "unstable"
        axes.set_title(f"mode {mode}: {state}", loc="left", fontsize=small())
    for axes in grid[len(modes) :]:
        axes.remove()
    return list(grid[: len(modes)])


def oscillation(eigenmodes: xr.Dataset, mechanism: Mechanism, mode: int, *, frames: int = 100, periods: int = 2) -> xr.Dataset:
    """Return a mode as a run-like motion, for pictures and films."""
    amplitude = 0.06  # largest drawn displacement as a fraction of the mechanism's longer side
    if mode not in eigenmodes["mode"].values:
        raise InputError(f"mode {mode}", f"1 to {eigenmodes.sizes['mode']}", "count=20")
    shape = eigenmodes.sel(mode=mode)
    placed = eigenmodes[["position", "angle"]].expand_dims(time=[0.0])
    low, high = picture_corners(Placement.at(mechanism, placed, [0]))
    size = amplitude * float(np.max(high - low))
    phase = np.sin(2.0 * np.pi * periods * np.linspace(0.0, 1.0, frames))
    frequency = abs(float(shape["frequency"])) or 1.0
    time = xr.DataArray(periods / frequency * np.linspace(0.0, 1.0, frames), dims="time", attrs={"units": "s"})
    wave = xr.DataArray(size * phase, dims="time", coords={"time": time})
    return xr.Dataset(
        {
            "position": (eigenmodes["position"] + wave * shape["shape"]).transpose("time", "body", "axis"),
            "angle": (eigenmodes["angle"] + wave * shape["rotation"]).transpose("time", "body"),
        },
        attrs={"title": "scissordyn mode"},
    )
