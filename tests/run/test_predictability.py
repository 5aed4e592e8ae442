"""The predictability horizon."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from benchmarks.horizon import EARLY, LATE, REFERENCES, first_apart, judge, simulated
from benchmarks.horizon_cases import KINDS, horizon_case

import scissordyn as sd

SAMPLES = 2001  # Number of instants at which runs are compared, a twentieth of the allowed error of a horizon apart or less


@pytest.mark.parametrize("kind", KINDS)
def test_horizon_against_a_much_tighter_run(kind):
    """Cross-check: references at 1e-12 and 1e-13; the horizon is at most 5 % late and 10 % early."""
    found = judge(kind, 1, SAMPLES)
    assert math.isfinite(found.said)
    assert math.isfinite(found.true), found.reason
    assert -EARLY <= found.late <= LATE
    # a run that agrees to the end is repeated as a whole: with a method of fifth order 1000^(1/5) times its steps
    assert found.cost <= (3.0 if found.said < 0.8 * found.end else 1.0 + 1000.0**0.2)


def test_touch_that_both_runs_could_miss():
    """Cross-check: both runs must not miss the same touch, which would make the horizon 58 % late."""
    case = horizon_case("guide and pin, LuGre", 35)
    run = simulated(case, case.rtol, "auto", SAMPLES, trust=True)
    method = json.loads(run.attrs["statistics"])["method"]
    horizons = [first_apart(case.mechanism, run, simulated(case, rtol, method, SAMPLES)) for rtol in REFERENCES]
    assert (1.0 - EARLY) * min(horizons) <= run.attrs["trusted_until"] <= 1.01 * max(horizons)


@pytest.fixture(scope="module")
def crank():
    """Return a free slider-crank with a bouncing pin, which is predictable for a short time only."""
    pin = sd.Clearance(2e-4, damping=sd.Flores(restitution=0.999))
    return sd.slider_crank(gravity=9.81, gravity_direction=0.3, angle=1.0).with_clearance("crank pin", pin)


def test_samples_do_not_matter(crank):
    """Identity: two samples and two thousand give the same horizon, and the samples are the requested ones."""
    few, many = (sd.simulate(crank, until=1.0, samples=samples, rtol=1e-6, atol=1e-6, trust=True) for samples in (2, 2001))
    assert many.attrs["predictability"] == "diverged"
    assert few.attrs["trusted_until"] == many.attrs["trusted_until"] < 0.9
    assert 0 < few.attrs["trusted_contacts"] == np.sum(few["contact_start"] < few.attrs["trusted_until"]) < few.sizes["contact"]
    assert few["time"].values.tolist() == [0.0, 1.0]
    assert np.array_equal(many["time"].values, np.linspace(0.0, 1.0, 2001))


def test_cost_of_few_steps():
    """Limit: a ring that keeps its velocities takes two steps, and is not repeated in more pieces than steps."""
    ring = sd.hoberman_ring().driven(speed=3.0)
    assert sd.simulate(ring, until=0.05, trust=True).attrs["predictability_cost"] <= 1.0 + 1000.0**0.2


def test_trust_changes_nothing_else(crank):
    """Identity: computing the horizon does not change the results."""
    plain, judged = (sd.simulate(crank, until=0.3, samples=31, trust=trust) for trust in (False, True))
    assert plain.equals(judged)


def test_horizon_at_the_smallest_tolerance(crank):
    """Contract: at the smallest tolerance the horizon is unknown."""
    run = sd.simulate(crank, until=0.01, rtol=1e-14, atol=1e-14, samples=2, trust=True)
    assert run.attrs["predictability"].startswith("unknown: no tighter tolerance")
    assert not {"trusted_until", "trusted_contacts"} & run.attrs.keys()


def test_second_run_that_breaks_off(crank):
    """Contract: if the second run ends early, agreement is claimed up to its end only."""
    steps = 500
    while (run := sd.simulate(crank, until=0.2, most_steps=steps, samples=2, trust=True)).attrs["status"] != "complete":
        assert run.attrs["predictability"] == "unknown: the run is not complete"
        assert "trusted_until" not in run.attrs
        steps = int(1.2 * steps)
    assert run.attrs["predictability"].startswith("unknown: the more accurate run ended early")
    assert "steps are not enough" in run.attrs["predictability"]
    assert run.attrs["trusted_until"] < 0.2


def test_horizon_of_ideal_joints():
    """Contract: a chaotic pendulum without clearance is predictable for a limited time."""
    case = horizon_case("ideal joints", 1)
    run = sd.simulate(case.mechanism, until=case.until, rtol=1e-6, atol=1e-6, samples=2, trust=True)
    assert run.attrs["predictability"] == "diverged"
    assert run.attrs["trusted_until"] < case.until
