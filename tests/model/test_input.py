"""Unfit values in Python, refused in one line when given, and values out of proportion to their mechanism."""

import dataclasses
import re

import numpy as np
import pytest
from tests.build import EXAMPLES, warnings_of

import scissordyn as sd
from scissordyn.model.check import loose_bodies, proportion_warnings
from scissordyn.units import RANGES

ARM = sd.scissor(units=1)  # Mechanism without a drive
DRIVEN = ARM.driven(speed=1.0)  # Mechanism with ideal joints and a drive
# Mechanism with a clearance joint and a periodic drive
LOOSE = ARM.with_clearance("A", sd.Clearance(1e-4)).driven(sd.Harmonic(1.0, 0.1, 3.0))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: sd.scissor(bar_length="2 m"), "bar_length = '2 m'; for example bar_length=2"),
        (lambda: sd.scissor(angle="30 deg"), "angle = '30 deg'; for example angle=degrees(30)"),
        (lambda: sd.scissor(angle=2.0), "for example angle=degrees(30)"),
        (lambda: sd.scissor(units=10.5), "units = 10.5; a whole number"),
        (lambda: sd.scissor(units="2"), "units = '2'"),
        (lambda: sd.scissor(driven_bar="pined"), "driven_bar = 'pined' (did you mean 'pinned'?)"),
        (lambda: sd.degrees("30"), "degrees('30'); for example degrees(30)"),
        (lambda: sd.rpm("150 rpm"), "for example rpm(150)"),
        (lambda: ARM.driven(150.0), "driven(): motion = 150.0; for example speed=rpm(150)"),
        (lambda: ARM.driven("150 rpm"), "for example speed=rpm(150)"),
        (lambda: ARM.driven(speed="150 rpm"), "speed = '150 rpm'; for example speed=rpm(150)"),
        (lambda: ARM.driven(sd.Harmonic), "motion = the class Harmonic"),
        (lambda: ARM.driven(speed=1.0, body=3), "body = 3; text"),
        (lambda: ARM.with_clearance("A", 5e-4), "clearance = 0.0005; for example clearance=Clearance(5e-4)"),
        (lambda: ARM.with_clearance("A", sd.Clearance), "clearance = the class Clearance"),
        (lambda: ARM.with_clearance(["A", 3], sd.Clearance(1e-4)), "joints = ['A', 3]; text"),
        (lambda: sd.Clearance("0.1 mm"), "clearance = '0.1 mm'; for example clearance=0.0001"),
        (lambda: sd.Clearance(0.02), "for example clearance=0.0005"),
        (lambda: sd.Clearance(1e-4, friction=0.1), "friction = 0.1; a friction law; friction=Ambrosio(kinetic=0.1)"),
        (lambda: sd.Clearance(1e-4, stiffness="liu"), "stiffness = 'liu'; an elastic law; for example stiffness=Liu()"),
        (lambda: sd.Clearance(1e-4, stiffness=sd.Hertz), "stiffness = the class Hertz; for example stiffness=Hertz()"),
        (lambda: sd.Clearance(1e-4, stiffness=sd.Flores()), "stiffness = Flores(restitution=0.9); an elastic law"),
        (lambda: sd.Clearance(1e-4, damping=sd.Liu()), "damping = Liu(); a damping law"),
        (lambda: sd.Clearance(1e-4, friction=None), "friction = None; a friction law"),
        (lambda: sd.Clearance(1e-4, material="steel"), "material = 'steel'; for example material=STEEL"),
        (lambda: sd.GuideClearance(1e-4, corners=3), "corners = 3"),
        (lambda: sd.GuideClearance(1e-4, length=0.04, width=0.02, stiffness="hertz"), "for example stiffness=Hertz()"),
        (lambda: sd.simulate("case.toml", until=0.01), "mechanism = 'case.toml'; Mechanism"),
        (lambda: sd.simulate(sd.scissor, until=0.01), "mechanism = <function scissor"),
        (lambda: sd.simulate(DRIVEN, until="10 ms"), "until = '10 ms'"),
        (lambda: sd.simulate(DRIVEN, until=0.01, samples=10.5), "samples = 10.5; a whole number"),
        (lambda: sd.simulate(DRIVEN, until=0.01, start="concentrik"), "did you mean 'concentric'"),
        (lambda: ARM.controlled("pid"), "controller = 'pid'; for example controller=PID(100.0)"),
        (lambda: ARM.controlled(sd.PID), "controller = the class PID"),
        (lambda: ARM.controlled(sd.PID(100.0), reference=3.0), "reference = 3.0; for example speed=rpm(150)"),
        (lambda: ARM.controlled(sd.PID(100.0), speed=1.0, sensor=3), "sensor = 3"),
        (lambda: sd.Mechanism(bodies=(3,)), "bodies = (3,); a tuple, each entry Body"),
        (lambda: sd.Body("a", "1 kg", None), "mass = '1 kg'; for example mass=1"),
        (lambda: sd.Body("a", 1.0, None, points={"a": ("x", "y")}), "points = {'a': ('x', 'y')}"),
        (lambda: sd.Body("a", 1.0, None, position=3), "position = 3; two numbers from"),
        (lambda: sd.Revolute("A", "crank", ("rod", "start")), "journal = 'crank'; expected (text, text)"),
        (lambda: sd.Revolute("A", ("a", "b"), ("c", "d"), 1e-4), "clearance = 0.0001; for example clearance=Clearance(5e-4)"),
        (lambda: sd.Guide("g", "slider"), "follower = 'slider'; (text, text)"),
        (lambda: sd.Weld("w", "a", "b"), "start = 'a'; (text, text)"),
        (lambda: sd.Drive("a", 3), "for example motion=ConstantSpeed(rpm(150))"),
        (lambda: sd.Force("f", ("a", "b"), 3), "force = 3; two numbers from"),
        (lambda: sd.Force("f", ("a", "b"), (1, 2), time_function=3), "time_function = 3"),
        (lambda: sd.Motor("m", 3, stall_torque=3, no_load_speed=1.0), "body = 3; text"),
        (lambda: sd.Tabulated("a", "b"), "times = 'a'; several numbers from"),
        (lambda: sd.Polynomial(("a",)), "coefficients = ('a',)"),
        (lambda: sd.tabulated(3, until=1.0), "function = 3; a function"),
        (lambda: sd.Harmonic("30 deg", 1.0, 1.0), "for example mean=degrees(30)"),
        (lambda: ARM.replace("B.clearance", 1e-4), "no part 'B' for 'B.clearance'; one of O, A, unit 1/pivot; 'A.clearance'"),
        (lambda: ARM.body(3), "body 3; one of"),
        (lambda: ARM.joint([]), "joint []; one of"),
        (lambda: sd.bifurcation(LOOSE, over=3, values=[1.0]), "over = 3; text or a function"),
        (lambda: sd.bifurcation(LOOSE, over="A.clearance", values="abc"), "values = 'abc'"),
        (lambda: sd.bifurcation(LOOSE, over="structure.crank", values=[1.0]), "no part 'structure' for 'structure.crank'"),
        (lambda: sd.with_payload(ARM, "A", "1"), "mass = '1'; for example mass=1"),
        (lambda: sd.four_bar(coupler_point=3), "coupler_point = 3; two numbers"),
        (lambda: sd.Mechanism((sd.Body("\ud800", 1.0, None),), ()), "written as UTF-8"),
        # sizes that no machine has
        (lambda: sd.Clearance(1e-4, journal_radius=1e308), "to 1e+06 [m]"),
        (lambda: sd.Body("a", 5e-324, None), "from 1e-12 to 1e+09 [kg]"),
        (lambda: sd.Body("a", 1.0, None, points={"far": (0.0, 1e300)}), "far = (0.0, 1e+300); two numbers"),
        (lambda: sd.LuGre(kinetic=1e308), "to 10"),
        (lambda: sd.scissor(gravity=10**400), "gravity = 1000"),
        (lambda: ARM.driven(speed=1e200), "to 1e+07 [rad/s]"),
        (lambda: sd.PID(1e308), "to 1e+30 [N m/rad]"),
        (lambda: sd.Tabulated(range(6), (0.0, 0.0, 0.0, 0.0, 0.0, 1e300)), "values = "),
    ],
)  # fmt: skip
def test_unfit_values_are_refused_where_they_are_given(make, says):
    """Contract: construction fails in one line with the given value, the allowed ones and the Python to write."""
    with pytest.raises(sd.InputError) as caught:
        make()
    message = str(caught.value)
    assert all(part in message for part in says.split("; ")), message
    assert "expected " in message
    assert "\n" not in message
    assert " deg'" not in message.partition("for example ")[2]


