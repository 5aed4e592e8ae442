"""What the curves of the page are drawn from: columns of numbers with one time axis, in units that suit them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.plot.contact import force_curve
from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.source import TorqueSource, torque_sources
from scissordyn.run.joints import clearance_joints

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.run.summary import PointAnswer, Summary

MOST_POINTS = 4000
"""Points of a curve in the browser; of longer runs each interval keeps its smallest and its largest value."""

MOST_TORQUES = 4
"""Torques in one figure, those with the largest values."""

NEAR = 5.0
"""What is allowed is drawn from a fifth of it on: further off it would flatten the curve."""

UNITS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "output": ("m", ("output",)),
    "torque": ("N m", ("torque", *(f"torque {k}" for k in range(2, MOST_TORQUES + 1)))),
    "force": ("N", ("force", "friction", "metal")),
    "slip": ("m/s", ("slip",)),
    "energy": ("J", ("kinetic", "potential", "stored", "work", "motor", "load")),
    "loss": ("J", ("dissipated",)),
    "film": ("m", ("film",)),
    "stress": ("Pa", ("stress",)),
    "track": ("m", ("track",)),
}
"""SI units and columns of the figures."""

BOOKED = {"stored": "stored_energy", "work": "drive_work", "motor": "motor_work", "load": "load_work"}
"""Columns of energies that are drawn if something was booked on them."""


def chosen_torques(run: xr.Dataset) -> tuple[list[TorqueSource], int]:
    """The torques to draw, in order, and the number of those that are left out."""
    found = torque_sources(run)
    kept = sorted(range(len(found)), key=lambda k: -float(np.abs(found[k].curve.values).max(initial=0.0)))[:MOST_TORQUES]
    return [found[k] for k in sorted(kept)], max(0, len(found) - MOST_TORQUES)


def chosen_point(summary: Summary) -> PointAnswer | None:
    """The tracked point to draw: of several the one that is furthest off, over its tolerance."""
    return max(summary.points, key=lambda point: point.share, default=None)


def requirements(
    torques: Sequence[TorqueSource], point: PointAnswer | None, curves: Mapping[str, np.ndarray]
) -> dict[str, list[float]]:
    """What is allowed in the figures of torques and of the tracked point, where their curves come near it."""
    limits = [
        side * source.limit
        for name, source in zip(UNITS["torque"][1], torques, strict=False)
        for side in (1.0, -1.0)
        if source.limit is not None and NEAR * np.nanmax(side * curves[name], initial=0.0) >= source.limit
    ]
    tolerance = None if point is None else point.tolerance
    near = point is not None and tolerance is not None and NEAR * point.deviation >= tolerance
    return {"torque": list(dict.fromkeys(limits)), "track": [tolerance] if near and tolerance is not None else []}


def columns(
    run: xr.Dataset,
    joint: str,
    output: str,
    torques: Sequence[str],
    point: str = "",
    known: Sequence[TorqueSource] | None = None,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The curves in SI with their instants: the samples, and the located peaks of force and torque between them."""
    time = run["time"].values
    here = joint if joint in clearance_joints(run) else ""
    curves = {source.name: source.curve for source in (torque_sources(run) if known is None else known)}
    exact = {f"torque {k}" if k > 1 else "torque": curves[name] for k, name in enumerate(torques, 1) if name in curves}
    if here:
        exact["force"] = force_curve(run, here)
    every = np.unique(np.concatenate([time, *(curve["time"].values for curve in exact.values())]))

    def drawn(values: np.ndarray) -> np.ndarray:
        return values if every.size == time.size else np.asarray(np.interp(every, time, values))

    nothing = np.full(every.size, np.nan)
    found = {name: nothing for _, names in UNITS.values() for name in names}
    found.update({name: np.interp(every, curve["time"].values, curve.values) for name, curve in exact.items()})
    if here:
        friction = run["friction_force"].sel(joint=here).values
        found["slip"] = drawn(run["slip_speed"].sel(joint=here).values)
        if np.any(np.nan_to_num(friction)):
            found["friction"] = drawn(friction)
        if "film" in run.dims and here in run["film"].values:
            found["metal"] = drawn(run["normal_force"].sel(joint=here).values)
    bodies = run["body"].values.astype(str).tolist()
    body = output if output in bodies else bodies[-1]
    moved = run["slider_position"] if "slider_position" in run else run["angle"].sel(body=body)
    found["output"] = drawn(moved.values)
    for name in ("kinetic", "potential"):
        found[name] = drawn(run[f"{name}_energy"].values)
    for name, variable in {**BOOKED, "dissipated": "dissipated_energy"}.items():
        if variable in run and np.any(np.nan_to_num(run[variable].values)):
            found[name] = drawn(run[variable].values)
    if "film" in run.dims:
        films = run["film"].values.astype(str).tolist()
        found["film"] = drawn(run["film_thickness"].values[:, films.index(here) if here in films else 0])
    if "beam_stress" in run and np.any(run["beam_stress"].values):
        found["stress"] = drawn(run["beam_stress"].max(dim="beam").values)
    if "track_deviation" in run and point in run["track"].values:
        found["track"] = drawn(run["track_deviation"].sel(track=point).values)
    return every, found


def scaled(
    run: xr.Dataset,
    joint: str,
    output: str,
    torques: Sequence[str],
    point: str,
    scales: dict[str, Scale] | None,
    known: Sequence[TorqueSource] | None = None,
) -> tuple[dict[str, Scale], dict[str, np.ndarray]]:
    """The columns in units that suit them, or in given ones."""
    time, raw = columns(run, joint, output, torques, point, known)
    kept = _thinned(
        time.size, [raw[name] for figure in ("force", "torque", "slip", "film", "stress", "track") for name in UNITS[figure][1]]
    )
    if scales is None:
        scales = {"time": engineering("s", run["time"].values)}
        for name, (unit, lines) in UNITS.items():
            values = [raw[line][np.isfinite(raw[line])] for line in lines]
            angular = name == "output" and "slider_position" not in run
            scales[name] = DEGREES if angular else engineering(unit, *values)
    data = {"time": scales["time"].factor * time[kept]}
    for name, (_, lines) in UNITS.items():
        data.update({line: scales[name].factor * raw[line][kept] for line in lines})
    return scales, data


def _thinned(count: int, curves: Sequence[np.ndarray]) -> np.ndarray | slice:
    """Points to draw: all of a short run, of a long one the extreme ones of each interval."""
    if count <= MOST_POINTS:
        return slice(None)
    shown = [curve for curve in curves if np.isfinite(curve).any()]
    edges = np.linspace(0, count, MOST_POINTS // (2 * max(1, len(shown))) + 1).astype(int)
    found = {0, count - 1}
    for curve in shown:
        values = np.nan_to_num(curve)
        for first, last in itertools.pairwise(edges.tolist()):
            found.update((first + int(np.argmin(values[first:last])), first + int(np.argmax(values[first:last]))))
    return np.array(sorted(found)) if shown else np.unique(np.linspace(0, count - 1, MOST_POINTS).astype(int))


def orbit(run: xr.Dataset, joint: str, factor: float) -> dict[str, np.ndarray]:
    """The journal's orbit as columns "x" and "y"; of a long run the outermost points of each interval."""
    x, y = factor * run["eccentricity"].sel(joint=joint).transpose("axis", "time").values
    kept = _thinned(x.size, [x, y, np.hypot(x, y)])
    return {"x": x[kept].copy(), "y": y[kept].copy()}
