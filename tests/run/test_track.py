"""Tracked points, and the synchronisation of the units of arrays."""

import json
import math

import numpy as np
import pytest
from tests import build

import scissordyn as sd
from scissordyn.config.template import template
from scissordyn.model.commanded import rigid
from scissordyn.plan.plan import plan
from scissordyn.run.ideal_path import ideal_path
from scissordyn.run.trajectory import compute
from scissordyn.units import short

ARM = sd.scissor(units=2).driven(speed=sd.rpm(150))  # Driven array with ideal joints


def test_point_of_a_rotating_bar():
    """Closed form: a point (x, y) of a bar at constant speed moves on a circle."""
    x, y, speed = 0.7, -0.3, sd.rpm(150)
    run = sd.simulate(ARM.track("P", "unit 1/bar 1", (x, y)).track("end", "unit 1/bar 1", "end"), until=0.05, samples=51)
    angle = ARM.body("unit 1/bar 1").angle + speed * run["time"].values
    cos, sin = np.cos(angle), np.sin(angle)
    place = np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
    np.testing.assert_allclose(run["track_position"].sel(track="P"), place, atol=1e-12)
    np.testing.assert_allclose(run["track_velocity"].sel(track="P"), speed * place[:, ::-1] * [-1.0, 1.0], atol=1e-11)
    np.testing.assert_allclose(run["track_acceleration"].sel(track="P"), -(speed**2) * place, atol=1e-9)
    length = ARM.body("unit 1/bar 1").points["end"][0]
    np.testing.assert_allclose(run["track_position"].sel(track="end"), length * np.stack([cos, sin], axis=1), atol=1e-12)
    assert "track_deviation" not in run


def test_deviation_from_the_ideal_mechanism():
    """Cross-check: the deviation is the distance of two runs, with and without clearance."""
    loose = ARM.with_clearance("A", sd.Clearance(0.5e-3)).track("tip", "unit 2/bar 1", "end").track("pin", "slider", (0.0, 0.0))
    run, ideal = sd.simulate(loose, until=0.02, samples=201), sd.simulate(loose.ideal(), until=0.02, samples=201)
    expected = np.linalg.norm(run["track_position"].values - ideal["track_position"].values, axis=2)
    np.testing.assert_allclose(run["track_deviation"], expected, atol=1e-10)
    assert 0.0 < float(run["peak_track_deviation"].sel(track="tip")) < 5.0 * 0.5e-3
    assert sd.replay(run).equals(run)


def test_largest_deviation_is_located():
    """Cross-check: with two samples, peak, r.m.s. and settling time are those of a hundred thousand samples."""
    loose = ARM.with_clearance("A", sd.Clearance(0.5e-3)).track("tip", "unit 2/bar 1", "end", 0.9e-3)
    coarse, fine = (sd.simulate(loose, until=0.02, samples=samples) for samples in (2, 100_001))
    apart, time = fine["track_deviation"].values[:, 0], fine["time"].values
    for name in ("peak_track_deviation", "peak_track_deviation_time", "rms_track_deviation", "settling_time"):
        assert float(coarse[name][0]) == float(fine[name][0])
    peak, when = float(coarse["peak_track_deviation"][0]), float(coarse["peak_track_deviation_time"][0])
    assert 0.0 <= peak - apart.max() < 1e-6 * peak
    assert abs(when - time[np.argmax(apart)]) <= 2e-7
    assert float(coarse["rms_track_deviation"][0]) == pytest.approx(math.sqrt(np.trapezoid(apart**2, time) / 0.02), rel=1e-6)
    outside = time[apart > 0.9e-3]
    assert 0.0 < outside[-1] < 0.02 - 1e-6
    assert 0.0 <= float(coarse["settling_time"][0]) - outside[-1] <= 2e-7