def test_numbers_of_numpy_are_numbers():
    """Contract: NumPy's numbers, arrays and truth values and lists give the same description as Python's own."""
    ours = sd.scissor(units=2, bar_length=2.0, angle=0.5)
    assert sd.scissor(units=np.int64(2), bar_length=np.float32(2.0), angle=np.float64(0.5)) == ours
    assert sd.scissor(units=2.0, bar_length=2, angle=0.5) == ours
    assert sd.Clearance(np.float32(0.5) * np.float32(1e-3), journal_radius=np.int32(1)).journal_radius == 1.0
    force = sd.Force("f", ("slider", "centre"), np.array([1, 2]), follows=np.bool_(True))
    assert force == sd.Force("f", ("slider", "centre"), (1.0, 2.0), follows=True)
    assert [type(x) for x in (*force.force, force.follows)] == [float, float, bool] or force.force == (1.0, 2.0)
    assert sd.Polynomial([1.0, np.float32(2.0)]).coefficients == (1.0, 2.0)
    assert sd.Tabulated(np.arange(6.0), np.arange(6)).values == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
    assert sd.simulate(DRIVEN, until=np.float32(1e-3), samples=np.int64(3)).sizes["time"] == 3


def test_every_quantity_has_bounds():
    """Contract: a quantity without bounds has those of its unit; a positive one also has the unit's smallest size."""
    for unit, (smallest, largest) in {**RANGES, "N/m^7": (1e-30, 1e30)}.items():
        free, positive = sd.Quantity(unit), sd.Quantity(unit, above=0.0)
        assert free.admits(-largest)
        assert free.admits(largest)
        assert not free.admits(1.01 * largest)
        assert positive.admits(smallest)
        assert not positive.admits(0.99 * smallest)
        assert not free.admits(10**400)
    assert sd.Quantity("m", above=0.1, below=0.2).expected == "a number > 0.1 and < 0.2 [m]"


