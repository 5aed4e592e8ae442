"""Velocity over acceleration at every sample, a plot that the literature on clearance joints calls a "Poincare map"."""

from __future__ import annotations

import xarray as xr

from scissordyn.analysis.variable import window
from scissordyn.errors import InputError, did_you_mean


def velocity_acceleration(
    run: xr.Dataset, *, after: float = 0.0, until: float | None = None, body: str = "", axis: str = "y"
) -> xr.Dataset:
    """Return velocity and acceleration of the slider, or of another body's mass centre, at every sample.

    The literature on clearance joints often plots one over the other and calls it a Poincare map. It is a projection: a
    single stroke has no period, and therefore no map. Use `stroboscopic` or `section` for maps.

    Parameters
    ----------
    run : Dataset
    after, until : float
        Window of the evaluation [s]; by default to the end of the run.
    body : str
        Body whose mass centre is used instead of the slider.
    axis : {"x", "y"}
        Axis, for another body.

    Returns
    -------
    Dataset
        `velocity` and `acceleration` along `time`.

    Raises
    ------
    InputError
        If there is no slider and no body is named, the body does not exist, or the axis is neither x nor y.
    """
    start, end = window(run, after, until)
    bodies = [str(name) for name in run["body"].values]
    if axis not in ("x", "y"):
        raise InputError(f"unknown axis = {axis!r}", "'x' or 'y'")
    if body and body not in bodies:
        raise InputError(f"unknown body '{body}'{did_you_mean(body, bodies)}", f"one of {', '.join(bodies)}")
    if not body and "slider_velocity" not in run:
        raise InputError("the run has no slider", "a body: one of " + ", ".join(bodies), f"body='{bodies[-1]}'")
    if body:
        pair = {name: run[name].sel(body=body, axis=axis, drop=True) for name in ("velocity", "acceleration")}
    else:
        pair = {name: run[f"slider_{name}"] for name in ("velocity", "acceleration")}
    return xr.Dataset(pair, attrs=run.attrs).sel(time=slice(start, end))
