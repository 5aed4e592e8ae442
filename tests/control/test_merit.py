"""Figures of merit, and what control of contact achieves on the array of the reference."""

import dataclasses
import math

import numpy as np
import pytest

import scissordyn as sd

UNTIL, DURATION, LIMIT = 1.2, 1.0, 770.0  # End of the run [s], duration of the motion [s] and largest torque of the motor [N m]
REFERENCE = sd.Cycloidal(math.radians(30), math.radians(60), DURATION)  # Reference angle of the array
# Load that disturbs the array from 0.6 to 0.8 s
GUST = sd.Force(
    "gust",
    ("slider", "centre"),
    (0.0, -50.0),
    time_function=sd.tabulated(
        lambda t: math.sin(math.pi * (t - 0.6) / 0.2) ** 2 if 0.6 < t < 0.8 else 0.0, until=UNTIL, points=4801
    ),
)


@pytest.fixture(scope="module")
def disturbed_array():
    """Return the array with clearance at joint A and a gust on its slider after half of the stroke."""
    return dataclasses.replace(sd.scissor(units=2).with_clearance("A", sd.Clearance(5e-4)), components=(GUST,))


@pytest.fixture(scope="module")
def ideal(disturbed_array):
    """Return the run of the ideal array on the reference motion, without the gust."""
    return sd.simulate(dataclasses.replace(disturbed_array.ideal(), components=()).driven(REFERENCE), until=UNTIL)


def test_ideal_against_itself(ideal):
    """Identity: the ideal run has no errors; its energy is the integral of its positive power."""
    found = sd.figures_of_merit(ideal, ideal)
    assert float(found["tracking_error"]) == 0.0
    assert float(found["position_error"]) == 0.0
    assert float(found["synchronisation_error"]) < 1e-15
    power = ideal["drive_torque"].values * ideal["angular_velocity"].sel(body="unit 1/bar 1").values
    work = float(np.sum(0.5 * (np.clip(power, 0, None)[1:] + np.clip(power, 0, None)[:-1]) * np.diff(ideal["time"].values)))
    assert float(found["energy_used"]) == pytest.approx(work, rel=1e-12)
    assert found.sizes["joint"] == 0


def test_energy_of_a_servo_between_bars():
    """Cross-check: the energy of a servo between the two bars of a unit is the work that the energy balance gains by it."""
    arm = sd.scissor(units=1, angle=math.radians(60), gravity=9.81, gravity_direction=math.pi)
    bars = {"body": "unit 1/bar 1", "base": "unit 1/bar 2"}
    lift = sd.Cycloidal(math.radians(120), math.radians(60), 10.0)
    run = sd.simulate(arm.controlled(sd.PID(2e4, derivative=800.0), reference=lift, **bars), until=10.0)
    found = sd.figures_of_merit(run, run)
    gained = np.clip(np.diff(run["motor_work"].values), 0.0, None).sum()
    assert float(found["energy_used"]) == pytest.approx(float(gained), rel=1e-3)


def test_angles_that_the_ideal_run_does_not_reach(ideal):
    """Limit: no error of synchronisation is known where the ideal mechanism has no such angle."""
    body = ideal["angle"].sel(body="unit 1/bar 1")
    for shift, known in ((-0.1, True), (-2.0, False)):
        found = sd.figures_of_merit(ideal.assign(angle=ideal["angle"] + shift), ideal)
        assert float(found["tracking_error"]) == pytest.approx(abs(shift), rel=1e-12)
        assert np.isfinite(float(found["synchronisation_error"])) == known
    assert float(body.max() - body.min()) > 0.5


def test_fraction_of_contact(clearance_run):
    """Cross-check: the fraction of contact from the table of contacts equals that of the samples to within their distance."""
    found = sd.figures_of_merit(clearance_run, clearance_run)
    sampled = float(clearance_run["in_contact"].sel(joint="A").mean())
    contacts = clearance_run.sizes["contact"]
    assert float(found["contact_fraction"][0]) == pytest.approx(sampled, abs=2.0 * contacts / clearance_run.sizes["time"])
    assert float(found["peak_force"][0]) == float(clearance_run["peak_force"].max())


def test_control_keeps_contact(disturbed_array, ideal):
    """Limit: from a concentric start, within the torque limit, control has lasting contact in an eighth of the drive's time.

    Both keep contact under the gust; with feed-forward alone the array deviates from the reference.
    """
    driven = sd.figures_of_merit(sd.simulate(disturbed_array.driven(REFERENCE), until=UNTIL), ideal)
    torque = sd.feed_forward(disturbed_array, REFERENCE, until=UNTIL)
    laws = sd.FeedForward(2e4, 1500.0, limit=LIMIT, ramp=0.02), sd.FeedForward(limit=LIMIT)
    runs = [sd.simulate(disturbed_array.controlled(law, reference=REFERENCE, feed_forward=torque), until=UNTIL) for law in laws]
    closed, opened = (sd.figures_of_merit(run, ideal) for run in runs)
    assert float(driven["in_contact_from"][0]) > 0.5
    assert float(closed["in_contact_from"][0]) < 0.125
    assert float(closed["contact_fraction"][0]) > 0.95 > float(driven["contact_fraction"][0])
    assert float(closed["peak_torque"]) <= LIMIT < float(driven["peak_torque"])
    assert float(closed["tracking_error"]) < 2.5e-3
    assert float(opened["tracking_error"]) > 2e-2


def test_part_of_a_run_has_the_figures_of_a_shorter_run(clearance_array):
    """Cross-check: the first part of a run and a run that ends there have the same figures, in flight and in contact."""
    whole = sd.simulate(clearance_array, until=0.05, samples=2001)
    k = int(np.nanargmax(whole["contact_duration"].values))
    during = float(whole["contact_start"][k] + 0.5 * whole["contact_duration"][k])
    time = whole["time"].values
    for last in (int(np.searchsorted(time, during)), 800):
        short = sd.simulate(clearance_array, until=float(time[last]), samples=last + 1)
        found, wanted = (sd.figures_of_merit(run, run) for run in (whole.isel(time=slice(last + 1)), short))
        for name in ("contact_fraction", "separations", "in_contact_from"):
            np.testing.assert_allclose(found[name].values, wanted[name].values, rtol=1e-6, err_msg=name)
        # the part has samples where the shorter run has located maxima
        for name in ("peak_force", "peak_torque"):
            assert 0.99 * float(wanted[name].max()) <= float(found[name].max()) <= (1.0 + 1e-6) * float(wanted[name].max())


def test_errors(ideal, clearance_run):
    """Contract: runs that do not fit, or are swapped, are refused."""
    with pytest.raises(sd.InputError, match="the ideal run has clearance joints and the run has none"):
        sd.figures_of_merit(ideal, clearance_run)
    with pytest.raises(sd.InputError, match="the run has no drive"):
        sd.figures_of_merit(sd.simulate(sd.scissor(units=1), until=0.01, samples=3), ideal)
    with pytest.raises(sd.InputError, match="fewer than two samples"):
        sd.figures_of_merit(ideal, ideal, after=5.0)
