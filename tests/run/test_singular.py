"""Singular positions of the ideal mechanism: their location, and warnings in runs, maps, diagrams and the command line."""

import math

import numpy as np
import pytest
from tests.build import EXAMPLES, warnings_of

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.kinematics.path import instants, path_of
from scissordyn.kinematics.singular import CHANGE_KIND, LOCKING_KIND, SingularPosition, suspected_samples
from scissordyn.plan.plan import plan

FILES = sorted(EXAMPLES.glob("*.toml"))  # Case files of all examples

LOCATED = 1e-6  # Allowed error of a located singular position, as a fraction of the stroke


def stroke(mechanism, until):
    """Return the path of a driven mechanism."""
    return path_of(plan(mechanism), until)


def assert_places(path, expected):
    """Compare singular positions with the expected ones."""
    assert [each.kind for each in path.singular] == [kind for kind, _ in expected]
    length = path.place[-1] - path.place[0]
    for each, (_, place) in zip(path.singular, expected, strict=True):
        assert each.place == pytest.approx(place, abs=LOCATED * length)


# Dimensions [m] and start angle [rad] of a parallelogram linkage
PARALLEL = {"ground": 0.2, "crank": 0.1, "coupler": 0.2, "rocker": 0.1, "angle": 0.3}
# [rad] crank angle at which a four-bar linkage locks, by the law of cosines
LOCK = math.acos((0.2**2 + 0.15**2 - (0.12 + 0.1) ** 2) / (2.0 * 0.2 * 0.15))
# Mechanism, end of the run [s], and expected kinds and inputs of its singular positions, by name
STROKES = {
    # driven from 30 deg, the rhombi of an array are flat at 90 deg
    **{
        f"array of {units}": (
            sd.scissor(units=units, angle=sd.degrees(30)).driven(speed=2.0),
            1.0,
            [(CHANGE_KIND, math.pi / 2)],
        )
        for units in (2, 3, 8)
    },
    # without a rhombus an array can branch where the slider meets the pin, at 0 and 180 deg, and only there
    "one unit of an array": (sd.scissor(units=1, angle=0.5).driven(speed=1.0), 4.0, [(CHANGE_KIND, math.pi)]),
    # where crank and rod line up only the slider stops; the assembly has one branch near by
    "dead centres of a slider-crank": (sd.slider_crank(crank=0.05, rod=0.12).driven(speed=1.0), 7.0, []),
    "dead centres of a four-bar": (sd.four_bar(ground=0.2, crank=0.06, coupler=0.18, rocker=0.12).driven(speed=1.0), 7.0, []),
    # the two assemblies of a four-bar with equal opposite sides meet at 0 and 180 deg
    "parallelogram": (sd.four_bar(**PARALLEL).driven(speed=-1.0), 4.0, [(CHANGE_KIND, -math.pi), (CHANGE_KIND, 0.0)]),
    "crossed parallelogram": (sd.four_bar(**PARALLEL, branch="crossed").driven(speed=-1.0), 0.5, [(CHANGE_KIND, 0.0)]),
    # with ground as long as the crank, coupler and rocker fall on one line at 0 deg and are free to turn
    "kite": (
        sd.four_bar(ground=0.2, crank=0.2, coupler=0.3, rocker=0.3, angle=0.3).driven(speed=-1.0),
        0.5,
        [(CHANGE_KIND, 0.0)],
    ),
    # crank against stretched coupler and rocker, by the law of cosines
    "four-bar that locks": (
        sd.four_bar(ground=0.2, crank=0.15, coupler=0.12, rocker=0.1).driven(speed=1.0),
        2.0,
        [(LOCKING_KIND, LOCK)],
    ),
    "mast driven too far": (
        sd.mast(units=5, angle=sd.degrees(15)).driven(sd.Cycloidal(start=sd.degrees(15), end=sd.degrees(120), duration=1.0)),
        1.0,
        [(CHANGE_KIND, math.pi / 2)],
    ),
    "stroke that ends flat": (
        sd.scissor(units=2, angle=sd.degrees(60)).driven(sd.Cycloidal(start=sd.degrees(60), end=sd.degrees(90), duration=1.0)),
        2.0,
        [(CHANGE_KIND, math.pi / 2)],
    ),
    # radii are proportional to cos(th); all bars meet at 90 deg, despite redundant joints
    "ring": (sd.hoberman_ring(units=6).driven(speed=1.0), 1.0, [(CHANGE_KIND, math.pi / 2)]),
}


@pytest.mark.parametrize("case", STROKES)
def test_places_on_a_stroke(case):
    """Closed form: kinds and positions, and the bodies that become free."""
    mechanism, until, expected = STROKES[case]
    path = stroke(mechanism, until)
    assert_places(path, expected)
    if case.startswith("array"):
        assert instants(path, until, path.singular[0].place) == pytest.approx([math.pi / 6], abs=1e-6)
        assert all(name.endswith(("bar 1", "bar 2")) for name in path.singular[0].bodies)
        assert f"unit {case.split()[-1]}/pivot" in path.singular[0].joints
    if case in ("kite", "four-bar that locks"):
        assert set(path.singular[0].bodies) == {"coupler", "rocker"}
    if case == "four-bar that locks":
        assert path.singular[0].joints[0] == "rocker pin"


