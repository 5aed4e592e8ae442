"""Derivatives of runs: closed forms of a single contact, and differences of runs at the tightest tolerances."""

import dataclasses
import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.integrate.integration import LARGEST
from scissordyn.laws.damping.factors import HuntCrossley
from scissordyn.model.parameter_path import changed, every_number
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import (
    CENTRAL_DIFFERENCES,
    Parameter,
    Start,
    _differences,
    _linear_slopes,
    derivatives,
    parameter_of,
)

RESTITUTIONS = (
    (sd.Flores, 0.5, 1.07308990055),
    (sd.LankaraniNikravesh, 0.5, 0.270367967569),
    (HuntCrossley, 0.5, 0.459202543812),
)
"""Damping law, its parameter c_r, and the exact derivative of an impact's actual restitution coefficient by c_r."""

SPEED, CLEARANCE = 0.5, 1e-3  # Speed of the ball [m/s] and radial clearance [m]


def journals():
    """Return bodies that move through their clearances, one for each law."""
    bodies, joints = [], []
    for damping, coefficient, _ in RESTITUTIONS:
        name = damping.__name__
        bodies.append(
            sd.Body(name, mass=1.0, inertia=1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(SPEED, 0.0))
        )
        clearance = sd.Clearance(
            CLEARANCE, journal_radius=0.01, damping=damping(coefficient), friction=sd.NoFriction(), reference="onset"
        )
        joints.append(sd.Revolute(name, (name, "centre"), ("ground", "hole"), clearance=clearance))
    return sd.Mechanism(bodies=tuple(bodies), joints=tuple(joints), ground=(("hole", (0.0, 0.0)),), gravity=0.0)


def test_no_elasticity_at_zero():
    """Contract: a parameter or a measure that is zero has a derivative, but no relative change."""
    of, by = ["peak_force", "friction_loss"], ["gravity", "Flores.clearance"]
    found = sd.gradient(journals().replace("gravity_direction", 0.0), of=of, by=by, until=4e-3, start="as-placed")
    assert np.isfinite(found["derivative"].values).all()
    assert found["derivative"].sel(measure="peak_force", parameter="gravity").item() != 0.0
    assert np.isnan(found["elasticity"].values).tolist() == [[True, False], [True, True]]


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_slopes_of_forces_vanish_at_their_largest_values(method):
    """Identity: the largest force has the derivative of the force at its instant, where the force's slope is zero."""
    mechanism, until, near = journals(), 0.0035, 1e-7
    options = sd.Options(until, "as-placed", 2, 1e-11, 1e-11, method, events="located")
    begin, tables = Start(mechanism, "as-placed"), plan(mechanism)
    seeds = [derivatives(begin, parameter_of(mechanism, path, 1.0)) for path in ("Flores.clearance", "body.Flores.velocity.x")]
    log = forward(tables, options, seeds).driver.log
    (end,) = np.flatnonzero((log["guard"] == 0) & (log["mode"] == 0))
    times = log["largest_time"][end] + near * np.arange(-2, 3)
    run = forward(tables, options, seeds, times=times)
    force, slope = (record.contact["normal"][:, 0] for record in run.outputs)
    size, duration = log["largest"][end], log["time"][end] - log["largest_time"][end]
    first, second = (np.array(weights) / 12.0 for weights in ((1, -8, 0, 8, -1), (-1, 16, -30, 16, -1)))
    late = -near * (first @ force) / (second @ force)
    assert abs(late) < 1e-6 * duration
    assert force[2] == pytest.approx(size, rel=1e-9)
    assert slope[2] + late / near * (first @ slope) == pytest.approx(run.peak[0, LARGEST], rel=1e-7)


