"""The joints of a run that have clearance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import InputError
from scissordyn.run.results import Run, along

if TYPE_CHECKING:
    import xarray as xr


def clearance_joints(run: Run) -> list[str]:
    """Names of the joints with clearance, in order."""
    if "clearance" not in run:
        return []
    return [str(name) for name in run["joint"].values[np.isfinite(run["clearance"].values)]]


def joint_force(run: Run, joint: str) -> np.ndarray:
    """Size of all that a joint transmits, at the samples [N]."""
    return np.asarray(np.hypot(*along(run["reaction"], "joint", "axis", "time")[run["joint"].values.tolist().index(joint)]))


def largest_force(run: xr.Dataset, joint: str, start: float = -math.inf, end: float = math.inf) -> float:
    """The largest force that a joint transmits between two instants [N]: at the samples, and as located between them.

    NaN where hard impacts are among its contacts.
    """
    time, sizes = run["time"].values, [joint_force(run, joint)]
    whens = [time]
    if "joint_peak_force" in run and np.isfinite(whole := float(run["joint_peak_force"].sel(joint=joint))):
        sizes.append(np.array([whole]))
        whens.append(run["joint_peak_force_time"].sel(joint=joint).values[None])
    elif "contact_joint" in run:
        here = run["contact_joint"].values.astype(str) == joint
        sizes.append(run["peak_force"].values[here])
        begun = run["contact_start"].values[here]
        whens.append(np.where(np.isnan(sizes[-1]), begun, begun + run["peak_time"].values[here]))
    size, when = np.concatenate(sizes), np.concatenate(whens)
    return float(np.max(size[(when >= start) & (when <= end)], initial=0.0))


def some_clearance_joints(run: xr.Dataset) -> list[str]:
    """The same of a run that has to have some."""
    joints = clearance_joints(run)
    if not joints:
        raise InputError(
            "a run without clearance joints",
            "a run of a mechanism with a clearance",
            'arm.with_clearance("A", Clearance(0.5e-3))',
        )
    return joints
