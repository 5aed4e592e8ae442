"""Actuators and tracking controllers, against closed forms and second descriptions of the same torque."""

import math

import numpy as np
import pytest
from tests.build import balanced, hanging

import scissordyn as sd
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.control.controller import Controller
from scissordyn.model.commanded import commanded
from scissordyn.plugin.element import ELEMENT_PARAMETERS_MAX
from scissordyn.run.inverse_dynamics import feed_forward

TIGHT = {"rtol": 1e-11, "atol": 1e-11, "samples": 101}  # Options of `simulate` for accurate runs
INERTIA = 0.45  # Moment of inertia of the bar about its pin [kg m^2]


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_proportional_derivative(method):
    """Closed form: with PD feedback a free bar is a damped oscillator about the reference."""
    controlled = hanging().controlled(sd.PID(30.0, 0.9), reference=sd.Polynomial((0.5,)), start_on_reference=False)
    run = sd.simulate(controlled, until=2.0, method=method, **TIGHT)
    decay = 0.9 / (2.0 * INERTIA)
    frequency, t = math.sqrt(30.0 / INERTIA - decay**2), run["time"].values
    exact = 0.5 - 0.2 * np.exp(-decay * t) * (np.cos(frequency * t) + decay / frequency * np.sin(frequency * t))
    assert np.allclose(run["angle"][:, 0], exact, atol=1e-9)
    assert np.allclose(run["control_error"][:, 0], 0.5 - exact, atol=1e-9)
    assert balanced(run)


def test_moving_reference():
    """Closed form: with the reference a t + b t^2 the error of PD feedback settles where k_p e is the torque I 2 b."""
    controlled = hanging().controlled(sd.PID(400.0, 20.0), reference=sd.Polynomial((0.3, 1.0, 0.5)))
    run = sd.simulate(controlled, until=3.0, **TIGHT)
    assert float(run["angular_velocity"][0, 0]) == pytest.approx(1.0, rel=1e-12)
    assert float(run["control_error"][-1, 0]) == pytest.approx(INERTIA * 1.0 / 400.0, rel=1e-7)


def test_error_counts_turns():
    """Closed form: turns are counted, so that a reference a full revolution away is reached by turning that far."""
    for reference in (0.5, 0.5 + 2.0 * math.pi):
        driven = hanging(gravity=0.0).controlled(
            sd.PID(30.0, 9.0), reference=sd.Polynomial((reference,)), start_on_reference=False
        )
        run = sd.simulate(driven, until=20.0, **TIGHT)
        assert float(run["angle"][-1, 0]) == pytest.approx(reference, abs=1e-9)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_integral_removes_the_error(method):
    """Closed form: the integral ends up carrying the weight, m g l cos(th)/2, with no error; without it the error stays."""
    reference = sd.Polynomial((0.6,))
    tight = {"until": 12.0, "method": method, "rtol": 1e-10, "atol": 1e-10}
    run = sd.simulate(hanging(gravity=9.81).controlled(sd.PID(60.0, 12.0, 90.0), reference=reference), **tight)
    weight = 9.81 * 0.5 * math.cos(0.6)
    assert abs(float(run["control_error"][-1, 0])) < 1e-6
    assert float(run["integral_torque"][-1, 0]) == pytest.approx(weight, rel=1e-5)
    assert balanced(run, 1e-7)
    without = sd.simulate(hanging(gravity=9.81).controlled(sd.PID(60.0, 12.0), reference=reference), **tight)
    sagged = float(without["control_error"][-1, 0])
    assert 60.0 * sagged == pytest.approx(9.81 * 0.5 * math.cos(0.6 - sagged), rel=1e-6)