@pytest.mark.parametrize(("method", "error"), [("dop853", 1e-9), ("rodas5p", 1e-8)])
def test_restitution_and_onset_of_an_impact(method, error):
    """Closed form: instant of the onset by the clearance, and rebound speed by the parameter of each law."""
    mechanism, options = journals(), sd.Options(0.0035, "as-placed", 2, 1e-12, 1e-12, method, events="located")
    names = [damping.__name__ for damping, *_ in RESTITUTIONS]
    parameters = [parameter_of(mechanism, f"{name}.damping.restitution", 1.0) for name in names]
    parameters.append(parameter_of(mechanism, f"{names[0]}.clearance", 1.0))
    begin = Start(mechanism, "as-placed")
    run = forward(plan(mechanism), options, [derivatives(begin, parameter) for parameter in parameters])
    log = run.driver.log
    for k, (_, coefficient, exact) in enumerate(RESTITUTIONS):
        (end,) = np.flatnonzero((log["guard"] == k) & (log["mode"] == 0))
        assert -run.log[end, 3, k] / SPEED / coefficient == pytest.approx(exact, rel=error)
    (onset,) = np.flatnonzero((log["guard"] == 0) & (log["mode"] == 1))
    assert run.log[onset, 0, 3] / CLEARANCE == pytest.approx(1.0 / SPEED, rel=1e-11)
    assert run.misfit < 1e-10


def hinged(name, height, angle):
    """Return a bar on a pin of the ground, the joint, and the pin."""
    points = {"hinge": (0.0, 0.0), "end": (0.4, 0.0)}
    body = sd.Body(name, mass=1.0, inertia=0.05, points=points, centre=(0.2, 0.0), position=(0.0, height), angle=angle)
    pin = f"{name} pivot"
    return body, sd.Revolute(f"{name} hinge", (name, "hinge"), ("ground", pin)), (pin, (0.0, height))


def stopped():
    """Return bars: one bounces on a stop, one locks in a latch with another that is coupled to it, one falls into a cable."""
    bodies, joints, pins = zip(
        hinged("arm", 0.0, 0.0), hinged("flap", 1.0, 0.1), hinged("hook", 2.0, 0.0), hinged("slave", 3.0, 0.0), strict=True
    )
    return sd.Mechanism(
        bodies=bodies,
        joints=joints,
        ground=(*pins, ("anchor", (0.3, 2.3))),
        gravity=9.81,
        components=(
            sd.TorsionSpring("spring", "arm", stiffness=20.0, free_angle=1.0),
            sd.AngleStop("stop", "arm", angle=0.2, stiffness=1e5, restitution=0.6),
            sd.TorsionSpring("closer", "flap", stiffness=30.0, free_angle=1.0),
            sd.PinFriction("friction", "arm", radius=0.05, kinetic=0.2),
            sd.Cable("cable", ("ground", "anchor"), ("hook", "end"), stiffness=5e4, free_length=0.35, damping=5.0),
        ),
        latches=(sd.Latch("latch", "flap", angle=0.5),),
        couplings=(sd.Coupling("belt", sd.RelativeAngle("slave"), sd.RelativeAngle("flap"), -0.6),),
    )


def differences(mechanism, options, path, value, step):
    """Return differences of sixth order of the events and largest values of a run, by path, divided by its size."""
    total = []
    for place, weight in ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0)):
        ends = []
        for sign in (1, -1):
            driver, _, _ = make_driver(plan(changed(mechanism, path, value + sign * place * step * abs(value))), options)
            advance(driver, options.until)
            ends.append((driver.log["time"], driver.log["rate"], driver.log["largest"], driver.peak["largest"], driver.state.y))
        parts = [weight / step * (np.array(one) - np.array(other)) for one, other in zip(*ends, strict=True)]
        total = [one + other for one, other in zip(total, parts, strict=True)] if total else parts
    return total


NOISE = 2e-6
"""Relative error of finite differences, which the precision of located events limits."""


PARAMETERS = {
    "stop.stiffness": 1e5,
    "stop.restitution": 0.6,
    "cable.free_length": 0.35,
    "latch.angle": 0.5,
    "flap.inertia": 0.05,
    "friction.kinetic": 0.2,
    "belt.ratio": -0.6,
}
"""Values of the parameters of `stopped`, by path."""

