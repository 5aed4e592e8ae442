"""The driving torque."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import compare, finish, time_scale
from scissordyn.plot.style import BLACK, Canvas, legend, panels

__all__ = ["torque"]


def torque(run: xr.Dataset, ideal: xr.Dataset | None = None, *, axes: Canvas = None) -> list[Axes]:
    """The driving torque and its located maximum, beside the ideal mechanism's torque; one panel per drive.

    Parameters
    ----------
    run : Dataset
    ideal : Dataset, optional
        The run of the ideal mechanism, drawn dashed.
    axes : Axes or iterable of Axes, optional
        One per drive. A new figure if not given.

    Returns
    -------
    list of Axes

    Raises
    ------
    InputError
        If there is no drive.
    """
    if "drive_torque" not in run:
        raise InputError("a run without a drive", "a run of a driven mechanism", "arm.driven(speed=rpm(150))")
    drives = run.sizes.get("drive", 1)
    drawn = panels(axes, drives, size=(8.0, 0.7 + 2.6 * drives))
    time = time_scale(run)
    for k, one in enumerate(drawn):
        curves = [_torque(part, k) for part in (run, ideal) if part is not None]
        name = "driving torque" if drives == 1 else f"torque of drive {k + 1}"
        peak = _peak(run, k)
        scale = engineering("N m", *(curve.values for curve in curves), *(() if peak is None else (peak[1],)))
        compare(one, name, curves[0], curves[1] if ideal is not None else None, scale=scale, time=time)
        if peak is not None:
            when, largest = time.factor * peak[0], scale.factor * peak[1]
            one.plot(when, largest, label="largest", linestyle="", marker="o", markersize=2.5, color=BLACK)
    finish(drawn, run, time)
    legend(drawn, above=axes is None)
    return drawn


def _torque(run: xr.Dataset, drive: int) -> xr.DataArray:
    return run["drive_torques"].isel(drive=drive) if "drive_torques" in run else run["drive_torque"]


def _peak(run: xr.Dataset, drive: int) -> tuple[float, float] | None:
    """When the torque of a drive is largest [s], and the torque [N m]; None if that is not in this part of the run."""
    if "peak_drive_torque" not in run:
        return None
    when, size = (float(run[name].isel(drive=drive)) for name in ("peak_drive_torque_time", "peak_drive_torque"))
    time, values = run["time"].values, _torque(run, drive).values
    if not (time[0] <= when <= time[-1] and math.isfinite(size)):
        return None
    # the run has its magnitude: its sign is that of the larger one of the samples around it
    after = min(int(np.searchsorted(time, when)), len(time) - 1)
    around = values[max(0, after - 1) : after + 1]
    return when, math.copysign(size, float(around[np.argmax(np.abs(around))]))
