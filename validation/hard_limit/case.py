"""Limit of stiff contacts: an array with hard contact and with compliant contact of increasing stiffness, by joint."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr

import scissordyn as sd
from scissordyn.config.file import read_case
from scissordyn.model.clearance import Clearance
from validation.case import Case, Check, case_file, mechanism

__all__ = ["CASE"]

NAME = "hard_limit"
FACTORS = (1, 10, 100)  # Factors of the stiffness

TOLERANCE, STEP = 1e-6, 2.5e-5  # Tolerance of compliant runs, step size of hard runs [s]
NEIGHBOURS = np.array([0.0, 1e-9, -1e-9, 2e-9, -2e-9])
"""Relative changes of the clearances of the compliant runs: chaos makes single runs differ, but hardly their means."""

OF_ALL = 0.01  # Allowed difference of the friction losses of a joint, or of the impact losses, as a fraction of all losses


def stiffer(joint: Clearance, factor: float, other: float) -> Clearance:
    """Return a joint with its stiffnesses multiplied by `factor` and its clearance changed by the fraction `other`."""
    assert joint.material is not None
    assert joint.bearing_material is not None
    pair = [replace(each, youngs_modulus=factor * each.youngs_modulus) for each in (joint.material, joint.bearing_material)]
    friction = joint.friction
    if joint.contact == "compliant":
        assert isinstance(friction, sd.LuGre)
        friction = replace(
            friction,
            bristle_stiffness=factor * friction.bristle_stiffness,
            bristle_damping=factor**0.5 * friction.bristle_damping,
        )
    clearance = joint.clearance * (1.0 + other)
    return replace(joint, clearance=clearance, material=pair[0], bearing_material=pair[1], friction=friction)


def deployed(contact: str, factor: float, other: float = 0.0) -> xr.Dataset:
    """Return a run of the array with hard or compliant contact at all clearance joints."""
    made = mechanism(NAME, f"clearance.all.contact={contact}")
    joints = tuple(
        joint if joint.clearance is None else replace(joint, clearance=stiffer(joint.clearance, factor, other))
        for joint in made.joints
    )
    until = read_case(case_file(NAME)).run.until
    accuracy = {"step": STEP} if contact == "hard" else {"rtol": TOLERANCE, "atol": TOLERANCE}
    found = sd.simulate(replace(made, joints=joints), until=until, **accuracy)
    if found.attrs["status"] != "complete":
        raise RuntimeError(found.attrs["cause"])
    return found


def sum_by_joint(run: xr.Dataset, name: str) -> dict[str, float]:
    """Return the sum of a variable over the contacts of each joint."""
    which, values = run["contact_joint"].values, run[name].values
    return {str(joint): float(np.nansum(values[which == joint])) for joint in np.unique(which)}


def checks() -> list[Check]:
    """Check hard contact against compliant contact."""
    made: list[Check] = []
    for factor in FACTORS:
        made += _check_factor(factor, [deployed("compliant", factor, other) for other in NEIGHBOURS], deployed("hard", factor))
    return made


def mean_sum_by_joint(runs: list[xr.Dataset], name: str) -> dict[str, float]:
    """Return the sum of a variable over the contacts of each joint, averaged over runs."""
    each = [sum_by_joint(run, name) for run in runs]
    return {joint: float(np.mean([one[joint] for one in each])) for joint in each[0]}


def _check_factor(factor: int, soft: list[xr.Dataset], hard: xr.Dataset) -> list[Check]:
    """Return the checks at one stiffness; single joints are checked at the largest one."""
    label, kind = f"{factor} times as stiff: ", "second formulation"

    def both(value: Callable[[xr.Dataset], float]) -> tuple[float, float]:
        return float(np.mean([value(run) for run in soft])), value(hard)

    tip = both(lambda run: 1e3 * float(run["peak_track_deviation"][0]))
    friction, restitution = both(lambda run: float(run["friction_loss"][-1])), both(lambda run: float(run["damping_loss"][-1]))
    all_losses = friction[0] + restitution[0]
    impulses, losses = (
        [mean_sum_by_joint(runs, name) for runs in (soft, [hard])] for name in ("impulse", "contact_friction_loss")
    )
    made = [
        Check(f"{label}largest deviation of the tip [mm]", *tip, 0.01, kind),
        Check(f"{label}friction [J]", *friction, 0.01, kind),
        Check(f"{label}restitution [J]", *restitution, OF_ALL * all_losses, kind, relative=False),
    ]
    if factor < max(FACTORS):
        apart = max(abs(impulses[1][joint] / of - 1.0) for joint, of in impulses[0].items())
        lost = max(abs(losses[1][joint] - of) for joint, of in losses[0].items())
        return [
            *made,
            Check(f"{label}largest difference of a joint's impulse, relative", 0.0, apart, 0.02, kind, relative=False),
            Check(
                f"{label}largest difference of a joint's friction [J]", 0.0, lost, OF_ALL * friction[0], kind, relative=False
            ),
        ]
    for joint in impulses[0]:
        made.append(Check(f"{label}{joint}: normal impulse [N s]", *(run[joint] for run in impulses), 0.02, kind))
        allowed = OF_ALL * friction[0]
        made.append(Check(f"{label}{joint}: friction [J]", *(run[joint] for run in losses), allowed, kind, relative=False))
    return made


CASE = Case(NAME, "Limit of stiff contacts", checks, quick=False)