# Tolerance of each method, at which its derivatives are more accurate than `NOISE`
TOLERANCES = {"dop853": 1e-12, "rodas5p": 1e-11}


@cache
def all_derivatives(method):
    """Return a run of `stopped` with its derivatives by all parameters."""
    mechanism, tolerance = stopped(), TOLERANCES[method]
    options = sd.Options(0.125, "as-placed", 2, tolerance, tolerance, method, events="located")
    start = Start(mechanism, "as-placed")
    return forward(plan(mechanism), options, [derivatives(start, parameter_of(mechanism, path, 1.0)) for path in PARAMETERS])


@cache
def all_differences(path):
    """Return differences of the runs of `stopped` by dop853."""
    options = sd.Options(0.125, "as-placed", 2, 1e-12, 1e-12, "dop853", events="located")
    return differences(stopped(), options, path, PARAMETERS[path], 1e-3)


@pytest.mark.parametrize("path", PARAMETERS)
@pytest.mark.parametrize("method", TOLERANCES)
def test_stops_latches_cables_and_couplings(path, method):
    """Cross-check: instants, speeds and largest values of all events against differences of six runs by dop853."""
    run, k = all_derivatives(method), list(PARAMETERS).index(path)
    time, rate, largest, peak, state = all_differences(path)
    assert len(run.log) >= 7
    assert run.misfit < 1e-9
    scale = np.max(np.abs(time)) + 1e-6
    assert run.log[:, 0, k] == pytest.approx(time, abs=NOISE * scale)
    assert run.log[:, 3, k] == pytest.approx(rate, abs=NOISE * (np.max(np.abs(rate)) + 1.0))
    assert run.log[:, 6, k] == pytest.approx(largest, abs=NOISE * (np.max(np.abs(largest)) + np.max(run.driver.log["largest"])))
    guards = run.driver.state.mode.size
    assert run.peak[guards:, 0, k] == pytest.approx(peak[guards:], abs=NOISE * (np.max(np.abs(peak)) + 1.0))
    assert run.state[:, k] == pytest.approx(state, abs=NOISE * (np.max(np.abs(state)) + 1.0))


# Measures of a contact that have derivatives
MEASURED = ("first_contact", "peak_force", "peak_approach_speed", "impulse", "peak_indentation", "contact_fraction")


def test_measures_of_a_run():
    """Closed form: what follows from the approach speed and the masses alone; of equal parts neither decides."""
    measures = [*(f"Flores.{name}" for name in MEASURED), "damping_loss", "first_contact"]
    found = sd.gradient(
        journals(), of=measures, by=["Flores.clearance", "body.Flores.mass"], until=0.0035, start="as-placed", rtol=1e-12
    )
    of = found["elasticity"].sel(parameter="body.Flores.mass").to_series()
    for name in ("first_contact", "peak_approach_speed"):
        assert of[f"Flores.{name}"] == pytest.approx(0.0, abs=1e-9)
    onset = found.sel(measure="Flores.first_contact", parameter="Flores.clearance")
    assert float(onset["elasticity"]) == pytest.approx(1.0, abs=1e-9)
    lost = 0.5 * SPEED**2 * (1.0 - (run_out("Flores") / SPEED) ** 2)
    slope = found["derivative"].sel(measure="damping_loss", parameter="body.Flores.mass")
    assert float(slope) == pytest.approx(lost, rel=1e-8)
    assert found["smooth"].sel(measure="Flores.peak_force").all()
    assert not found["smooth"].sel(measure="first_contact", parameter="Flores.clearance")
    assert "'first_contact': another part" in json.loads(found.attrs["warnings"])[0]


def run_out(name):
    """Return the rebound speed of a journal."""
    mechanism = journals()
    run = sd.simulate(mechanism, until=0.0035, start="as-placed", rtol=1e-11, atol=1e-11, method="dop853", events="located")
    at = run["contact_joint"].values.tolist().index(name)
    return -float(run["rebound_speed"].values[at])


