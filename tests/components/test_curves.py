"""Loads, springs and motors by curves over position and speed, and gas springs."""

import dataclasses
import math
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from tests import build
from tests.build import on_pin

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.components.curve import curve_at, curve_knots
from scissordyn.record.summary import summary_of

from .shared import ENDS, METHODS, TIGHT, assert_balance, ball_on

# Points of a curve through which the interpolation passes
PAIRS = ((-0.2, 3.0), (0.1, 5.0), (0.35, 5.0), (0.5, -2.0), (1.2, 0.0))


ball = partial(ball_on, mass=0.8)


def wheel(*components, **more):
    """Return a disc of 0.02 kg m^2 on a pin."""
    return on_pin(build.wheel("disc", 0.02, **more), *components)


def test_curve_and_its_integral():
    """Cross-check: scipy's monotone cubic and its antiderivative, held beyond the ends."""
    curve, table = PchipInterpolator(*np.array(PAIRS).T), np.array([7.0, *curve_knots(PAIRS)])
    whole = curve.antiderivative()
    for place in np.linspace(-0.2, 1.2, 57):
        value, integral, beyond = curve_at(place, table, 1, len(PAIRS))
        assert value == pytest.approx(float(curve(place)), abs=1e-14)
        assert integral == pytest.approx(float(whole(place)), abs=1e-14)
        assert beyond == 0.0
    assert curve_at(-0.5, table, 1, 5) == pytest.approx((3.0, -0.9, 0.3))
    assert curve_at(1.3, table, 1, 5) == pytest.approx((0.0, float(whole(1.2)), 0.1))


def test_straight_curve_is_a_spring():
    """Identity: the curve of a linear spring."""
    curve = tuple((length, 30.0 * (length - 0.2)) for length in (0.01, 0.3, 0.7, 2.0))
    by_curve = sd.simulate(ball(sd.NonlinearSpring("s", *ENDS, curve, 0.1), velocity=(0.3, 0.0)), until=0.35, **TIGHT)
    linear = sd.simulate(ball(sd.Spring("s", *ENDS, 30.0, 0.2, 0.1), velocity=(0.3, 0.0)), until=0.35, **TIGHT)
    np.testing.assert_allclose(by_curve["position"], linear["position"], atol=1e-9)
    energy = by_curve["nonlinear_spring_energy"] - linear["spring_energy"].values
    assert np.ptp(energy.values) < 1e-9


@pytest.mark.parametrize("method", METHODS)
def test_progressive_spring(method):
    """Cross-check by a second formulation: a mass on a line by scipy, with scipy's curve."""
    pairs = ((0.02, -60.0), (0.1, -20.0), (0.3, 0.0), (0.5, 6.0), (0.9, 40.0))
    curve = PchipInterpolator(*np.array(pairs).T)
    mechanism = ball(sd.NonlinearSpring("s", *ENDS, pairs), place=(0.55, 0.0))
    run = sd.simulate(mechanism, until=1.5, samples=101, method=method, **TIGHT)
    exact = solve_ivp(
        lambda t, y: (y[1], -float(curve(y[0])) / 0.8),
        (0.0, 1.5),
        (0.55, 0.0),
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=run["time"].values,
    )
    np.testing.assert_allclose(run["position"][:, 0, 0], exact.y[0], atol=2e-8)
    assert_balance(run)
    assert float(run["nonlinear_spring_peak_beyond"][0]) == 0.0


@pytest.mark.parametrize("exponent", [1.0, 1.4])
def test_speed_that_a_gas_spring_gives(exponent):
    """Closed form: the work of a polytropic expansion becomes kinetic energy."""
    force, extended, stroke, progression = 40.0, 0.9, 0.6, 1.5
    spring = sd.GasSpring("strut", *ENDS, force, extended, stroke, progression, exponent)
    run = sd.simulate(ball(spring, place=(0.35, 0.0)), until=0.08, **TIGHT)
    gas = stroke / (1.0 - 1.0 / progression)

    def stored(length):
        part = 1.0 - (extended - length) / gas
        if exponent == 1.0:
            return -force * gas * np.log(part)
        return force * gas * (part ** (1.0 - exponent) - 1.0) / (exponent - 1.0)

    length, speed = run["gas_spring_length"].values[:, 0], run["velocity"].values[:, 0, 0]
    work = stored(np.array(0.35)) - stored(length)
    assert length.max() > 0.45
    np.testing.assert_allclose(0.4 * speed**2, work, atol=1e-9 * work.max())
    first = force * (1.0 - 0.55 / gas) ** -exponent
    assert float(run["gas_spring_force"][0, 0]) == pytest.approx(-first, rel=1e-14)
    assert_balance(run)


