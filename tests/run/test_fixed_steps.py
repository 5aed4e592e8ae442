"""Steps and contacts: fixed steps notice contacts late; with located or crossed events no contact is missed."""

import dataclasses
import math

import numpy as np
import pytest
from benchmarks.horizon_cases import KINDS
from benchmarks.missed_contacts import CASES, RELEASED, SEEN, ends, judge, outside
from tests.build import counts_of

import scissordyn as sd
from reference.lagrange import Array, constant_speed
from reference.laws import flores, liu
from reference.marching import ClearanceJoint, march_in_steps
from scissordyn.laws.damping.none import NoDamping
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import compute

EXACT = 0.0013651259130  # [s] start of the first contact, a reference event of docs/reference.md

JOINT = sd.Clearance(5e-4)  # Clearance of joint A
ARM = sd.scissor(units=2).driven(speed=sd.rpm(150))  # Driven array with ideal joints


def run(step, until=3e-3, joint=JOINT, **options):
    """Return a run of the paper's array."""
    return sd.simulate(ARM.with_clearance("A", joint), until=until, step=step, **options)


@pytest.mark.parametrize("step", [1e-5, 3e-5])
def test_onset_of_contact_with_fixed_steps(step):
    """Cross-check: the contact begins at the end of a step with position and speed of a free flight with more clearance."""
    late = run(step, method="dopri5")
    start = step * np.ceil(EXACT / step)
    assert late["contact_start"].values[0] == pytest.approx(start, rel=1e-12)
    free = sd.simulate(ARM.with_clearance("A", dataclasses.replace(JOINT, clearance=6e-4)), until=start, samples=50_001)
    place = free["eccentricity"].sel(joint="A").values
    size = np.linalg.norm(place, axis=1)
    assert JOINT.clearance < size[-1] < 6e-4
    speed = (1.5 * size[-1] - 2.0 * size[-2] + 0.5 * size[-3]) / float(free["time"][1])
    assert late["approach_speed"].values[0] == pytest.approx(speed, rel=1e-6)
    assert counts_of(late)["steps"] == round(3e-3 / step)


@pytest.mark.parametrize("driven_bar", ["pinned", "slider"])
def test_fixed_steps_by_lagrange(driven_bar):
    """Second formulation: Lagrange's equations with steps of order five and contacts that switch between steps, 12 ms."""
    step, angle = 2e-5, math.radians(30.0)
    array = Array(
        ClearanceJoint(5e-4, 10e-3, liu(5e-4, 15e-3), flores(0.9)), constant_speed(angle, sd.rpm(150)), driven_bar=driven_bar
    )
    expected = march_in_steps(array, 0.012, step)
    arm = sd.scissor(units=2, driven_bar=driven_bar).driven(speed=sd.rpm(150)).with_clearance("A", JOINT)
    found = sd.simulate(arm, until=0.012, step=step, method="dopri5")
    assert len(expected) >= 3
    for name in ("start", "duration"):
        assert found[f"contact_{name}"].values == pytest.approx([getattr(one, name) for one in expected], rel=1e-9, nan_ok=True)
    for name in ("approach_speed", "rebound_speed"):
        assert found[name].values == pytest.approx([getattr(one, name) for one in expected], rel=1e-6, nan_ok=True)


def test_fixed_steps_converge_to_located_contacts():
    """Order of convergence: the error of the first peak force is proportional to the delay of the contact."""
    exact = run(None)["peak_normal_force"].values[0]
    for step in (1e-5, 1e-6):
        late = run(step, method="dopri5")
        assert late["peak_normal_force"].values[0] == pytest.approx(exact, rel=2e3 * step)


def test_warning_of_fixed_steps():
    """Contract: a run and a batch warn of contacts at the ends of steps, unless nothing can touch."""
    many = sd.simulate_many(ARM.with_clearance("A", JOINT), {"A.clearance": [4e-4]}, until=1e-3, step=1e-4)
    for text in (run(1e-4, 1e-3).attrs["warnings"], str(many["warnings"].values[0])):
        assert "contacts begin and end with steps of 0.0001 s, whatever their error, not where surfaces touch" in text
    assert "with steps of" not in sd.simulate(ARM, until=1e-3, step=1e-4).attrs["warnings"]


