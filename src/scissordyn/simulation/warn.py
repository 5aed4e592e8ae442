"""Warnings of a run."""

from __future__ import annotations

import numpy as np
import xarray as xr

from scissordyn.laws.validity import contact_warnings
from scissordyn.model.mechanism import Mechanism

__all__ = ["run_warnings"]


def run_warnings(mechanism: Mechanism, run: xr.Dataset, immobile: tuple[str, ...]) -> list[str]:
    """The warnings of a run, each once.

    Parameters
    ----------
    mechanism : Mechanism
    run : Dataset
    immobile : tuple of str
        Clearance joints that cannot move.

    Returns
    -------
    list of str
    """
    found: list[str] = []
    touched, speed = run["contact_joint"].values, run["approach_speed"].values
    for joint in mechanism.contacts:
        assert joint.clearance is not None
        depth = run["indentation"].values[:, mechanism.joint_names.index(joint.name)]
        found += contact_warnings(
            joint.name,
            joint.clearance.contact,
            joint.clearance.stiffness,
            joint.clearance.damping,
            joint.clearance.friction,
            approach_speed=speed[touched == joint.name].tolist(),
            indentation=float(np.max(depth, initial=0.0)),
        )
    for i, rod in enumerate(mechanism.rods):
        force = run["rod_force"].values[:, i]
        if rod.tension_only and np.min(force, initial=0.0) < 0.0:
            first, worst = int(np.argmax(force < 0.0)), int(np.argmin(force))
            found.append(
                f"joint '{rod.name}': negative normal force from t = {run['time'].values[first]:.6g} s on (N falls to "
                f"{force[worst]:.6g} N at t = {run['time'].values[worst]:.6g} s); constrained contact is not possible there"
            )
    found += [
        f"clearance joint '{name}' cannot move: the rest of the mechanism is rigid there, so the clearance has no effect"
        for name in immobile
    ]
    found += _undetermined(run)
    return list(dict.fromkeys(found))


def _undetermined(run: xr.Dataset) -> list[str]:
    """Reactions that are not determined, at all times or where bodies are aligned."""
    missing = np.isnan(run["reaction"].values).any(axis=2)
    if not missing.any():
        return []
    names = _some(run["joint"].values[missing.any(axis=0)].tolist())
    instants = missing.any(axis=1)
    if instants.all():
        return [f"there are redundant ideal joints; the reactions of {names} are not determined and are left out (NaN)"]
    return [
        f"at {np.sum(instants)} of {instants.size} instants, first at t = {run['time'].values[instants][0]:.6g} s, bodies are "
        f"aligned (a singular position): the reactions of {names} are not determined there and are left out (NaN)"
    ]


def _some(names: list[str], most: int = 6) -> str:
    quoted = [f"'{name}'" for name in names[:most]] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return ", ".join(quoted)