def test_catalogue_forces_of_a_gas_spring():
    """Closed form: pressed in slowly it gives the progression, with its friction in and out."""
    spring = sd.GasSpring(
        "strut", ("ground", "O"), ("slider", "centre"), 200.0, 0.45, 0.25, 1.4, friction=15.0, friction_speed=0.2
    )
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=0.0)
    crank = dataclasses.replace(crank, components=(spring,), ground=(*crank.ground, ("O", (0.0, 0.0))))
    run = sd.simulate(crank.driven(speed=2.0 * math.pi), until=1.0, samples=1001, **TIGHT)
    rate = run["velocity"].sel(body="slider", axis="x").values
    # the trapezoidal rule is exact for a smooth periodic function
    lost = np.trapezoid(15.0 * np.tanh(rate / 0.2) * rate, run["time"].values)
    assert float(run["dissipated_energy"][-1]) == pytest.approx(lost, rel=1e-7)
    pressed = 0.45 - run["gas_spring_length"].values[:, 0]
    push = 200.0 / (1.0 - pressed * (1.0 - 1.0 / 1.4) / 0.25)
    np.testing.assert_allclose(-run["gas_spring_force"].values[:, 0], push - 15.0 * np.tanh(rate / 0.2), rtol=1e-12)
    assert_balance(run)


def test_work_of_a_press():
    """Closed form: over a turn a force does no work in both senses, and in one the area below its curve."""
    loads = [
        sd.StrokeLoad("cut", ("slider", "centre"), 0.0, ((0.15, 0.0), (0.3, -120.0), (0.45, -240.0)), acts, transition=2e-3)
        for acts in ("both", "forward", "backward")
    ]
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=0.0, angle=math.pi)
    works = []
    for load in loads:
        run = sd.simulate(
            dataclasses.replace(crank, components=(load,)).driven(speed=1.0), until=2.0 * math.pi, samples=101, **TIGHT
        )
        assert_balance(run, 1e-6)
        works.append(float(run["load_work"][-1]))
    area = 0.5 * 800.0 * ((0.4 - 0.15) ** 2 - (0.2 - 0.15) ** 2)
    np.testing.assert_allclose(works, (0.0, -area, area), atol=1e-3 * area)


def test_periodic_torque():
    """Closed form: the energy that a turn adds; the curve repeats smoothly at its ends."""
    curve = tuple((math.radians(angle), torque) for angle, torque in ((0, 1.0), (120, 3.0), (240, 2.0), (360, 1.0)))
    run = sd.simulate(wheel(sd.AngleLoad("gas", "disc", curve, periodic=True), angle=0.0), until=2.0, samples=2001, **TIGHT)
    angle = run["angle"].values[:, 0]
    three = np.array([(place + 2.0 * math.pi * turn, torque) for turn in range(-1, 60) for place, torque in curve[:-1]])
    whole = PchipInterpolator(*three.T).antiderivative()
    work = whole(angle) - whole(0.0)
    assert angle[-1] > 8.0 * math.pi
    np.testing.assert_allclose(0.01 * run["angular_velocity"].values[:, 0] ** 2, work, atol=2e-9 * work.max())
    assert_balance(run)
    assert "leaves" not in run.attrs["warnings"]


