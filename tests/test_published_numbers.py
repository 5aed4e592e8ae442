"""The numbers of docs/reference.md: closed forms of the ideal array, events of the one with clearance."""

import numpy as np
import pytest

import scissordyn as sd
from test_reference import EVENTS

# Length [m] and mass [kg] of a bar, mass of the slider [kg], gravity [m/s^2] of the paper's array
L, M, SLIDER, G = 2.0, 5.68, 5.0, 9.81


@pytest.fixture(scope="module")
def ideal_run(array):
    return sd.simulate(array, until=0.05, samples=101)


@pytest.mark.parametrize(
    ("at", "torque", "force"), [(0.0, 7850.912334, (7464.867308, 1184.650550)), (0.02, 8911.346064, (5795.014529, 1784.586360))]
)
def test_ideal_figures(ideal_run, at, torque, force):
    """Published number: the table of the ideal array in docs/reference.md, to its ten digits."""
    here = ideal_run.sel(time=at, method="nearest")
    assert float(here["drive_torque"]) == pytest.approx(torque, rel=1e-9)
    assert here["reaction"].sel(joint="A").values == pytest.approx(force, rel=1e-9)


@pytest.mark.parametrize("units", [1, 2, 5])
def test_ideal_array_of_any_length(units):
    """Identity: torque times speed is the rate of T + U with the sums S_N and C_N of docs/theory (S2), (S3), to 1e-9."""
    run = sd.simulate(sd.scissor(units=units).driven(speed=sd.rpm(150)), until=0.02, samples=11)
    w, th = sd.rpm(150), np.pi / 6 + sd.rpm(150) * run["time"].values
    squares, products = units * (units + 1) * (2 * units + 1) / 6, (units - 1) * units * (units + 1) / 3
    squares += (units - 1) * units * (2 * units - 1) / 6
    kinetic = (M * L**2 / 4) * (squares - 2 * products * np.cos(2 * th)) * w**2 + (units * M * L**2 / 12) * w**2
    kinetic += SLIDER * (L * w * np.cos(th)) ** 2 / 2
    potential = M * G * L * units * np.sin(th) + SLIDER * G * L * np.sin(th)
    power = (M * L**2 / 4) * 4 * products * np.sin(2 * th) * w**3 - SLIDER * L**2 * w**3 * np.cos(th) * np.sin(th)
    power += (M * units + SLIDER) * G * L * np.cos(th) * w
    assert np.allclose(run["kinetic_energy"], kinetic, rtol=1e-9)
    assert np.allclose(
        run["potential_energy"] - run["potential_energy"][0], potential - potential[0], atol=1e-9 * np.max(kinetic)
    )
    assert np.allclose(run["drive_torque"] * w, power, rtol=1e-9, atol=1e-9 * np.max(np.abs(power)))


@pytest.mark.parametrize(("case", "events"), [("clearance_array", EVENTS["liu"]), ("hertz_array", EVENTS["hertz"][:2])])
def test_events(case, events, request):
    """Published number: the table of contacts in docs/reference.md, to the digits that agree at two tolerances.

    First contact to 1e-8; later ones to what the digits and the growth of errors from impact to impact allow; peaks to 1e-4.
    """
    run = sd.simulate(request.getfixturevalue(case), until=0.0075, rtol=1e-11, atol=1e-11, samples=11)
    for k, (start, speed, angle, peak, _, duration, rebound) in enumerate(events):
        digits = 1e-8 if k == 0 else 5e-8
        assert float(run["contact_start"][k]) == pytest.approx(start, rel=1e-9 if k == 0 else digits)
        assert float(run["approach_speed"][k]) == pytest.approx(speed, rel=digits)
        assert np.degrees(float(run["contact_angle"][k])) == pytest.approx(angle, abs=1e-5)
        assert float(run["peak_force"][k]) == pytest.approx(peak, rel=1e-4)
        assert float(run["contact_duration"][k]) == pytest.approx(duration, rel=5e-8)
        assert float(run["rebound_speed"][k]) == pytest.approx(rebound, rel=5e-8)


def test_first_contact_at_default_tolerance(clearance_run):
    """Published number: the first contact needs no contact law; 1e-8 relative at the default tolerance."""
    assert float(clearance_run["contact_start"][0]) == pytest.approx(0.001365125913, rel=1e-9)
    assert float(clearance_run["approach_speed"][0]) == pytest.approx(0.7351429838, rel=1e-8)
