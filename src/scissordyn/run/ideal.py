"""Ideal kinematics of a mechanism: range of motion, singular positions, transmission angles, torque, reactions."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.kinematics.branching import path_warnings
from scissordyn.kinematics.closure import Closure
from scissordyn.kinematics.path import Path, follow, instants, path_of, smooth_peak, start_of
from scissordyn.kinematics.singular import LOCKING_KIND
from scissordyn.kinematics.transmission import dyads, transmission_angle
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import Plan, plan
from scissordyn.run.simulate import simulate
from scissordyn.units import checked

if TYPE_CHECKING:
    import xarray as xr

IDEAL_SAMPLES_MAX = 50_001  # Largest automatic number of samples of a run with ideal joints, for about a hundred revolutions
IDEAL_SAMPLES = 501  # Default number of samples of a run with ideal joints
ROTATION_MAX = math.radians(5.0)  # [rad] largest rotation of a body between two automatic samples of a run with ideal joints


@checked
def ideal_kinematics(mechanism: Mechanism, *, until: float, samples: int | None = None) -> xr.Dataset:
    """Compute the motion of a mechanism with ideal joints, its transmission angles, torque, reactions and singular positions.

    Positions are followed by continuation, which finds change points (branches of the assembly meet) and locking positions (the
    drive can go no further). Torque and reactions are those of a run with ideal joints.

    Parameters
    ----------
    mechanism : Mechanism
        Its clearances are ignored.
    until : float
        End of the time of the drives [s].
    samples : int, optional
        Number of instants. The default is 501, or more if a body would rotate by more than 5 deg between two instants.

    Returns
    -------
    Dataset
        The run of `simulate` with ideal joints, up to its end, with these additions. `transmission_angle (time, dyad)` [rad].
        `peak_reaction (joint)` [N] and `peak_reaction_time (joint)` [s], located between the samples. `singular_time`,
        `singular_input`, `singular_kind` and `singular_subject (singular)` for each singular position that is passed.
        Attributes `range_low` and `range_high`: input between locking positions, NaN if there is none within a revolution.
        Attributes `range_unit` ("rad" or "m", empty without a single drive) and `singular_warnings`.

    Raises
    ------
    InputError
        If the mechanism cannot be assembled.
    """
    run = simulate(mechanism.ideal(), until=until, samples=samples or IDEAL_SAMPLES)
    needed = 1 + math.ceil(_largest_rotation(run) / ROTATION_MAX * (IDEAL_SAMPLES - 1))
    if samples is None and needed > IDEAL_SAMPLES:
        run = simulate(mechanism.ideal(), until=until, samples=min(needed, IDEAL_SAMPLES_MAX))
    ideal = plan(mechanism.ideal())
    chosen = dyads(ideal)
    position, angle = run["position"].transpose("time", "body", "axis").values, run["angle"].transpose("time", "body").values
    values = [transmission_angle(ideal, dyad, position, angle) for dyad in chosen]
    run = run.assign_coords(dyad=("dyad", np.array([dyad.joint for dyad in chosen], dtype=object)))
    run["transmission_angle"] = (
        ("time", "dyad"),
        np.stack(values, axis=1) if values else np.zeros((run.sizes["time"], 0)),
        {"units": "rad", "long_name": "transmission angle at the inner joint of a dyad"},
    )
    force = np.linalg.norm(run["reaction"].transpose("joint", "time", "axis").values, axis=2)
    largest = np.array([smooth_peak(run["time"].values, size) for size in force]).reshape(-1, 2)
    run["peak_reaction"] = ("joint", largest[:, 0], {"units": "N", "long_name": "largest reaction"})
    run["peak_reaction_time"] = ("joint", largest[:, 1], {"units": "s", "long_name": "when the reaction is largest"})
    path = path_of(ideal, until)
    _add_singular(run, path, until)
    low, high, unit = motion_range(ideal) if path is not None and path.parameter != "time" else (math.nan, math.nan, "")
    run.attrs.update(title="scissordyn ideal kinematics", range_low=low, range_high=high, range_unit=unit)
    warnings = [] if path is None else path_warnings(path, until)
    if samples is None and needed > IDEAL_SAMPLES_MAX:
        most = f"bodies rotate by up to {math.degrees(_largest_rotation(run)):.3g} deg between two instants"
        warnings.append(f"{most}, so that peaks are missed; a shorter run resolves them")
    run.attrs["singular_warnings"] = json.dumps(warnings)
    return run


def _largest_rotation(run: xr.Dataset) -> float:
    """Return the largest rotation of a body between two instants [rad]."""
    rotation = np.abs(np.diff(run["angle"].transpose("time", "body").values, axis=0))
    return float(np.max(rotation[np.isfinite(rotation)], initial=0.0))


def _add_singular(run: xr.Dataset, path: Path | None, until: float) -> None:
    """Add the singular positions of a path to a run, one entry for each time that a position is passed."""
    rows = [
        (time, position.place, position.kind, position.subject)
        for position in (() if path is None else path.singular)
        for time in instants(path, until, position.place)  # type: ignore[arg-type]
    ]
    rows.sort(key=lambda row: row[0])
    unit = {"angle": "rad", "length": "m", "time": "s"}["time" if path is None else path.parameter]
    for k, (name, units, long_name) in enumerate(
        (
            ("singular_time", "s", "time at which a singular position is passed"),
            ("singular_input", unit, "input at a singular position"),
            ("singular_kind", "1", "change point, near change point or locking position"),
            ("singular_subject", "1", "bodies and joints that can move there to first order"),
        )
    ):
        column = np.array([row[k] for row in rows], dtype=float if k < 2 else object)
        run[name] = (("singular",), column, {"units": units, "long_name": long_name})


def motion_range(plan: Plan) -> tuple[float, float, str]:
    """Return the lower and upper locking positions of a mechanism's only input and their unit; NaN where no position locks."""
    closure = Closure(plan)
    start = start_of(closure)
    if start is None or closure.inputs.count != 1 or closure.mobility != 0:
        return math.nan, math.nan, ""
    first = float(closure.inputs.at(0.0)[0])
    turns = closure.inputs.units == ["rad"]
    ends = (
        (first - 2.0 * math.pi, first + 2.0 * math.pi)
        if turns
        else (1e-3 * closure.size, max(2.0 * first, 3.0 * closure.size))  # a driven rod, followed from short to long
    )
    path = follow(closure, "angle" if turns else "length", lambda value: np.array([value]), start, first, *ends)
    locks = [position.place for position in path.singular if position.kind == LOCKING_KIND]
    low = max((place for place in locks if place < first), default=math.nan)
    high = min((place for place in locks if place > first), default=math.nan)
    return low, high, "rad" if turns else "m"
