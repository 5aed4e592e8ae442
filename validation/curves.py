"""Pictures of error over time, from the scans of a case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from scissordyn.plot.style import number_decades

__all__ = ["Curve", "draw"]

Curve = tuple[str, Sequence[tuple[float, float]]]
"""Name of a code with its errors and seconds: empty if it is not installed, infinite if it fails."""

COLOURS = 10  # Colours of matplotlib's cycle; curves beyond are dotted


def draw(curves: Sequence[Curve], goal: float, error: str, path: Path) -> None:
    """Draw error against time for every setting of every code, with the goal.

    Parameters
    ----------
    curves : sequence of (str, sequence of (float, float))
    goal : float
        Error that every code has to reach.
    error : str
        Meaning of the error.
    path : Path
        File of the picture.
    """
    figure = Figure(figsize=(7.5, 4.5 + 0.1 * len(curves)), layout="constrained")  # legend: two names per line, below
    axes = figure.subplots()
    markers = "osD^v<>Pp"
    for k, (name, points) in enumerate(curves):
        finite = [(1e3 * seconds, miss) for miss, seconds in points if math.isfinite(miss) and miss > 0.0]
        if finite:
            style = {"marker": markers[k % len(markers)], "linestyle": "-" if k < COLOURS else ":"}
            axes.plot(*zip(*finite, strict=True), **style, markersize=4, linewidth=1, label=name)
        else:
            axes.plot([], [], " ", label=f"{name}: {'fails' if points else 'not installed'}")
    axes.axhline(goal, color="grey", linestyle="--", linewidth=1, label="goal")
    axes.set(xscale="log", yscale="log", xlabel="time [ms]", ylabel=error)
    for axis in (axes.xaxis, axes.yaxis):
        number_decades(axis)
    axes.grid(visible=True, which="major", alpha=0.3)
    figure.legend(fontsize=7, loc="outside lower center", ncols=2)
    figure.savefig(path, dpi=110, metadata={"Software": ""})