def test_the_part_of_a_run_in_which_a_gradient_holds():
    """Contract: a change that moves a journal far ends it at the event."""
    near, far = (
        sd.gradient(journals(), of=["peak_force"], by=["Flores.clearance"], until=0.0035, start="as-placed", change=change)
        for change in (1e-3, 0.5)
    )
    assert near["limit"].item() == ""
    assert near["valid_until"].item() == 0.0035
    assert far["limit"].item() == "far"
    # a clearance of half its size is crossed in half the time
    assert far["valid_until"].item() == pytest.approx(0.5 * CLEARANCE / SPEED)
    assert "more than a tenth of its clearance" in json.loads(far.attrs["warnings"])[0]


# Arguments of `gradient` that are an error, by pattern of its message
REFUSED = {
    "contact_count.*count": {"of": ["contact_count"]},
    "peak_bar_stress.*taken at samples": {"of": ["peak_bar_stress"]},
    "is a requirement, whose verdict has no derivatives; expected its measure": {"of": ["Flores.peak_force < 3 kN"]},
    "'peak_force' is given twice": {"of": ["peak_force", "peak_force"]},
    "'gravity' is given twice": {"by": ["gravity", "gravity"]},
    "unknown measure 'peak_forc'": {"of": ["peak_forc"]},
    "no part 'B'": {"by": ["B.clearance"]},
    "'Flores.friction' is not a number": {"by": ["Flores.friction"]},
    "'peak_drive_torque' has no value in this run": {"of": ["peak_drive_torque"]},
    "no measure": {"of": []},
    "no parameter": {"by": []},
    "'gravity_direction' does not affect this run": {"by": ["gravity_direction"]},
    "no field 'clearanc'": {"by": ["Flores.clearanc"]},
    "change = 2.0": {"change": 2.0},
    "no joint 'B'": {"of": ["B.peak_force"]},
    "no drive 'Flores' with a peak_drive_torque; expected Flores.peak_force, ": {"of": ["Flores.peak_drive_torque"]},
}


@pytest.mark.parametrize("message", REFUSED)
def test_errors(message):
    """Contract: what has no gradient is refused in one line."""
    options = {"of": ["peak_force"], "by": ["Flores.clearance"], "until": 1e-3, "start": "as-placed"} | REFUSED[message]
    with one_line_error(match=message):
        sd.gradient(journals(), **options)


def test_a_largest_value_in_the_short_steps_of_a_tight_tolerance():
    """Identity: a maximum that round-off moves to the end of a step of 0.06 us has the derivative of a looser tolerance."""
    case = sd.read_case(Path(__file__).parents[2] / "examples" / "ring.toml")
    how = {"of": ["peak_drive_torque"], "by": ["unit 4/lower.restitution"], "until": 0.01, "method": "dop853"}
    loose, tight = (sd.gradient(case.mechanism, start=case.run.start, rtol=rtol, **how) for rtol in (1e-11, 1e-13))
    assert tight["derivative"].item() == pytest.approx(loose["derivative"].item(), rel=1e-7)


def test_the_end_of_a_run_at_a_locking_position_is_proposed():
    """Contract: derivatives grow without limit there; the proposed end has them."""
    crank = sd.slider_crank(crank=0.05, rod=0.04).driven(speed=2.0 * math.pi)
    says = r"no derivatives at t = 0.1475\d+ s: .*; expected a run that ends before this instant; for example until = 0.146 s"
    with pytest.raises(sd.ScissordynError, match=says):
        sd.gradient(crank, of=["peak_drive_torque"], by=["rod.mass"], until=1.0)
    assert sd.gradient(crank, of=["peak_drive_torque"], by=["rod.mass"], until=0.146)["derivative"].notnull().all()


