"""Wear of joints over many cycles: Archard's volume, the worn-in profile, steps of cycles, continuation, lives, bad input."""

import dataclasses
import json
import math

import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text
from scipy.optimize import brentq

import scissordyn as sd
from scissordyn.laws.foundation import INDENTATION, PRESSURE
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.material import MATERIALS
from scissordyn.lifetime.error import scatter, significant_drift
from scissordyn.lifetime.ideal import ideal_loads
from scissordyn.lifetime.life import life_lines, simulated_line
from scissordyn.lifetime.loads import CycleRunner, Loads, WornSurface, with_coefficients, worn_surfaces
from scissordyn.lifetime.step import WornJoint
from scissordyn.lifetime.wear import wear_out
from scissordyn.mechanics.monitored import BALANCED, FRICTION, PRESSURE_VELOCITY
from scissordyn.mechanics.worn_contact import LOAD_DIRECTIONS
from scissordyn.plan.plan import plan
from scissordyn.record.warn import warnings_of
from scissordyn.run.response import Response
from scissordyn.run.trajectory import advance_to, make_driver
from scissordyn.studies.ask.requirement import value_text

RADIUS, GAP, LENGTH, MASS = 10e-3, 5e-5, 15e-3, 10.0  # Radius, clearance and length of the bearing [m], mass of the rotor [kg]
FORCE = MASS * 9.81  # [N] weight on the worn bearing
TURN = FORCE * 2.0 * math.pi * (RADIUS - GAP)  # [J] force times slip distance of one turn


def rotor(volume, cycles, *, turns=5.0, unbalance=0.0, turning_bearing=False, **laws):
    """Return a heavy shaft that turns at constant speed in a bearing, which loses a volume [m^3] in a number of cycles.

    `unbalance` is the rotating force as a fraction of the weight.
    """
    speed = 2.0 * math.pi * turns
    body = sd.Body("shaft", MASS, 0.01, {"pin": (0.0, 0.0)}, centre=(unbalance * 9.81 / speed**2, 0.0), position=(0.0, 0.0))
    ends = ("shaft", "pin"), ("ground", "origin")
    joint = sd.Revolute("bearing", *(reversed(ends) if turning_bearing else ends))
    still = sd.Mechanism((body,), joints=(joint,), ground=(("origin", (0.0, 0.0)),), gravity=9.81)
    sizes = {"clearance": GAP, "journal_radius": RADIUS - GAP, "bearing_length": LENGTH}
    clearance = sd.Clearance(**sizes, wear=volume and volume / (TURN * cycles), **laws)
    return still.driven(speed=speed, body="shaft").with_clearance("bearing", clearance)


def worn(mechanism, cycles, **options):
    """Return the wear of a mechanism that starts at rest in contact, from few simulated cycles."""
    return sd.wear(mechanism, until=1.0, cycles=cycles, **{"start": "in-contact", "settle": 0, "angles": 180} | options)


def test_worn_in_profile():
    """Closed form: V = k F w R t (integration at 1e-6), and the profile of a round journal where elasticity is negligible.

    c = 0.05 mm, R = 10 mm, L = 15 mm, V = 1 mm^3: depth 8.98746112485 um (1e-4) over a half arc of 32.044338 deg. The cells of
    the contour cause most of the error, as the ends of the arc lie at the worst place of a cell: the sum of 180 cells has the
    volume V at a depth that is 5.6e-4 larger, of 720 cells 2.1e-5. Elasticity reduces it by 8e-5 and 1e-5.
    """
    coarse, run = (worn(rotor(1e-9, 200), 200, angles=angles) for angles in (180, 720))
    assert run.attrs["status"] == "complete"
    np.testing.assert_allclose(run["worn_volume"].values[:, 0], 1e-9 * run["cycle"].values / 200, rtol=1e-7)
    depths = run["depth"].values[-1, 0]
    assert np.max(depths) == pytest.approx(8.98746112485e-6, rel=1e-4)
    assert math.degrees(math.acos(GAP / (GAP + np.max(depths)))) == pytest.approx(32.044338, rel=1e-4)
    exact = np.maximum(0.0, (GAP + 8.98746112485e-6) * np.cos(run["angle"].values - 1.5 * np.pi) - GAP)
    assert np.max(np.abs(depths - exact)) < 5e-3 * np.max(depths)  # 98 N indent the edges by 0.3 % of the depth
    cells = np.cos(coarse["angle"].values - 1.5 * np.pi)
    area = 2.0 * math.pi * RADIUS * LENGTH / cells.size
    e = brentq(lambda e: area * np.sum(np.maximum(0.0, e * cells - GAP)) - 1e-9, GAP, 2.0 * GAP)
    assert float(coarse["depth_largest"][-1, 0]) == pytest.approx(e - GAP, rel=1.5e-4)