def test_one_name_for_one_meaning_of_a_frequency(tmp_path):
    """Contract: a harmonic has an angular_frequency, in rad/s in Python; the name frequency is refused."""
    harmonic = '[drive.harmonic]\nmean = "45 deg"\namplitude = "1 deg"\nfrequency = "3 Hz"\n'
    (tmp_path / "case.toml").write_text('[structure]\nkind = "scissor"\n[run]\nuntil = "1 ms"\n' + harmonic)
    with pytest.raises(sd.InputError, match="did you mean 'angular_frequency'"):
        sd.read_case(tmp_path / "case.toml")
    with pytest.raises(TypeError, match="frequency"):
        sd.Harmonic(mean=0.0, amplitude=1.0, frequency=3.0)


def test_equal_mechanisms_have_one_hash():
    """Contract: equal mechanisms are one key of a dict."""
    arms = [sd.scissor(units=2).with_clearance("all", sd.Clearance(0.1e-3)) for _ in range(2)]
    assert arms[0] == arms[1]
    assert len({*arms, sd.scissor(units=2)}) == 2


def test_points_as_text_or_pair():
    """Contract: "BODY.POINT" and (BODY, POINT) give equal parts wherever a body and a point are named."""
    arm = sd.scissor(units=2)
    for made in (
        lambda point, other: sd.Revolute("pin", point, other),
        lambda point, other: sd.Spring("spring", point, other, 10.0),
        lambda point, other: sd.Rod("rod", point, other),
        lambda point, other: sd.Weld("weld", point, other),
        lambda point, other: sd.Force("push", point, (1.0, 0.0)),
        lambda point, other: sd.Guide("guide", point, (0.0, 0.0), 0.0),
        lambda point, other: sd.common_pin("pin", point, other),
        lambda point, other: sd.with_payload(arm, point, 2.0),
        lambda point, other: arm.controlled(sd.PID(10.0), sensor=point),
        lambda point, other: arm.place(point),
    ):
        pairs = ("unit 2/bar 1", "end"), ("unit 1/bar 2", "start")
        assert made(*map(".".join, pairs)) == made(*pairs)


def test_joint_names_take_precedence_over_points():
    """Contract: where a joint or a point may be given, the name of a joint means the joint."""
    arm = sd.scissor(units=1)
    assert arm.joint_or_point("A") == arm.joint("A")
    assert arm.joint_or_point("slider.centre") == ("slider", "centre")
    with pytest.raises(sd.InputError, match="joint 'B'"):
        arm.joint_or_point("B")


