"""Payloads, panels and angulated bars compared with other compositions of their masses; friction in many pins at once."""

import dataclasses
import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd

TIGHT = {"until": 1.0, "rtol": 1e-12, "atol": 1e-12, "samples": 51}  # Options of `simulate` for accurate runs


def pendulum(*more, joints=(), welds=()):
    """Return a bar of 1 m and 2 kg that rotates about its start, with further bodies."""
    rod = sd.bar("rod", length=1.0, mass=2.0, angle=0.3)
    pin = sd.Revolute("pin", ("rod", "start"), ("ground", "origin"))
    return sd.Mechanism((rod, *more), joints=(pin, *joints), welds=welds, ground=(("origin", (0.0, 0.0)),))


def angle(mechanism):
    """Return the angle of the rod over time."""
    return sd.simulate(mechanism, **TIGHT)["angle"].sel(body="rod").values


def test_payload_oscillates_as_a_pinned_mass():
    """Cross-check: a payload moves as a separate body on a pin, to 1e-10 rad over 1 s."""
    tip = math.cos(0.3), math.sin(0.3)
    ball = sd.point_mass("ball", mass=3.0, position=tip)
    pinned = pendulum(ball, joints=(sd.Revolute("tip", ("ball", "centre"), ("rod", "end")),))
    loaded = sd.with_payload(pendulum(), ("rod", "end"), 3.0)
    assert np.allclose(angle(loaded), angle(pinned), rtol=0, atol=1e-10)


def test_panel_oscillates_as_a_welded_bar():
    """Cross-check: a panel over half of a bar moves as a separate bar that is welded on, to 1e-10 rad over 1 s."""
    panel = sd.bar("panel", length=0.5, mass=3.0, angle=0.3)
    welded = pendulum(panel, welds=(sd.Weld("seam", ("rod", "start"), ("panel", "start")),))
    loaded = sd.with_panels(pendulum(), "rod", 3.0, end="middle")
    assert np.allclose(angle(loaded), angle(welded), rtol=0, atol=1e-10)


def test_payload_inertia_slows_the_oscillation():
    """Closed form: small oscillations of a bar with a disc at its end have w^2 = g (m L/2 + M L)/(m L^2/3 + M L^2 + I)."""
    hanging = pendulum()
    low = dataclasses.replace(hanging.body("rod"), angle=-0.5 * math.pi + 1e-3)
    hanging = sd.with_payload(hanging.replace("bodies", (low,)), ("rod", "end"), 3.0, inertia=0.8)
    w = math.sqrt(9.81 * (1.0 + 3.0) / (2.0 / 3.0 + 3.0 + 0.8))
    oscillation = angle(hanging) + 0.5 * math.pi
    # the period of a oscillation of 1e-3 differs by 1e-3^2/16 = 6e-8 of itself from that of a small one
    assert np.allclose(oscillation, 1e-3 * np.cos(w * np.linspace(0.0, 1.0, 51)), rtol=0, atol=1e-3 * 1e-6)


def test_payload_at_a_joint():
    """Identity: a payload at a joint belongs to the journal's body; on a slider it only adds mass."""
    arm = sd.scissor(units=2)
    assert sd.with_payload(arm, "unit 1/upper", 2.0) == sd.with_payload(arm, ("unit 1/bar 1", "end"), 2.0)
    slider = sd.with_payload(arm, ("slider", "centre"), 2.0).body("slider")
    marked = {**arm.body("slider").points, "payload": (0.0, 0.0)}
    assert slider == dataclasses.replace(arm.body("slider"), mass=7.0, points=marked, payloads=(2.0,))


def test_panels_on_bars_of_a_pattern():
    """Contract: a pattern puts a panel on each bar that it matches, and on no other body."""
    arm = sd.with_panels(sd.scissor(units=3), "unit */bar 1", 2.0)
    heavier = [body.name for body in arm.bodies if body.mass == pytest.approx(7.68)]
    assert heavier == ["unit 1/bar 1", "unit 2/bar 1", "unit 3/bar 1"]
    assert arm.body("unit 1/bar 1").inertia == pytest.approx(7.68 * 4.0 / 12.0, rel=1e-14)


