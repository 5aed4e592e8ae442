"""Warnings of a run about the limits of its laws, controllers and steps, and Painlevé's paradox."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline
from tests.build import EXAMPLES, array, counts_of, warnings_of

import scissordyn as sd
from scissordyn.kinematics.closure import table_warnings
from scissordyn.laws.evaluate import elastic_force
from scissordyn.plan.hard_contact import elastic_law
from scissordyn.plan.plan import plan
from scissordyn.record.warn import largest_energy_change, run_warnings


def test_journal_pressed_in_by_its_radius():
    """Contract: a material far too soft for its load fails the run, with the time from which results are invalid."""
    rubber = sd.Material("rubber", 1e3, 0.49, 1000.0)
    soft = sd.Clearance(1e-4, journal_radius=1e-3, material=rubber)
    arm = sd.scissor(units=1, slider_mass=500.0).with_clearance("A", soft).driven(speed=0.0)
    run = sd.simulate(arm, until=0.2, samples=401)
    deep = run["indentation"].sel(joint="A").values
    assert deep.max() > 1e-3
    first = run["time"].values[np.argmax(deep > 1e-3)]
    (said,) = [text for text in warnings_of(run) if "contact model has failed" in text]
    assert f"from t = {first:.6g} s on are not valid: joint 'A': indentation" in said
    assert "exceeds the journal radius of 1 mm" in said
    assert run.attrs["status"] == "failed"
    assert run.attrs["cause"] == said
    assert run.attrs["end"] == 0.2
    short = sd.simulate(arm, until=0.2, samples=401, most_steps=counts_of(run)["steps"] - 1)
    assert short.attrs["status"] == "failed"
    assert "the contact model has failed" in short.attrs["cause"]


@pytest.mark.parametrize("friction", [sd.LuGre(kinetic=0.1), sd.NoFriction()])
def test_damping_of_contacts_closed_from_rest(friction):
    """Limit: from equilibrium no force exceeds 1 + xi times that of the deepest indentation; warnings explain the damping."""
    damping = sd.Flores(restitution=0.8)
    joint = sd.Clearance(5e-5, journal_radius=5e-3, damping=damping, friction=friction)
    mast = sd.mast(units=5, bar_length=0.8, bar_mass=0.7, slider_mass=0.5, platform_mass=2.0, angle=sd.degrees(15))
    mast = mast.with_clearance("pivots", joint).driven(sd.Cycloidal(sd.degrees(15), sd.degrees(60), 0.8))
    run = sd.simulate(mast, until=0.05, start="static", samples=11)
    law = elastic_law(joint)
    for name in np.unique(run["contact_joint"].values):
        deepest = float(run["peak_indentation"].sel(joint=name))
        largest = float(run["peak_normal_force"].values[run["contact_joint"].values == name].max())
        assert largest < (1.0 + damping.factor) * elastic_force(law.force, deepest, law.row)
    assert all("a contact that began at 0 m/s was loaded to" in text for text in warnings_of(run) if "damping" in text)


def test_slow_contact_that_is_thrown_later():
    """Contract: a latch throws a contact that began at 0.7 mm/s; its force is that of an impact at the later speed."""
    mechanism = sd.read_case(EXAMPLES / "self_deploying.toml").mechanism
    gaps = {joint.name: joint.clearance for joint in mechanism.clearance_joints}
    runs = {}
    for name, law in (
        ("damped", {}),
        ("undamped", {"damping": sd.law("damping", "none")()}),
        ("onset", {"reference": "onset"}),
    ):
        changed = mechanism
        for joint, gap in gaps.items():
            changed = changed.with_clearance(joint, replace(gap, **law))
        runs[name] = sd.simulate(changed, until=0.7105, samples=11)
    largest = {name: float(run["peak_force"].max()) for name, run in runs.items()}
    assert largest["damped"] == pytest.approx(largest["undamped"], rel=0.05)
    assert largest["onset"] > 10.0 * largest["undamped"]
    (said,) = [text for text in warnings_of(runs["damped"]) if "unit 3/pivot" in text and "not by an impact" in text]
    assert said.startswith("joint 'unit 3/pivot': a contact that began at 0.000742 m/s was loaded to 24")
    (said,) = [text for text in warnings_of(runs["onset"]) if "unit 3/pivot" in text and "not by an impact" in text]
    assert said.endswith("can be far too large; compare reference = 'loaded'")


def test_controller_at_its_limit():
    """Contract: the warning gives the share of the run at the limit and the largest error there."""
    arm = sd.scissor(units=1)
    run = sd.simulate(arm.controlled(sd.PID(2e4, derivative=1500.0, limit=100.0), speed=sd.rpm(20)), until=0.05, samples=101)
    torque, error = run["control_torque"].values[:, 0], run["control_error"].values[:, 0]
    at = np.abs(torque) == 100.0
    (said,) = warnings_of(run)
    assert "is at its limit of 100 N m" in said
    assert f"for {np.mean(at):.2g} of the run" in said
    assert f"up to {np.degrees(np.abs(error[at]).max()):.3g} deg from its reference" in said
    assert "from one limit to the other" not in said
    restless = run.copy(deep=True)
    restless["control_torque"][1::2], restless["control_torque"][2::2] = 100.0, -100.0
    texts = map(str, run_warnings(plan(run.scissordyn.mechanism), restless, ""))
    assert any("it changes from one limit to the other 99 times" in text for text in texts)
    wide = sd.simulate(arm.controlled(sd.PID(2e4, derivative=1500.0, limit=1e5), speed=sd.rpm(20)), until=0.05, samples=101)
    assert warnings_of(wide) == []


def test_controller_at_its_rising_limit():
    """Contract: the warning gives the last sample at which the unlimited torque exceeds the limit of that instant."""
    soft = sd.PID(2e4, derivative=1500.0, limit=250.0, ramp=0.04)
    run = sd.simulate(sd.scissor(units=1).controlled(soft, speed=sd.rpm(20)), until=0.05, samples=101)
    time, error = run["time"].values, run["control_error"].values[:, 0]
    command = 2e4 * error + 1500.0 * np.gradient(error, time, edge_order=2)
    at = (np.abs(command) > 250.0 * time / 0.04) & (time > 0.0)
    assert 2 < at.sum() < 50
    (said,) = warnings_of(run)
    assert f"which reaches 250 N m after 0.04 s, until t = {time[at][-1]:.6g} s" in said
    assert f"up to {np.degrees(np.abs(error[at]).max()):.3g} deg" in said


def test_warnings_of_a_batch():
    """Contract: each case has the warnings of its own run about contacts, bristles and controllers, and no others."""
    constant = sd.LuGre(0.1, bristle_damping=316.0, damping_speed=1e6)
    arm = array(sd.Clearance(5e-4, friction=constant))
    speeds = [sd.rpm(20), sd.rpm(250)]
    batch = sd.simulate_many(arm, {"drive.speed": speeds}, until=0.02, measures=("steps",))
    for speed, said in zip(speeds, batch["warnings"].values.tolist(), strict=True):
        run = sd.simulate(arm.replace("drive.speed", speed), until=0.02, samples=2)
        assert [text for text in said.split("\n") if text] == [
            text for text in warnings_of(run) if text.startswith("joint 'A'")
        ]
    assert ["of its law" in said for said in batch["warnings"].values.tolist()] == [False, True]
    assert "start faster" in str(batch["warnings"].values[1])
    servo = sd.scissor(units=1).controlled(sd.PID(2e4, derivative=1500.0, limit=100.0), speed=sd.rpm(20))
    limited = sd.simulate_many(
        servo, {f"{servo.components[0].name}.controller.limit": [100.0, 1e5]}, until=0.05, measures=("steps",)
    )
    assert [bool(said) for said in limited["warnings"].values.tolist()] == [True, False]
    assert "the controller reaches its limit of 100 N m" in str(limited["warnings"].values[0])


def test_bristles_beyond_the_static_limit():
    """Contract: with constant micro-damping the run warns by how much and how long; with the default there is no warning."""
    arm = sd.scissor(units=2).driven(speed=sd.rpm(150))
    constant = sd.LuGre(0.1, bristle_damping=316.0, damping_speed=1e6)
    run = sd.simulate(arm.with_clearance("A", sd.Clearance(5e-4, friction=constant)), until=0.05, samples=50_001)
    (said,) = [text for text in warnings_of(run) if "static limit" in text]
    joint = run.sel(joint="A")
    ratio = np.abs(joint["friction_force"]) / np.maximum(0.15 * joint["normal_force"], 1e-300)
    ratio = ratio.where(joint["in_contact"], 0.0).values
    peak, lasting = float(joint["peak_friction_ratio"]), float(joint["friction_excess_time"])
    assert 0.9 * ratio.max() < peak
    assert peak > 1.5
    assert lasting == pytest.approx(np.mean(ratio > 1.05) * 0.05, rel=0.1)
    assert f"reaches {peak:.3g} times" in said
    assert f"for {lasting:.3g} s" in said
    fading = sd.simulate(arm.with_clearance("A", sd.Clearance(5e-4, friction=sd.LuGre(0.1))), until=0.05, samples=2)
    assert float(fading["peak_friction_ratio"].sel(joint="A")) <= 1.0 + 1e-9
    assert not [text for text in warnings_of(fading) if "static limit" in text or "Painlevé" in text]


def test_located_peak_of_indentation(clearance_run, clearance_array):
    """Cross-check: the peak of indentation is located, and does not depend on the samples."""
    coarse = sd.simulate(clearance_array, until=0.05, samples=2)
    fine = sd.simulate(clearance_array, until=0.05, samples=200_001).sel(joint="A")
    found, when = (float(coarse[name].sel(joint="A")) for name in ("peak_indentation", "peak_indentation_time"))
    assert 0.0 <= found - float(fine["indentation"].max()) < 1e-5 * found
    assert abs(when - float(fine["time"][int(np.argmax(fine["indentation"].values))])) < 3e-7
    assert found == float(clearance_run["peak_indentation"].sel(joint="A"))


def test_warning_of_the_energy_balance(clearance_run, clearance_array):
    """Contract: an energy error above a thousandth of the energy turned over gives a warning."""
    whole = largest_energy_change(clearance_run)
    assert not any("energy balance" in text for text in warnings_of(clearance_run))
    hard = clearance_array.replace("A.contact", "hard")
    for share, count in ((0.99e-3, 0), (1.01e-3, 1)):
        off = clearance_run.copy(deep=True)
        off["energy_residual"][-1] = share * whole
        for arm, finer in ((clearance_array, "try a smaller rtol and atol"), (hard, "try a shorter step")):
            found = [text for text in map(str, run_warnings(plan(arm), off, ())) if "energy balance error" in text]
            assert len(found) == count
            assert all(finer in text for text in found)


def test_warning_of_a_gain_of_energy():
    """Contract: an event that adds energy gives a warning with its size; a loss does not."""
    cord = sd.Cable("cord", ("ground", "O"), ("stone", "centre"), free_length=1.0, stiffness=1e4)
    stone = replace(sd.point_mass("stone", mass=2.0, position=(0.9, 0.0)), velocity=(3.0, 0.0))
    swung = sd.Mechanism((stone,), components=(cord,), ground=(("O", (0.0, 0.0)),))
    run = sd.simulate(swung, until=0.1, samples=101)
    assert run.sizes["event"] >= 1
    assert not [text for text in map(str, run_warnings(plan(swung), run, ())) if "gives" in text]
    gained = run.copy(deep=True)
    gained["event_loss"][0] = -0.25
    (said,) = [text for text in map(str, run_warnings(plan(swung), gained, ())) if "gives" in text]
    assert said.startswith(f"the event of 'cord' at t = {run['event_time'].values[0]:.6g} s gives 0.25 J")


def test_event_at_the_start():
    """Closed form: a cable that is taut as placed has an event at t = 0 with the speed of its end."""
    cord = sd.Cable("cord", ("ground", "O"), ("stone", "centre"), free_length=1.0, stiffness=1e4)
    stone = replace(sd.point_mass("stone", mass=2.0, position=(0.6, 0.8001)), velocity=(3.0, 4.0))
    run = sd.simulate(sd.Mechanism((stone,), components=(cord,), ground=(("O", (0.0, 0.0)),)), until=0.01, samples=11)
    assert run["event_time"].values[0] == 0.0
    assert run["event_speed"].values[0] == pytest.approx(5.0, rel=1e-6)


def test_no_warning_at_rest():
    """Limit: without motion rounding gives no warning."""
    run = sd.simulate(sd.scissor(units=1).driven(speed=0.0), until=0.01, samples=11)
    assert warnings_of(run) == []


@pytest.mark.parametrize("make", [sd.Force, sd.Torque])
def test_time_functions_of_loads_that_end_before_the_run(make):
    """Contract: a table of a load must cover the run."""
    table = sd.Tabulated((0.0, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3), (0.0, 1.0, 1.0, 1.0, 1.0, 1.0))
    where = ("unit 1/bar 1", "end") if make is sd.Force else "unit 1/bar 1"
    amount = (0.0, 1.0) if make is sd.Force else 1.0
    arm = sd.scissor(units=1)
    loaded = arm.replace("components", (make("load", where, amount, time_function=table),))
    assert sd.simulate(loaded, until=5e-3, samples=3).attrs["status"] == "complete"
    with pytest.raises(sd.InputError, match=r"time function of 'load' is tabulated from 0 s to 0\.005 s"):
        sd.simulate(loaded, until=5.1e-3, samples=3)


@pytest.mark.parametrize(
    ("times", "overshoot"),
    [((0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 5.0), True), ((0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2), False)],
)
def test_tables_whose_curve_overshoots(times, overshoot):
    """Closed form: the warning gives the largest distance of SciPy's spline from the values, over their range."""
    values = (0.0, 0.1, 0.35, 0.7, 0.95, 1.0, 1.0)
    arm = sd.scissor(units=1, angle=0.4).driven(sd.Tabulated(times, tuple(0.4 + 0.2 * value for value in values)))
    found = json.loads(sd.simulate(arm, until=0.1, samples=3).attrs["warning_data"])
    assert [item["kind"] for item in found] == ["table overshoots"] * overshoot
    if overshoot:
        instants = np.linspace(*times[-2:], 10)
        largest = np.max(make_interp_spline(times, values, k=5)(instants)) - 1.0
        assert found[0]["numbers"]["share"] == pytest.approx(largest, rel=1e-9)


