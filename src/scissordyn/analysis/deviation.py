"""Deviation of a mechanism with clearance joints from its ideal motion."""

from __future__ import annotations

import re

import numpy as np
import xarray as xr

from scissordyn.analysis.variable import Variable, described, window
from scissordyn.errors import InputError
from scissordyn.run.advance.instants import time_mean
from scissordyn.run.configuration import ATTRIBUTE, read_configuration

PART = re.compile(r"unit (\d+)/(bar \d+)")  # Names of the bars of an array


def deviation(run: xr.Dataset, ideal: xr.Dataset, *, after: float = 0.0, until: float | None = None) -> xr.Dataset:
    """The error of position, and the loss of synchronism between the units of an array.

    With e_k = angle of a bar less that of the ideal mechanism in unit k, the synchronisation error is the spread between the
    units, largest over the bars of a unit:

        s(t) = max_bars ( max_k e_k(t) - min_k e_k(t) )
    """
    start, end = window(run, after, until)
    times, ideal_times = run["time"].values, ideal["time"].values[: run.sizes["time"]]
    if times.shape != ideal_times.shape or not np.allclose(
        times, ideal_times, rtol=0.0, atol=1e-9 * float(times[-1] - times[0])
    ):
        raise InputError(
            f"an ideal run of {ideal.sizes['time']} instants to {float(ideal['time'].values[-1]):g} s for a run of "
            f"{times.size} instants to {times[-1]:g} s",
            "a run of the mechanism with ideal joints, with the same until and samples",
            "simulate(arm.ideal(), until=..., samples=...)",
        )
    bodies = [str(name) for name in run["body"].values]
    if bodies != [str(name) for name in ideal["body"].values]:
        raise InputError("an ideal run with other bodies", "a run of the same mechanism with ideal joints")
    inside = (times >= start) & (times <= end)
    if not np.any(inside):
        raise InputError(f"no sample between {start:g} s and {end:g} s", "a window with samples")
    instants = slice(None, times.size)

    def difference(name: str, *dims: str) -> np.ndarray:
        ours, theirs = (part[name].transpose("time", *dims).values for part in (run, ideal))
        gap: np.ndarray = (ours - theirs[instants])[inside]
        return gap

    apart = np.linalg.norm(difference("position", "body", "axis"), axis=-1)
    variables: dict[str, Variable] = {
        "position_error_max": described(("body",), np.max(apart, axis=0), "m", "largest error of position"),
        "position_error_rms": described(("body",), _rms(apart, times[inside]), "m", "root mean square error of position"),
    }
    output_body = _output_body(run)
    output: np.ndarray | None = None
    if "slider_position" in run and "slider_position" in ideal:
        output = difference("slider_position")
    elif output_body in bodies:
        output = apart[:, bodies.index(output_body)]
    if output is not None:
        variables["output_error_max"] = described((), np.max(np.abs(output)), "m", "largest error of the output")
        variables["output_error_rms"] = described((), _rms(output, times[inside]), "m", "root mean square error of the output")
    units = _units(bodies)
    if units:
        turned = difference("angle", "body")
        turned = np.mod(turned + np.pi, 2.0 * np.pi) - np.pi
        spread = np.max([np.ptp(turned[:, columns], axis=1) for columns in units], axis=0)
        text = "spread between units of the error of a bar's angle"
        variables["synchronisation_error"] = described(("time",), spread, "rad", text)
        variables["synchronisation_error_max"] = described((), np.max(spread), "rad", f"largest {text}")
        variables["synchronisation_error_rms"] = described((), _rms(spread, times[inside]), "rad", f"root mean square {text}")
    coordinates = {"body": bodies, "time": described(("time",), times[inside], "s", "time")}
    return xr.Dataset(variables, coords=coordinates, attrs={"after": start, "until": end})


def _output_body(run: xr.Dataset) -> str:
    return str(read_configuration(run).mechanism.output_body) if ATTRIBUTE in run.attrs else ""


def _units(bodies: list[str]) -> list[list[int]]:
    """Columns of the bars with the same name in every unit; none for a single unit."""
    parts: dict[str, list[int]] = {}
    for column, name in enumerate(bodies):
        if matched := PART.fullmatch(name):
            parts.setdefault(matched[2], []).append(column)
    return [columns for columns in parts.values() if len(columns) > 1]


def _rms(values: np.ndarray, time: np.ndarray) -> np.ndarray:
    root: np.ndarray = np.sqrt(time_mean(np.square(values), time))
    return root
