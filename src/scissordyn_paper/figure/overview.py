"""First figure of the report: the array, the orbit of the journal, and the force in the joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from scissordyn.plot.animation_scene import Scene, scene_of
from scissordyn.plot.drawing import Drawing
from scissordyn.plot.joint import draw_orbit, force, write_time_bar
from scissordyn.plot.label import Label, write_labels
from scissordyn.plot.series import mechanism_of
from scissordyn.plot.style import BLACK, LIGHT, VERMILION, draw_scale_bar, dress, normal, small
from scissordyn_paper.cases import PaperCase
from scissordyn_paper.measures import JOINT


def draw_overview(runs: Mapping[PaperCase, xr.Dataset]) -> Figure:
    """Draw the array at both ends of its stroke, the orbit, and the force in the joint."""
    run, ideal = runs[PaperCase()], runs[PaperCase().ideal]
    figure = Figure(figsize=(9.0, 2.9), layout="constrained")
    array, path, loads = figure.subplots(1, 3, width_ratios=(1.3, 1.0, 1.6))
    scale = draw_orbit(path, run, JOINT).scale
    write_time_bar([path], run)
    force(run, ideal, joint=JOINT, axes=loads)
    for axes in (path, loads):
        if (own := axes.get_legend()) is not None:
            own.remove()
    scene = scene_of(run, mechanism_of(run), np.array([0, run.sizes["time"] - 1]), [])
    drawing = Drawing(array, scene)
    for shape in scene.shapes:
        if shape.kind == "bar":  # at the end, pale
            array.plot(*shape.points[-1].T, color=LIGHT, linewidth=4.0, solid_capstyle="round", zorder=0.8)
    drawing.show(0)
    for axes, title in (
        (array, "array at 0 and 50 ms"),
        (path, "path of the pin's centre"),
        (loads, f"force in joint {JOINT}"),
    ):
        axes.set_title(title, loc="left", fontsize=normal())
    for axes in (array, path):
        axes.set_anchor("N")  # titles of all panels on one line
    dress(path)
    draw_scale_bar(path, factor=scale.factor)
    loads.annotate("ideal joint", (0.62, 0.155), xycoords="axes fraction", fontsize=small(), color=BLACK)
    loads.annotate(
        "in contact", (0.985, 0.035), xycoords="axes fraction", fontsize=small(), color="white", ha="right", va="center"
    )
    figure.draw_without_rendering()
    drawing.fit_sizes()
    write_labels(array, [*_names(scene)])
    return figure


def _names(scene: Scene) -> list[Label]:
    """Return labels with the names of the joint with clearance, the driven bar and the slider."""
    bar = next(shape.points[0] for shape in scene.shapes if shape.name == "unit 1/bar 1")
    slider = next(shape.points[0].mean(axis=0) for shape in scene.shapes if shape.kind == "block")
    joint = next(place for name, place in scene.rings if name == JOINT)[0]
    return [
        Label(f"joint {JOINT}", joint, VERMILION),
        Label("driven bar", 0.75 * bar[0] + 0.25 * bar[-1], BLACK),
        Label("slider", slider + np.array([0.0, 0.1]), BLACK),
    ]