def test_cams_whose_profile_overshoots():
    """Closed form: SciPy's periodic spline cuts into the dwell of a cam with one pair at each of its ends."""
    profile = tuple(zip(np.radians([0, 90, 120, 150, 180, 360]), [0.03, 0.03, 0.04, 0.04, 0.03, 0.03], strict=True))
    arm = sd.scissor(units=1)
    cam = sd.Cam("cam", ("unit 1/bar 1", "start"), ("slider", "centre"), tuple((float(a), r) for a, r in profile))
    (found,) = table_warnings(plan(arm.replace("components", (cam,))))
    least = np.min(CubicSpline(*np.array(profile).T, bc_type="periodic")(np.linspace(np.pi, 2 * np.pi, 10)))
    assert found.numbers["share"] == pytest.approx((0.03 - least) / 0.01, rel=1e-9)
    assert "cam 'cam': between its pairs" in str(found)


HALF, MASS, RADIUS = 0.5, 1.0, 0.02
"""Half length [m] and mass [kg] of a uniform rod, and radius of the journal at its tip [m]."""

CLEARANCE, DEPTH = 0.01, 1e-7  # Clearance of the bearing and initial indentation [m]


def sliding(angle, friction, speed):
    """Return a rod that slides with its lower tip, a journal, on the bottom of its bearing."""
    rod = sd.Body(
        name="rod",
        mass=MASS,
        inertia=MASS * HALF**2 / 3.0,
        points={"tip": (0.0, 0.0)},
        centre=(HALF, 0.0),
        position=(0.0, -CLEARANCE - DEPTH),
        angle=angle,
        velocity=(speed, 0.0),
    )
    law = sd.Ambrosio(kinetic=friction)
    ground = sd.Clearance(CLEARANCE, journal_radius=RADIUS, stiffness=sd.law("stiffness", "linear")(), friction=law)
    pin = sd.Revolute("tip", ("rod", "tip"), ("ground", "centre"), clearance=ground)
    return sd.Mechanism((rod,), joints=(pin,), ground=(("centre", (0.0, 0.0)),))