@pytest.mark.parametrize(
    ("law", "rotor", "until", "power", "factor"),
    [
        (sd.PID(1e4, limit=0.9), 0.0, 1.0, 2, 1.0),
        (sd.PID(1e4, limit=2.7, ramp=1.0), 0.0, 0.9, 3, 1.0),
        (sd.PID(1e4, limit=0.9), INERTIA, 1.0, 2, 0.5),
    ],
    ids=["limit", "ramp", "rotor"],
)
def test_limited_torque_is_exact(law, rotor, until, power, factor):
    """Closed form: uniform acceleration at the limit, t^3 while it rises, half of it with a rotor of the bar's inertia."""
    steered = hanging().controlled(law, reference=sd.Polynomial((2.5,)), start_on_reference=False, inertia=rotor)
    run = sd.simulate(steered, until=until, **TIGHT)
    assert np.allclose(run["angle"][:, 0], 0.3 + factor * run["time"] ** power, atol=1e-9)
    assert law.ramp or np.all(run["control_torque"] == 0.9)


def test_integral_does_not_wind_up():
    """Limit: at its limit the integral stops where the commanded torque exceeds the limit by k_i e T_t; no windup."""
    wall = sd.TorsionSpring("wall", "rod", stiffness=1e6, free_angle=0.3, damping=1e3)
    run = sd.simulate(
        hanging(wall).controlled(
            sd.PID(1.0, 0.0, 50.0, limit=2.0, tracking_time=0.01), reference=sd.Polynomial((1.3,)), start_on_reference=False
        ),
        until=0.5,
        method="rodas5p",
    )
    # e stays 1 to within 2e-6: z' = 50 e + (2 - e - z)/0.01 = 0
    assert float(run["integral_torque"][-1, 0]) == pytest.approx(2.0 - 1.0 + 0.5, rel=1e-5)


def test_feedback_is_a_hinge_spring():
    """Cross-check: PD feedback between two free bars acts like a hinge spring with a damper, whatever its base does."""
    spin = {"angular_velocity": 1.5}
    one = sd.Body("one", 1.0, 0.1, {"start": (0.0, 0.0), "end": (1.0, 0.0)}, centre=(0.5, 0.0), angle=0.2, **spin)
    other = sd.Body(
        "other", 2.0, 0.3, {"start": (0.0, 0.0)}, centre=(0.4, 0.1), angle=1.0, position=(math.cos(0.2), math.sin(0.2))
    )
    pins = (sd.Revolute("pin", ("one", "start"), ("ground", "O")), sd.Revolute("elbow", ("other", "start"), ("one", "end")))
    arm = sd.Mechanism((one, other), joints=pins, ground=(("O", (0.0, 0.0)),))
    hinge = sd.TorsionSpring("hinge", "other", "one", stiffness=40.0, free_angle=0.5, damping=0.8)
    servo = sd.Actuator("servo", "other", sd.PID(40.0, 0.8), base="one", reference=sd.Polynomial((0.5,)))
    for method in ("dop853", "rodas5p"):
        sprung, steered = (
            sd.simulate(arm.replace("components", (element,)), until=0.6, method=method, **TIGHT) for element in (hinge, servo)
        )
        assert np.allclose(sprung["angle"], steered["angle"], atol=1e-8)
        assert np.allclose(sprung["torsion_spring_torque"][:, 0], steered["control_torque"][:, 0], atol=1e-6)
        assert np.allclose(sprung["reaction"], steered["reaction"], atol=1e-5)


def test_actuators_add_up():
    """Contract: two actuators of half the gain are one of the whole gain."""
    reference = sd.Harmonic(0.3, 0.2, 5.0)
    whole = sd.simulate(hanging().controlled(sd.PID(50.0, 4.0), reference=reference), until=1.0, **TIGHT)
    half = hanging().controlled(sd.PID(25.0, 2.0), reference=reference).controlled(sd.PID(25.0, 2.0), reference=reference)
    split = sd.simulate(half, until=1.0, **TIGHT)
    assert split.sizes["actuator"] == 2
    assert np.allclose(whole["angle"], split["angle"], atol=1e-10)
    assert np.allclose(whole["control_torque"][:, 0], split["control_torque"].sum("actuator"), atol=1e-8)


