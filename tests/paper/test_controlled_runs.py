"""Runs with the paper's control, a constrained contact, and manoeuvres with other controllers."""

import numpy as np
import pytest
import xarray as xr

from scissordyn_paper import controlled
from scissordyn_paper.cases import ARRAY_CLEARANCE, CONTROLLED, PaperCase
from scissordyn_paper.controlled import CONTROLLED_RUNS, LIMIT, SLOW_PERIOD, ControlledRun, ideal_of, merits, mismatch
from scissordyn_paper.measures import measure
from scissordyn_paper.runs import compute

HALF = 1.0  # [m] half the length of a bar


@pytest.mark.parametrize("size", CONTROLLED)
def test_journal_stays_on_the_clearance_circle(runs, size):
    """Contract: the eccentricity of the bodies' motion is the prescribed one."""
    place = runs[PaperCase(size, constrained=True)]["eccentricity"].sel(joint="A").values
    assert np.hypot(*place.T) == pytest.approx(size, rel=1e-7)


def test_eccentricity_of_the_lagrange_coordinates(runs):
    """Second formulation: e = ((L/2)(cos th_1 - cos th_2), (L/2)(sin th_1 - sin th_2) - y)."""
    run = runs[PaperCase(constrained=True)]
    one, two = (run["angle"].sel(body=f"unit 1/bar {number}").values for number in (1, 2))
    across = HALF * (np.cos(one) - np.cos(two))
    along = HALF * (np.sin(one) - np.sin(two)) - run["slider_position"].values
    assert run["eccentricity"].sel(joint="A").values == pytest.approx(np.stack([across, along], axis=1), abs=1e-12)


def test_constrained_run_is_one_contact(runs):
    """Limit: without free flight the fraction of time in contact is one, and one contact is counted."""
    case = PaperCase(0.3e-3, constrained=True)
    found = measure(runs[case], runs[case.ideal])
    assert (found.settled_fraction, found.final_fraction, found.impacts) == (pytest.approx(1.0), pytest.approx(1.0), 1)
    assert found.smallest_force == pytest.approx(float(runs[case]["rod_force"].min()))
    assert found.peak_force == pytest.approx(float(runs[case]["rod_force"].max()))


def test_merits_of_a_constrained_run(runs):
    """Limit: contact from the start, no separation, and the peak force of the constraint."""
    case = PaperCase(0.3e-3, constrained=True)
    found = merits(runs[case], runs[case.ideal])
    assert (found["contact_fraction"], found["separations"], found["in_contact_from"]) == (pytest.approx(1.0), 0.0, 0.0)
    assert found["peak_force"] == pytest.approx(float(runs[case]["rod_force"].max()))
    assert found["tracking_error"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("size", CONTROLLED)
def test_start_in_contact_keeps_contact(size):
    """Limit: when started in contact, the joint stays closed without control, too (docs/reference.md)."""
    run = compute(PaperCase(size, start="in-contact"), trust=False)
    found = measure(run, compute(PaperCase(None), trust=False))
    assert (found.impacts, found.whole_fraction) == (1, pytest.approx(1.0))
    assert found.smallest_force > 0.0


def test_names_and_mechanisms_are_distinct():
    """Contract: no two runs share a file name or a case."""
    assert len({job.name for job in CONTROLLED_RUNS}) == len(CONTROLLED_RUNS)
    assert len({(job.manoeuvre, job.toml) for job in CONTROLLED_RUNS}) == len(CONTROLLED_RUNS)
    for job in CONTROLLED_RUNS:
        names = [joint.name for joint in job.mechanism().clearance_joints]
        assert names == ([] if job.scheme == "ideal" else ["A"])


def test_the_deployment_lands_within_its_limit():
    """Limit: torque within the limit, early lasting contact, milliradian errors in the gust; late contact without control."""
    job, driven = ControlledRun("deployment", "feed-forward, feedback"), ControlledRun("deployment", "prescribed")
    ideal = controlled.compute(ideal_of(job))
    steered, prescribed = (merits(controlled.compute(one), ideal) for one in (job, driven))
    assert steered["peak_torque"] <= LIMIT < prescribed["peak_torque"]
    assert steered["in_contact_from"] < 0.1 < prescribed["in_contact_from"]
    assert 0.0 < steered["tracking_error"] < 5e-3
    assert prescribed["tracking_error"] == pytest.approx(0.0, abs=1e-9)


def made(change):
    time = np.linspace(0.0, 5.0 * SLOW_PERIOD, 501)
    place = np.stack(
        [ARRAY_CLEARANCE * np.sin(2.0 * np.pi * time / SLOW_PERIOD), change * ARRAY_CLEARANCE * time / SLOW_PERIOD], axis=1
    )
    return xr.Dataset(
        {"eccentricity": (("time", "joint", "axis"), place[:, None]), "clearance": ("joint", [ARRAY_CLEARANCE])},
        coords={"time": time, "joint": ["A"], "axis": ["x", "y"]},
    )


def test_mismatch_is_the_change_over_a_period():
    """Closed form: a periodic motion has no mismatch; a steady drift adds its change over a period."""
    assert mismatch(made(0.0), SLOW_PERIOD) == pytest.approx(0.0, abs=1e-12)
    assert mismatch(made(0.3), SLOW_PERIOD) == pytest.approx(0.3, rel=1e-12)