def test_horizon_of_fixed_steps():
    """Contract: the horizon of a run with fixed steps is that of its step, which misses the impacts."""
    assert run(5e-5, 0.01, method="dopri5", trust=True).attrs["trusted_until"] < 0.01


def test_slip_of_contact_points():
    """Closed form: e'.t delta/|e|, without the rotation of the bodies; a hard contact refuses it."""
    rough = dataclasses.replace(JOINT, friction=sd.Ambrosio(kinetic=0.1), slip="contact-points")
    found = run(None, 1.6e-3, rough, samples=160_001)
    place = found["eccentricity"].sel(joint="A").values
    size, time = np.linalg.norm(place, axis=1), found["time"].values
    across = (place[:, 0] * np.gradient(place[:, 1], time) - place[:, 1] * np.gradient(place[:, 0], time)) / size
    inside = np.flatnonzero(found["in_contact"].sel(joint="A").values)[5:-5]
    slip = found["slip_speed"].sel(joint="A").values
    assert inside.size > 10_000
    assert slip[inside] == pytest.approx((across * (1.0 - JOINT.clearance / size))[inside], rel=1e-5, abs=1e-6)
    with pytest.raises(sd.InputError, match="slip of the contact points: not supported by a hard contact"):
        sd.Clearance(5e-4, slip="contact-points", contact="hard")


def fall(angle, one, other):
    """Return an array of two units that is released, with two lossless clearance joints."""
    array = sd.scissor(units=2, angle=sd.degrees(angle))
    for joint, clearance in (("A", one), ("unit 2/pivot", other)):
        array = array.with_clearance(joint, sd.Clearance(clearance, damping=NoDamping()))
    return array


@pytest.mark.parametrize("events", ["located", "crossed"])
@pytest.mark.parametrize(
    ("mechanism", "until", "tolerance"),
    [(fall(40.888, 0.1137e-3, 0.2754e-3), 0.1, 1e-8), (fall(50.0, 0.2e-3, 0.2e-3), 0.12, 1e-6)],
    ids=["leaves and returns between two probes", "leaves and stays"],
)
def test_flight_stays_in_the_bearing(mechanism, until, tolerance, events):
    """Contract: a journal in free flight is inside its bearing, where it would otherwise leave it for 4 ms."""
    options = sd.Options(until, samples=20_001, rtol=tolerance, atol=tolerance, events=events)
    path = compute(plan(mechanism), options, record_steps=True)
    assert outside(path, path.samples.time, path.samples.state, path.samples.mode)[0] < SEEN
    assert outside(path, *ends(*path.steps))[0] < SEEN


def test_contact_agrees_with_another_method():
    """Cross-check: the stiff method takes short steps, which cannot skip a contact of 4 ms."""
    mechanism = fall(40.888, 0.1137e-3, 0.2754e-3)
    runs = [sd.simulate(mechanism, until=0.064, samples=101, method=method) for method in ("dop853", "rodas5p")]
    starts, again = (run["contact_start"].values for run in runs)
    assert starts.size == again.size
    np.testing.assert_allclose(starts[-1], 0.0605206, atol=4e-6)
    np.testing.assert_allclose(starts, again, atol=4e-6)
    energy = runs[0]["energy_residual"].values
    assert np.max(np.abs(energy)) < 1e-7 * float(np.ptp(runs[0]["kinetic_energy"].values))


@pytest.mark.parametrize("numbers", [range(2), pytest.param(range(CASES), marks=pytest.mark.slow)], ids=len)
@pytest.mark.parametrize("kind", [*KINDS, RELEASED])
def test_random_runs(kind, numbers):
    """Contract: no random run misses a contact; `python -m benchmarks.missed_contacts` has all of them."""
    for number in numbers:
        found = judge(kind, number)
        assert max(found.sample, found.step) < SEEN, found


def test_contact_that_shows_in_the_shorter_step_only():
    """Contract: a touch of 0.1 ms is found, which the dense output shows only after the step is shortened to its event."""
    found = judge("slider-crank", 33)
    assert max(found.sample, found.step) < SEEN, found
