"""A Poincare section: the states in which a variable of a run crosses a level."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
import xarray as xr

from scissordyn.analysis.hermite import RATES, cubic, interpolate, slope
from scissordyn.analysis.variable import described
from scissordyn.errors import InputError, did_you_mean

Direction = Literal["both", "rising", "falling"]
SIGNS: dict[str, tuple[int, ...]] = {"both": (-1, 1), "rising": (1,), "falling": (-1,)}

POLISHING = 3  # Newton steps on each root; the companion matrix gives at least half the digits, and each step doubles them
TWICE = 1e-7  # Roots nearer than this fraction of an interval are one: the same root in the intervals on both sides of a sample


def section(
    run: xr.Dataset,
    *,
    variable: str,
    level: float = 0.0,
    direction: Direction = "both",
    at: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """The states in which a variable crosses a level, located on cubic Hermite polynomials between the samples.

    Every root of every cubic is found, also two between two samples; a touch without crossing is not one.

    Parameters
    ----------
    run : Dataset
    variable : str
        A variable whose rate is recorded: slider_position, slider_velocity, position, velocity, angle, angular_velocity.
    level : float
        In the variable's unit.
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
        If the variable has no recorded rate, or `at` does not choose one series.
    """
    usable = [name for name, rate in RATES.items() if name in run and rate in run]
    if variable not in usable:
        raise InputError(f"a section of '{variable}'{did_you_mean(variable, usable)}", "one of " + ", ".join(usable))
    if direction not in SIGNS:
        raise InputError(f"direction = {direction!r}{did_you_mean(str(direction), SIGNS)}", "one of " + ", ".join(SIGNS))
    chosen = {} if at is None else dict(at)
    left_over = [str(dim) for dim in run[variable].dims if dim != "time" and dim not in chosen]
    unknown = [
        f"{dim} '{name}'" for dim, name in chosen.items() if dim not in run[variable].dims or name not in run[dim].values
    ]
    if left_over or unknown:
        raise InputError(
            f"a section of '{variable}' " + ("at " + ", ".join(unknown) if unknown else "without " + " and ".join(left_over)),
            "one name for each of " + ", ".join(str(dim) for dim in run[variable].dims if dim != "time"),
            "at={'body': 'slider', 'axis': 'y'}",
        )
    values, rates = (run[name].sel(chosen).values - shift for name, shift in ((variable, level), (RATES[variable], 0.0)))
    when, way = _crossings(run["time"].values, values, rates)
    kept = np.isin(way, SIGNS[direction])
    attributes = {**run.attrs, "section_variable": variable, "section_level": level, "section_direction": direction}
    crossings = xr.Dataset(
        {
            **interpolate(run, when[kept], "crossing"),
            "direction": described(("crossing",), way[kept], "1", "1 rising, -1 falling"),
        },
        coords={name: run[name] for name in run.coords if name != "time"},
        attrs=attributes,
    )
    return crossings.assign_coords(time=described(("crossing",), when[kept], "s", "time"))


def _crossings(time: np.ndarray, values: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and directions of the zeros of the piecewise cubic."""
    step = np.diff(time)
    y0, r0, y1, r1 = values[:-1], rates[:-1], values[1:], rates[1:]
    # a cubic is between the smallest and the largest of its four Bernstein coefficients
    corners = np.stack([y0, y0 + step * r0 / 3.0, y1 - step * r1 / 3.0, y1])
    when, way = list[float](), list[int]()
    for k in np.flatnonzero((corners.min(axis=0) <= 0.0) & (corners.max(axis=0) >= 0.0)):
        ends, h = (y0[k], r0[k], y1[k], r1[k]), step[k]
        rise, bend = h * (r0[k] + r1[k]) - 2.0 * (y1[k] - y0[k]), 3.0 * (y1[k] - y0[k]) - h * (2.0 * r0[k] + r1[k])
        roots = np.roots([rise, bend, h * r0[k], y0[k]])
        for s in np.sort(roots.real[np.abs(roots.imag) < TWICE]):
            for _ in range(POLISHING):
                fall = h * slope(s, h, ends)
                s = s - cubic(s, h, ends) / fall if fall else s
            passing = np.sign(slope(s, h, ends))
            if not -TWICE <= s <= 1.0 + TWICE or passing == 0.0:
                continue
            if when and time[k] + s * h - when[-1] < TWICE * h:
                continue
            when.append(float(np.clip(time[k] + s * h, time[0], time[-1])))
            way.append(int(passing))
    return np.array(when, float), np.array(way, int)