def test_straight_torque_speed_curve_is_a_motor():
    """Identity: behind a gear of ratio 2 a motor of half the torque and twice the speed."""
    line = tuple((speed, 1.5 * (1.0 - speed / 60.0)) for speed in (-10.0, 0.0, 30.0, 70.0))
    by_curve = sd.simulate(wheel(sd.TabulatedMotor("m", "disc", line, ratio=2.0, inertia=0.01)), until=1.0, **TIGHT)
    linear = sd.simulate(wheel(sd.Motor("m", "disc", 3.0, 30.0, inertia=0.01)), until=1.0, **TIGHT)
    np.testing.assert_allclose(by_curve["angular_velocity"], linear["angular_velocity"], atol=1e-9)
    np.testing.assert_allclose(by_curve["motor_work"], linear["motor_work"], atol=1e-8)
    needed = sd.torque_over_speed(by_curve)
    assert needed.attrs["of"] == "m"
    np.testing.assert_allclose(needed["torque"][0], 3.0)


def test_run_up_of_an_asynchronous_motor():
    """Closed form: where torque of motor and load are equal the speed stays."""
    curve = ((-5.0, 4.0), (0.0, 4.0), (100.0, 7.0), (150.0, 0.0), (200.0, -7.0))
    load = sd.Torque("load", "disc", -3.5)
    run = sd.simulate(wheel(sd.TabulatedMotor("m", "disc", curve), load), until=6.0, **TIGHT)
    speed = float(run["angular_velocity"][-1, 0])
    assert float(PchipInterpolator(*np.array(curve).T)(speed)) == pytest.approx(3.5, rel=1e-9)
    assert speed > 100.0
    assert_balance(run)


def cart(*components, speed=0.0):
    """Return a cart of 2 kg on a rail of another cart of 3 kg; both are free along the rail."""
    bodies = tuple(
        dataclasses.replace(sd.point_mass(name, mass=mass, position=(x, 0.0)), velocity=(v, 0.0))
        for name, mass, x, v in (("cart", 2.0, 0.5, speed), ("base", 3.0, 0.0, 0.0))
    )
    guides = tuple(sd.Guide(f"rail of {body.name}", (body.name, "centre")) for body in bodies)
    return sd.Mechanism(bodies, guides=guides, components=components, ground=(("foot", (-1.0, 0.0)),))


@pytest.mark.parametrize("method", METHODS)
def test_exponential_approach_of_a_linear_motor(method, tmp_path):
    """Closed form: a straight curve and a load give v = v_e (1 - exp(-F_0 t/(m v_0))), v_e = v_0 (1 - F_L/F_0)."""
    line = tuple((v, 40.0 * (1.0 - v / 0.8)) for v in (-0.2, 0.0, 0.5, 1.0))
    drive = sd.LinearMotor("m", ("ground", "foot"), ("cart", "centre"), line)
    mechanism = cart(drive, sd.Force("load", ("cart", "centre"), (-10.0, 0.0)))
    run = sd.simulate(mechanism, until=0.3, samples=101, method=method, **TIGHT)
    t = run["time"].values
    speed = 0.6 * -np.expm1(-40.0 * t / (2.0 * 0.8))
    np.testing.assert_allclose(run["velocity"].sel(body="cart", axis="x"), speed, atol=1e-9)
    np.testing.assert_allclose(run["linear_motor_force"][:, 0], -40.0 * (1.0 - speed / 0.8), atol=1e-7)
    way = 0.6 * (t - 0.04 * -np.expm1(-t / 0.04))
    # work of the motor: kinetic energy and what the load takes
    np.testing.assert_allclose(run["motor_work"], speed**2 + 10.0 * way, atol=1e-9)
    assert_balance(run)
    assert sd.read_case(sd.write_case(mechanism, tmp_path / "cart.toml")).mechanism == mechanism


def test_power_of_a_cylinder_between_two_bodies():
    """Closed form: action and reaction keep the momentum; on the hyperbola F = P/v the kinetic energy grows as P t."""
    speeds = np.geomspace(0.2, 4.0, 400)
    pump = sd.LinearMotor(
        "m", ("base", "centre"), ("cart", "centre"), ((-1.0, 60.0), *((v, 12.0 / v) for v in speeds.tolist()))
    )
    run = sd.simulate(cart(pump, speed=0.25), until=0.4, **TIGHT)
    velocity = run["velocity"].sel(axis="x")
    np.testing.assert_allclose(2.0 * velocity.sel(body="cart") + 3.0 * velocity.sel(body="base"), 0.5, atol=1e-9)
    kinetic = run["kinetic_energy"].values - run["kinetic_energy"].values[0]
    np.testing.assert_allclose(kinetic, 12.0 * run["time"].values, atol=1e-4 * kinetic[-1])
    assert float(run["linear_motor_peak_beyond"][0]) == 0.0
    assert [(part.name, part.unit) for part in summary_of(run).actuators] == [("m", "N")]
    fast = sd.simulate(cart(pump, speed=4.5), until=0.01)
    assert "linear motor 'm' leaves its curve or stroke by up to 0.5" in fast.attrs["warnings"]


