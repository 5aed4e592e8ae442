"""What the user should know before using the numbers of a run."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from scissordyn.laws.validity import contact_warnings
from scissordyn.model.body import GROUND
from scissordyn.model.element import AngleStop, TorsionSpring
from scissordyn.model.mechanism import Mechanism

__all__ = ["run_warnings"]


def run_warnings(mechanism: Mechanism, run: xr.Dataset, still: tuple[str, ...]) -> list[str]:
    """Sentences on what the user should know before using the numbers; each once.

    Parameters
    ----------
    mechanism : Mechanism
    run : Dataset
    still : tuple of str
        Loose joints that cannot move.

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
    for i, link in enumerate(mechanism.links):
        force = run["link_force"].values[:, i]
        if link.tension_only and np.min(force, initial=0.0) < 0.0:
            first, worst = int(np.argmax(force < 0.0)), int(np.argmin(force))
            found.append(
                f"joint '{link.name}': contact would have to pull from t = {run['time'].values[first]:.6g} s on (N falls to "
                f"{force[worst]:.6g} N at t = {run['time'].values[worst]:.6g} s); the held contact is not possible there"
            )
    found += [f"loose joint '{name}' cannot move: everything else is rigid there, as if it had no clearance" for name in still]
    found += _overturned(mechanism, run)
    found += _undetermined(run)
    return list(dict.fromkeys(found))


def _overturned(mechanism: Mechanism, run: xr.Dataset) -> list[str]:
    """Elements whose angle has left the half turn around its start, within which it is counted."""
    found = []
    for element in mechanism.elements:
        if not isinstance(element, TorsionSpring | AngleStop):
            continue
        turned = run["angle"].sel(body=element.body).values
        if element.base != GROUND:
            turned = turned - run["angle"].sel(body=element.base).values
        beyond = np.flatnonzero(np.abs(turned - turned[:1]) > math.pi)
        if beyond.size:
            kind = "torsion spring" if isinstance(element, TorsionSpring) else "end stop"
            found.append(
                f"{kind} '{element.name}': body '{element.body}' has turned by more than half a turn since the start at "
                f"t = {run['time'].values[beyond[0]]:.6g} s; the angle is counted within half a turn of the start, so the "
                "torque is wrong from there on"
            )
    return found


def _undetermined(run: xr.Dataset) -> list[str]:
    """Reactions that are not determined: at all, or where bodies are aligned."""
    missing = np.isnan(run["reaction"].values).any(axis=2)
    if not missing.any():
        return []
    names = _some(run["joint"].values[missing.any(axis=0)].tolist())
    instants = missing.any(axis=1)
    if instants.all():
        return [
            f"more ideal joints hold the bodies than needed; the reactions of {names} are not determined and are left out (NaN)"
        ]
    return [
        f"at {np.sum(instants)} of {instants.size} instants, first at t = {run['time'].values[instants][0]:.6g} s, bodies are "
        f"aligned (a singular position): the reactions of {names} are not determined there and are left out (NaN)"
    ]


def _some(names: list[str], most: int = 6) -> str:
    quoted = [f"'{name}'" for name in names[:most]] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return ", ".join(quoted)
