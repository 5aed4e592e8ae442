"""Backlash of couplings, and inputs of a prescribed output."""

import dataclasses
import json
import math

import numpy as np
import pytest

import scissordyn as sd
from test_couplings import ANGLE, TIGHT, coupled_arms, gear_pair


def test_backlash():
    """Closed form: instants at which a free wheel meets both flanks in turn, and how long and how hard, with elastic flanks."""
    driven = dataclasses.replace(gear_pair(-0.5), components=()).driven(speed=4.0, body="pinion")
    loose = sd.with_backlash(driven, "mesh", 0.02, stiffness=1e5, restitution=1.0)
    assert [body.name for body in loose.bodies] == ["pinion", "wheel", "mesh flanks"]
    assert sum(body.inertia or 0.0 for body in loose.bodies) == pytest.approx(0.07)
    run = sd.simulate(loose, until=0.2, **TIGHT)
    inertia, speed, stiffness = 0.99 * 0.05, 2.0, 1e5
    depth = (1.25 * inertia * speed**2 / stiffness) ** 0.4
    lasting = 2.0 * depth / speed * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)
    when = run["event_time"].values
    touches = 0.005 + np.arange(when.size // 2) * (lasting + 0.01)
    assert when.size == 22
    assert np.allclose(when[::2], touches, atol=1e-8)
    assert np.allclose(when[1::2], touches + lasting, atol=1e-8)
    assert list(run["event_name"].values[:4:2]) == ["mesh leading flank", "mesh trailing flank"]
    assert np.allclose(run["angle_stop_peak_torque"].values, stiffness * depth**1.5, rtol=1e-7)
    assert np.max(np.abs(run["energy_residual"].values)) < 1e-8
    # in mesh under a torque it moves as without backlash
    pressed = sd.simulate(sd.with_backlash(gear_pair(), "mesh", 0.02, stiffness=1e7, restitution=0.2), until=3.0)
    ideal = sd.simulate(gear_pair(), until=3.0)
    assert abs(float(pressed["angular_velocity"][-1, 0] / ideal["angular_velocity"][-1, 0]) - 1.0) < 0.02


def test_backlash_in_a_case_file(tmp_path):
    """Contract: the key opens the coupling as `with_backlash` does, and is written again where it gives the same bits."""
    bare = (
        dataclasses.replace(gear_pair(-0.5), components=())
        .driven(speed=4.0, body="pinion")
        .with_clearance("A", sd.Clearance(1e-5))
    )
    path = sd.write_case(bare, tmp_path / "case.toml")
    ratio = "ratio = -0.5\n"
    text = path.read_text(encoding="utf-8")
    for key, more in (
        ('"1.3 deg"', {}),
        ('{ angle = "1.3 deg", stiffness = 1e5, share = 0.02 }', {"stiffness": 1e5, "share": 0.02}),
    ):
        path.write_text(text.replace(ratio, f"{ratio}backlash = {key}\n"), encoding="utf-8")
        opened = sd.with_backlash(bare, "mesh", sd.degrees(1.3), **more)
        assert sd.read_case(path).mechanism == opened
        written = sd.case_text(opened)
        assert 'backlash = { angle = "1.3 deg"' in written
        assert "[[angle_stop]]" not in written
    wider = sd.read_case(path, ["coupling.mesh.backlash.angle=2 deg"]).mechanism
    assert wider == sd.with_backlash(bare, "mesh", sd.degrees(2.0), **more)
    # a flank of another place is no backlash of the key, and is written as what it is
    uneven = opened.replace("mesh leading flank.angle", 0.1)
    path.write_text(sd.case_text(uneven), encoding="utf-8")
    assert "[[angle_stop]]" in path.read_text(encoding="utf-8")
    assert sd.read_case(path).mechanism == uneven


def test_backlash_with_an_offset():
    """Limit: the wheel starts between its flanks, also where the offset of the coupling turns them."""
    gears = dataclasses.replace(gear_pair(-0.5), components=())
    offset = dataclasses.replace(gears.couplings[0], offset=0.3)
    opened = sd.with_backlash(dataclasses.replace(gears, couplings=(offset,)), "mesh", 0.02)
    assert opened.body("wheel").angle == pytest.approx(0.3)
    run = sd.simulate(opened, until=0.01)
    assert run.sizes["event"] == 0
    assert "rotated" not in run.attrs["warnings"]


def test_check_of_couplings(tmp_path, answer):
    """Contract: check says parts, ratio, sense and backlash, what can move, and where a wheel's centre can, as a run does."""
    loose = dataclasses.replace(gear_pair(-0.5), components=()).driven(speed=4.0, body="pinion")
    loose = sd.with_backlash(loose.with_clearance("B", sd.Clearance(1e-4)), "mesh", sd.degrees(1.0))
    said = answer("check", sd.write_case(loose, tmp_path / "case.toml"))
    assert "Coupling mesh: angle of wheel = -0.5 x angle of pinion, in opposite senses, backlash 1 deg." in said
    assert "3 degrees of freedom besides the drives." in said  # the wheel moves in its bearing, and turns between the flanks
    moving = "this clearance lets the centre of 'wheel' move by 0.1 mm"
    assert moving in said
    run = sd.simulate(loose, until=0.01)
    assert [(data["kind"], data["part"]) for data in json.loads(run.attrs["warning_data"])] == [
        ("unseen force", "mesh"),
        ("moving centre", "B"),
    ]
    many = sd.simulate_many(loose, {"B.clearance": np.array([1e-4])}, until=0.01, measures=("peak_force",))
    assert moving in str(many["warnings"].values[0])
    arms = coupled_arms()
    said = answer("check", sd.write_case(arms, tmp_path / "arms.toml"))
    assert "Coupling belt: angle of lower against upper = -0.6 x angle of upper + 13.75098" in said
    assert "1 degree of freedom besides the drives." in said


# Coupling with an impossible coordinate: the slide of a wheel that a pin holds
PUSHED = sd.Coupling("mesh", sd.Slide(("wheel", "c")), ANGLE("pinion"), 0.1)


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        (
            lambda: sd.simulate(gear_pair().with_parts({"couplings": (PUSHED,)}), until=0.1),
            "coupling 'mesh': one coordinate cannot move, so that it holds the other one; expected two coordinates",
        ),
        (lambda: sd.with_backlash(gear_pair(), "gear", 0.01), "no coupling 'gear'; expected one of mesh"),
        (lambda: sd.with_backlash(gear_pair(), "mesh", 0.0), "backlash = 0"),
        (
            lambda: sd.with_backlash(dataclasses.replace(gear_pair(), joints=()), "mesh", 0.01),
            "backlash at body 'wheel', which no pin holds on 'ground'",
        ),
    ],
)
def test_bad_backlash(wrong, line):
    """Contract: one line that says what came."""
    with pytest.raises(sd.InputError, match=line):
        wrong()