@pytest.mark.parametrize(
    ("load", "hint"),
    [
        (lambda arm: sd.with_payload(arm, "unit 1/up", 1.0), "did you mean 'unit 1/upper'"),
        (lambda arm: sd.with_payload(arm, ("unit 1/bar 1", "mid"), 1.0), "did you mean 'middle'"),
        (lambda arm: sd.with_payload(arm, ("ground", "origin"), 1.0), "ground"),
        (lambda arm: sd.with_payload(arm, "A", 0.0), "from 1e-12"),
        (lambda arm: sd.with_payload(arm, "A", 1.0, inertia=-1.0), "from 0"),
        (lambda arm: sd.with_panels(arm, "slider", 1.0), "rotating body 'slider'"),
        (lambda arm: sd.with_panels(arm, "unit 1/*", math.nan), "from 1e-12"),
    ],
)
def test_refused_loads(load, hint):
    """Contract: a load that cannot be carried is refused in one line with the reason."""
    with one_line_error(hint):
        load(sd.scissor(units=2))


@pytest.mark.parametrize("kink", [0.0, 0.5, -1.2, math.pi / 2])
def test_angulated_bar(kink):
    """Cross-check: mass centre and inertia equal those of 20000 point masses along the two legs."""
    body = sd.angulated_bar("bent", first=0.7, second=0.4, kink=kink, mass=3.0)
    s = (np.arange(20000) + 0.5) / 20000 * 1.1
    first, second = np.minimum(s, 0.7), np.maximum(s - 0.7, 0.0)
    points = np.stack([first + second * math.cos(kink), second * math.sin(kink)], axis=1)
    centre = points.mean(axis=0)
    assert np.allclose(body.centre, centre, atol=1e-8)
    assert body.inertia == pytest.approx(3.0 * np.mean(np.sum((points - centre) ** 2, axis=1)), rel=1e-7)
    assert math.dist(body.points["pivot"], body.points["end"]) == pytest.approx(0.4, rel=1e-14)


def test_straight_bar_is_a_bar():
    """Limit: without a kink and with equal legs it is the uniform bar."""
    bent = sd.angulated_bar("rod", first=0.5, second=0.5, mass=2.0, position=(0.1, 0.2), angle=0.3)
    straight = sd.bar("rod", length=1.0, mass=2.0, position=(0.1, 0.2), angle=0.3)
    assert bent.inertia == pytest.approx(straight.inertia, rel=1e-14)
    assert bent.centre == pytest.approx(straight.centre, rel=1e-14)
    assert bent.place("end") == pytest.approx(straight.place("end"), rel=1e-14)


@pytest.mark.parametrize("length", [0.0, -1.0, math.inf, True, "1 m"])
def test_refused_lengths(length):
    """Contract: a leg that is not a positive length is refused by name."""
    with pytest.raises(sd.InputError, match="second"):
        sd.angulated_bar("rod", first=0.5, second=length, mass=1.0)


SLIDE = ("ground", "origin"), ("slider", "centre")  # Start and end of friction in the guide of a slider-crank
RUBBING = {"radius": 0.01, "kinetic": 0.15}  # Pin radius [m] and friction coefficient


def test_array_of_twenty_units():
    """Identity: in a driven array with 60 pins the additional drive torque has the power of the friction."""
    array = sd.scissor(units=20).driven(sd.Cycloidal(0.4, 0.8, 0.5))
    rubbing = sd.with_joint_friction(array, "all", **RUBBING)
    without, run = (sd.simulate(part, until=0.5, samples=11) for part in (array, rubbing))
    assert run["pin_friction"].values.tolist() == [joint.name for joint in array.ideal_joints]
    torque, angle = run["pin_friction_torque"].values[1:-1], run["angular_velocity"]
    parts = {part.name: part for part in rubbing.components}
    speed = np.stack(
        [
            angle.sel(body=parts[name].body) - (0.0 if parts[name].base == "ground" else angle.sel(body=parts[name].base))
            for name in run["pin_friction"].values.tolist()
        ],
        axis=1,
    )[1:-1]
    beyond = (run["drive_torque"] - without["drive_torque"]).values.reshape(11, -1)[1:-1, 0]
    power = -np.sum(torque * speed, axis=1)
    assert np.all(power > 0.0)
    np.testing.assert_allclose(beyond * angle.sel(body=array.input_body).values[1:-1], power, rtol=1e-9)
    size, joints = np.linalg.norm(run["reaction"].values, axis=2), run["joint"].values.tolist()
    exact = size[:, [joints.index(name) for name in run["pin_friction"].values.tolist()]]
    np.testing.assert_allclose(run["pin_friction_reaction"], exact, atol=1e-9 * exact.max())


