"""Controlled manoeuvres."""

import numpy as np
import pytest
import xarray as xr

from scissordyn_paper.cases import ARRAY
from scissordyn_paper.controlled import (
    CONTROLLED_RUNS,
    LIMIT,
    PERIOD,
    ControlledRun,
    compute,
    ideal_of,
    merits,
    mismatch,
)


def test_names_and_mechanisms_are_distinct():
    """Contract: no run overwrites another one's file, and their keys differ."""
    assert len({job.name for job in CONTROLLED_RUNS}) == len(CONTROLLED_RUNS)
    assert len({(job.manoeuvre, job.toml) for job in CONTROLLED_RUNS}) == len(CONTROLLED_RUNS)
    for job in CONTROLLED_RUNS:
        names = [joint.name for joint in job.mechanism().clearance_joints]
        assert names == ([] if job.scheme == "ideal" else ["A"])


def test_the_deployment_lands_within_its_limit():
    """Limit: torque within the limit, early lasting contact, milliradian errors in the gust; late contact without control."""
    job, driven = ControlledRun("deployment", "feed-forward, feedback"), ControlledRun("deployment", "prescribed")
    ideal = compute(ideal_of(job))
    steered, prescribed = (merits(compute(one), ideal) for one in (job, driven))
    assert steered["peak_torque"] <= LIMIT < prescribed["peak_torque"]
    assert steered["in_contact_from"] < 0.1 < prescribed["in_contact_from"]
    assert 0.0 < steered["tracking_error"] < 5e-3
    assert prescribed["tracking_error"] == pytest.approx(0.0, abs=1e-9)


def made(change):
    time = np.linspace(0.0, 5.0 * PERIOD, 501)
    place = np.stack([ARRAY * np.sin(2.0 * np.pi * time / PERIOD), change * ARRAY * time / PERIOD], axis=1)
    return xr.Dataset(
        {"eccentricity": (("time", "joint", "axis"), place[:, None]), "clearance": ("joint", [ARRAY])},
        coords={"time": time, "joint": ["A"], "axis": ["x", "y"]},
    )


def test_mismatch_is_the_change_over_a_period():
    """Closed form: a periodic motion and a steady drift on top of it."""
    assert mismatch(made(0.0), PERIOD) == pytest.approx(0.0, abs=1e-12)
    assert mismatch(made(0.3), PERIOD) == pytest.approx(0.3, rel=1e-12)