def test_warning_where_a_stroke_is_left():
    """Limit: the largest distance beyond a curve is located and said, in a run, in statics and in batches."""
    load = sd.StrokeLoad("cut", ("slider", "centre"), 0.0, ((0.25, 0.0), (0.41, -10.0)))
    crank = dataclasses.replace(sd.slider_crank(crank=0.1, rod=0.3, gravity=0.0), components=(load,)).driven(speed=1.0)
    run = sd.simulate(crank, until=3.0)
    assert float(run["stroke_load_peak_beyond"][0]) == pytest.approx(
        0.25 - 0.1 * (math.sqrt(9 - math.sin(3.0) ** 2) + math.cos(3.0))
    )
    for found in (run, sd.statics(crank, until=3.0)):
        assert "stroke load 'cut' leaves its curve or stroke by up to 0.04" in found.attrs["warnings"]
        assert "(t = 3 s), where its force is constant" in found.attrs["warnings"]


@pytest.mark.parametrize(
    ("part", "text"),
    [
        (lambda: sd.StrokeLoad("cut", ("ball", "centre"), 0.0, ((0.3, 1.0),)), "stroke load 'cut': the curve has 1 pairs"),
        (
            lambda: sd.NonlinearSpring("s", *ENDS, ((0.3, 1.0), (0.2, 2.0))),
            r"nonlinear spring 's': the curve has 2 pairs at \[0.3, 0.2\]; expected two or more lengths, which increase, and "
            "as many forces",
        ),
        (
            lambda: sd.AngleLoad("gas", "disc", ((0.0, 1.0), (6.0, 2.0)), periodic=True),
            "angle load 'gas': the periodic curve begins with 1 and ends with 2; expected equal values",
        ),
        (
            lambda: sd.GasSpring("strut", *ENDS, 1.0, 0.5, 0.5),
            "gas spring 'strut': a stroke of 0.5 m of a length of 0.5 m; expected a stroke below the extended length",
        ),
        (
            lambda: sd.simulate(ball(sd.StrokeLoad("cut", ("ball", "centre"), 0.0, ((0.6, 1.0), (0.9, 1.0)))), until=0.1),
            "stroke load 'cut': its curve goes from 0.6 to 0.9 m, and the start is at 0.5 m; expected a curve that covers",
        ),
        (
            lambda: sd.simulate(ball(sd.GasSpring("g", *ENDS, 1.0, 0.4, 0.2)), until=0.1),
            "gas spring 'g': its curve goes from 0.2 to 0.4 m, and the start is at 0.5 m",
        ),
    ],
)
def test_refused(part, text):
    with pytest.raises(sd.InputError, match=text):
        part()


@pytest.mark.parametrize("kind", ["scissor", "slider-crank", "four-bar", "mast", "ring"])
def test_new_cases_have_parts_that_fit(kind, tmp_path, capsys):
    """Contract: `new --with` writes curves that cover the stroke; a motor can have a stop."""
    parts = "nonlinear_spring,gas_spring,stroke_load,angle_load"
    for wanted in (parts, "tabulated_motor", "linear_motor"):
        assert status_of(["new", kind, "--with", wanted]) == 0
        path = tmp_path / "case.toml"
        path.write_text(capsys.readouterr().out, encoding="utf-8")
        case = sd.read_case(path)
        assert {part.declaration.section for part in case.mechanism.components} - {"angle_stop"} == set(wanted.split(","))
        assert "leaves its curve" not in sd.simulate(case.mechanism.ideal(), until=0.2, samples=11).attrs["warnings"]
