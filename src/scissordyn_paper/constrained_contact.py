"""A run with the paper's control, with the variables of a run with a clearance joint."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from scissordyn.model.mechanism import Mechanism
from scissordyn.run.answer.placement import Placement
from scissordyn_paper.measures import JOINT


def with_contact(run: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """Add eccentricity and normal force, so that a constrained contact can be evaluated and drawn like a clearance joint."""
    joint = mechanism.joint(JOINT)
    assert joint.clearance is not None
    force = run["rod_force"].isel(rod=0).values
    highest = int(np.argmax(force))
    names = [*run["joint"].values.astype(str).tolist(), JOINT]
    whole = run.drop_dims("contact").reindex(joint=names)

    def here(values: np.ndarray, units: str, long_name: str) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
        full = np.full((values.shape[0], len(names), *values.shape[1:]), np.nan)
        full[:, -1] = values
        return ("time", "joint", "axis")[: full.ndim], full, {"units": units, "long_name": long_name}

    touching = np.zeros((force.size, len(names)), bool)
    touching[:, -1] = force > 0.0
    clearance = np.full(len(names), np.nan)
    clearance[-1] = joint.clearance.clearance
    placed = Placement.at(mechanism, run, slice(None))
    journal, bearing = placed.place(joint.journal), placed.place(joint.bearing)
    apart = journal - bearing
    reaction = whole["reaction"].transpose("time", "joint", "axis").copy(deep=True)
    reaction[:, -1] = -force[:, None] * apart / np.linalg.norm(apart, axis=1)[:, None]
    contact = (
        ("contact_start", 0.0, "s"),
        ("contact_duration", math.nan, "s"),
        ("peak_force", float(force[highest]), "N"),
        ("peak_time", float(run["time"].values[highest]), "s"),
        ("peak_normal_force", float(force[highest]), "N"),
        ("peak_normal_time", float(run["time"].values[highest]), "s"),
    )
    variables = {
        "eccentricity": here(apart, "m", "journal centre relative to the bearing centre"),
        "reaction": reaction,
        "normal_force": here(force, "N", "normal force of the constrained contact"),
        "in_contact": (
            ("time", "joint"),
            touching,
            {"units": "1", "long_name": "the normal force of the constrained contact is positive"},
        ),
        "clearance": (("joint",), clearance, {"units": "m", "long_name": "radial clearance"}),
        "contact_joint": (("contact",), np.array([JOINT]), {"long_name": "joint"}),
    }
    for name, value, unit in contact:
        variables[name] = (("contact",), np.array([value]), {"units": unit, "long_name": name.replace("_", " ")})
    return whole.assign(variables)
