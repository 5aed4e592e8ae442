"""Curves of contact forces have the located instants of the contacts, and every source of work has its curve."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes

import scissordyn as sd
from scissordyn.plot.animation_scene import scene_of
from scissordyn.plot.contact import contact_times, force_curve, with_instants
from scissordyn.plot.joint import force
from scissordyn.plot.over_time import comparison, energy, torque
from scissordyn.plot.report import draw_all

SAMPLES = 41


@pytest.fixture(scope="module")
def coarse() -> xr.Dataset:
    """A slider-crank whose contacts are shorter than the distance of its samples."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).with_clearance("slider pin", sd.Clearance(5e-4))
    return sd.simulate(crank.driven(speed=sd.rpm(600)), until=0.2, samples=SAMPLES)


@pytest.fixture(scope="module")
def servo() -> xr.Dataset:
    """A crank that a controller turns, without a drive."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4)
    held = crank.controlled(sd.PID(proportional=10.0, limit=5.0), reference=sd.Cycloidal(0.4, 2.0, 0.05))
    return sd.simulate(held, until=0.1, samples=101)


def line(axes: Axes, label: str) -> np.ndarray:
    return np.asarray(next(each for each in axes.lines if each.get_label() == label).get_xydata())


def test_line_of_a_force_reaches_its_peaks(coarse: xr.Dataset) -> None:
    """Contract: each marked peak is a point of the line, which has every sample too, and the samples alone miss the peaks."""
    (axes,) = force(coarse)
    drawn, peaks = line(axes, "force"), line(axes, "peak of a contact")
    assert len(peaks) == coarse.sizes["contact"] > 5
    sampled = coarse["normal_force"].sel(joint="slider pin").values
    assert float(coarse["peak_force"].max()) > 1.05 * sampled.max()
    points = {(float(x), float(y)) for x, y in drawn}
    assert {(float(x), float(y)) for x, y in peaks} <= points
    scale = drawn[:, 1].max() / force_curve(coarse, "slider pin").values.max()
    at = np.isin(force_curve(coarse, "slider pin")["time"].values, coarse["time"].values)
    np.testing.assert_allclose(drawn[at, 1], scale * sampled, rtol=1e-12)
    assert np.all(np.diff(drawn[:, 0]) >= 0.0)


def test_flights_between_contacts_have_no_force(coarse: xr.Dataset) -> None:
    """Contract: between the end of a contact and the start of the next one the line is at zero."""
    curve, found = force_curve(coarse, "slider pin"), contact_times(coarse, "slider pin")
    for end, start in zip(found.end[:-1], found.start[1:], strict=True):
        between = (curve["time"].values >= end) & (curve["time"].values <= start)
        np.testing.assert_array_equal(curve.values[between], 0.0)


def test_point_at_a_sample_stays_one_point() -> None:
    """Closed form: the larger magnitude stays at the instant of a sample; what is outside or not finite is left out."""
    time, values = with_instants(
        np.array([0.0, 1.0, 2.0]),
        np.array([0.0, -1.0, 0.0]),
        np.array([1.0, 0.5, 3.0, np.nan]),
        np.array([-4.0, 2.0, 9.0, 9.0]),
    )
    assert time.tolist() == [0.0, 0.5, 1.0, 2.0]
    assert values.tolist() == [0.0, 2.0, -4.0, 0.0]


def test_largest_torque_is_on_its_line(coarse: xr.Dataset) -> None:
    """Contract: the mark of the largest torque is a point of the line, and no point of it is farther from zero."""
    (axes,) = torque(coarse)
    drawn, (mark,) = line(axes, "with clearance"), line(axes, "largest")
    assert tuple(mark) in {tuple(point) for point in drawn}
    assert abs(mark[1]) == np.abs(drawn[:, 1]).max()


def test_frames_of_a_film_have_the_peaks(coarse: xr.Dataset) -> None:
    """Contract: the largest force of all frames is that of all contacts, and each contact is in a frame."""
    mechanism = coarse.scissordyn.mechanism
    (joint,) = scene_of(coarse, mechanism, np.arange(0, SAMPLES, 4), ["slider pin"]).clearance_joints
    assert joint.force.max() == coarse["peak_force"].max()
    frames = coarse["time"].values[::4]
    for start in coarse["contact_start"].values:
        assert joint.touched[np.searchsorted(frames, start)]


def test_compared_forces_reach_their_peaks(coarse: xr.Dataset) -> None:
    """Contract: both lines of a comparison reach the largest contact force."""
    drawn = comparison(coarse, coarse)
    axes = next(each for each in drawn if "slider pin" in " ".join(each.get_ylabel().split()))
    factor = 1e-3 if "kN" in axes.get_ylabel() else 1.0
    for each in axes.lines[:2]:
        assert np.max(each.get_ydata()) == pytest.approx(factor * float(coarse["peak_force"].max()), rel=1e-12)


def test_torque_of_a_controller_is_drawn(servo: xr.Dataset, tmp_path: Path) -> None:
    """Identity: a run without a drive has the picture of its controller's torque, and the work of it among the energies."""
    (axes,) = torque(servo)
    assert axes.get_ylabel().replace("\n", " ").startswith("torque of actuator of crank")
    drawn = line(axes, "with clearance")[:, 1]
    sampled = servo["control_torque"].values[:, 0]
    np.testing.assert_allclose(np.delete(drawn, int(np.argmax(np.abs(drawn)))), sampled, rtol=1e-12)  # beside its located peak
    assert np.max(np.abs(drawn)) == float(servo["peak_control_torque"][0])
    balance = energy(servo)[0]
    drawn = line(balance, "work of motors and actuators")[:, 1]
    assert servo["motor_work"].values[-1] > 0.1
    np.testing.assert_allclose(drawn / drawn[-1], (servo["motor_work"] / servo["motor_work"][-1]).values, rtol=1e-12)
    assert "torque" in [path.stem for path in draw_all(servo, None, tmp_path, None)]
    names = [each.get_ylabel().replace("\n", " ").partition(" [")[0] for each in comparison(servo, servo)]
    assert {"torque of actuator of crank", "work"} <= set(names)
