"""The torques that do work on a mechanism: of its drives, of its controllers and of its motors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.plot.contact import with_instants
from scissordyn.run.answer.summary import actuator_limits

OF_COMPONENTS = (("control_torque", "actuator", "peak_control_torque"), ("motor_torque", "motor", "motor_peak_torque"))
"""Variables along the dimension of their sources, with those of their largest values."""


@dataclass(frozen=True)
class TorqueSource:
    name: str
    variable: str  # Where it stands in a run
    part: int
    curve: xr.DataArray  # Along "time" [N m], with its located maximum between the samples
    peak: tuple[float, float] | None = None  # Instant [s] and value [N m] of the largest magnitude, where the run has it
    limit: float | None = None  # Largest torque in either sense [N m], where there is one


def torque_sources(run: xr.Dataset) -> list[TorqueSource]:
    """The torques of drives, actuators and motors, in this order."""
    sources = []
    drives = run.sizes.get("drive", 1) if "drive_torque" in run else 0
    for k in range(drives):
        sampled = run["drive_torques"].isel(drive=k) if "drive_torques" in run else run["drive_torque"]
        name = "driving torque" if drives == 1 else f"torque of drive {k + 1}"
        peak = _peak(run, sampled.values, "peak_drive_torque", k)
        sources.append(TorqueSource(name, "drive_torque", k, _with_peak(sampled, peak), peak))
    limits = actuator_limits(run) if any(variable in run for variable, _, _ in OF_COMPONENTS) else {}
    for variable, along, largest in OF_COMPONENTS:
        if variable in run and along in run[variable].dims:
            for k, name in enumerate(run[along].values.astype(str).tolist()):
                sampled = run[variable].isel({along: k})
                peak = _peak(run, sampled.values, largest, k)
                curve = _with_peak(sampled, peak)
                sources.append(TorqueSource(f"torque of {name}", variable, k, curve, peak, limits.get(name)))
    return sources


def _with_peak(sampled: xr.DataArray, peak: tuple[float, float] | None) -> xr.DataArray:
    when, value = (np.empty(0), np.empty(0)) if peak is None else (np.array([peak[0]]), np.array([peak[1]]))
    time, values = with_instants(sampled["time"].values, sampled.values, when, value)
    return xr.DataArray(values, {"time": time}, ("time",), attrs=sampled.attrs)


def _peak(run: xr.Dataset, values: np.ndarray, largest: str, source: int) -> tuple[float, float] | None:
    """When the torque of a source is largest [s], and the torque [N m]; None if that is not in this part of the run."""
    if largest not in run or f"{largest}_time" not in run:
        return None
    when, size = (float(run.variables[name].values[source]) for name in (f"{largest}_time", largest))
    time = run["time"].values
    if not (time.size and time[0] <= when <= time[-1] and math.isfinite(size)):
        return None
    # the run has its magnitude: its sign is that of the larger one of the samples around it
    after = min(int(np.searchsorted(time, when)), len(time) - 1)
    around = values[max(0, after - 1) : after + 1]
    return when, math.copysign(size, float(around[np.argmax(np.abs(around))]))