def test_worn_volume_is_the_friction_path_of_all_loads():
    """Identity: the energies of all directions add up to the integral of F_n |v_t| that the monitor keeps (round-off)."""
    contour = tuple((1e-5 * np.maximum(0.0, np.cos(2.0 * np.pi * np.arange(360) / 360 - 1.0)) ** 4).tolist())
    for clearance in (sd.Clearance(2e-4, contour=contour), sd.Clearance(2e-4, contour=(0.0,) * 360)):
        mechanism = sd.slider_crank().driven(speed=300.0).with_clearance("slider pin", clearance)
        driver, _, _ = make_driver(plan(mechanism), sd.Options(0.02, "concentric", 2, 1e-6, 1e-6), loads=True)
        assert advance_to(driver, 0.02, 10**6) == ""
        energy, moment = driver.state.total[BALANCED:].reshape(2, LOAD_DIRECTIONS)
        row = driver.peak[driver.rows(PRESSURE_VELOCITY)[0]]
        area = float(driver.system.content.parameters.contact["area"][0])
        assert np.sum(energy) > 1.0
        assert np.sum(energy) == pytest.approx(area * row["integral"], rel=1e-12)
        assert np.sum(moment) > np.sum(energy)


@pytest.mark.parametrize("events", ["located", "crossed"])
def test_loads_of_a_hard_contact(events):
    """Identity: friction loses the coefficient times the integral of F_n |v_t|, in steps and in impacts (sliding: 1e-4)."""
    clearance = sd.Clearance(1e-4, contact="hard", friction=Coulomb(kinetic=0.1), wear=1e-15, journal_wear=1e-15)
    mechanism = sd.slider_crank().driven(speed=100.0).with_clearance("slider pin", clearance)
    driver, _, _ = make_driver(plan(mechanism), sd.Options(0.1, "concentric", 2, events=events), loads=True)
    assert advance_to(driver, 0.1, 10**6) == ""
    totals = driver.state.total
    energy = totals[BALANCED:].reshape(8, LOAD_DIRECTIONS).sum(axis=-1)
    assert 0.1 * energy[0] == pytest.approx(totals[FRICTION], rel=1e-4)
    assert energy[4] == pytest.approx(energy[0], rel=1e-12)
    assert energy[0] > 1.0


def test_life_of_a_hard_contact():
    """Closed form: V = k F w R t, and the worn-in profile of a constant load."""
    run = worn(rotor(1e-9, 200, contact="hard"), 200, angles=360)
    assert run.attrs["status"] == "complete"
    np.testing.assert_allclose(run["worn_volume"].values[:, 0], 1e-9 * run["cycle"].values / 200, rtol=1e-7)
    assert float(run["depth_largest"][-1, 0]) == pytest.approx(8.98746112485e-6, rel=2e-4)


@pytest.mark.parametrize("laws", [{}, {"journal_wear": 2e-13}])
def test_wear_of_a_hard_contact_is_that_of_a_compliant_one(laws):
    """Cross-check: an unbalanced shaft whose load swings beyond its pocket, with the contours in either contact (scatter)."""
    soft, hard = (
        worn(rotor(1e-9, 200, unbalance=0.6, contact=contact, **laws), 200, members=1)["depth"].values[-1]
        for contact in ("compliant", "hard")
    )
    assert hard.max(axis=1) == pytest.approx(soft.max(axis=1), rel=0.03)
    assert np.abs(hard - soft).sum() < 0.03 * soft.sum()


def test_steps_of_cycles_converge(monkeypatch):
    """Order of convergence: the profile tends to that of a simulation before each cycle, with order two.

    The load of an unbalanced shaft swings by 37 degrees on either side, so that the wear changes the loads on each angle.
    """
    profiles = []
    for steps in (48, 12, 6):
        monkeypatch.setattr("scissordyn.lifetime.wear.STEPS_MIN", steps)
        run = worn(rotor(5e-10, 48, unbalance=0.6), 48, members=1, tolerance=1.0)
        assert run.sizes["state"] == steps + 1
        profiles.append(run["depth"].values[-1, 0])
    errors = [np.max(np.abs(profile - profiles[0])) / np.max(profiles[0]) for profile in profiles[1:]]
    assert errors[1] < 0.01
    assert math.log2(errors[1] / errors[0]) > 1.8


