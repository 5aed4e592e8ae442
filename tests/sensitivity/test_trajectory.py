"""Derivatives of variables over time: differences of runs, the energy balance, and derivatives of measures."""

from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.model.parameter_path import changed, number

CASE = Path(__file__).parent.parent.parent / "examples/paper.toml"

UNTIL = 4e-3  # [s] end of the runs, after two contacts
WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # Central differences of eighth order

ERRORS = {
    "position": 1e-9, "velocity": 1e-8, "eccentricity": 1e-7, "normal_force": 1e-7, "drive_torque": 1e-6, "reaction": 1e-6,
    "elastic_energy": 1e-7, "drive_work": 1e-7, "damping_loss": 1e-7, "kinetic_energy": 1e-7,
}  # fmt: skip
"""Errors of differences of runs, relative to the largest derivative or relative change; those of forces have friction."""


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_variables_over_time(method):
    """Cross-check: variables before, during and after contacts against differences of eighth order; energy is balanced."""
    mechanism, steps = sd.read_case(CASE).mechanism, {"A.clearance": 8e-4, "body.slider.mass": 1e-3}
    options = {"until": UNTIL, "method": method, "samples": 81, "rtol": 1e-12, "atol": 1e-12}
    found = sd.gradient(mechanism, by=list(steps), trajectory=True, **options)
    accurate = {"until": UNTIL, "samples": 81, "rtol": 1e-12, "atol": 1e-12, "method": "dop853", "events": "located"}
    for path, step in steps.items():
        value = float(number(mechanism, path).value)
        ends = {
            place: sd.simulate(changed(mechanism, path, value * (1.0 + place * step)), **accurate)
            for place in (*WEIGHTS, *(-k for k in WEIGHTS))
        }
        for name, error in ERRORS.items():
            expected = sum(w / (step * value) * (ends[k][name] - ends[-k][name]).values for k, w in WEIGHTS.items())
            slope = found[f"{name}_derivative"].sel(parameter=path).values
            known = np.isfinite(expected)
            assert np.array_equal(np.isfinite(slope), known)
            size = max(np.max(np.abs(expected[known])), np.max(np.abs(found[name].values[known])) / value)
            assert slope[known] == pytest.approx(expected[known], abs=error * size), name
        work = np.max(np.abs(found["drive_work_derivative"].sel(parameter=path).values))
        residual = found["energy_residual_derivative"].sel(parameter=path).values
        assert residual == pytest.approx(np.zeros(81), abs=1e-6 * work)


def test_the_end_of_curves():
    """Contract: the last sample of the drive's work has the derivative of the measure; the parameter is the last dimension."""
    mechanism = sd.read_case(CASE).mechanism
    found = sd.gradient(mechanism, of=["drive_work"], by=["A.clearance"], until=UNTIL, trajectory=True, samples=5)
    measure = found["derivative"].sel(measure="drive_work", parameter="A.clearance").item()
    assert found["drive_work_derivative"].dims == ("time", "parameter")
    assert found["drive_work_derivative"][-1, 0].item() == pytest.approx(measure, rel=1e-10)
    assert "normal_force_derivative" not in sd.gradient(mechanism, of=["drive_work"], by=["A.clearance"], until=1e-4)


def double_pendulum(mass, clearance=None):
    """Return a double pendulum whose upper arm has a given mass [kg], with a clearance in the joint between the arms."""
    one = sd.Body("one", mass, 0.004, {"start": (0.0, 0.0), "end": (0.16, 0.12)}, (0.08, 0.01), (0.0, 0.0), -0.3)
    end = 0.16 * np.cos(0.3) + 0.12 * np.sin(0.3), 0.12 * np.cos(0.3) - 0.16 * np.sin(0.3)
    two = sd.Body("two", 0.6, 0.004, {"start": (0.0, 0.0)}, (0.08, 0.01), end, -0.8)
    joints = (
        sd.Revolute("J", ("one", "start"), ("ground", "o")),
        sd.Revolute("K", ("two", "start"), ("one", "end"), clearance=clearance),
    )
    return sd.Mechanism(bodies=(one, two), joints=joints, ground=(("o", (0.0, 0.0)),))


