"""A part of a run in time, for pictures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def window(run: xr.Dataset, first: float | None = None, last: float | None = None) -> xr.Dataset:
    """The samples, contacts and events of a run between two instants."""
    if first is None and last is None:
        return run
    begin, end = -math.inf if first is None else first, math.inf if last is None else last
    time = run["time"].values
    inside = (time >= begin) & (time <= end)
    if np.count_nonzero(inside) < 2:
        bounds = f"{time[0]:g} to {time[-1]:g} s" if time.size else "no samples"
        raise InputError(f"fewer than two samples between {begin:g} and {end:g} s", f"more; the run has {bounds}")
    part = run.isel(time=np.flatnonzero(inside))
    if "contact" in run.sizes:
        start = run["contact_start"].values
        over = start + np.nan_to_num(run["contact_duration"].values, nan=math.inf)
        part = part.isel(contact=np.flatnonzero((start <= end) & (over >= begin)))
    if "event_time" in run:
        (along,) = run["event_time"].dims
        when = run["event_time"].values
        part = part.isel({along: np.flatnonzero((when >= begin) & (when <= end))})
    return part