def test_tolerance_of_a_step():
    """Limit: a smaller tolerance gives a profile nearer to that of all cycles simulated; a step beyond it is repeated."""
    mechanism, errors, simulations = rotor(1e-9, 120, unbalance=0.6), [], []
    exact = worn(mechanism, 120, members=1, tolerance=1e-12)
    assert exact["step"].values[1:].tolist() == [1] * 120
    for tolerance in (6.4e-7, 4e-8, 1e-8):
        run = worn(mechanism, 120, members=1, tolerance=tolerance)
        assert np.abs(np.diff(run["depth_correction"].values[:, 0], axis=0)).max() <= tolerance
        errors.append(float(np.max(np.abs(run["depth"].values[-1] - exact["depth"].values[-1]))))
        simulations.append(int(run["simulations"].sum()))
    assert errors[0] < 3e-3 * float(exact["depth_largest"][-1, 0])
    assert errors[2] < 0.6 * errors[1] < 0.6 * errors[0]
    assert simulations[0] < simulations[1] < simulations[2] < 30
    assert run["simulations"].max() > 1
    assert run.attrs["simulated_cycles"] == simulations[2]


def test_an_interrupted_wear_goes_on(tmp_path):
    """Contract: a result that was interrupted and saved goes on to the result of one run, bit for bit."""
    mechanism, kept = rotor(2e-10, 50, unbalance=0.5), []
    whole = worn(mechanism, 50)

    def stop(run):
        kept.append(run)
        if len(kept) == 2:
            raise KeyboardInterrupt

    part = worn(mechanism, 50, each=stop)
    assert part.attrs["status"] == "interrupted"
    assert 0 < int(part["cycle"][-1]) < 50
    sd.save(part, tmp_path / "life.nc")
    again = worn(mechanism, 50, earlier=sd.load(tmp_path / "life.nc"))
    xr.testing.assert_identical(again, whole)
    assert again.attrs["status"] == "complete"
    longer = worn(mechanism, 60, earlier=again)
    assert longer["cycle"].values.tolist()[: whole.sizes["state"]] == whole["cycle"].values.tolist()
    assert longer["cycle"].values[-1] == 60
    with pytest.raises(sd.InputError, match="has another case or other options"):
        worn(rotor(2e-10, 50, unbalance=0.4), 50, earlier=again)
    with pytest.raises(sd.InputError, match="has 60 cycles already"):
        worn(mechanism, 50, earlier=longer)


def test_life_of_a_clearance_and_a_bush():
    """Closed form: the depth of the worn-in profile is reached after the volume that belongs to it."""
    depth = 4e-6
    half = math.acos(GAP / (GAP + depth))
    volume = 2.0 * RADIUS * LENGTH * (math.sqrt((GAP + depth) ** 2 - GAP**2) - GAP * half)
    cycles = 1000
    run = worn(rotor(2.0 * volume, cycles), cycles, most_clearance=GAP + depth)
    assert float(run["life"][0]) == pytest.approx(cycles / 2, rel=0.02)  # linear between states 1 % of c apart
    assert run["life_low"][0] <= run["life"][0] <= run["life_high"][0]
    assert str(run["limited_by"].values[0]) == "bearing"
    assert life_lines(run)[0].startswith("clearance of joint 'bearing' at most 54 µm: fails after ")
    through = worn(rotor(2.0 * volume, cycles, bush=depth), cycles)
    assert through.attrs["status"] == "failed"
    assert "has worn through its bush of 0.004 mm by cycle" in through.attrs["cause"]
    assert float(through["life"][0]) == pytest.approx(cycles / 2, rel=0.05)