def test_a_slide_that_reverses_at_two_limits(tmp_path, answer):
    """Closed form: seven strokes at constant speed, each reversal rounded by one parabola, then rest."""
    low, high, stroke, ramp, mass = 0.1, 0.4, 0.5, 0.2, 2.0
    feed = sd.CoordinateDrive("feed", sd.Slide(("cart", "centre")), sd.Trapezoidal(low, high, stroke, ramp, strokes=7))
    cart = sd.point_mass("cart", mass=mass, position=(low, 0.0))
    mechanism = sd.Mechanism((cart,), guides=(sd.Guide("bed", ("cart", "centre")),), gravity=0.0, drives=(feed,))
    run = sd.simulate(mechanism, until=4.0, samples=401)
    phase = run["time"].values % (2.0 * stroke)
    into = np.minimum(phase, 2.0 * stroke - phase)  # time since it was at the lower limit, or until it is there
    speed, rounded = (high - low) / (stroke * (1.0 - ramp)), ramp * stroke
    near = np.minimum(into, stroke - into)  # time from the nearer limit
    way = np.where(near < rounded, 0.5 * speed / rounded * near**2, speed * (near - 0.5 * rounded))
    expected = np.where(into < 0.5 * stroke, low + way, high - way)
    expected[run["time"].values > 7 * stroke] = high
    assert np.allclose(run["coordinate_drive_value"].values[:, 0], expected, atol=1e-12)
    assert float(run["peak_coordinate_drive_force"][0]) == pytest.approx(mass * speed / rounded, rel=1e-10)
    assert abs(run["drive_work"].values[-1]) < 1e-12
    words = "Drive feed of the slide of cart.centre along 0 deg: "
    words += "trapezoidal, start 100 mm, end 400 mm, duration 500 ms, ramp 0.2, strokes 7."
    assert words in answer("check", sd.write_case(mechanism, tmp_path / "case.toml"))
    with pytest.raises(sd.InputError, match="strokes = 0"):
        sd.Trapezoidal(low, high, stroke, ramp, strokes=0)