@pytest.mark.parametrize("loose", [False, True])
def test_deviation_parts_of_bars_and_servos(loose):
    """Cross-check: the deviation is relative to the rigid ideal mechanism with a drive, and its parts sum up to it."""
    motion = sd.Cycloidal(0.8, 0.5, 0.2)
    made = sd.scissor(units=2).track("tip", "unit 2/bar 1", "end", 1e-6)
    servo = made.controlled(sd.PID(3e4, 0.0, 3e3), reference=motion)
    bending = sd.with_bending(servo, bending_stiffness=4e5, axial_stiffness=7e8, modes=1)
    bending = bending.with_clearance("A", sd.Clearance(1e-6)) if loose else bending
    run, path = (sd.simulate(each, until=0.2) for each in (bending, made.driven(motion)))
    difference = (run["track_position"] - path["track_position"]).sel(track="tip").transpose("time", "axis").values
    np.testing.assert_allclose(run["track_deviation"].sel(track="tip"), np.hypot(*difference.T), atol=1e-9)
    parts = run["deviation_part"].sel(track="tip").transpose("part", "time", "axis")
    np.testing.assert_allclose(parts.sum("part"), difference, atol=1e-9)
    stiff = sd.simulate(servo, until=0.2)
    alone = (stiff["track_position"] - path["track_position"]).sel(track="tip").transpose("time", "axis").values
    np.testing.assert_allclose(parts.sel(part="servo"), alone, atol=1e-7)
    assert bool(np.any(parts.sel(part="clearance") != 0.0)) is loose
    assert float(run["peak_track_deviation"][0]) > 1e-4
    point = run.scissordyn.summary().points[0]
    assert list(point.parts) == ["servo", "bending", "clearance"][: 2 + loose]
    assert f"bending {short(point.parts['bending'], 'm')}" in str(point)
    measures = ("end_track_deviation", "bending_deviation", "end_servo_deviation")
    batch = sd.simulate_many(bending, {"gravity": [9.81]}, until=0.2, measures=measures).isel(case=0, track=0)
    assert float(batch["end_track_deviation"]) == pytest.approx(point.at_end, rel=1e-9)
    bent = float(np.hypot(*parts.sel(part="bending").values.T).max())
    assert float(batch["bending_deviation"]) == pytest.approx(bent, rel=1e-9)
    assert float(batch["end_servo_deviation"]) == pytest.approx(point.parts_at_end["servo"], rel=1e-6)


@pytest.mark.parametrize("samples", [2, 31, 2001, "auto"])
def test_parts_of_the_largest_deviation(samples):
    """Identity: at the located peak the parts sum up to the deviation, for any samples; their sizes bound it."""
    motion = sd.Cycloidal(0.8, 0.5, 0.05)
    made = sd.scissor(units=2).track("tip", "unit 2/bar 1", "end").track("pin", "slider", "centre")
    servo = made.controlled(sd.PID(3e4, 0.0, 3e3), reference=motion).with_clearance("A", sd.Clearance(0.5e-3))
    run = sd.simulate(servo, until=0.05, samples=samples)
    added = run["peak_deviation_part"].sum("part").transpose("track", "axis").values
    np.testing.assert_allclose(np.hypot(*added.T), run["peak_track_deviation"], rtol=1e-6)
    for point in run.scissordyn.summary().points:
        assert list(point.parts) == ["servo", "clearance"]
        first, second = point.parts.values()
        assert abs(first - second) * (1.0 - 1e-6) <= point.deviation <= (first + second) * (1.0 + 1e-6)


def test_a_latch_does_not_end_the_commanded_path(tmp_path):
    """Closed form: a latch holds the tip of a printed scissor at its angle; the deviation counts from the reference's end."""
    case = build.case_of(tmp_path, template("scissor", ["servo", "tip", "latch"]))
    run = sd.simulate(case.mechanism.ideal(), until=case.run.until, samples=3)
    assert "locked" in run["event_kind"].values
    assert json.loads(run.attrs["warnings"]) == []
    locked, end = (np.array([4.0 * math.cos(angle), 2.0 * math.sin(angle)]) for angle in np.radians([15.45, 15.0]))
    np.testing.assert_allclose(run["track_position"].values[-1, 0], locked, rtol=1e-8)
    assert float(run["track_deviation"][-1, 0]) == pytest.approx(np.linalg.norm(locked - end), rel=1e-6)
    np.testing.assert_allclose(run["deviation_part"].sel(part="servo")[-1, 0], locked - end, rtol=1e-6)


def test_steps_of_a_locked_mechanism(tmp_path):
    """Limit: a mechanism that a latch has locked needs few steps, also if it started with an acceleration of round-off."""
    text = template("slider-crank", ["servo", "tip", "latch"])
    assert text.count('end = "90 deg", duration') == 1
    case = build.case_of(tmp_path, text.replace('end = "90 deg", duration', 'end = "90.9 deg", duration'))
    mechanism = case.mechanism.ideal().replace("latch.angle", math.radians(114.624318352))  # crank at 90 deg
    path = compute(plan(mechanism), sd.Options(until=case.run.until, method="dop853", most_steps=1000))
    assert path.status == "complete"
    assert len(path.log) == 1  # the latch