def test_joint_that_limits_a_track():
    """Closed form: the start of the rod depends on the crank pin alone, which is not the deepest worn joint."""
    joint = sd.Clearance(1e-4, wear=2e-14)
    crank = sd.slider_crank().driven(speed=150.0).with_clearance("crank pin", joint)
    both = crank.with_clearance("slider pin", dataclasses.replace(joint, wear=4e-13))
    both = both.track("pin", "rod", "start", tolerance=1e-6)
    run = sd.wear(both, until=2e-3, cycle="run", cycles=2, angles=180, start="in-contact")
    assert run["depth_largest"].sel(joint="slider pin")[-1] > run["depth_largest"].sel(joint="crank pin")[-1]
    assert run["limited_by"].values.tolist() == [""]
    assert life_lines(run)[0] == "track 'pin' within 1 µm: fails in the first cycle, before any wear"


def test_tip_of_a_deployment():
    """Limit: a run is a cycle; a worn joint moves the tracked tip, and members that do not diverge give no spread."""
    drive = sd.Harmonic(mean=0.6, amplitude=0.3, angular_frequency=math.pi, phase=math.pi / 2)
    arm = sd.scissor(units=1, angle=0.9).driven(drive).with_clearance("A", sd.Clearance(1e-4, wear=2e-11))
    arm = dataclasses.replace(arm, tracks=(sd.Track("tip", "unit 1/bar 2", "end", tolerance=1.2e-4),))
    run = sd.wear(arm, until=0.4, cycle="run", cycles=600, start="in-contact", angles=180)
    deviation, depth = run["track_deviation"].values[:, 0], run["depth_largest"].values[:, 0]
    assert run.attrs["cycle_time"] == 0.4
    # while the contact widens at first, the largest deviation is that of the transient at the start
    widened = int(np.argmax(depth > 5e-6))
    assert 0.8 < (deviation[-1] - deviation[widened]) / (depth[-1] - depth[widened]) < 1.0
    assert np.max(run["track_deviation_error"].values) < 1e-6 * deviation[0]
    assert math.isnan(float(run["life"][0]))
    assert life_lines(run)[0] == "track 'tip' within 120 µm: holds for 600 cycles"
    # cross-check: forces of ideal joints wear the bearing, which turns, at the same angles and as deep
    ideal = sd.wear(arm, until=0.4, cycle="run", cycles=600, start="in-contact", angles=180, loads="ideal")
    apart = ideal["depth"].values[-1, 0] - run["depth"].values[-1, 0]
    assert np.max(np.abs(apart)) < 0.01 * depth[-1]
    assert (
        json.loads(ideal.attrs["warnings"])[1] == "the life until a tracked point leaves its tolerance needs simulated cycles"
    )
    assert ideal.sizes["requirement"] == 0


def test_interval_contains_the_depth_of_mean_loads(monkeypatch):
    """Identity: 95 % intervals of loads that scatter by 10 % contain the depth of their mean at least nine times of ten.

    They are not wide for free either: at most five times the standard deviation of the depths.
    """
    numbers = np.random.default_rng(1)

    def loads(runner, depths, part):
        members = runner.settings.members
        energy = np.zeros((members, 1, LOAD_DIRECTIONS))
        level = TURN * (1.0 + np.max(depths) / GAP)  # the loads grow with the wear
        total, share = numbers.standard_normal((members, 1)), numbers.standard_normal((members, 5))
        energy[:, 0, 133:138] = 0.2 * level * np.abs((1.0 + 0.1 * part * total) * (1.0 + 0.1 * part * share))
        return Loads(
            energy, energy * FORCE, *np.zeros((2, *energy.shape)), np.full((members, 1), FORCE), np.zeros((members, 0))
        )

    monkeypatch.setattr(CycleRunner, "loads", lambda runner, depths: loads(runner, depths, 0.0))
    exact = float(worn(rotor(3e-10, 200), 200, angles=90, tolerance=2e-9)["depth_largest"][-1, 0])
    monkeypatch.setattr(CycleRunner, "loads", lambda runner, depths: loads(runner, depths, 1.0))
    last = [worn(rotor(3e-10, 200), 200, angles=90).isel(state=-1, joint=0) for _ in range(40)]
    found, half = (np.array([float(run[name]) for run in last]) for name in ("depth_largest", "depth_error"))
    assert np.mean(np.abs(found - exact) <= half) >= 0.9
    assert np.mean(half) < 5.0 * np.std(found)
    assert "joint 'bearing': cycles do not repeat: the wear of a cycle scatters by" in json.loads(last[0].attrs["warnings"])[-1]


