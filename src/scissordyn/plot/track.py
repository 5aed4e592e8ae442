"""How far the tracked points are from their commanded paths, against their tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.contact import with_instants
from scissordyn.plot.picture import picture
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import draw_limit, finish, mark_largest, time_scale, window
from scissordyn.plot.style import BLUE, LINE, VERMILION, Canvas, legend, literal, panels, small
from scissordyn.run.answer.summary import summary_of

if TYPE_CHECKING:
    import xarray as xr


def has_tracks(run: xr.Dataset) -> bool:
    return "track_deviation" in run and run.sizes.get("track", 0) > 0


@picture("One for each tracked point.")
def track(run: xr.Dataset, *, start: float | None = None, end: float | None = None, axes: Canvas = None) -> list[Axes]:
    """Deviation of tracked points from their commanded paths, with the located maximum and the tolerance; one panel for each.

    Where a point is outside its tolerance the panel is shaded.

    Raises
    ------
    InputError
        If the run has no tracked point with a deviation.
    """
    run = window(run, start, end)
    if not has_tracks(run):
        raise InputError(
            "a run without the deviation of a tracked point",
            "a run of a mechanism with clearance and a tracked point",
            'arm.track("tip", "unit 2/bar 1", "end", 1e-3)',
        )
    answers = {point.name: point for point in summary_of(run).points}
    names = run["track"].values.astype(str).tolist()
    drawn = panels(axes, len(names), size=(8.0, 0.7 + 2.4 * len(names)))
    time = time_scale(run)
    for panel, name in zip(drawn, names, strict=True):
        sampled = run["track_deviation"].sel(track=name).values
        point = answers.get(name)
        tolerance = None if point is None else point.tolerance
        peak = ([], []) if point is None else ([point.when], [point.deviation])
        instants, values = with_instants(run["time"].values, sampled, *map(np.array, peak))
        scale = engineering("m", values, *(() if tolerance is None else (tolerance,)))
        at, deviation = time.factor * instants, scale.factor * values
        panel.plot(at, deviation, color=BLUE, linewidth=LINE, label="deviation")
        if point is not None and instants[0] <= point.when <= instants[-1]:
            mark_largest(panel, time.factor * point.when, scale.factor * point.deviation)
        if tolerance is not None:
            outside, limit = values > tolerance, scale.factor * tolerance
            draw_limit(panel, limit, "tolerance")
            look: dict[str, Any] = {"facecolor": VERMILION, "alpha": 0.15, "linewidth": 0.0, "interpolate": True}
            panel.fill_between(at, limit, deviation, where=outside, label="outside" if outside.any() else None, **look)
        panel.set_ylim(bottom=0.0)
        panel.set_ylabel(scale.label("deviation"))
        panel.set_title(f"tracked point {literal(name)}", loc="left", fontsize=small())
    finish(drawn, run, time)
    legend(drawn)
    return drawn
