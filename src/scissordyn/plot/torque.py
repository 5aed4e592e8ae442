"""The torques of drives, actuators and motors over time, and over the speed that a run needs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.contact import TorqueSource, torque_sources
from scissordyn.plot.picture import picture
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.series import compare, draw_limit, finish, mark_largest, time_scale, window
from scissordyn.plot.style import BLACK, BLUE, LINE, ORANGE, VERMILION, Canvas, legend, literal, panels
from scissordyn.run.answer.summary import at_limit

if TYPE_CHECKING:
    import xarray as xr


RPM = Scale(30.0 / math.pi, "rpm")

ROUND = 1.15  # The curve is drawn up to so many times the speed and the torque that are needed, at least


@picture("One for each drive, actuator and motor, in this order.")
def torque(
    run: xr.Dataset,
    ideal: xr.Dataset | None = None,
    *,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """The torques of drives, actuators and motors with their located maxima, beside the ideal mechanism's; one panel for each.

    A limit is a dotted line in either sense; where the torque is at its limit the panel is shaded.

    Raises
    ------
    InputError
        If there is no drive, no actuator and no motor.
    """
    run = window(run, start, end)
    sources = torque_sources(run)
    if not sources:
        raise InputError("a run without a drive", "a run of a driven or controlled mechanism", "arm.driven(speed=rpm(150))")
    beside = {} if ideal is None else {source.name: source.curve for source in torque_sources(ideal)}
    drawn = panels(axes, len(sources), size=(8.0, 0.7 + 2.6 * len(sources)))
    time = time_scale(run)
    for panel, source in zip(drawn, sources, strict=True):
        other = beside.get(source.name)
        scale = engineering("N m", source.curve.values, *(() if other is None else (other.values,)))
        compare(panel, literal(source.name), source.curve, other, scale=scale, time=time)
        if source.peak is not None:
            mark_largest(panel, time.factor * source.peak[0], scale.factor * source.peak[1])
        _limit(panel, source, scale, time)
    finish(drawn, run, time)
    legend(drawn, above=axes is None)
    return drawn


def _limit(axes: Axes, source: TorqueSource, scale: Scale, time: Scale) -> None:
    """Lines at the limit where the curve comes near it, and shading where the torque is there."""
    if source.limit is None:
        return
    values = source.curve.values
    for sign in (1.0, -1.0):
        if np.max(sign * values, initial=0.0) > 0.5 * source.limit:
            draw_limit(axes, sign * scale.factor * source.limit, "limit")
    shaded: dict[str, Any] = {"facecolor": ORANGE, "alpha": 0.22, "linewidth": 0.0, "zorder": 0.5, "label": "at the limit"}
    for start, end in at_limit(source.curve["time"].values, values, source.limit):
        axes.axvspan(time.factor * start, time.factor * end, **shaded)


def torque_speed(
    needed: xr.Dataset,
    *,
    speeds: np.ndarray | None = None,
    torques: np.ndarray | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Torque over speed of a drive, an actuator or a motor."""
    (panel,) = panels(axes, 1, size=(5.4, 4.2))
    scale = engineering("N m", needed["torque"].values, *(() if torques is None else (torques,)))
    speed, torque = RPM.factor * needed["speed"].values, scale.factor * needed["torque"].values
    panel.plot(speed, torque, color=BLUE, linewidth=0.7 * LINE, label=literal(f"torque of {needed.attrs['of']}"))
    k = int(np.argmax(np.abs(torque)))
    panel.plot(speed[k], torque[k], linestyle="", marker="o", markersize=3.0, color=BLACK, label="largest")
    if speeds is not None and torques is not None:
        at, most = RPM.factor * speeds, scale.factor * torques
        for sense in (1.0, -1.0):
            for side in (1.0, -1.0):
                label = "motor" if sense == side == 1.0 else None
                panel.plot(side * at, sense * most, color=VERMILION, linewidth=1.5 * LINE, label=label)
        wide = ROUND * max(float(np.max(np.abs(speed))), float(at[-1]))
        panel.set_xlim(-wide if speed.min() < -0.02 * wide else -0.02 * wide, wide)
    panel.set(xlabel=RPM.label("speed"), ylabel=scale.label("torque"))
    legend([panel], above=axes is None)
    return [panel]