def test_scatter_and_drift_of_cycles():
    """Closed form: pooled variance of independent numbers, no scatter in a trend, and a drift between members."""
    numbers, cycles = np.random.default_rng(0), np.cumsum(np.arange(1.0, 401.0))
    free = numbers.standard_normal((400, 2))
    assert scatter(cycles, free).single == pytest.approx(1.0, rel=0.2)
    alike = scatter(cycles, np.repeat(free[:, :1], 2, axis=1))
    assert alike.mean == pytest.approx(1.0, rel=0.2)
    assert scatter(cycles, np.repeat(cycles[:, None], 2, axis=1)).mean < 1e-20 * cycles[-1] ** 2
    three = scatter(cycles[:3], np.repeat(free[:3, :1], 2, axis=1))
    assert three.factor == pytest.approx(12.7062047)  # Student's t, one degree of freedom
    assert significant_drift(5.0 + free, 1) == 0.0
    assert significant_drift(5.0 + free + np.array([0.0, 1.0]), 1) == pytest.approx(0.2, rel=0.2)


def test_wear_by_forces_of_ideal_joints():
    """Closed form: V = k F w R t and the worn-in profile, as with simulated cycles, and an even ring if the bearing turns.

    c = 0.05 mm, R = 10 mm, L = 15 mm, V = 1 mm^3: depth 8.98746112485 um (1e-4).
    """
    run = worn(rotor(1e-9, 200), 200, angles=360, loads="ideal")
    assert float(run["worn_volume"][-1, 0]) == pytest.approx(1e-9, rel=1e-9)
    assert float(run["depth_largest"][-1, 0]) == pytest.approx(8.98746112485e-6, rel=1e-4)
    assert run.attrs["simulated_cycles"] == 0
    assert life_lines(run) == ["joint 'bearing' after 200 cycles: worn 8.988 µm deep, 1 mm³; largest clearance 58.99 µm"]
    assert "that of 'bearing' falls to 100 % of its largest" in json.loads(run.attrs["warnings"])[0]
    ring = worn(rotor(1e-9, 200, turning_bearing=True), 200, loads="ideal")
    np.testing.assert_allclose(ring["depth"].values[-1, 0], 1e-9 / (2.0 * math.pi * RADIUS * LENGTH), rtol=1e-3)
    # in a quarter of a turn the journal presses on the angles from 90 down to 0 degrees of the bearing, with the weight
    loads = ideal_loads(rotor(1e-9, 200, turning_bearing=True), [WornSurface("bearing", "bearing")], 0.05)
    energy, force, _, _ = loads.by_direction(0)
    assert np.flatnonzero(energy > 1e-9 * TURN).tolist() == [*range(46)]
    assert energy.sum() == pytest.approx(TURN / 4.0, rel=1e-9)
    np.testing.assert_allclose(energy[1:45], TURN / 180.0, rtol=5e-3)
    np.testing.assert_allclose(force, FORCE, rtol=1e-9)


def test_journal_that_turns_under_a_constant_load():
    """Closed form: both volumes are k F w R t. The journal loses the ring V / (2 pi R_J L), the bearing the worn-in profile.

    The profile is that of the larger clearance c + ring: V = 2 R L (sqrt(e^2 - c^2) - c acos(c/e)).
    """
    run = worn(rotor(1e-9, 200, journal_wear=1e-9 / (TURN * 200)), 200)
    assert run["joint"].values.tolist() == ["bearing", "bearing/journal"]
    for side in range(2):
        np.testing.assert_allclose(run["worn_volume"].values[:, side], 1e-9 * run["cycle"].values / 200, rtol=1e-6)
    ring = 1e-9 / (2.0 * math.pi * (RADIUS - GAP) * LENGTH)
    np.testing.assert_allclose(run["depth"].values[-1, 1], ring, rtol=5e-3)  # steps of the integration next to 2 deg
    clearance = GAP + ring
    e = clearance + float(run["depth_largest"][-1, 0])
    volume = 2.0 * RADIUS * LENGTH * (math.sqrt(e**2 - clearance**2) - clearance * math.acos(clearance / e))
    assert volume == pytest.approx(1e-9, rel=3e-3)
    np.testing.assert_allclose(run["worn_clearance"].values[-1], e, rtol=1e-4)