def test_a_count_is_refused():
    """Contract: a number that cannot change by a small amount."""
    arm = sd.scissor(units=1).driven(sd.Trapezoidal(sd.degrees(30), sd.degrees(60), 1.0))
    with one_line_error(match=r"'drive\.strokes' is an integer"):
        sd.gradient(arm, of=["drive_work"], by=["drive.strokes"], until=1e-3)


@pytest.mark.parametrize(
    ("measure", "message"), [("impulse", "ideal joints have no contacts"), ("peak_force", "has no derivatives")]
)
def test_ideal_joints_are_refused(measure, message):
    """Contract: joints without clearance have a largest force without derivatives, and no other measure."""
    arm = sd.scissor(units=1).with_clearance("A", sd.Clearance(1e-4)).driven(speed=1.0)
    with one_line_error(match=message):
        sd.gradient(arm, of=[f"ideal joints.{measure}"], by=["A.clearance"], until=1e-3)


def test_a_parameter_that_the_mass_does_not_depend_on():
    """Identity: the derivative of a mass by a clearance is zero without round-off."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(1e-4)).driven(speed=1.0)
    assert sd.gradient(arm, of=["mass"], by=["A.clearance"], until=1e-4)["derivative"].item() == 0.0


def test_a_run_whose_contacts_only_graze():
    """Contract: a change of the speed with which a ball is thrown removes its only contact, unless the change is tiny."""
    balls = journals()
    body, speed = balls.bodies[0], math.sqrt(2.0 * 9.81 * CLEARANCE)
    ball = dataclasses.replace(body, velocity=(0.0, speed * (1.0 + 1e-6)))
    thrown = dataclasses.replace(balls, bodies=(ball,), joints=balls.joints[:1], gravity=9.81)
    wanted = {"of": ["first_contact"], "by": ["body.Flores.velocity.y"], "until": 0.0148, "start": "as-placed"}
    with one_line_error(match=r"only grazes: a change of .*velocity\.y. by 0\.1 % may"):
        sd.gradient(thrown, **wanted)
    found = sd.gradient(thrown, **wanted, change=1e-7)
    onset = speed / 9.81 * (1.0 + 1e-6 - math.sqrt((1.0 + 1e-6) ** 2 - 1.0))
    slope = -onset / (speed * (1.0 + 1e-6) - 9.81 * onset)
    assert found["derivative"].item() == pytest.approx(slope, rel=1e-6)


def test_a_contact_that_nearly_happens():
    """Closed form: a ball turns back 2e-4 of its clearance below its bearing at v/g, and a change of v by 1e-4 reaches it."""
    balls = journals()
    speed = math.sqrt(2.0 * 9.81 * CLEARANCE) * (1.0 - 1e-4)
    ball = dataclasses.replace(balls.bodies[0], velocity=(0.0, speed))
    thrown = dataclasses.replace(balls, bodies=(ball,), joints=balls.joints[:1], gravity=9.81)
    wanted = {"by": ["body.Flores.velocity.y", "body.Flores.mass"], "until": 0.02, "start": "as-placed", "trajectory": True}
    for change, limits in ((1.01e-4, ["near", ""]), (0.99e-4, ["", ""])):
        found = sd.gradient(thrown, **wanted, samples=2, change=change)
        assert found["limit"].values.tolist() == limits
        # the changed ball reaches its bearing a little before the first one turns back
        early = math.sqrt(2.0 * (change * speed**2 - (9.81 * CLEARANCE - 0.5 * speed**2))) / 9.81 if limits[0] else 0.0
        assert found["valid_until"].values == pytest.approx([speed / 9.81 - early if limits[0] else 0.02, 0.02], rel=1e-5)


def test_a_contact_that_grazes():
    """Closed form: the change of the speed that removes a contact, by the derivative of the approach speed."""
    balls = journals()
    ball = dataclasses.replace(balls.bodies[0], velocity=(0.0, math.sqrt(2.0 * 9.81 * CLEARANCE) * (1.0 + 1e-4)))
    thrown = dataclasses.replace(balls, bodies=(ball,), joints=balls.joints[:1], gravity=9.81)
    wanted = {"of": ["first_contact"], "by": ["body.Flores.velocity.y"], "until": 0.0145, "start": "as-placed"}
    with pytest.raises(sd.InputError, match="only grazes"):
        sd.gradient(thrown, **wanted, change=1.01e-4)
    found = sd.gradient(thrown, **wanted, change=0.99e-4)
    assert found["limit"].item() == ""


def test_a_second_peak_within_the_change():
    """Contract: the largest of two forces is not smooth if a change of the parameter makes the other one larger."""
    balls = journals()
    pair = [dataclasses.replace(joint, clearance=balls.joints[0].clearance) for joint in balls.joints[:2]]
    bodies = (balls.bodies[0], dataclasses.replace(balls.bodies[1], velocity=(SPEED * (1.0 + 5e-4), 0.0)))
    both = dataclasses.replace(balls, bodies=bodies, joints=tuple(pair))
    wanted = {"of": ["peak_force"], "by": [f"body.{bodies[1].name}.velocity.x"], "until": 2.4e-3, "start": "as-placed"}
    assert not sd.gradient(both, **wanted, change=1e-3)["smooth"].item()
    assert sd.gradient(both, **wanted, change=3e-4)["smooth"].item()


def test_derivatives_of_the_start_by_a_small_offset():
    """Cross-check: a length of zero, whose effect bends over much less than the mechanism's size, by other differences."""
    arm, path, step = sd.scissor(units=4).driven(speed=1.0), "body.unit 1/bar 1.points.start.x", 1e-5
    begin = Start(arm, "as-placed")
    slopes = derivatives(begin, parameter_of(arm, path, 8.0))
    ends = [begin.arrays_of(changed(arm, path, sign * step)) for sign in (1.0, -1.0)]
    for name in ("y", "parameters.linear", "work.value"):
        if name in slopes:
            expected = 8.0 * (ends[0][name] - ends[1][name]) / (2.0 * step)
            assert slopes[name] == pytest.approx(expected, abs=1e-8 * np.max(np.abs(expected)))
    assert "y" in slopes


