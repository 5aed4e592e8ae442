"""The stroboscopic map: the states of a run once per period of its drive."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from scissordyn.analysis.hermite import interpolate
from scissordyn.analysis.variable import described
from scissordyn.errors import InputError

ON_THE_GRID = 1e-9  # A sample within this fraction of the period of an instant of the map is used as it is


def stroboscopic(run: xr.Dataset, *, period: float, phase: float = 0.0, skip: int = 0) -> xr.Dataset:
    """The states of a run at t_k = (k + phase) period: the Poincare map of a periodically driven mechanism.

    Where every t_k is a sample (until/(samples - 1) divides the period), the samples are used with all
    variables. Otherwise positions, velocities and angles are interpolated by cubic Hermite polynomials, and variables without
    a recorded rate are left out.

    Parameters
    ----------
    run : Dataset
    period : float
        Of the drive [s].
    phase : float
        Phase as a fraction of the period [1].
    skip : int
        Number of instants at the start that are left out as transient.

    Returns
    -------
    Dataset
        The variables of the run along `strobe`, with `time`; attributes of the run, and `source`: "samples" or "interpolated".

    Raises
    ------
    InputError
        If the period is not positive, or no instant is left.

    References
    ----------
    Guckenheimer and Holmes 1983, Nonlinear Oscillations, section 1.5, doi:10.1007/978-1-4612-1140-2
    """
    if not (math.isfinite(period) and period > 0.0):
        raise InputError(f"period = {period!r}", "a period > 0 [s]")
    if not 0.0 <= phase < 1.0:
        raise InputError(f"phase = {phase!r}", "a fraction of the period, at least 0 and below 1")
    if isinstance(skip, bool) or not isinstance(skip, int) or skip < 0:
        raise InputError(f"skip = {skip!r}", "a whole number >= 0")
    time = run["time"].values
    slack = ON_THE_GRID * period
    first = math.ceil((time[0] - slack) / period - phase)
    last = math.floor((time[-1] + slack) / period - phase)
    when = period * (phase + np.arange(first + skip, last + 1))
    if when.size == 0:
        raise InputError(
            f"a run from {time[0]:g} s to {time[-1]:g} s has no instant left with period = {period:g} s and skip = {skip}",
            "a longer run, or a smaller skip",
        )
    nearest = np.clip(np.searchsorted(time, when), 1, max(time.size - 1, 1))
    nearest -= when - time[nearest - 1] < time[np.minimum(nearest, time.size - 1)] - when
    attributes = {**run.attrs, "period": period, "phase": phase, "skip": skip}
    if np.all(np.abs(time[nearest] - when) <= slack):
        taken = run[[name for name in run if "time" in run[name].dims or name == "clearance"]].isel(time=nearest)
        return taken.swap_dims(time="strobe").assign_attrs({**attributes, "source": "samples"})
    inside = np.clip(when, time[0], time[-1])
    coordinates = {name: run[name] for name in run.coords if name != "time"}
    samples = xr.Dataset(interpolate(run, inside, "strobe"), coords=coordinates)
    return samples.assign_coords(time=described(("strobe",), when, "s", "time")).assign_attrs(
        {**attributes, "source": "interpolated"}
    )
