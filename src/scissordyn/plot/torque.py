"""The torques of drives, actuators and motors."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import compare, finish, time_scale
from scissordyn.plot.source import torque_sources
from scissordyn.plot.style import BLACK, Canvas, legend, literal, panels

__all__ = ["torque"]


def torque(run: xr.Dataset, ideal: xr.Dataset | None = None, *, axes: Canvas = None) -> list[Axes]:
    """The torques of drives, actuators and motors with their located maxima, beside the ideal mechanism's; one panel for each.

    Parameters
    ----------
    run : Dataset
    ideal : Dataset, optional
        The run of the ideal mechanism, drawn dashed.
    axes : Axes or iterable of Axes, optional
        One for each drive, actuator and motor, in this order. A new figure if not given.

    Returns
    -------
    list of Axes

    Raises
    ------
    InputError
        If there is no drive, no actuator and no motor.
    """
    sources = torque_sources(run)
    if not sources:
        raise InputError("a run without a drive", "a run of a driven or controlled mechanism", "arm.driven(speed=rpm(150))")
    beside = {} if ideal is None else {source.name: source.curve for source in torque_sources(ideal)}
    drawn = panels(axes, len(sources), size=(8.0, 0.7 + 2.6 * len(sources)))
    time = time_scale(run)
    for one, source in zip(drawn, sources, strict=True):
        other = beside.get(source.name)
        scale = engineering("N m", source.curve.values, *(() if other is None else (other.values,)))
        compare(one, literal(source.name), source.curve, other, scale=scale, time=time)
        if source.peak is not None:
            when, largest = time.factor * source.peak[0], scale.factor * source.peak[1]
            one.plot(when, largest, label="largest", linestyle="", marker="o", markersize=2.5, color=BLACK)
    finish(drawn, run, time)
    legend(drawn, above=axes is None)
    return drawn