@pytest.mark.parametrize("loads", ["simulated", "ideal"])
def test_journal_under_a_load_of_constant_direction(loads):
    """Closed form: a journal that is pressed on one side has the worn-in profile, and slides by R_J + e in each radian.

    e is the eccentricity of the worn joint. Loads of ideal joints have R_J.
    """
    wears, radius = 1e-9 / (TURN * 200), RADIUS - GAP
    run = worn(rotor(None, 200, turning_bearing=True, journal_wear=wears), 200, loads=loads)
    cycles, e = run["cycle"].values, GAP + run["depth_largest"].values[:, 1]
    arm = radius + (loads == "simulated") * np.trapezoid(e, cycles) / 200.0
    assert run["worn_volume"].values[-1, 1] == pytest.approx(wears * 200 * FORCE * 2.0 * math.pi * arm, rel=1e-5)
    profile = math.sqrt(e[-1] ** 2 - GAP**2) - GAP * math.acos(GAP / e[-1])
    assert run["worn_volume"].values[-1, 1] == pytest.approx(2.0 * radius * LENGTH * profile, rel=3e-3)
    assert int(np.argmax(run["depth"].values[-1, 1])) == 45  # the bearing's weight presses on top of the journal
    assert not run["depth"].values[:, 0].any()


def test_bearing_that_turns_about_a_worn_journal():
    """Closed form: the bearing loses an even ring, the journal the worn-in profile of the clearance c + ring."""
    run = worn(rotor(1e-9, 200, turning_bearing=True, journal_wear=1e-9 / (TURN * 200)), 200, loads="ideal")
    ring = 1e-9 / (2.0 * math.pi * RADIUS * LENGTH)
    np.testing.assert_allclose(run["depth"].values[-1, 0], ring, rtol=3e-3)
    clearance = GAP + ring
    e = clearance + float(run["depth_largest"][-1, 1])
    profile = math.sqrt(e**2 - clearance**2) - clearance * math.acos(clearance / e)
    assert 2.0 * (RADIUS - GAP) * LENGTH * profile == pytest.approx(1e-9, rel=3e-3)


@pytest.mark.parametrize("joint", ["slider pin", "crank pin"])
def test_loads_of_worn_surfaces_against_all_samples(joint):
    """Cross-check: depths of a cycle by loads in each direction, and by the pressure at each sample with its own rotation.

    Both surfaces are worn. The crank pin turns fully against the rod, and the slider pin swings. The loads keep the mean force
    and the range of rotations in each direction, which misplaces 4 to 7 % of the volume (3 and 6 % with a round journal).
    """
    count, end, gap = 360, math.pi / 50.0, 1e-4
    theta = 2.0 * np.pi * np.arange(count) / count
    lobes = [4e-6 * np.maximum(0.0, np.cos(theta - at)) ** 4 for at in (2.9, 3.1)]
    contours = {"contour": tuple(lobes[0].tolist()), "journal_contour": tuple(lobes[1].tolist())}
    clearance = sd.Clearance(gap, wear=1e-15, journal_wear=3e-15, damping=sd.Flores(restitution=0.2), **contours)
    mechanism = sd.slider_crank().driven(speed=100.0).with_clearance(joint, clearance)
    surfaces, part = worn_surfaces(mechanism), mechanism.joint(joint)
    options, settings = sd.Options(end, "in-contact", rtol=1e-6, atol=1e-6), sd.Wear(cycle="run", members=1)
    found = WornJoint(mechanism, surfaces, [0, 1], count)
    rates = found.rate(found.depths, CycleRunner(mechanism, options, settings, surfaces, None).loads(found.depths))
    run = sd.simulate(mechanism, until=end, start="in-contact", samples=4001, trust=False)
    angle = [run["angle"].sel(body=body).values for body in (part.bearing[0], part.journal[0])]
    here, exact = run.sel(joint=joint), np.zeros((2, count))
    path = (here["normal_force"] * np.abs(here["slip_speed"])).values * end / 4000.0
    e = here["eccentricity"].transpose("time", "axis").values
    for k in np.flatnonzero(path > 0.0):
        psi, at = angle[1][k] - angle[0][k], math.atan2(e[k, 1], e[k, 0]) - angle[0][k]
        turned = np.interp(theta - psi, theta, lobes[1], period=2.0 * np.pi)
        w = np.maximum(math.hypot(*e[k]) * np.cos(theta - at) - gap - lobes[0] - turned, 1e-12)
        pressure = np.exp(np.interp(np.log(w), np.log(found.table[:, INDENTATION]), np.log(found.table[:, PRESSURE])))
        share = path[k] * pressure / pressure.sum()
        exact += share, np.interp(theta, np.mod(theta - psi, 2.0 * np.pi), share, period=2.0 * np.pi)
    for ours, theirs, area, wears in zip(rates, exact, found.areas, found.coefficients, strict=True):
        assert ours.sum() * area == pytest.approx(wears * theirs.sum(), rel=5e-3)  # impacts between samples
        assert 0.5 * np.sum(np.abs(ours / ours.sum() - theirs / theirs.sum())) < 0.09


