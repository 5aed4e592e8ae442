"""Pictures of tracked points, of limits and of payloads show what the run has."""

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.plot.animation_scene import loads
from scissordyn.run.answer.placement import Placement

TOLERANCE = 0.05e-3


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    crank = sd.slider_crank().with_clearance("slider pin", sd.Clearance(2e-4)).track("pin", "rod", "end", TOLERANCE)
    return sd.simulate(crank.controlled(sd.PID(30.0, 0.5, limit=2.0), reference=sd.Cycloidal(0.0, 2.0, 0.05)), until=0.1)


def test_deviation_meets_its_peak_and_tolerance(run: xr.Dataset) -> None:
    """Contract: the curve has the located maximum, the dotted line the tolerance, in one scale; a window has its part."""
    (axes,) = run.scissordyn.plot.track()
    lines = {line.get_label(): line for line in axes.lines}
    factor = 1e3 if "mm" in axes.get_ylabel() else 1e6
    largest = float(run["peak_track_deviation"][0])
    assert np.max(lines["deviation"].get_ydata()) == pytest.approx(factor * largest, rel=1e-12)
    assert lines["largest"].get_ydata()[0] == pytest.approx(factor * largest)
    assert lines["tolerance"].get_ydata()[0] == pytest.approx(factor * TOLERANCE)
    assert run.scissordyn.plot.track(start=0.02, end=0.03)[0].get_xlim() == pytest.approx((20.0, 30.0), abs=0.1)
    plain = sd.simulate(sd.slider_crank().driven(speed=100.0), until=0.01, samples=11)
    with pytest.raises(sd.InputError, match="tracked point"):
        plain.scissordyn.plot.track()


def test_torque_shades_its_limit(run: xr.Dataset) -> None:
    """Contract: the shaded stretches last as long as the summary says, and the line stands at the limit."""
    (axes,) = run.scissordyn.plot.torque()
    shaded = [patch for patch in axes.patches if patch.get_label() == "at the limit"]
    lasting = run.scissordyn.summary().actuators[0].time_at_limit
    assert lasting > 0.0
    factor = 1e3 if "ms" in axes.get_xlabel() else 1.0
    assert sum(patch.get_width() for patch in shaded) == pytest.approx(factor * lasting, rel=0.02)
    limits = [float(line.get_ydata()[0]) for line in axes.lines if line.get_label() == "limit"]
    assert {abs(limit) for limit in limits} == {2.0}


def test_payloads_and_panels_are_where_they_are_fixed() -> None:
    """Contract: the middle of a payload is its point, that of a panel the middle of its two points, at every sample."""
    arm = sd.scissor(units=2).driven(speed=sd.rpm(150))
    arm = sd.with_panels(sd.with_payload(arm, "unit 2/bar 1.end", 12.0), "unit 1/bar 2", 1.0)
    moved = sd.simulate(arm, until=0.02, samples=5)
    placement = Placement.at(arm, moved, slice(None))
    panel, payload = loads(arm, placement, 0.02)
    assert (panel.kind, payload.kind) == ("panel", "payload")
    assert payload.points.mean(axis=1) == pytest.approx(placement.place(("unit 2/bar 1", "end")))
    ends = [placement.place(("unit 1/bar 2", name)) for name in ("start", "end")]
    assert panel.points.mean(axis=1) == pytest.approx(0.5 * (ends[0] + ends[1]))
    twice = sd.with_payload(arm, "unit 2/bar 1.end", 1.0).body("unit 2/bar 1").points
    assert {"payload", "payload 2"} <= twice.keys()