def test_positions_are_those_of_a_run():
    """Second formulation: positions along the stroke are those of the integrated motion of the reduced model."""
    linkage = sd.four_bar(ground=0.2, crank=0.06, coupler=0.18, rocker=0.12, gravity=0.0).driven(speed=1.0)
    path = stroke(linkage, 2.0)
    run = sd.simulate(linkage, until=2.0, samples=2001)
    driven = path.closure.plan.bodies.index(linkage.body("crank"))
    angle = run["angle"].values
    for k in range(angle.shape[1]):
        there = np.interp(path.place, angle[:, driven], angle[:, k])
        assert np.allclose(np.cos(path.angle[:, k] - there), 1.0, atol=1e-6)


@pytest.mark.parametrize("case", FILES, ids=lambda path: path.stem)
def test_examples_have_none(case):
    """Closed form: no example passes a singular position.

    The arrays stay between 15 and 75 deg: paper 30 to 75, long 60 to 54, periodic 45 to 51, mast 15 to 60, ring 15 to 35, and
    the jack moves the lift from 70 to 45 deg (sin th is the distance from slider to foot in m: 0.9397 and 0.71). The rods of
    the slider-cranks are 2.4 times as long as the cranks, and the crank of the four-bar is its shortest side with 60 + 200 <
    180 + 120 mm (Grashof): both turn without limit. Controlled array, press and self-deploying array have no drive that
    prescribes motion.
    """
    read = sd.read_case(case, [])
    assert drive_warnings(plan(read.mechanism), read.run.until) == []


def paper(speed):
    """Return the array of the paper at another speed."""
    return sd.read_case(EXAMPLES / "paper.toml", [f"drive.speed={speed!r}"]).mechanism


def singular_warnings(run):
    """Return warnings about singular positions."""
    return [each for each in warnings_of(run) if each.startswith((CHANGE_KIND, LOCKING_KIND))]


def test_warning_of_a_run_with_clearance():
    """Closed form: 250 rpm turn the paper's array from 30 through 90 deg at t = 60/(6 * 250) s; 150 rpm do not."""
    warned = singular_warnings(sd.simulate(paper("250 rpm"), until=0.05, samples=501))
    assert len(warned) == 1
    assert "at t = 0.04 s (drive of 'unit 1/bar 1' at 90 deg)" in warned[0]
    assert "matter of chance" in warned[0]
    assert not singular_warnings(sd.simulate(paper("150 rpm"), until=0.05, samples=501))


def test_warning_does_not_depend_on_samples():
    """Identity: the warning does not depend on the samples."""
    array = sd.scissor(units=2, angle=0.5).driven(speed=1.0)
    for samples in (2, 3, 5, 50, 500):
        assert singular_warnings(sd.simulate(array, until=1.5, samples=samples)), samples
    # nine samples of two swings, some of them far apart, others near
    swing = sd.Harmonic(mean=1.2, amplitude=0.7, angular_frequency=9.0, phase=-0.5 * math.pi)
    swinging = sd.simulate(sd.scissor(units=2, angle=0.5).driven(swing), until=4.0 * math.pi / 9.0, samples=9)
    assert singular_warnings(swinging)


def test_mechanism_that_closes_by_clearance_only():
    """Contract: a mechanism without an ideal assembly has no singular positions."""
    joints = (
        sd.Revolute("A", ("bar", "start"), ("ground", "A")),
        sd.Revolute("C", ("bar", "end"), ("ground", "C"), clearance=sd.Clearance(2e-3)),
    )
    loose = sd.Mechanism((sd.bar("bar", length=1.0, mass=1.0),), joints, ground=(("A", (0.0, 0.0)), ("C", (1.001, 0.0))))
    run = sd.simulate(loose, until=1e-3, samples=11, start="as-placed")
    assert not singular_warnings(run)


def test_failed_run_gives_the_locking_position():
    """Closed form: the run of a crank longer than its rod gives the angle at which it locks."""
    run = sd.simulate(sd.slider_crank(crank=0.12, rod=0.1, angle=0.5).driven(speed=1.0), until=1.0)
    assert run.attrs["status"] == "failed"
    (text,) = singular_warnings(run)
    assert text.startswith(LOCKING_KIND)
    assert f"at {math.degrees(math.asin(1 / 1.2)):.6g} deg" in text