def test_wear_in_a_case_file(tmp_path):
    """Contract: [wear], coefficients, bushes and contours of a case are written and read again as they are."""
    contour = tuple((1e-6 * np.arange(90.0)).tolist())
    mechanism = rotor(1e-9, 10, contour=contour, bush=1e-3, journal_wear=1e-15, journal_contour=contour[::-1])
    case = sd.Case(mechanism, sd.Options(1.0), sd.Wear(cycles=50, most_clearance=1e-4, coefficients={"steel/bronze": 1e-14}))
    sd.write_case(case, tmp_path / "worn.toml")
    assert sd.read_case(tmp_path / "worn.toml") == case


def test_coefficients_by_pair_of_materials():
    """Contract: a joint takes the coefficient of its materials unless it has its own; others are named in warnings."""
    mechanism = sd.slider_crank().driven(speed=30.0)
    mechanism = mechanism.with_clearance("ground pin", sd.Clearance(1e-4, wear=3e-14))
    mechanism = mechanism.with_clearance("crank pin", sd.Clearance(1e-4, bearing_material=MATERIALS["bronze"]))
    mechanism = mechanism.with_clearance("slider pin", sd.Clearance(1e-4, slip="contact-points"))
    found, warnings = with_coefficients(mechanism, {"steel/bronze": 1e-14, "steel/brass": 2e-14})
    wears = {joint.name: joint.clearance.wear for joint in found.clearance_joints}
    assert wears == {"ground pin": 3e-14, "crank pin": 1e-14, "slider pin": None}
    assert str(warnings[0]).startswith("joint 'slider pin': wear of a joint with lubrication or slip")
    assert str(warnings[1]) == "no joint takes the wear coefficient of 'steel/brass'"


@pytest.mark.parametrize(
    ("mechanism", "options", "said"),
    [
        (lambda: sd.slider_crank().driven(speed=30.0), {}, "no clearance joint has a coefficient of wear"),
        (
            lambda: sd.slider_crank().driven(speed=30.0),
            {"coefficients": {"steel": 1e-14}},
            "coefficients: 'steel'; expected the mat",
        ),
        (lambda: sd.slider_crank().driven(speed=30.0), {"coefficients": {"a/b": 0.0}}, "; expected a number from"),
        (
            lambda: sd.slider_crank().driven(speed=30.0).with_clearance("slider pin", sd.Clearance(1e-4)),
            {"coefficients": {"steel/bronze": 1e-14}},
            "joint 'slider pin': no wear coefficient for 'steel/steel'",
        ),
        (lambda: rotor(1e-9, 10), {"cycles": 0}, "cycles = 0"),
        (lambda: rotor(1e-9, 10, contour=(0.0,) * 90), {}, "a contour of 90 depths; expected 360 depths"),
        (lambda: rotor(1e-9, 10), {"earlier": xr.Dataset(attrs={"title": "scissordyn run"})}, "earlier is a 'scissordyn run'"),
    ],
)
def test_bad_input_of_wear(mechanism, options, said):
    with pytest.raises(sd.InputError, match=said):
        sd.wear(mechanism(), until=0.1, **options)


def test_wear_that_is_too_fast():
    """Contract: a cycle that errs by more than the tolerance is reported, and one that destroys the bearing is a cause."""
    fast = worn(rotor(2e-10, 4, unbalance=0.6), 4, members=1, tolerance=1e-9)
    said = "joint 'bearing': the error of a single cycle exceeds the tolerance of 1 nm"
    assert json.loads(fast.attrs["warnings"]).count(said) == 1
    assert [str(item) for item in warnings_of(fast)] == json.loads(fast.attrs["warnings"])
    assert life_lines(fast)[-1].startswith("joint 'bearing' after 4 cycles: worn ")
    assert simulated_line(fast) == f"{fast.attrs['simulated_cycles']} cycles simulated for 4 cycles."
    assert "(no interval from a single member)" in life_lines(fast)[-1]
    mad = worn(rotor(5e-6, 1), 4, members=1)
    assert mad.attrs["status"] == "failed"
    assert "check its coefficient of wear" in mad.attrs["cause"]