def test_feed_forward_is_the_drive():
    """Cross-check: the torque of a drive as feed-forward moves the ideal array along the same motion."""
    arm, reference = sd.scissor(units=2), sd.Cycloidal(math.radians(30), math.radians(60), 0.5)
    torque = feed_forward(arm, reference, until=0.5)
    driven = sd.simulate(arm.driven(reference), until=0.5, **TIGHT)
    fed = sd.simulate(arm.controlled(sd.FeedForward(), reference=reference, feed_forward=torque), until=0.5, **TIGHT)
    assert np.allclose(driven["angle"], fed["angle"], atol=1e-8)
    assert np.allclose(driven["drive_torque"], fed["control_torque"][:, 0], rtol=1e-8, atol=1e-6)
    assert balanced(fed)


def test_feed_forward_turns_the_rotor(tmp_path):
    """Closed form: the torque for bar and rotor together, in Python, in a case file and in a preview."""
    reference, rotor = sd.Cycloidal(0.3, 2.0, 1.0), 0.5
    times = np.linspace(0.0, 1.0, 2001)
    turn = 2.0 * math.pi
    rate = 1.7 * turn * np.sin(turn * times)
    angle = 0.3 + 1.7 * (times - np.sin(turn * times) / turn)
    wanted = (0.2 + 0.25 + rotor) * rate + 9.81 * 0.5 * np.cos(angle)
    servo = hanging(gravity=9.81).controlled(sd.FeedForward(), reference=reference, inertia=rotor)
    np.testing.assert_allclose(feed_forward(servo, reference, until=1.0).values, wanted, atol=1e-9)
    torque = sd.ideal_kinematics(commanded(servo), until=1.0)["drive_torque"]
    np.testing.assert_allclose(torque, np.interp(torque["time"], times, wanted), atol=1e-3)
    table = '[control]\ncontroller = { name = "feed-forward" }\nfeed_forward = "ideal"\ninertia = "0.5 kg m^2"\n'
    motion = 'reference = { cycloidal = { start = "0.3 rad", end = "2 rad", duration = "1 s" } }\n'
    sd.write_case(hanging(gravity=9.81), tmp_path / "bar.toml", run=sd.Options(1.0))
    case = tmp_path / "servo.toml"
    case.write_text((tmp_path / "bar.toml").read_text() + table + motion)
    run = sd.simulate(sd.read_case(case).mechanism, until=1.0, **TIGHT)
    assert float(run["angle"][-1, 0]) == pytest.approx(2.0, abs=1e-7)


def test_feed_forward_is_that_of_rigid_bars():
    """Cross-check: bars that bend and are loose have the feed-forward torque of the ideal array of rigid ones."""
    arm, reference = sd.scissor(units=2), sd.Cycloidal(math.radians(30), math.radians(60), 0.5)
    tubes = sd.with_bending(arm.with_clearance("A", sd.Clearance(5e-4)), bending_stiffness=1e4, axial_stiffness=1e7)
    torques = [feed_forward(array, reference, until=0.5, samples=101).values for array in (tubes, arm)]
    assert torques[0] == pytest.approx(torques[1], rel=1e-6, abs=1e-6)


@sd.element(slot="controller")
def steer(
    reference_speed, error, speed, sensor_x, sensor_y, sensor_rate_x, sensor_rate_y, feed_forward, stiffness, damping, radial
):
    """Return the torque of PD feedback, feed-forward and damping of the eccentricity's rate, written out."""
    outward = (sensor_x * sensor_rate_x + sensor_y * sensor_rate_y) / math.sqrt(sensor_x**2 + sensor_y**2 + 1e-10)
    return feed_forward + stiffness * error + damping * (reference_speed - speed) - radial * outward