def test_equally_near_samples_are_both_examined():
    """Closed form: a zero midway between two samples makes both suspected_samples, as do dependent gradients everywhere."""
    volume = np.abs(np.arange(8.0) - 3.5)
    assert suspected_samples(volume) == [3, 4]
    assert suspected_samples(volume[::-1]) == [3, 4]
    assert suspected_samples(np.zeros(4)) == [0, 1, 2, 3]
    assert suspected_samples(np.array([3.0, 0.0, 3.0])) == [1]


def test_free_motion_is_judged_by_its_samples():
    """Closed form: an array turned by a controller passes 90 deg; the warning interpolates the samples."""
    free = sd.scissor(units=2, angle=sd.degrees(60), gravity=0.0)
    turning = free.controlled(sd.PID(200.0, derivative=100.0), speed=2.0)
    for until in (0.6, 0.75, 0.775):  # the position is before or after the sample that is nearest to it
        passed = sd.simulate(turning, until=until, samples=301)
        (text,) = singular_warnings(passed)
        angle = np.degrees(passed["angle"].sel(body="unit 1/bar 1").values)
        when = float(text.split("t = ")[1].split(" s")[0])
        assert when == pytest.approx(float(np.interp(90.0, angle, passed["time"].values)), abs=1e-3)
    assert not singular_warnings(sd.simulate(turning, until=0.2, samples=301))


def test_redundant_joints_are_no_change_point():
    """Closed form: three free parallel cranks with a platform pass a change point only when flat."""
    cranks = [
        sd.Body(
            f"crank {k}",
            1.0,
            0.1,
            {"foot": (0.0, 0.0), "tip": (0.5, 0.0)},
            position=(float(k), 0.0),
            angle=1.0,
            angular_velocity=0.5,
        )
        for k in range(3)
    ]
    tip = 0.5 * math.cos(1.0), 0.5 * math.sin(1.0)
    platform = sd.Body("platform", 1.0, 0.1, {str(k): (float(k), 0.0) for k in range(3)}, position=tip)
    joints = [sd.Revolute(f"foot {k}", (f"crank {k}", "foot"), ("ground", str(k))) for k in range(3)]
    joints += [sd.Revolute(f"tip {k}", (f"crank {k}", "tip"), ("platform", str(k))) for k in range(3)]
    ground = tuple((str(k), (float(k), 0.0)) for k in range(3))
    free = sd.Mechanism((*cranks, platform), tuple(joints), ground=ground, gravity=0.0)
    assert not singular_warnings(sd.simulate(free, until=1.0, samples=201))
    assert singular_warnings(sd.simulate(free, until=10.0, samples=401))


@pytest.mark.parametrize("ratio", [-1.0, 1.0, -2.5])
@pytest.mark.parametrize("gravity", [9.81, 9.8, 4.0])
def test_coupling_is_no_change_point(ratio, gravity):
    """Closed form: two arms with coupled angles have gradients of constant length, for any number of samples."""
    arms = [
        sd.Body(name, 1.0, 0.02, {"pin": (0.0, 0.0)}, centre=(0.25, 0.0), position=(0.0, y))
        for name, y in (("l", 0.0), ("r", 1.0))
    ]
    joints = tuple(sd.Revolute(f"pin {arm.name}", (arm.name, "pin"), ("ground", arm.name)) for arm in arms)
    coupling = sd.Coupling("gear", sd.RelativeAngle("r"), sd.RelativeAngle("l"), ratio)
    ground = (("l", (0.0, 0.0)), ("r", (0.0, 1.0)))
    coupled = sd.Mechanism(tuple(arms), joints, ground=ground, gravity=gravity, couplings=(coupling,))
    for samples in (2, 3, 4, 20, 301):
        assert not singular_warnings(sd.simulate(coupled, until=1.0, samples=samples)), samples


def test_subject_of_a_singular_position():
    """Contract: a singular position without distinctive body and joint is one of the mechanism."""
    assert SingularPosition("change point", 0.0, (), ()).subject == "the mechanism"
    assert SingularPosition("change point", 0.0, ("a",), ()).subject == "body 'a'"


def test_warnings_of_maps_and_diagrams():
    """Contract: a map and a diagram of a rotating array warn of its flat positions."""
    array = (
        sd.scissor(units=2, angle=0.5).with_clearance("A", sd.Clearance(0.5e-3, friction=sd.NoFriction())).driven(speed=100.0)
    )
    assert len(singular_warnings(sd.cycle(array, cycles=1))) == 4
    diagram = sd.bifurcation(array, over="A.clearance", values=[0.4e-3, 0.5e-3], cycles=1, keep=1, engine=1)
    assert len(singular_warnings(diagram)) == 4


def test_check_warns_of_a_change_point(capsys):
    """Contract: `scissordyn check` prints the warning of the README's faster run."""
    case = str(EXAMPLES / "paper.toml")
    assert status_of(["check", case, "--set", "drive.speed='250 rpm'"]) == 0
    assert "change point at t = 0.0" in " ".join(capsys.readouterr().out.split())
    assert status_of(["check", case]) == 0
    assert "change point" not in capsys.readouterr().out
