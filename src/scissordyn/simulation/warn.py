"""Warnings of a run: models outside their range, limits reached, balances that do not close."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from scissordyn.component.actuator import Actuator
from scissordyn.laws.validity import contact_failure, contact_warnings
from scissordyn.mechanics.monitored import EXCEEDED
from scissordyn.model.mechanism import Mechanism

__all__ = ["contact_failures", "energy_turned_over", "run_warnings"]

TURNED_OVER = (
    "kinetic_energy",
    "potential_energy",
    "elastic_energy",
    "stored_energy",
    "drive_work",
    "motor_work",
    "load_work",
)
"""Energies whose change during a run is what its energy balance is compared with."""

UNBALANCED = 1e-3
"""Residual of the energy balance over the energy turned over above which a run has a warning. At the default tolerances it is
below 1e-6."""

CARRIED = 1e-6
"""Residual over the largest energy below which the balance closes however little energy is turned over: a body that rotates
freely carries energy and turns none over."""

AT_LIMIT = 1.0 - 1e-9
"""Torque over its limit above which a controller is at the limit."""


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
    found = contact_failures(mechanism, run)
    touched, speed = run["contact_joint"].values, run["approach_speed"].values
    for joint in mechanism.contacts:
        assert joint.clearance is not None
        found += contact_warnings(
            joint.name,
            joint.clearance.contact,
            joint.clearance.stiffness,
            joint.clearance.damping,
            joint.clearance.friction,
            approach_speed=speed[touched == joint.name].tolist(),
            indentation=float(run["peak_indentation"].values[mechanism.joint_names.index(joint.name)]),
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
    found += _exceeded(run)
    found += _undetermined(run)
    found += _saturated(mechanism, run)
    found += _unbalanced(run)
    return list(dict.fromkeys(found))


def contact_failures(mechanism: Mechanism, run: xr.Dataset) -> list[str]:
    """For each joint whose journal was pressed in by more than its radius: that its contact model has failed, and when."""
    found = []
    for joint in mechanism.contacts:
        assert joint.clearance is not None
        at = mechanism.joint_names.index(joint.name)
        text = contact_failure(joint.name, joint.clearance.contact, float(run["peak_indentation"].values[at]))
        if text:
            beyond = run["indentation"].values[:, at] > joint.clearance.contact.journal_radius
            largest = float(run["peak_indentation_time"].values[at])
            first = min(largest, run["time"].values[int(np.argmax(beyond))]) if beyond.any() else largest
            found.append(f"the contact model has failed, and the results from t = {first:.6g} s on are not valid: {text}")
    return found


def energy_turned_over(run: xr.Dataset) -> float:
    """The largest change of an energy or work during a run [J]."""
    return (
        max((float(np.ptp(run[name].values)) for name in TURNED_OVER if name in run), default=0.0) if run.sizes["time"] else 0.0
    )


def _unbalanced(run: xr.Dataset) -> list[str]:
    """A run that gains or loses energy."""
    residual = float(np.max(np.abs(run["energy_residual"].values), initial=0.0))
    turned_over = energy_turned_over(run)
    largest = max((float(np.max(np.abs(run[name].values), initial=0.0)) for name in TURNED_OVER if name in run), default=0.0)
    if not residual > max(UNBALANCED * turned_over, CARRIED * largest):
        return []
    share = f", {residual / turned_over:.2g} of the energy turned over" if turned_over > 0.0 else ""
    return [f"the energy balance misses {residual:.3g} J{share}: the results are not accurate; try a smaller rtol and atol"]


def _saturated(mechanism: Mechanism, run: xr.Dataset) -> list[str]:
    """Controllers at their limit, how long, and how far from their reference."""
    found = []
    actuators = [part for part in mechanism.components if isinstance(part, Actuator)]
    for k, part in enumerate(actuators):
        limit = getattr(part.controller, "limit", None)
        if limit is None or not float(run["peak_control_torque"].values[k]) >= AT_LIMIT * limit:
            continue
        at = np.abs(run["control_torque"].values[:, k]) >= AT_LIMIT * limit
        time = run["time"].values
        text = f"actuator '{part.name}': the controller is at its limit of {limit:g} N m "
        if at.any():
            text += f"for {np.mean(at):.2g} of the run, first at t = {time[at][0]:.6g} s"
        else:
            text += "for less than the time between two samples"
        if part.reference is not None and at.any():
            behind = float(np.max(np.abs(run["control_error"].values[at, k])))
            text += f", and there up to {math.degrees(behind):.3g} deg from its reference"
        found.append(text)
    return found


def _exceeded(run: xr.Dataset) -> list[str]:
    """Bristles that give more friction than their law's static limit, how much and how long."""
    if "peak_friction_ratio" not in run:
        return []
    rows = zip(run["joint"].values, run["peak_friction_ratio"].values, run["friction_excess_time"].values, strict=True)
    return [
        f"joint '{name}': friction reaches {ratio:.3g} times the static limit of its law, and exceeds {EXCEEDED:g} times it "
        f"for {lasting:.3g} s; see bristle_damping and damping_speed"
        for name, ratio, lasting in rows
        if lasting > 0.0
    ]


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