DEPTH = 4e-6  # of the bearing at which its clearance exceeds the requirement, after 500 cycles [m]
HALF = math.acos(GAP / (GAP + DEPTH))
VOLUME = 2.0 * RADIUS * LENGTH * (math.sqrt((GAP + DEPTH) ** 2 - GAP**2) - GAP * HALF)
COEFFICIENT = VOLUME / (TURN * 500)


def case_of_life(**settings):
    """Return the case of a shaft whose clearance exceeds a requirement after 500 cycles, by forces of ideal joints."""
    wears = sd.Wear(**{"cycles": 1000, "most_clearance": GAP + DEPTH, "angles": 180, "loads": "ideal"} | settings)
    return sd.Case(rotor(VOLUME, 500), sd.Options(0.2, "in-contact", rtol=1e-6, atol=1e-6), wears)


def test_life_as_a_response_of_a_study(tmp_path):
    """Closed form: life is inversely proportional to the coefficient; a life beyond the computed cycles is no number."""
    factors = {"bearing.wear": [2.0 * COEFFICIENT, COEFFICIENT, 0.25 * COEFFICIENT]}
    found = sd.study(case_of_life(), factors, requirements="life > 400 cycles", store=tmp_path / "lives.db")
    for result in (found, sd.open_study(tmp_path / "lives.db")):
        lives = result.table["life [cycles]"].to_numpy()
        np.testing.assert_allclose(lives[:2], [250.0, 500.0], rtol=0.02)  # linear between states
        assert math.isinf(lives[2])
        assert result.recommend().point == 2
        assert result.fractions[0].fraction == pytest.approx(2.0 / 3.0)
        assert value_text(result.dataset, Response("life"), 2) == "not reached within 1000 cycles"
        assert "estimated from forces of ideal joints" in str(result.dataset["warnings"].values[0])
    text = found.report(tmp_path / "lives.html").read_text(encoding="utf-8")
    assert "<td>over 1000</td>" in text
    figure = found.plot.curves()[0].get_figure()
    assert "not reached within 1000 cycles" in [label.get_text() for label in figure.findobj(Text)]


def test_life_of_a_study_is_that_of_wear():
    """Contract: the life is that of `wear` with simulated cycles, bit for bit, also over pairs of materials."""
    pairs = {"steel/bronze": COEFFICIENT, "steel/steel": 4.0 * COEFFICIENT}
    case = case_of_life(loads="simulated", coefficients=pairs, settle=0, members=1)
    unworn = dataclasses.replace(case.mechanism.joint("bearing").clearance, wear=None)
    case = dataclasses.replace(case, mechanism=case.mechanism.with_clearance("bearing", unworn))
    found = sd.study(
        case, {"bearing.bearing_material": {name: MATERIALS[name] for name in ("steel", "bronze")}}, measures="life"
    )
    for material, life in zip(("steel", "bronze"), found.table["life [cycles]"], strict=True):
        bearing = dataclasses.replace(unworn, bearing_material=MATERIALS[material])
        assert life == float(wear_out(case.mechanism.with_clearance("bearing", bearing), case.run, case.wear)["life"].min())
    assert found.table["life [cycles]"][0] < 0.3 * found.table["life [cycles]"][1]


@pytest.mark.parametrize(
    ("settings", "options", "said"),
    [
        ({}, {"requirements": "life > 2000 cycles"}, "'life > 2000 cycles': only 1000 cycles are computed"),
        ({}, {"requirements": "life > 10 m"}, "'m' is not a unit of \\[cycles\\]"),
        ({}, {"goals": "maximise life"}, "'life' as a goal: lives beyond 1000 cycles are not known"),
        ({"most_clearance": None}, {"measures": "life"}, "'life': no requirement on worn joints"),
    ],
)
def test_bad_input_of_lives(settings, options, said):
    with pytest.raises(sd.InputError, match=said):
        sd.study(case_of_life(**settings), {"bearing.clearance": (4e-5, 6e-5)}, points=4, **options)
