"""Integrals of powers where the drives alone determine the motion, so that no error of a state shows theirs."""

import math

import numpy as np
import pytest
from tests.build import array, counts_of, on_pin

import scissordyn as sd

UNTIL = 1.0


@pytest.fixture(scope="module")
def stopped():
    """Return an array that swings against an end stop, three times in `UNTIL`."""
    swinging = array(angle=sd.degrees(45)).driven(sd.Harmonic(sd.degrees(45), sd.degrees(10), 18.0))
    stop = sd.TravelStop("stop", "slider.centre", 0.5 * math.pi, 1.5488, stiffness=1e6)
    return swinging.with_parts({"components": (stop,)})


@pytest.mark.parametrize(("rtol", "bound"), [(1e-8, 1e-6), (1e-11, 2e-8)])
def test_the_loss_of_an_end_stop_is_the_work_of_its_force(stopped, rtol, bound):
    run = sd.simulate(stopped, until=UNTIL, samples=100_001, rtol=rtol)
    power = -run["travel_stop_force"].values[:, 0] * run["velocity"].sel(body="slider", axis="y").values
    work = np.trapezoid(power, run["time"].values)  # the stop's elastic energy is zero at both ends
    assert counts_of(run)["events"] >= 4
    assert run["damper_loss"].values[-1] == pytest.approx(work, rel=bound)


def test_round_off_of_a_power_does_not_shorten_steps():
    """A bar that turns about its mass centre at constant speed needs no power but for round-off."""
    bar = sd.Body("bar", mass=1.3, inertia=0.7, points={"centre": (0.0, 0.0), "end": (0.9, 0.1)})
    turning = on_pin(bar).driven(speed=3.0)
    run = sd.simulate(turning, until=UNTIL)
    assert abs(run["drive_work"].values).max() < 1e-12
    assert counts_of(run)["rejected"] == 0