@pytest.mark.parametrize("given", ["", "end", ".end", "bar.", ("bar",), 3])
def test_invalid_points(given):
    """Contract: the error names the joint and the expected form."""
    with pytest.raises(sd.InputError, match=r"joint 'pin'|Revolute"):
        sd.Revolute("pin", given, ("ground", "O"))


FILES = sorted(EXAMPLES.glob("*.toml"))  # Case files of all examples


def arm(**surfaces):
    """Return the paper's array of two units of 2 m, with clearance at A."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(**{"clearance": 5e-4, **surfaces}))


def changed(mechanism, name, **facts):
    """Return the mechanism with other properties of one body."""
    bodies = tuple(dataclasses.replace(b, **facts) if b.name == name else b for b in mechanism.bodies)
    return dataclasses.replace(mechanism, bodies=bodies)


def rotor(inertia):
    """Return the array with a motor whose rotor has an inertia."""
    motor = sd.Motor("m", "unit 1/bar 1", 1.0, 10.0, inertia=inertia)
    return dataclasses.replace(arm(), components=(motor,))


@pytest.mark.parametrize(
    ("mechanism", "message"),
    [
        (
            arm(bearing_length=1e6),
            r"joint 'A' has a bearing length of 1e\+06 m, .* times the size of the mechanism; check its unit",
        ),
        (arm(journal_radius=1e6), r"joint 'A' has a journal radius of 1e\+06 m"),
        (arm(clearance=0.5, journal_radius=1.0), r"joint 'A' has a clearance of 0\.5 m, 0\.2"),
        (changed(arm(), "slider", mass=1e9), r"body 'slider' has a mass of 1e\+09 kg, .* times that of body 'unit 1/bar 1'"),
        (changed(arm(), "unit 1/bar 1", inertia=1e9), r"body 'unit 1/bar 1' has a radius of gyration of"),
        (rotor(1e9), r"motor 'm' has a rotor of 1e\+09 kg m\^2"),
    ],
)
def test_warning_of_values_out_of_proportion(mechanism, message):
    """Contract: a value a million times out of proportion gives one warning with its name and the ratio."""
    (said,) = proportion_warnings(mechanism)
    assert re.match(message, said)


def test_proportion_warnings_of_runs_and_checks(capsys, tmp_path):
    """Contract: the warning appears in a run, in a batch, and in the output of `check`."""
    from scissordyn.cli.main import status_of
    from scissordyn.config.template import template

    wide = arm(bearing_length=1e6).driven(speed=1.0)
    (expected,) = proportion_warnings(wide)
    assert expected in warnings_of(sd.simulate(wide, until=1e-3, samples=3))
    many = sd.simulate_many(wide, {"A.clearance": [4e-4, 5e-4]}, until=1e-3)
    assert all(expected in text.splitlines() for text in many["warnings"].values.tolist())
    (tmp_path / "case.toml").write_text(template("scissor"), encoding="utf-8")
    assert status_of(["check", str(tmp_path / "case.toml"), "--set", "A.bearing_length=1e9 mm"]) == 0
    assert "has a bearing length of 1e+06 m" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_examples_are_in_proportion(path):
    """Contract: no example gives a proportion warning."""
    assert proportion_warnings(sd.read_case(path).mechanism) == []


def test_loose_groups_of_one_size():
    """Contract: of equally large groups without a ground the first is the mechanism, in every process."""
    bodies = [sd.Body(name, 1.0, 0.1, {"p": (0.0, 0.0)}) for k in range(12) for name in (f"a{k}", f"b{k}")]
    joints = [sd.Revolute(f"J{k}", (f"a{k}", "p"), (f"b{k}", "p")) for k in range(12)]
    expected = [f"bodies 'a{k}', 'b{k}' are connected to each other, but to nothing else" for k in range(1, 12)]
    assert loose_bodies(sd.Mechanism(bodies=tuple(bodies), joints=tuple(joints))) == expected


def test_text_of_a_mechanism():
    """Contract: a mechanism is printed as its counts of parts, and its parameters are documented with their defaults."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(1e-3)).driven(speed=1.0)
    assert str(arm) == "Mechanism of 5 bodies, 5 ideal joints, 1 clearance joint, 1 guide, 1 drive"
    assert "bar_length : a number, default 2" in (sd.scissor.__doc__ or "")
