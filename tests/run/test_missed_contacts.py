"""No journal is outside its bearing without contact: at no sample, and at no end of a step."""

import numpy as np
import pytest
from benchmarks.horizon_cases import KINDS
from benchmarks.missed_contacts import CASES, RELEASED, SEEN, ends, judge, outside

import scissordyn as sd
from scissordyn.laws.damping.none import NoDamping
from scissordyn.plan.plan import plan
from scissordyn.run.advance.trajectory import compute
from scissordyn.run.options import Options


def fall(angle: float, one: float, other: float) -> sd.Mechanism:
    """An array of two units that is released, with two lossless clearance joints."""
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
def test_flight_that_leaves_the_bearing(mechanism: sd.Mechanism, until: float, tolerance: float, events: str) -> None:
    """Contract: an open joint is open. Both joints fly for more than 30 ms, and leave their bearings for 4 ms."""
    options = Options(until, samples=20_001, rtol=tolerance, atol=tolerance, events=events)
    path = compute(plan(mechanism), options, record_steps=True)
    assert outside(path, path.samples.time, path.samples.state, path.samples.mode)[0] < SEEN
    assert outside(path, *ends(*path.steps))[0] < SEEN


def test_contact_agrees_with_another_method() -> None:
    """Cross-check by another method: the stiff one takes short steps, which cannot pass a contact of 4 ms."""
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
def test_random_runs(kind: str, numbers: range) -> None:
    """Contract, on random mechanisms: `python -m benchmarks.missed_contacts` has all of them."""
    for number in numbers:
        found = judge(kind, number)
        assert max(found.sample, found.step) < SEEN, found


def test_contact_that_shows_in_the_shorter_step_only() -> None:
    """Contract: a touch of 0.1 ms, which the dense output of the step does not show before it is shortened to its event."""
    found = judge("slider-crank", 33)
    assert max(found.sample, found.step) < SEEN, found