def two_links():
    """Return two links whose tip is driven along a circle."""
    tip, turn = ("lower", "end"), 0.5 * math.pi
    arms = dataclasses.replace(coupled_arms(), couplings=())
    placed = (dataclasses.replace(arms.bodies[0], angle=1.2), dataclasses.replace(arms.bodies[1], position=None, angle=-0.3))
    across = sd.CoordinateDrive("x", sd.Slide(tip), sd.Harmonic(0.30, 0.03, 4.0, turn))
    up = sd.CoordinateDrive("y", sd.Slide(tip, turn), sd.Harmonic(0.22, 0.03, 4.0))
    return dataclasses.replace(arms, bodies=placed, coordinate_drives=(across, up))


def test_inverse_dynamics():
    """Second formulation: torques of shoulder and elbow for a circle of the tip, by the Jacobian and Lagrange's equations."""
    run = sd.inverse_dynamics(two_links(), {"shoulder": ANGLE("upper"), "elbow": ANGLE("lower", "upper")}, until=1.5)
    t, angle = run["time"].values, np.cumsum(run["input_value"].values, axis=1)
    l1, l2, m1, m2 = 0.3, 0.2, 1.0, 0.7
    assert np.allclose(l1 * np.cos(angle[:, 0]) + l2 * np.cos(angle[:, 1]), 0.3 + 0.03 * np.cos(4.0 * t), atol=1e-12)
    for (a, b), when, force in zip(angle, t, run["input_force"].values, strict=True):
        jacobian = np.array([[-l1 * np.sin(a), -l2 * np.sin(b)], [l1 * np.cos(a), l2 * np.cos(b)]])
        speed = np.linalg.solve(jacobian, [-0.12 * np.sin(4.0 * when), 0.12 * np.cos(4.0 * when)])
        turning = np.array([[-l1 * np.cos(a), -l2 * np.cos(b)], [-l1 * np.sin(a), -l2 * np.sin(b)]]) @ speed**2
        acceleration = np.linalg.solve(jacobian, [-0.48 * np.cos(4.0 * when), -0.48 * np.sin(4.0 * when)] - turning)
        h = 0.5 * m2 * l1 * l2
        mass = np.array([[(m1 / 3.0 + m2) * l1**2, h * np.cos(a - b)], [h * np.cos(a - b), m2 * l2**2 / 3.0]])
        moment = mass @ acceleration + h * np.sin(a - b) * np.array([speed[1] ** 2, -(speed[0] ** 2)])
        moment += 9.81 * np.array([(0.5 * m1 + m2) * l1 * np.cos(a), 0.5 * m2 * l2 * np.cos(b)])
        assert force == pytest.approx([moment.sum(), moment[1]], abs=1e-11)


def test_inverse_dynamics_where_there_is_none():
    """Contract: one line where outputs and inputs do not fit, have no authority, or pass a singular position."""
    links, crank = two_links(), sd.slider_crank(angle=1.0)
    turn = sd.CoordinateDrive("turn", ANGLE("crank"), sd.Polynomial((1.0, -4.01)))
    push = {"push": sd.Slide(("slider", "centre"))}
    cases = (
        (links, {"s": ANGLE("upper")}, "1 inputs for 2 driven coordinates"),
        (links, {"s": ANGLE("upper"), "t": ANGLE("upper")}, "input 's' and 't' cannot control 'x' and 'y'"),
        (coupled_arms(), {"s": ANGLE("upper")}, "without a driven coordinate"),
        (
            links.with_parts({"coordinate_drives": links.coordinate_drives[:1]}),
            {"s": ANGLE("upper")},
            "with 2 degrees of freedom",
        ),
        (links.with_clearance("B", sd.Clearance(1e-4)), {"s": ANGLE("upper")}, "inverse dynamics with clearance at 'B'"),
        (dataclasses.replace(crank, drives=(turn,)), push, "past a singular position"),
    )
    for mechanism, inputs, line in cases:
        with pytest.raises(sd.InputError, match=line):
            sd.inverse_dynamics(mechanism, inputs, until=1.0)