def test_an_array_that_is_even_in_the_parameter():
    """Limit: an array that is zero and changes by the same amount in both directions has the derivative zero."""
    places, weights = CENTRAL_DIFFERENCES
    changed_arrays = [{"y": np.array([(1e-3 * place) ** 2])} for place in places]
    found = _differences({"y": np.zeros(1)}, changed_arrays, weights, 1e-3)["y"]
    assert found.error == 0.0
    assert found.values.tolist() == [0.0]


class Curve(Start):
    """Start whose array has a large constant and an angle, that of a point at the height of the parameter."""

    has_plain_numbers = False

    def arrays_of(self, height):
        return {"y": np.array([10.0, math.atan(height / 0.3)])}


def test_step_of_differences_at_the_start():
    """Closed form: the derivative of an angle by a height, for which the largest step has an error of 3e-11."""
    found = derivatives(Curve(0.01, "as-placed"), Parameter("height", 0.01, 1.0, "m", lambda height: height))
    assert found["y"][1] == pytest.approx(0.3 / (0.3**2 + 0.01**2), rel=2e-12)


@pytest.mark.parametrize("places", [(3, -2), (6, 1), (-6, -1)])
def test_arrays_that_are_linear_in_the_parameter(places):
    """Identity: two changes of a parameter give the slope of a line; a kink, a square or a cube is not a line."""
    step, value = 4e-3, 0.7

    def slopes(function):
        base, *moved = ({"y": np.array([function(place * step)])} for place in (0, *places))
        return _linear_slopes(base, dict(zip(places, moved, strict=True)), step)

    assert slopes(lambda x: value + 0.3 * x)["y"] == pytest.approx([0.3], rel=1e-13)
    for function in (
        lambda x: value + 1e-6 * x * x,
        lambda x: value + 1e-4 * x**3,
        lambda x: value + 1e-6 * abs(abs(x) - 5e-3),
    ):
        assert slopes(function) is None


