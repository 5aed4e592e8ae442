"""A friction clutch: two rotors that it brings to one speed, and its linings at rest."""

import dataclasses
import math

import numpy as np
import pytest
from tests.build import ORIGIN, on_pin, wheel

import scissordyn as sd

from .shared import METHODS, TIGHT, assert_balance

# Capacity [N m], yield angle [rad], inertias of both sides [kg m^2] and speed at the start [rad/s]
CAPACITY, YIELD, ONE, OTHER, SPEED = 2.0, 0.02, 0.3, 0.5, 10.0
REDUCED = ONE * OTHER / (ONE + OTHER)  # [kg m^2] inertia of the relative rotation of both sides


def rotors(**options):
    """Return two balanced rotors on the ground with a clutch between them; the first one turns."""
    bodies = wheel("one", ONE, angular_velocity=SPEED), wheel("other", OTHER, angular_velocity=0.0)
    clutch = sd.Clutch("clutch", "one", CAPACITY, base="other", yield_angle=YIELD, **options)
    joints = tuple(sd.Revolute(f"{body.name} pin", (body.name, "c"), ("ground", "O")) for body in bodies)
    return sd.Mechanism(bodies, joints=joints, ground=ORIGIN, components=(clutch,), input_body="one")


@pytest.mark.parametrize("method", METHODS)
def test_two_rotors_come_to_one_speed(method):
    """Closed form: over the slip angle p the load is 1 - exp(-p/y), and w^2 = w_0^2 - 2 M/I (p - y (1 - exp(-p/y)))."""
    stops = REDUCED * SPEED / CAPACITY
    run = sd.simulate(rotors(), until=0.9 * stops, method=method, samples=101, **TIGHT)
    slip = run["clutch_angle"].values[:, 0]
    load = -np.expm1(-slip / YIELD)
    speed = np.sqrt(SPEED**2 - 2.0 * CAPACITY / REDUCED * (slip - YIELD * load))
    found = run["angular_velocity"].sel(body="one").values - run["angular_velocity"].sel(body="other").values
    np.testing.assert_allclose(found, speed, rtol=1e-7)
    np.testing.assert_allclose(run["clutch_torque"][:, 0], -CAPACITY * load, atol=1e-7 * CAPACITY)
    np.testing.assert_allclose(run["damper_loss"], 0.5 * REDUCED * (SPEED**2 - found**2), atol=1e-7 * 15.0)
    assert_balance(run)


def test_energy_that_a_clutch_takes():
    """Limit: once both turn together half the reduced inertia times the square of the first difference is gone."""
    run = sd.simulate(rotors(), until=3.0, samples=11)
    final = ONE * SPEED / (ONE + OTHER)
    np.testing.assert_allclose(run["angular_velocity"][-1], final, atol=0.05)
    assert float(run["damper_loss"][-1]) == pytest.approx(0.5 * REDUCED * SPEED**2, rel=2e-3)


def test_engagement_over_time():
    """Closed form: the torque is that of the engaged clutch times t/T - sin(2 pi t/T)/(2 pi), none while it is open."""
    run = sd.simulate(rotors(time_function=sd.Cycloidal(0.0, 1.0, 0.5)), until=0.7, samples=71, **TIGHT)
    share = np.minimum(run["time"].values / 0.5, 1.0)
    share = share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi)
    load = -np.expm1(-run["clutch_angle"].values[:, 0] / YIELD)
    assert load[2] > 0.99
    np.testing.assert_allclose(run["clutch_torque"][:, 0], -CAPACITY * share * load, atol=1e-7 * CAPACITY)
    assert_balance(run)


def test_linings_at_rest_are_a_spring():
    """Closed form: against the ground a small twist swings with the stiffness M/y, cos(sqrt(M/(y I)) t)."""
    clutch = sd.Clutch("brake", "one", CAPACITY, yield_angle=YIELD)
    mechanism = on_pin(wheel("one", ONE, angular_velocity=1e-5), clutch)
    frequency = math.sqrt(CAPACITY / YIELD / ONE)
    run = sd.simulate(mechanism, until=2.0 / frequency, samples=41, rtol=1e-10, atol=1e-12)
    speed = run["angular_velocity"].sel(body="one").values
    np.testing.assert_allclose(speed, 1e-5 * np.cos(frequency * run["time"].values), atol=1e-8)
    twice = dataclasses.replace(mechanism, components=(dataclasses.replace(clutch, capacity=4.0 * CAPACITY),))
    other = sd.simulate(twice, until=1.0 / frequency, samples=41, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(other["angular_velocity"].sel(body="one").values, speed, atol=1e-8)