def test_angles_by_a_mass():
    """Cross-check by differences: coordinates depend on masses, and angles that are zero among them have round-off."""
    options = {"until": 0.1, "start": "as-placed", "samples": 3}
    found = sd.gradient(double_pendulum(0.5), by=["body.one.mass"], trajectory=True, **options)
    ends = {k: sd.simulate(double_pendulum(0.5 + k * 1e-3), rtol=1e-12, **options)["angle"].values for k in (-2, -1, 1, 2)}
    expected = (8.0 * (ends[1] - ends[-1]) - (ends[2] - ends[-2])) / 12e-3
    assert found["angle_derivative"].values[..., 0] == pytest.approx(expected, abs=1e-8)


def test_journal_in_the_centre_up_to_round_off():
    """Closed form: energy by the height of a journal whose direction in its bearing is undefined and has a huge derivative."""
    arms = double_pendulum(0.5, sd.Clearance(1e-3, friction=sd.NoFriction()))
    path = "body.two.position.y"
    found = sd.gradient(arms, by=[path], until=1e-3, start="as-placed", trajectory=True, samples=2)
    assert 0.0 < np.max(np.abs(found["eccentricity"].values[0, -1])) < 1e-15
    assert found["potential_energy_derivative"].values[0, 0] == pytest.approx(0.6 * 9.81, rel=1e-8)


def shifts(run, other, clearance):
    """Return the earlier instants of onsets and releases of two runs, and by how many clearances the journal moves there."""
    instants, speeds = [], []
    for found in (run, other):
        start = found["contact_start"].values
        instants.append(np.stack([start, start + found["contact_duration"].values], axis=1).ravel())
        speeds.append(np.stack([found["approach_speed"].values, found["rebound_speed"].values], axis=1).ravel())
    return np.minimum(*instants), np.abs((instants[1] - instants[0]) * speeds[0]) / clearance


def test_valid_until_by_changed_runs():
    """Cross-check: from `valid_until` on runs with the changed parameter have moved a journal by a tenth of its clearance."""
    mechanism, path, change = sd.read_case(CASE).mechanism, "A.clearance", 0.03
    clearance = float(number(mechanism, path).value)
    found = sd.gradient(mechanism, of=["drive_work"], by=[path], until=8.5e-3, change=change)
    assert found["limit"].item() == "far"
    options = {"until": 8.5e-3, "samples": 2, "rtol": 1e-11, "atol": 1e-11, "method": "dop853", "events": "located"}
    run = sd.simulate(mechanism, **options)
    earliest = []
    for sign in (1.0, -1.0):
        instants, moved = shifts(
            run, sd.simulate(changed(mechanism, path, clearance * (1.0 + sign * change)), **options), clearance
        )
        first = int(np.flatnonzero(moved > 0.1)[0])
        assert np.all(moved[:first] < 0.1)
        earliest.append(instants[first])
    assert min(earliest) == pytest.approx(found["valid_until"].item(), rel=1e-3)


def test_parameter_at_its_bound():
    """Closed form: position and mass of an oscillator by its damping, which is zero and cannot be smaller."""
    stiffness, stretch, speed, end = 10.0, 0.5, 0.1, 0.5
    ball = sd.Body("ball", 1.0, 0.1, {"c": (0.0, 0.0)}, (0.0, 0.0), velocity=(speed, 0.0))
    spring = sd.Spring("spring", ("ball", "c"), ("ground", "o"), stiffness=stiffness, free_length=1.0 - stretch)
    free = sd.Mechanism(bodies=(ball,), joints=(), ground=(("o", (1.0, 0.0)),), gravity=0.0, components=(spring,))
    found = sd.gradient(free, of=["mass"], by=["spring.damping"], until=end, start="as-placed", trajectory=True, samples=11)
    t, w = found["time"].values, stiffness**0.5
    motion = -stretch * np.cos(w * t) + speed / w * np.sin(w * t)
    exact = 0.5 * (-t * motion - stretch / w * np.sin(w * t))
    slope = found["position_derivative"].sel(body="ball", axis="x").values[:, 0]
    np.testing.assert_allclose(slope, exact, atol=1e-9)
    assert found["derivative"].item() == 0.0