def test_errors_of_the_path_are_no_deviation():
    """Limit: a servo that follows exactly adds no deviation; parts below the error of the ideal path are zero."""
    held = sd.scissor(units=2, angle=0.6, gravity=0.0).track("tip", "unit 2/bar 1", "end", 1e-3)
    run = sd.simulate(held.controlled(sd.PID(3e4, 0.0, 3e3), reference=sd.Cycloidal(0.6, 0.6, 1.0)), until=0.02)
    (point,) = run.scissordyn.summary().points
    assert float(run["peak_track_deviation"][0]) < 1e-9
    assert (point.deviation, point.at_end, point.parts) == (0.0, 0.0, {})
    assert " pm" not in str(point)


@pytest.mark.parametrize("how", [{"modes": 2}, {"elements": 3}])
def test_bars_made_rigid_again(how):
    """Identity: bars made bending and rigid again have mass and inertia of the uniform bars."""
    again = rigid(sd.with_bending(ARM, bending_stiffness=4e5, axial_stiffness=7e8, **how))
    torques = [sd.simulate(made, until=0.05, samples=11)["drive_torque"].values for made in (ARM, again)]
    np.testing.assert_allclose(torques[1], torques[0], rtol=1e-6)
    assert rigid(ARM) is ARM


def test_limits_of_the_settling_time():
    """Limit: 0 for a point that never leaves its tolerance, inf for one outside at the end, NaN without a tolerance."""
    loose = ARM.with_clearance("A", sd.Clearance(0.5e-3))
    for number, tolerance in enumerate((1.0, 1e-9, None)):
        loose = loose.track(f"P{number}", "unit 2/bar 1", "end", tolerance)
    found = sd.simulate(loose, until=0.01, samples=2)["settling_time"].values
    assert found[0] == 0.0
    np.testing.assert_array_equal(found[1:], [np.inf, np.nan])


@pytest.mark.parametrize("motion", [sd.Harmonic(0.6, 0.3, 60.0), sd.Cycloidal(0.5, 0.9, 0.031)])
def test_table_of_the_ideal_mechanism(motion):
    """Limit: between its rows the table of the ideal path keeps its error bound for any drive."""
    arm = sd.scissor(units=3, angle=0.5).driven(motion).track("tip", "unit 3/bar 1", "end")
    path = ideal_path(plan(arm), sd.Options(until=0.06))
    times = np.linspace(0.0, 0.06, 1237)
    exact = sd.simulate(arm, until=0.06, samples=1237)["track_position"].transpose("time", "track", "axis").values
    assert path.warnings == ()
    assert np.max(np.abs(path.at(times) - exact)) < 1e-9 * arm.size


def test_in_a_case_file(tmp_path):
    """Contract: a [[track]] table gives a tracked point."""
    case = '[structure]\nkind = "scissor"\n[drive]\nspeed = "150 rpm"\n[run]\nuntil = "1 ms"\n'
    tracks = '[[track]]\nname = "P"\nbody = "slider"\npoint = "10, -20 mm"\ntolerance = "2 mm"\n'
    tracks += '[[track]]\nname = "E"\nbody = "unit 1/bar 1"\npoint = "end"\n'
    path = tmp_path / "case.toml"
    path.write_text(case + tracks)
    found = sd.read_case(path).mechanism.tracks
    assert found == (sd.Track("P", "slider", (0.01, -0.02), 0.002), sd.Track("E", "unit 1/bar 1", "end"))


@pytest.mark.parametrize(
    ("track", "says"),
    [
        (("P", "slyder", "centre"), "did you mean 'slider'"),
        (("P", "slider", "end"), "point 'end' of body 'slider'"),
        (("", "slider", "centre"), "a name"),
        (("P", "slider", (math.nan, 0.0)), "tracked point 'P'"),
    ],
)
def test_refused_tracks(track, says):
    """Contract: wrong bodies, points and names are refused."""
    with pytest.raises(sd.InputError, match=says):
        ARM.track(*track)
    with pytest.raises(sd.InputError, match="tracked point 'P' is given 2 times"):
        ARM.track("P", "slider", "centre").track("P", "slider", "centre")


