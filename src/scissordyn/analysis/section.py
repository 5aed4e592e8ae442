"""Poincaré sections of a run: crossings of a level, and samples once per period of the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np
import xarray as xr
from scipy.interpolate import BPoly, PPoly

from scissordyn.analysis.variable import Variable, dataset_variable
from scissordyn.errors import InputError, did_you_mean, whole_number
from scissordyn.tolerance import DATA_TOL, EVENT_TOL
from scissordyn.units import checked

Direction = Literal["both", "rising", "falling"]
DIRECTION_SIGNS: dict[str, tuple[int, ...]] = {"both": (-1, 1), "rising": (1,), "falling": (-1,)}
"""Signs of the variable's rate at the crossings that each direction selects."""


@checked
def section(
    run: xr.Dataset, *, variable: str, level: float = 0.0, direction: Direction = "both", at: Mapping[str, str] | None = None
) -> xr.Dataset:
    """Return the states at which a variable crosses a level, by cubic Hermite interpolation between the samples.

    All roots of every cubic are found, even two roots between two samples. A tangent point without crossing is not a root.

    Parameters
    ----------
    run : Dataset
    variable : str
        Variable whose rate is recorded: slider_position, slider_velocity, position, velocity, angle, angular_velocity.
    level : float
        Level in the variable's unit.
    direction : {"both", "rising", "falling"}
    at : mapping of str to str, optional
        Body and axis, such as ``{"body": "slider", "axis": "y"}``.

    Returns
    -------
    Dataset
        Positions, velocities, angles and accelerations along `crossing`, with `time` and `direction` (1 rising, -1 falling).

    Raises
    ------
    InputError
        If the variable has no recorded rate, or `at` does not select one series.
    """
    usable = [name for name, rate in RATE_OF.items() if name in run and rate in run]
    if variable not in usable:
        raise InputError(f"a section of '{variable}'{did_you_mean(variable, usable)}", "one of " + ", ".join(usable))
    if direction not in DIRECTION_SIGNS:
        raise InputError(
            f"direction = {direction!r}{did_you_mean(str(direction), DIRECTION_SIGNS)}", "one of " + ", ".join(DIRECTION_SIGNS)
        )
    chosen = {} if at is None else dict(at)
    left_over = [str(dim) for dim in run[variable].dims if dim != "time" and dim not in chosen]
    unknown = [
        f"{dim} '{name}'" for dim, name in chosen.items() if dim not in run[variable].dims or name not in run[dim].values
    ]
    if left_over or unknown:
        raise InputError(
            f"a section of '{variable}' with "
            + ("unknown " + ", ".join(unknown) if unknown else "no choice of " + " and ".join(left_over)),
            "in `at`, one name for each of " + ", ".join(str(dim) for dim in run[variable].dims if dim != "time"),
            "at={'body': 'slider', 'axis': 'y'}",
        )
    values, rates = (run[name].sel(chosen).values - shift for name, shift in ((variable, level), (RATE_OF[variable], 0.0)))
    when, way = _crossings(_cubics(run["time"].values, values, rates))
    kept = np.isin(way, DIRECTION_SIGNS[direction])
    attributes = {**run.attrs, "section_variable": variable, "section_level": level, "section_direction": direction}
    crossings = xr.Dataset(
        {
            **_interpolate(run, when[kept], "crossing"),
            "direction": dataset_variable(("crossing",), way[kept], "1", "1 rising, -1 falling"),
        },
        coords={name: run[name] for name in run.coords if name != "time"},
        attrs=attributes,
    )
    return crossings.assign_coords(time=dataset_variable(("crossing",), when[kept], "s", "time"))


def _cubics(time: np.ndarray, values: np.ndarray, rates: np.ndarray) -> BPoly:
    """Return the cubic Hermite polynomials with given values and rates at both ends of each interval.

    Their error is at most y''''(t) h^4/384 (Davis 1975, Interpolation and Approximation).
    """
    third = np.diff(time).reshape(-1, *[1] * (values.ndim - 1)) / 3.0
    return BPoly([values[:-1], values[:-1] + third * rates[:-1], values[1:] - third * rates[1:], values[1:]], time)


def _crossings(cubics: BPoly) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and directions (1 rising, -1 falling) of the zeros at which the cubics change sign."""
    time = cubics.x
    zeros = np.sort(PPoly.from_bernstein_basis(cubics).roots())
    near = DATA_TOL * np.diff(time)[np.clip(np.searchsorted(time, zeros) - 1, 0, time.size - 2)]
    kept = (zeros >= time[0] - near) & (zeros <= time[-1] + near) & (np.diff(zeros, prepend=-math.inf) >= near)
    zeros = np.clip(zeros[kept], time[0], time[-1])
    way = np.sign(cubics.derivative()(zeros)).astype(int)
    return zeros[way != 0], way[way != 0]


@checked
def stroboscopic(run: xr.Dataset, *, period: float, phase: float = 0.0, skip: int = 0) -> xr.Dataset:
    """Return the states at t_k = (k + phase) period: the Poincare map of a periodically driven mechanism.

    If every t_k is a sample (until/(samples - 1) divides the period), the samples are returned with all variables. Otherwise
    positions, velocities and angles are interpolated by cubic Hermite polynomials, and variables without a recorded rate are
    left out.

    Parameters
    ----------
    run : Dataset
    period : float
        Period of the drive [s].
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
    skip = whole_number("skip", skip, 0)
    time = run["time"].values
    slack = EVENT_TOL * period
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
    samples = xr.Dataset(_interpolate(run, inside, "strobe"), coords=coordinates)
    return samples.assign_coords(time=dataset_variable(("strobe",), when, "s", "time")).assign_attrs(
        {**attributes, "source": "interpolated"}
    )


RATE_OF = {
    "slider_position": "slider_velocity",
    "slider_velocity": "slider_acceleration",
    "position": "velocity",
    "velocity": "acceleration",
    "angle": "angular_velocity",
    "angular_velocity": "angular_acceleration",
}
"""Recorded time derivative of each variable, for variables that have one."""


def _interpolate(run: xr.Dataset, when: np.ndarray, dim: str) -> dict[str, Variable]:
    """Return the variables of a run that have a recorded rate, interpolated at the instants `when`."""
    variables: dict[str, Variable] = {}
    for name, rate in RATE_OF.items():
        if name not in run or rate not in run:
            continue
        ordered = run[name].transpose("time", ...)
        cubics = _cubics(run["time"].values, ordered.values, run[rate].transpose(*ordered.dims).values)
        dims = (dim, *map(str, ordered.dims[1:]))
        variables[name] = dims, cubics(when), dict(run[name].attrs)
        if rate not in RATE_OF:
            variables[rate] = dims, cubics.derivative()(when), dict(run[rate].attrs)
    return variables