@pytest.mark.parametrize("path", ["A.clearance", "A.restitution", "body.slider.mass", "drive.speed"])
def test_derivatives_of_the_start_from_fewer_mechanisms(path):
    """Cross-check: differences of sixth order of all arrays, each from a mechanism of its own, which is compiled alone."""
    case = sd.read_case(Path(__file__).parents[2] / "examples/paper.toml")
    begin, parameter, step = Start(case.mechanism, case.run.start), parameter_of(case.mechanism, path, 1.0), 4e-3
    places, weights = CENTRAL_DIFFERENCES
    several = [begin.arrays_of(parameter.moved(place * step)) for place in places]
    slopes, found = _differences(begin.arrays, several, weights, step), derivatives(begin, parameter)
    expected = {name: slope.values for name, slope in slopes.items()}
    for name in {*expected, *found}:
        size = np.max(np.abs(begin.arrays[name])) + np.max(np.abs(expected.get(name, 0.0)))
        assert found.get(name, 0.0) == pytest.approx(expected.get(name, 0.0), rel=1e-11, abs=1e-12 * size)


def guided(until: float):
    """Return the derivatives of the largest force of the example with a clearance guide."""
    case = sd.read_case(Path(__file__).parents[2] / "examples/clearance_guide.toml")
    return sd.gradient(case.mechanism, of=["peak_force"], by=["gravity", "body.rod.mass"], until=until)


def test_peak_before_contacts_with_large_derivatives():
    """Identity: the largest force, of an early contact, keeps its derivatives while those of later contacts grow."""
    short, long = guided(3e-3), guided(0.03)
    np.testing.assert_allclose(long["derivative"], short["derivative"], rtol=1e-5)
    assert short["smooth"].all()
    assert not long["smooth"].any()


@pytest.mark.slow
def test_peak_before_contacts_with_endless_derivatives():
    """Limit: later contacts whose derivatives are 1e11 leave the largest force right derivatives or none, not false ones."""
    short, longest = guided(3e-3), guided(0.1)
    assert short["value"].item() == pytest.approx(longest["value"].item(), rel=1e-9)
    unknown = np.isnan(longest["derivative"].values)
    assert unknown.any()
    np.testing.assert_allclose(longest["derivative"].values[~unknown], short["derivative"].values[~unknown], rtol=1e-4)
    assert not longest["smooth"].any()


def test_passes_in_any_number_of_threads(monkeypatch):
    """Identity: derivatives by more than eight parameters do not depend on the number of threads that compute the passes."""
    balls, found = journals(), []
    by = [path for path in every_number(balls) if path.endswith((".mass", ".clearance", "velocity.x", ".youngs_modulus"))]
    for threads in (1, 3):
        monkeypatch.setattr("scissordyn.sensitivity.gradient.processors", lambda threads=threads: threads)
        found.append(sd.gradient(balls, of=["peak_force", "peak_approach_speed"], by=by, until=3e-3, start="as-placed"))
    assert found[0].identical(found[1].assign_attrs(found[0].attrs))
    assert found[0].sizes["parameter"] == len(by)
    assert json.loads(found[1].attrs["statistics"])["runs"] == -(-len(by) // 8) > 1


def test_a_short_step_does_not_make_an_array_linear(monkeypatch):
    """Limit: round-off of a short step hides that an array bends, which is therefore decided at the largest step alone."""
    arm, path = sd.scissor(units=4).driven(speed=1.0), "body.unit 1/bar 1.points.start.x"
    used = []

    def slopes(base, known, step):
        used.append(step)
        return _linear_slopes(base, known, step)

    monkeypatch.setattr("scissordyn.sensitivity.seed._linear_slopes", slopes)
    derivatives(Start(arm, "as-placed"), parameter_of(arm, path, 8.0))
    assert set(used) == {4e-3}