@pytest.mark.filterwarnings("error")
def test_root_mean_square_of_round_off():
    """Limit: a point of the driven bar deviates by round-off; its mean square is not negative."""
    made = (
        sd.scissor(units=1)
        .driven(speed=sd.rpm(100))
        .with_clearance("A", sd.Clearance(0.5e-3))
        .track("tip", "unit 1/bar 1", "end")
    )
    for clearance in (0.2e-3, 0.3e-3, 0.4e-3, 0.5e-3):
        run = sd.simulate(made.replace("A.clearance", clearance), until=5e-3)
        assert 0.0 <= float(run["rms_track_deviation"][0]) < 1e-12


def test_root_mean_square_is_at_most_the_peak():
    """Limit: without clearance the deviation is the error of the steps, and its r.m.s. at most its peak."""
    arm = sd.scissor(units=2).driven(speed=sd.rpm(60)).track("tip", "unit 2/bar 1", "end", tolerance=1e-3)
    measures = "rms_track_deviation", "peak_track_deviation"
    found = sd.simulate_many(arm, {"gravity": [9.81]}, until=0.05, measures=measures)
    mean, largest = (float(found[name].values[0, 0]) for name in measures)
    assert 0.0 <= mean <= largest < 1e-6


SMALL = 1e-9
"""[rad] Largest angle error: above round-off of positions of some metres, far below a clearance over a bar's length."""

# Functions that build an array, by kind
ARRAYS = {
    "scissor": lambda: sd.scissor(units=4),
    "driven at the slider": lambda: sd.scissor(units=3, driven_bar="slider"),
    "polar": lambda: sd.polar_scissor(units=4),
    "ring": lambda: sd.hoberman_ring(units=6),
    "mast": lambda: sd.mast(units=3, platform_mass=4.0),
}


@pytest.mark.parametrize("kind", ARRAYS)
def test_ideal_arrays_are_synchronous(kind):
    """Closed form: in an ideal array of equal units all deployment angles are equal."""
    run = sd.simulate(ARRAYS[kind]().driven(speed=sd.rpm(20)), until=0.1, samples=21)
    assert run["synchronisation_error"].dims == ("time", "unit")
    assert list(run["unit"].values) == [f"unit {k + 1}" for k in range(run.sizes["unit"])]
    assert float(np.max(np.abs(run["synchronisation_error"].values))) < SMALL
    assert float(run["peak_synchronisation_error"].max()) < SMALL


def test_one_clearance_joint():
    """Closed form: the bars of unit 2 start at the ends of unit 1, displaced by the eccentricity."""
    length, c = 2.0, 1e-3
    arm = sd.scissor(units=2, bar_length=length).with_clearance("unit 1/upper", sd.Clearance(c)).driven(speed=sd.rpm(150))
    run = sd.simulate(arm, until=0.05, samples=201)
    bars = run["angle"].sel(body=["unit 1/bar 1", "unit 1/bar 2"]).values
    ends = 0.5 * length * np.stack([np.cos(bars), np.sin(bars)], axis=-1)
    pins = ends[:, 0] - ends[:, 1]  # of the first unit, from the end of bar 2 to that of bar 1
    eccentricity = run["eccentricity"].sel(joint="unit 1/upper").values  # of the end of bar 1 in the start of unit 2's bar 2
    starts = pins - eccentricity
    angle = [np.arcsin(np.hypot(*between.T) / length) for between in (pins, starts)]
    error = run["synchronisation_error"].sel(unit="unit 2").values
    assert np.allclose(error, angle[1] - angle[0], rtol=0.0, atol=SMALL)
    assert float(np.max(np.abs(error))) > 0.5 * c / length
    assert float(run["peak_synchronisation_error"].sel(unit="unit 2")) == np.max(np.abs(error))
    assert not np.any(run["synchronisation_error"].sel(unit="unit 1").values)


def test_angles_that_differ_by_turns():
    """Contract: a full turn in a bar's given angle changes nothing."""
    arm = sd.scissor(units=2).driven(speed=sd.rpm(60))
    turned = arm.replace("unit 2/bar 2.angle", arm.body("unit 2/bar 2").angle + 2.0 * math.pi)
    error = sd.simulate(turned, until=0.02, samples=5)["synchronisation_error"].values
    assert float(np.max(np.abs(error))) < SMALL


@pytest.mark.parametrize("mechanism", [lambda: sd.scissor(units=1), lambda: sd.slider_crank()])
def test_mechanisms_without_several_units(mechanism):
    """Contract: fewer than two units have no synchronisation error."""
    run = sd.simulate(mechanism().driven(speed=1.0), until=1e-3, samples=2)
    assert "synchronisation_error" not in run
    assert "unit" not in run.dims