def bracket(angle, friction, speed):
    """Return n M n - mu n M t times the mass: 1 + 3 cos th (cos th + mu s (sin th + r/a)).

    s is the direction of sliding, a half the rod's length, r the radius of the journal.
    """
    lean = math.sin(angle) + RADIUS / HALF
    return 1.0 + 3.0 * math.cos(angle) * (math.cos(angle) + friction * math.copysign(1.0, speed) * lean)


@pytest.mark.parametrize("speed", [-1.0, 1.0])
@pytest.mark.parametrize("friction", [0.5, 1.2, 1.5, 2.0, 3.0])
def test_painleve_paradox_of_a_sliding_rod(friction, speed):
    """Closed form: the warning appears where the bracket is negative; a rod on a point needs a friction above 4/3."""
    for degrees in (25.0, 40.0, 55.0, 63.4, 75.0, 85.0, 120.0, 150.0):
        angle = math.radians(degrees)
        if abs(bracket(angle, friction, speed)) < 0.02:
            continue
        run = sd.simulate(sliding(angle, friction, speed), until=1e-6, samples=3, start="as-placed")
        assert bool(run["in_contact"][0, 0])
        said = [text for text in warnings_of(run) if "Painlevé" in text]
        assert bool(said) == (bracket(angle, friction, speed) < 0.0), (degrees, said)
        if said:
            assert said[0].startswith("joint 'tip': Painlevé's paradox at ")
