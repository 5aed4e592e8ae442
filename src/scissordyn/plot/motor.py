"""Torque over speed that a run needs, with the curve of a motor."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.style import BLACK, BLUE, LINE, VERMILION, Canvas, legend, literal, panels

if TYPE_CHECKING:
    import xarray as xr

RPM = Scale(30.0 / math.pi, "rpm")

ROUND = 1.15
"""The curve is drawn up to so many times the speed and the torque that are needed, at least."""


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
