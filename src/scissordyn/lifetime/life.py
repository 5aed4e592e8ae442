"""Life of worn joints: number of cycles until a requirement fails, with its 95 % interval, and the lines that report it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from scissordyn.model.mechanism import Mechanism
from scissordyn.model.wear import Wear
from scissordyn.tolerance import REPORTED_FRACTION
from scissordyn.units import short
from scissordyn.warning import RunWarning, warning

REPEATED_SCATTER = 0.01  # [-] relative standard deviation of the wear of cycles that repeat, to the two digits that are printed
NO_INTERVAL = {"simulated": " (no interval from a single member)", "ideal": ""}  # text in place of an interval, by loads


class WearRequirement(NamedTuple):
    """Limit on a wear result: on the deviation of a tracked point, the clearance of a joint, or the depth in a bush."""

    text: str
    limit: float  # [m]
    curve: np.ndarray  # (states,) the limited quantity after each simulated state [m]
    error: np.ndarray  # (states,) half the 95 % interval [m]
    joint: str  # joint whose wear is limited, or "" for a requirement on a track


def requirements(run: xr.Dataset, mechanism: Mechanism, settings: Wear) -> Iterator[WearRequirement]:
    """Yield the requirements: tolerances of tracks, largest clearance of worn joints, thickness of bushes."""
    for k, track in enumerate(mechanism.tracks):
        if track.tolerance is not None and np.all(np.isfinite(run["track_deviation"].values[:, k])):
            curve, error = run["track_deviation"].values[:, k], run["track_deviation_error"].values[:, k]
            yield WearRequirement(
                f"track '{track.name}' within {short(track.tolerance, 'm')}", track.tolerance, curve, error, ""
            )
    for j, (name, side) in enumerate(zip(run["joint"].values.tolist(), run["side"].values.tolist(), strict=True)):
        if side == "journal":
            continue
        clearance = mechanism.joint(name).clearance
        if settings.most_clearance is not None:
            text = f"clearance of joint '{name}' at most {short(settings.most_clearance, 'm')}"
            curve, error = (run[part].values[:, j] for part in ("worn_clearance", "clearance_error"))
            yield WearRequirement(text, settings.most_clearance, curve, error, name)
        if clearance is not None and clearance.bush is not None:
            text = f"bush of joint '{name}' of {short(clearance.bush, 'm')} not worn through"
            yield WearRequirement(
                text, clearance.bush, run["depth_largest"].values[:, j], run["depth_error"].values[:, j], name
            )


def add_lives(run: xr.Dataset, mechanism: Mechanism, settings: Wear) -> xr.Dataset:
    """Add to a wear result the life until each requirement fails, its interval, and the joint that limits it."""
    cycles, listed = run["cycle"].values.astype(float), list(requirements(run, mechanism, settings))
    lives, joints = np.full((3, len(listed)), math.nan), []
    # a track may depend on any worn joint, not most on the deepest one
    worn = run["joint"].values[run["side"].values == "bearing"].tolist()
    only = worn[0] if len(worn) == 1 else ""
    for r, need in enumerate(listed):
        lives[0, r] = first_crossing(cycles, need.curve, need.limit)
        lives[1, r] = first_crossing(cycles, need.curve + need.error, need.limit)
        lives[2, r] = first_crossing(cycles, need.curve - need.error, need.limit)
        if not need.joint:
            # the relative error of a depth is also that of the number of cycles at which the depth is reached
            depths, errors = run["depth_largest"].values[-1], run["depth_error"].values[-1]
            part = float(np.max(np.divide(errors, depths, out=np.zeros_like(depths), where=depths > 0.0)))
            lives[1, r], lives[2, r] = lives[1, r] / (1.0 + part), lives[2, r] * (1.0 + part)
        joints.append(need.joint or only)
    long_names = (
        "cycles until the requirement fails; NaN if it does not",
        "95 % interval, lower end",
        "95 % interval, upper end",
    )
    for name, values, text in zip(("life", "life_low", "life_high"), lives, long_names, strict=True):
        run[name] = ("requirement", values, {"units": "1", "long_name": text})
    run["limited_by"] = (
        "requirement",
        np.array(joints, dtype=object),
        {"long_name": "joint that limits the requirement; empty for a track if several joints wear"},
    )
    return run.assign_coords(requirement=("requirement", np.array([need.text for need in listed], dtype=object)))


def repetition(run: xr.Dataset) -> list[RunWarning]:
    """Return the warnings of a wear result about cycles that do not repeat: their wear scatters, or drifts."""
    warnings = []
    for name, scatter, drift in zip(run["joint"].values, run["cycle_scatter"].values, run["cycle_drift"].values, strict=True):
        if scatter > REPEATED_SCATTER:
            warnings.append(warning("scatter", name, percent=100.0 * scatter))
        if abs(drift) > REPORTED_FRACTION:
            warnings.append(warning("drift", name, percent=100.0 * drift))
    return warnings


def first_crossing(cycles: np.ndarray, curve: np.ndarray, limit: float) -> float:
    """Return the number of cycles at which a curve first exceeds a limit, by linear interpolation; NaN if it does not."""
    exceeded = np.flatnonzero(curve > limit)
    if not exceeded.size:
        return math.nan
    k = int(exceeded[0])
    if k == 0:
        return float(cycles[0])
    fraction = (limit - curve[k - 1]) / (curve[k] - curve[k - 1])
    return float(cycles[k - 1] + fraction * (cycles[k] - cycles[k - 1]))


def life_lines(run: xr.Dataset) -> list[str]:
    """Return text lines of a wear result: a line per requirement, shortest life first; a line per joint, deepest first."""
    reached, lines = int(run["cycle"].values[-1]), []
    lives, none = run["life"].values, NO_INTERVAL[json.loads(run.attrs["settings"])["loads"]]
    for r in np.argsort(np.where(np.isnan(lives), math.inf, lives), kind="stable").tolist():
        text, joint = str(run["requirement"].values[r]), str(run["limited_by"].values[r])
        low, high = run["life_low"].values[r], run["life_high"].values[r]
        if math.isnan(lives[r]):
            sure = f"; it may fail from {low:.0f} cycles on" if math.isfinite(low) else ""
            lines.append(f"{text}: holds for {reached} cycles{sure}")
            continue
        if lives[r] == 0.0:
            lines.append(f"{text}: fails in the first cycle, before any wear")
            continue
        upper = f"{high:.0f}" if math.isfinite(high) else f"more than {reached}"
        interval = f" ({low:.0f} to {upper})" if math.isfinite(low) else none
        limiting = f"; limited by joint '{joint}'" if joint else ""
        lines.append(f"{text}: fails after {lives[r]:.0f} cycles{interval}{limiting}")
    last = run.isel(state=-1)
    for j in np.argsort(-last["depth_largest"].values, kind="stable").tolist():
        depth, error = float(last["depth_largest"][j]), float(last["depth_error"][j])
        shown = f" (± {short(error, 'm')})" if math.isfinite(error) else none
        lines.append(
            f"joint '{run['joint'].values[j]}' after {reached} cycles: worn {short(depth, 'm')} deep{shown}, "
            f"{1e9 * float(last['worn_volume'][j]):.4g} mm³; largest clearance {short(float(last['worn_clearance'][j]), 'm')}"
        )
    return lines


def simulated_line(run: xr.Dataset) -> str:
    """Return a line with the number of simulated cycles; repeated steps and members may simulate more than a short life has."""
    reached, simulated = int(run["cycle"].values[-1]), run.attrs["simulated_cycles"]
    if simulated > reached:
        return f"{simulated} cycles simulated for {reached} cycles."
    return f"{simulated} of {reached} cycles simulated."


# Headings of the columns of `joint_rows`
JOINT_HEAD = ("joint", "worn depth", "± 95 %", "worn volume", "largest clearance", "force in the first cycle", "in the last")


def joint_rows(run: xr.Dataset) -> list[tuple[str, ...]]:
    """Return a row of texts under `JOINT_HEAD` for each joint, deepest first."""
    last, rows = run.isel(state=-1), []
    for j in np.argsort(-last["depth_largest"].values, kind="stable").tolist():
        depth, error, clearance = (float(last[name][j]) for name in ("depth_largest", "depth_error", "worn_clearance"))
        forces = (short(float(force), "N") for force in (run["peak_force"][0, j], last["peak_force"][j]))
        shown = short(error, "m") if math.isfinite(error) else "none"
        volume = f"{1e9 * float(last['worn_volume'][j]):.4g} mm³"
        rows.append((str(run["joint"].values[j]), short(depth, "m"), shown, volume, short(clearance, "m"), *forces))
    return rows
