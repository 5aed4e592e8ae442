"""Results of a path: the inertia that a drive moves, and the largest value of a smooth sampled curve."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.kinematics.path import drive_inertia, path_of, smooth_peak
from scissordyn.plan.plan import plan

# Mechanisms and the speeds of their drives [rad/s], by name
CASES = {
    "scissor": (sd.with_payload(sd.scissor(units=3, angle=math.radians(60.0)), "unit 3/bar 1.end", 2.0), -2.0),
    "mast": (sd.mast(), 1.5),
    "ring": (sd.hoberman_ring(), -0.4),
    "slider-crank": (sd.slider_crank(), 30.0),
    "four-bar": (sd.four_bar(), 10.0),
}


@pytest.mark.parametrize("name", CASES)
def test_inertia_is_that_of_the_kinetic_energy(name):
    """Second road: twice the kinetic energy of a run at constant speed, over the square of the speed."""
    mechanism, speed = CASES[name]
    ideal = mechanism.ideal().driven(speed=speed)
    until = 0.3 / abs(speed)
    found = path_of(plan(ideal), until)
    run = sd.simulate(ideal, until=until, samples=2)
    ends = drive_inertia(found)[[0, -1] if speed > 0.0 else [-1, 0]]
    np.testing.assert_allclose(ends, 2.0 * run["kinetic_energy"].values / speed**2, rtol=1e-9)


def test_a_driven_length_has_a_mass():
    """Closed form: a rod from the ground pushes a ladder's foot along the floor; m l^2/3 (dphi/ds)^2 with s = l cos phi."""
    length, mass, angle = 2.0, 3.0, math.radians(50.0)
    foot = length * math.cos(angle)
    ladder = sd.Mechanism(
        bodies=(sd.bar("ladder", length=length, mass=mass, position=(foot, 0.0), angle=math.pi - angle),),
        ground=(("corner", (0.0, 0.0)),),
        joints=(),
        guides=(
            sd.Guide("floor", ("ladder", "start"), direction=0.0),
            sd.Guide("wall", ("ladder", "end"), direction=0.5 * math.pi),
        ),
        rods=(sd.Rod("jack", ("ground", "corner"), ("ladder", "start"), motion=sd.Cycloidal(foot, 1.1 * foot, 1.0)),),
        gravity=0.0,
    )
    path = path_of(plan(ladder), 1.0)
    assert path.parameter == "length"
    turning = np.arccos(path.place / length)
    np.testing.assert_allclose(drive_inertia(path), mass * length**2 / 3.0 / (length * np.sin(turning)) ** 2, rtol=1e-9)


def test_a_bar_about_its_pin():
    """Closed form: m l^2/3."""
    arm = sd.Mechanism(
        bodies=(sd.bar("arm", length=0.7, mass=1.3),),
        ground=(("O", (0.0, 0.0)),),
        joints=(sd.Revolute("pin", ("arm", "start"), ("ground", "O")),),
        input_body="arm",
    ).driven(speed=1.0)
    path = path_of(plan(arm), 1.0)
    np.testing.assert_allclose(drive_inertia(path), 1.3 * 0.7**2 / 3.0, rtol=1e-13)


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_the_top_of_a_sine(phase):
    """Closed form: 1, at a quarter period, to the fourth power of the distance of the samples."""
    time = np.linspace(0.0, 1.0, 501)
    largest, when = smooth_peak(time, np.sin(2.0 * math.pi * (time + 1e-3 * phase)))
    assert largest == pytest.approx(1.0, abs=1e-8)
    assert when == pytest.approx(0.25 - 1e-3 * phase, abs=1e-7)


def test_curves_without_a_top_inside():
    """Limit: the largest sample at an end, beside a gap or on a plateau; NaN without any value."""
    time = np.linspace(0.0, 1.0, 5)
    assert smooth_peak(time, time) == (1.0, 1.0)
    assert smooth_peak(time, np.array([0.0, 3.0, math.nan, 1.0, 0.0])) == (3.0, 0.25)
    assert smooth_peak(time, np.ones(5)) == (1.0, 0.0)
    # a bend that is lost in rounding
    assert smooth_peak(time, np.array([0.5, np.nextafter(1.0, 0.0), 1.0, 1.0, 0.5])) == (1.0, 0.5)
    assert all(map(math.isnan, smooth_peak(time, np.full(5, math.nan))))


def test_reactions_of_an_ideal_mechanism():
    """Cross-check: located from 501 samples they are those of 100 001."""
    crank = sd.slider_crank(gravity=9.81).driven(speed=sd.rpm(1000))
    found, fine = sd.ideal_kinematics(crank, until=0.06), sd.simulate(crank, until=0.06, samples=100_001)
    force = np.linalg.norm(fine["reaction"].transpose("time", "joint", "axis").values, axis=2)
    np.testing.assert_allclose(found["peak_reaction"], np.nanmax(force, axis=0), rtol=1e-6)


@pytest.mark.parametrize("duration", [2e4, 1e5, 1e6])
def test_drive_that_moves_by_round_off(duration):
    """Limit: the path of a drive that moves by the last digits of its angle is one position."""
    angle = math.radians(15.0)
    drive = sd.Cycloidal(angle, math.radians(60.0), duration=duration)
    found = path_of(plan(sd.mast(units=5, angle=angle).driven(drive)), 1.0)
    assert found.place == pytest.approx(angle, rel=1e-9)
    assert np.isfinite(found.z).all()
