"""[control] in case files, and the catalogue on the command line."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from tests.build import case_of

import scissordyn as sd

# Case file; "CONTROL" is replaced by a table [control]
CASE = """
[structure]
kind = "scissor"
units = 2

[drive]
cycloidal = { start = "30 deg", end = "60 deg", duration = "1 s" }

CONTROL

[run]
until = "10 ms"
samples = 11
"""


def case(tmp_path, control):
    """Return the case with a table."""
    return case_of(tmp_path, CASE.replace("CONTROL", control))


def test_one_table(tmp_path):
    """Identity: a case file and Python describe the same mechanism, and it runs."""
    read = case(
        tmp_path,
        '[control]\nfeed_forward = "ideal"\nsensor = "slider.centre"\n'
        'controller = { name = "feed-forward", proportional = "2e4 N m/rad", derivative = "1500 N m s/rad", limit = "1 kN m" }',
    )
    arm, reference = sd.scissor(units=2), sd.Cycloidal(np.radians(30), np.radians(60), 1.0)
    made = arm.controlled(
        sd.FeedForward(2e4, 1500.0, limit=1000.0),
        reference=reference,
        feed_forward=sd.feed_forward(arm, reference, until=0.01),
        sensor=("slider", "centre"),
    )
    found, wanted = read.mechanism.components[0], made.components[0]
    assert isinstance(found, sd.Actuator)
    same = {"reference": None, "controller": wanted.controller, "start_on_reference": False}
    assert dataclasses.replace(found, **same) == dataclasses.replace(wanted, **same)
    assert found.controller.parameters() == pytest.approx(wanted.controller.parameters())
    assert not read.mechanism.drives
    assert sd.simulate(read.mechanism, **read.run.keywords).attrs["status"] == "complete"


def test_several_tables(tmp_path):
    """Contract: [[control]] stacks actuators; a reference of its own replaces the drive's."""
    read = case(
        tmp_path,
        '[[control]]\nname = "servo"\ncontroller = { name = "pid", proportional = "2e4 N m/rad" }\n'
        'reference = { speed = "20 rpm" }\n'
        '[[control]]\ncontroller = { name = "pyragas", gain = "3 N m", delay = "20 ms", recorded = "speed" }\n',
    )
    first, second = read.mechanism.components
    assert (first.name, first.controller, first.start_on_reference) == ("servo", sd.PID(2e4), True)
    assert (second.controller, second.start_on_reference) == (sd.Pyragas(3.0, 0.02), False)
    assert first.reference == sd.ConstantSpeed(sd.rpm(20.0))


def test_inertia_that_a_servo_accelerates(tmp_path, answer):
    """Closed form: body and rotor about the ground. Contract: no inertia is printed for a servo between two bodies."""

    def check(rotor, base):
        gain = 'controller = { name = "pid", proportional = "2e4 N m/rad" }'
        case(tmp_path, f'[control]\n{gain}\ninertia = "{rotor} kg m^2"\nbase = "{base}"')
        return answer("check", tmp_path / "case.toml")

    about = "Inertia about unit 1/bar 1: "
    alone, turned = (float(check(rotor, "ground").split(about)[1].split()[0]) for rotor in (0, 50))
    assert turned == pytest.approx(alone + 50.0, abs=0.1)
    assert about not in check(0, "unit 1/bar 2")


def test_inertia_grows_without_bound_towards_a_locking_position(answer):
    """Closed form: coupler and rocker are in line where 12^2 + 20^2 - 2 * 12 * 20 cos(angle) = (10 + 10)^2."""
    lengths = {"crank": "120 mm", "coupler": "100 mm", "rocker": "100 mm", "coupler_point": "60, 60 mm"}
    changes = [text for name, length in lengths.items() for text in ("--set", f"structure.{name}={length}")]
    four_bar = Path(__file__).parents[2] / "examples" / "four_bar.toml"
    told = " ".join(answer("check", four_bar, *changes).split())
    angle = math.degrees(math.acos(0.3))
    assert f"at the start, without bound towards the locking position at {angle:.6g} deg (ideal joints)." in told
    inertia = json.loads(answer("check", four_bar, *changes, "--json"))["drive_inertia"]
    assert (inertia["end"], inertia["largest"]) == (None, None)
    assert inertia["locked"] == pytest.approx(math.acos(0.3), abs=1e-6)
    before = " ".join(answer("check", four_bar, *changes, "--set", "run.until=5 ms").split())
    assert "at the start, 0.02354 kg m^2 at the end, at most 0.02354 kg m^2" in before


def test_own_file(tmp_path):
    """Contract: a controller in the user's own file, beside the case."""
    law = "@sd.element(slot='controller', delay=0.005, recorded='error')\ndef steer(error, delayed, gain):\n"
    (tmp_path / "mine.py").write_text(f"import scissordyn as sd\n\n\n{law}    return gain * error - 10.0 * delayed\n")
    read = case(tmp_path, '[control]\ncontroller = { name = "mine.py:steer", gain = 2e4 }')
    assert read.mechanism.components[0].controller.delay == pytest.approx(0.005)
    assert sd.simulate(read.mechanism, **read.run.keywords).attrs["status"] == "complete"


@pytest.mark.parametrize(
    ("control", "words"),
    [
        ('[control]\ncontroller = "pdi"', "did you mean 'pid'"),
        ('[control]\ncontroller = { name = "pid" }', "missing key 'proportional'"),
        ('[control]\ncontroller = { name = "pid", proportional = "2 N" }', "proportional"),
        ('[control]\ncontroller = "none"\nsensor = "Q"', "control"),
        ('[control]\ncontroller = "none"\nfeed_forward = "idael"', '"ideal"'),
        ('[control]\ncontroller = "none"\nreference = { speed = "1 rpm", body = "x" }', "unknown key 'body'"),
    ],
)
def test_errors(tmp_path, control, words):
    """Contract: what is wrong is named with its place."""
    with pytest.raises(sd.InputError, match=words):
        case(tmp_path, control)


def test_the_feed_forward_torque_blames_the_part(tmp_path):
    """Contract: an error about a part has the line of the part; one about the driven body has that of [control]."""
    law = 'controller = { name = "feed-forward", proportional = "2e4 N m/rad", derivative = "1500 N m s/rad" }'
    control = f'[control]\nfeed_forward = "ideal"\nname = "servo"\n{law}\n'
    ends = 'start = "unit 1/bar 1.middle"\nend = "unit 1/bar 2.middle"'
    spring = f'[[spring]]\nname = "s"\n{ends}\nstiffness = "100 N/m"\nfree_length = "1 m"\n'
    with pytest.raises(sd.InputError, match=r"case.toml, line 13: spring 's' has zero length at the start"):
        case(tmp_path, control + spring)
    with pytest.raises(sd.InputError, match=r"case.toml, line 9: control: .*slider"):
        case(tmp_path, control + 'body = "slider"\nreference = { speed = "1 rpm" }\n')


def test_catalogue_on_the_command_line(answer):
    """Contract: the list names every controller; one is shown with its parameters; an unknown one is refused."""
    assert {"pid", "feed-forward", "pyragas", "extended", "none"} <= set(answer("controllers").split())
    assert "proportional" in answer("controllers", "pid")
    assert "did you mean 'pid'" in answer("controllers", "pdi", status=2)