def test_friction_in_joints_of_a_pattern():
    """Contract: groups and patterns choose joints; a later call replaces an earlier one; clearance joints are refused."""
    array = sd.scissor(units=3)
    pivots = sd.with_joint_friction(array, "pivots", **RUBBING)
    assert [part.name for part in pivots.components] == ["unit 1/pivot", "unit 2/pivot", "unit 3/pivot"]
    other = sd.with_joint_friction(pivots, "unit 2/*", radius=0.02, kinetic=0.3, bristle_stiffness=1e5)
    kinds = {part.name: type(part) for part in other.components}
    assert kinds["unit 1/pivot"] is sd.PinFriction
    assert kinds["unit 2/pivot"] is sd.PinLuGre
    assert len(kinds) == len(other.components) == 5
    loose = array.with_clearance("A", sd.Clearance(1e-4))
    assert "A" not in {part.name for part in sd.with_joint_friction(loose, **RUBBING).components}
    with pytest.raises(sd.InputError, match="ideal joint 'A'"):
        sd.with_joint_friction(loose, "A", **RUBBING)
    named = sd.with_joint_friction(array, "unit 1/pivot", **RUBBING).components[0]
    own = array.with_parts({"components": (sd.PinFriction("mine", named.body, 0.01, 0.1, named.base),)})
    with pytest.raises(sd.InputError, match="pin 'unit 1/pivot' already has friction 'mine'; expected one of them"):
        sd.with_joint_friction(own, **RUBBING)


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ((sd.PinFriction("a", "crank", 0.01, 0.1), sd.PinLuGre("b", "crank", 0.01, 0.1)), "'b' acts in the same pin as 'a'"),
        (
            (sd.PinFriction("a", "crank", 0.01, 0.1, "rod"), sd.PinFriction("b", "rod", 0.01, 0.1, "crank")),
            "'b' acts in the same pin as 'a'; expected one friction in each pin",
        ),
        (
            (sd.GuideFriction("a", *SLIDE, 0.0, 0.1), sd.GuideLuGre("b", *SLIDE, np.pi, 0.1)),
            "'b' acts in the same guide as 'a'",
        ),
    ],
)
def test_two_frictions_in_one_joint(parts, says):
    """Contract: friction would be counted twice; frictions in different joints are accepted."""
    crank = sd.slider_crank()
    with pytest.raises(sd.InputError, match=says):
        crank.with_parts({"components": parts})
    others = sd.PinFriction("a", "crank", 0.01, 0.1), sd.PinFriction("b", "rod", 0.01, 0.1, "crank")
    across = sd.GuideFriction("c", *SLIDE, 0.0, 0.1), sd.GuideFriction("d", *SLIDE, 1.0, 0.1)
    assert len(crank.with_parts({"components": (*others, *across)}).components) == 4


# Case file with two tables of joint friction
CASE = """
[structure]
kind = "scissor"
units = 2

[drive]
speed = "10 rpm"

[[joint_friction]]
joint = "all"
radius = "10 mm"
kinetic = 0.1

[[joint_friction]]
joint = "pivots"
radius = "15 mm"
kinetic = 0.2
bristle_stiffness = "1e5 1/m"

[run]
until = "10 ms"
"""


def test_case_file(tmp_path, capsys):
    """Contract: tables of joint friction apply in order, `check` lists each pin, and the case is written as it was read."""
    from scissordyn.cli.main import status_of

    path = tmp_path / "case.toml"
    path.write_text(CASE, encoding="utf-8")
    mechanism = sd.read_case(path).mechanism
    array = sd.scissor(units=2)
    first = sd.with_joint_friction(array, radius=0.01, kinetic=0.1)
    both = sd.with_joint_friction(first, "pivots", radius=0.015, kinetic=0.2, bristle_stiffness=1e5)
    assert mechanism.components == both.components
    assert status_of(["check", str(path)]) == 0
    assert "Pin friction unit 1/pivot" in capsys.readouterr().out
    sd.write_case(mechanism, tmp_path / "again.toml")
    assert sd.read_case(tmp_path / "again.toml").mechanism == mechanism
    changed = sd.read_case(path, ["pin_friction.all.kinetic=0.3", "joint_friction.pivots.kinetic=0.4"]).mechanism
    assert {(type(part), part.kinetic) for part in changed.components} == {(sd.PinFriction, 0.3), (sd.PinLuGre, 0.4)}


def test_bars_that_bend(tmp_path):
    """Contract: pins keep their names on bars that bend, and friction may be added before or after."""
    array = sd.scissor(units=1)
    bars = {"bending_stiffness": 2e3, "axial_stiffness": 2e6}
    before = sd.with_bending(sd.with_joint_friction(array, **RUBBING), **bars)
    after = sd.with_joint_friction(sd.with_bending(array, **bars), **RUBBING)
    friction = [{p for p in m.components if isinstance(p, sd.PinFriction)} for m in (before, after)]
    assert friction[0] == friction[1]
    assert len(friction[0]) == len(array.ideal_joints)
