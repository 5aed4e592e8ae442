"""The numbers of the curves of the page, without a browser."""

from __future__ import annotations

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.explore.figures import MOST_POINTS, Chosen, orbit
from scissordyn.run.answer.summary import summary_of


def test_controller_and_motor_have_torque_and_work() -> None:
    """Identity: without a drive the torque of a controller is a curve, and its work is one of the energies."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4)
    held = crank.controlled(sd.PID(proportional=10.0, limit=5.0), reference=sd.Cycloidal(0.4, 2.0, 0.05))
    run = sd.simulate(held, until=0.1, samples=101)
    chosen = Chosen(run, summary_of(run), "", held.output_body)
    assert [source.name for source in chosen.torques.values()] == ["torque of actuator of crank"]
    assert chosen.figures["torque"].title == "torque"
    time, found = chosen.columns(run)
    sampled = np.isin(time, run["time"].values)  # the located peak stands between them
    np.testing.assert_array_equal(found["torque 1"][sampled], run["control_torque"].values[:, 0])
    np.testing.assert_array_equal(found["motor_work"][sampled], run["motor_work"].values)
    assert np.abs(found["torque 1"]).max() == float(run["peak_control_torque"][0])
    assert "drive_work" not in found
    assert run["motor_work"].values[-1] > 0.1


@pytest.mark.parametrize("samples", [41, 3 * MOST_POINTS])
def test_curves_of_the_page_reach_their_peaks(samples: int) -> None:
    """Contract: the curves of few and of very many samples reach the located peaks of force and torque."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).with_clearance("slider pin", sd.Clearance(5e-4))
    run = sd.simulate(crank.driven(speed=sd.rpm(600)), until=0.2, samples=samples)
    scales, (data,) = Chosen(run, summary_of(run), "slider pin", "slider").scaled([run])
    assert data["force"].max() == pytest.approx(scales["force"].factor * float(run["peak_force"].max()), rel=1e-12)
    assert np.abs(data["torque 1"]).max() == pytest.approx(
        scales["torque"].factor * float(run["peak_drive_torque"][0]), rel=1e-12
    )
    assert data["time"].size <= MOST_POINTS + 2


def test_long_orbit_keeps_its_outermost_points() -> None:
    """Contract: of an orbit with more points than are drawn the deepest indentation and the range of both axes stay."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).with_clearance("slider pin", sd.Clearance(5e-4))
    run = sd.simulate(crank.driven(speed=sd.rpm(600)), until=0.2, samples=3 * MOST_POINTS)
    drawn = orbit(run, "slider pin", 1.0)
    place = run["eccentricity"].sel(joint="slider pin")
    assert np.hypot(drawn["x"], drawn["y"]).max() == np.hypot(*place.transpose("axis", "time").values).max()
    for axis in "xy":
        assert (drawn[axis].min(), drawn[axis].max()) == (place.sel(axis=axis).min(), place.sel(axis=axis).max())
    assert drawn["x"].size <= MOST_POINTS + 2
