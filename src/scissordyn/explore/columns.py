"""What the curves of the page are drawn from: columns of numbers with one time axis, in units that suit them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.plot.contact import force_curve
from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.source import TorqueSource, torque_sources
from scissordyn.run.answer.joints import clearance_joints

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.run.answer.summary import PointAnswer, Summary

MOST_POINTS = 100_000
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
    sources = torque_sources(run)
    largest = sorted(range(len(sources)), key=lambda k: -float(np.abs(sources[k].curve.values).max(initial=0.0)))
    return [sources[k] for k in sorted(largest[:MOST_TORQUES])], max(0, len(sources) - MOST_TORQUES)


def chosen_point(summary: Summary) -> PointAnswer | None:
    """The tracked point to draw: of several the one that is furthest off, over its tolerance."""
    return max(summary.points, key=lambda point: point.share, default=None)


def requirements(
    torques: Sequence[TorqueSource], point: PointAnswer | None, curves: Mapping[str, np.ndarray]
) -> dict[str, list[float]]:
    """What is allowed in the figures of torques [N m] and of the tracked point [m], where their curves come near it."""
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
    sources: Sequence[TorqueSource] | None = None,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The curves in SI with their instants: the samples, and the located peaks of force and torque between them.

    Straight between samples, as a line is drawn. Columns are those of the joint ("" for none), of the output body, of the named
    torques and of the tracked point; what a run does not have is left out. `sources`: those of the run, if known.
    """
    time = run["time"].values
    here = joint if joint in clearance_joints(run) else ""
    curves = {source.name: source.curve for source in (torque_sources(run) if sources is None else sources)}
    exact = {column: curves[name] for column, name in zip(UNITS["torque"][1], torques, strict=False) if name in curves}
    if here:
        exact["force"] = force_curve(run, here)
    every = np.unique(np.concatenate([time, *(curve["time"].values for curve in exact.values())]))

    def drawn(values: np.ndarray) -> np.ndarray:
        return values if every.size == time.size else np.asarray(np.interp(every, time, values))

    values = {name: np.interp(every, curve["time"].values, curve.values) for name, curve in exact.items()}
    if here:
        friction = run["friction_force"].sel(joint=here).values
        values["slip"] = drawn(run["slip_speed"].sel(joint=here).values)
        if np.any(np.nan_to_num(friction)):
            values["friction"] = drawn(friction)
        if "film" in run.dims and here in run["film"].values:
            values["metal"] = drawn(run["normal_force"].sel(joint=here).values)
    bodies = run["body"].values.astype(str).tolist()
    body = output if output in bodies else bodies[-1]
    moved = run["slider_position"] if "slider_position" in run else run["angle"].sel(body=body)
    values["output"] = drawn(moved.values)
    for name in ("kinetic", "potential"):
        values[name] = drawn(run[f"{name}_energy"].values)
    for name, variable in {**BOOKED, "dissipated": "dissipated_energy"}.items():
        if variable in run and np.any(np.nan_to_num(run[variable].values)):
            values[name] = drawn(run[variable].values)
    if "film" in run.dims:
        films = run["film"].values.astype(str).tolist()
        values["film"] = drawn(run["film_thickness"].values[:, films.index(here) if here in films else 0])
    if "beam_stress" in run and np.any(run["beam_stress"].values):
        values["stress"] = drawn(run["beam_stress"].max(dim="beam").values)
    if "track_deviation" in run and point in run["track"].values:
        values["track"] = drawn(run["track_deviation"].sel(track=point).values)
    return every, {name: column for name, column in values.items() if np.isfinite(column).any()}


def scaled(
    run: xr.Dataset,
    joint: str,
    output: str,
    torques: Sequence[str],
    point: str,
    scales: dict[str, Scale] | None,
    sources: Sequence[TorqueSource] | None = None,
) -> tuple[dict[str, Scale], dict[str, np.ndarray]]:
    """Scales by the names of figures and "time", and the columns of `columns` with them, "time" among them.

    The scales suit the columns if none are given. Of a long run only those points are there that a line of pixels needs.
    """
    time, raw = columns(run, joint, output, torques, point, sources)
    kept = thinned(time.size, [raw[name] for _, names in UNITS.values() for name in names if name in raw])
    if scales is None:
        scales = {"time": engineering("s", run["time"].values)}
        for name, (unit, lines) in UNITS.items():
            angular = name == "output" and "slider_position" not in run
            scales[name] = DEGREES if angular else engineering(unit, *(raw[line] for line in lines if line in raw))
    data = {"time": scales["time"].factor * time[kept]}
    for name, (_, lines) in UNITS.items():
        data.update({line: scales[name].factor * raw[line][kept] for line in lines if line in raw})
    return scales, data


def thinned(count: int, curves: Sequence[np.ndarray]) -> np.ndarray | slice:
    """Points to draw: all of a short run, of a long one the extreme ones of each interval."""
    if count <= MOST_POINTS or not curves:
        return slice(None)
    long = -(-2 * max(1, len(curves)) * count // MOST_POINTS)
    firsts = np.arange(0, count - long + 1, long)
    points = [np.array([0, count - 1]), np.arange(firsts.size * long, count)]
    for curve in curves:
        intervals = np.nan_to_num(curve[: firsts.size * long]).reshape(firsts.size, long)
        points += [firsts + intervals.argmin(axis=1), firsts + intervals.argmax(axis=1)]
    return np.unique(np.concatenate(points))


def orbit(run: xr.Dataset, joint: str, factor: float) -> dict[str, np.ndarray]:
    """The journal's orbit as columns "x" and "y"; of a long run the outermost points of each interval."""
    x, y = factor * run["eccentricity"].sel(joint=joint).transpose("axis", "time").values
    kept = thinned(x.size, [x, y, np.hypot(x, y)])
    return {"x": x[kept].copy(), "y": y[kept].copy()}