def test_user_controller():
    """Cross-check: a user's function for the same torque gives an array with clearance the same motion as the built-in one."""
    arm, reference = (
        sd.scissor(units=2).with_clearance("A", sd.Clearance(5e-4)),
        sd.Cycloidal(math.radians(30), math.radians(60), 1.0),
    )
    torque = feed_forward(arm, reference, until=0.02)
    chosen = sd.FeedForward(2e4, 1500.0, eccentricity_rate_damping=300.0), steer(2e4, 1500.0, 300.0)
    runs = [
        sd.simulate(arm.controlled(law, reference=reference, feed_forward=torque, sensor="A"), until=0.02) for law in chosen
    ]
    assert runs[0].sizes["contact"] >= 2
    assert np.allclose(runs[0]["contact_start"], runs[1]["contact_start"], rtol=1e-9)
    assert np.allclose(runs[0]["control_torque"], runs[1]["control_torque"], rtol=1e-8)


@pytest.mark.parametrize("friction", [sd.NoFriction(), sd.LuGre(0.05)])
def test_energy_balance_closes_with_everything(friction):
    """Identity: the energy balance closes with feedback, integral, rate damping, limit and contacts together."""
    arm, reference = (
        sd.scissor(units=2).with_clearance("A", sd.Clearance(5e-4, friction=friction)),
        sd.Cycloidal(math.radians(30), 1.0, 1.0),
    )
    law = sd.FeedForward(2e4, 1500.0, 1e5, limit=600.0, ramp=0.01, eccentricity_rate_damping=-300.0)
    torque = feed_forward(arm, reference, until=0.04)
    run = sd.simulate(arm.controlled(law, reference=reference, feed_forward=torque, sensor="A"), until=0.04)
    assert run.attrs["status"] == "complete"
    assert run.sizes["contact"] > 2
    assert balanced(run, 1e-6)
    assert float(np.abs(run["control_torque"]).max()) <= 600.0


def test_replay():
    """Identity: a controlled run is run again from its attributes, bit for bit."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(5e-4))
    run = sd.simulate(arm.controlled(sd.PID(2e4, 1500.0, 1e4), speed=0.5, sensor="A"), until=0.01, samples=11)
    again = sd.replay(run)
    for name in ("angle", "control_torque", "integral_torque", "normal_force"):
        assert np.array_equal(again[name].values, run[name].values, equal_nan=True)


def test_catalogue():
    """Contract: every controller of the folders keeps the contract."""
    made = {"pid": sd.PID(1.0), "feed-forward": sd.FeedForward(), "none": sd.NoControl()}
    made |= {name: CONTROLLERS[name](1.0, 0.5) for name in ("filtered-pd", "pyragas", "extended")}
    assert set(made) == set(CONTROLLERS)
    for name, law in made.items():
        assert isinstance(law, Controller)
        assert law.name == name
        assert len(law.parameters()) <= ELEMENT_PARAMETERS_MAX
        assert sd.controller(name) is type(law)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sd.controller("pdi"), "did you mean 'pid'"),
        (lambda: sd.PID(-1.0), "proportional = -1.0"),
        (lambda: sd.PID(1.0, ramp=0.1), "requires a limit"),
        (lambda: CONTROLLERS["pyragas"](1.0, 0.5, recorded="sped"), "did you mean 'speed'"),
        (lambda: hanging().controlled(sd.FeedForward(eccentricity_rate_damping=1.0)), "requires a sensor"),
        (lambda: hanging().controlled(sd.PID(1.0), feed_forward=sd.Polynomial((1.0,))), "does not use a feed-forward"),
        (lambda: hanging().controlled(sd.PID(1.0), sensor="pni"), "did you mean 'pin'"),
        (lambda: hanging().controlled(sd.PID(1.0), sensor=("rod", "tip")), "point 'tip'"),
        (lambda: hanging().controlled(sd.PID(1.0), reference=sd.Polynomial((0.0,)), speed=1.0), "both reference and speed"),
        (lambda: hanging().controlled(sd.element(slot="controller", delay=1.0)(lambda error: error)()), "recorded = ''"),
    ],
)
def test_errors(make, words):
    """Contract: wrong input is refused with its name."""
    with pytest.raises(sd.InputError, match=words):
        make()
