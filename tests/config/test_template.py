"""The case file that is printed to start from."""

import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.build import warnings_of

import scissordyn as sd
from scissordyn.casefile.case import CaseTable
from scissordyn.casefile.part import PARTS
from scissordyn.casefile.structure import STRUCTURES, ClearanceTable
from scissordyn.casefile.table import table_of
from scissordyn.casefile.time_function import DriveTable
from scissordyn.config.fitted import PART_VALUES
from scissordyn.config.template import DEPLOYMENT_TURNS, TEMPLATE_VALUES, template
from scissordyn.model.addition import panel_ends, payload_points

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"  # Case file of the paper's array


def test_template_is_the_paper_case(case_of):
    """Identity: what is printed reads back as the paper's case, but it deploys, and it records the contacts' own instants."""
    text = template("scissor")
    changes = ["structure.angle=60 deg", "drive.speed=-150 rpm", "run.samples=auto", "A.reference=loaded"]
    paper = sd.read_case(PAPER, changes)
    assert case_of(text) == replace(paper, mechanism=replace(paper.mechanism, source=""))
    run = sd.simulate(case_of(text).mechanism.ideal(), until=0.05, samples=2)
    assert run.scissordyn.summary().span.change == "grows along x and shrinks along y"


@pytest.mark.parametrize("kind", STRUCTURES)
def test_templates_can_be_run(case_of, kind):
    """Contract: each printed case is read, assembled and runs a few steps to its end."""
    case = case_of(template(kind), ["run.until=0.1 ms", "run.samples=3"])
    assert case.mechanism.clearance_joints
    assert sd.simulate(case.mechanism, **case.run.keywords).attrs["status"] == "complete"


@pytest.mark.parametrize("kind", STRUCTURES)
def test_template_shows_every_key_with_its_meaning(kind):
    """Contract: each declared key stands in the text, and each line that is not a further table of a list has a comment."""
    text = template(kind)
    tables = [
        STRUCTURES[kind],
        *[DriveTable] * ("drive" in TEMPLATE_VALUES[kind]),
        ClearanceTable,
        table_of(sd.Options, until="50 ms"),
    ]
    tables += [part.table for name, part in PARTS.items() if kind == "mechanism"]
    for table in tables:
        for key in table.declared_keys():
            assert f"\n{key} = " in text or f"\n# {key} = " in text
    further = sum(len(values) + 1 for name in PARTS for values in TEMPLATE_VALUES[kind].get(name, [])[1:])
    assert sum(bool(line) and "# " not in line for line in text.splitlines()) == further
    for line in text.splitlines():
        assert line == line.rstrip()
        assert "None" not in line


@pytest.mark.parametrize("kind", STRUCTURES)
def test_keys_left_out_can_be_put_in(kind):
    """Contract: a commented key is valid TOML once its mark is taken away."""
    keys = {key for name in CaseTable.declared_keys() if name in PARTS for key in PARTS[name].table.declared_keys()}
    keys |= {*DriveTable.declared_keys(), *ClearanceTable.declared_keys(), *STRUCTURES[kind].declared_keys()}
    lines = [line[2:] for line in template(kind).splitlines() if line.startswith("# ") and line[2:].split(" = ")[0] in keys]
    assert len(lines) >= (7 if "drive" in TEMPLATE_VALUES[kind] else 1)
    for line in lines:
        assert len(tomllib.loads(line)) == 1


DRIVING = ("servo", "motor", "tabulated_motor", "linear_motor", "rod")  # Names of the additional parts that move a structure
APART = ("pin_friction", "pin_lugre", "tape_spring")  # Names of the additional parts that are tested alone
GROUPS = [
    ("servo", "tip", "payload", "panels", "latch"),
    *((part,) for part in (*DRIVING[1:], *APART)),
    tuple(part for part in PART_VALUES if part not in (*DRIVING, *APART, "tip", "payload", "panels", "latch")),
]
"""Groups of additional parts that are added to a structure together; only one part of a group drives it."""

MOTORS = ("motor", "tabulated_motor")  # Names of the additional parts that turn a structure
STOPPED = ("scissor", "mast", "ring", "n-four-bar", "polar")  # Kinds of structure that motors turn to a stop

# Error of a kind of structure that cannot have an additional part
REFUSED = {("slider-crank", "rod"): "cannot drive this structure at its start"}
REFUSED |= {("ring", part): "not determined" for part in ("pin_friction", "pin_lugre")}
# Field of `Mechanism` for an additional part that is not among its components
PART_FIELDS = {"tip": "tracks", "rod": "rods", "latch": "latches"}


def has_part(mechanism, part):
    """Return whether a mechanism has a part of the list of `new --with`."""
    if part == "servo":
        return any(isinstance(one, sd.Actuator) for one in mechanism.components)
    if part in ("payload", "panels"):
        return any({"payload": payload_points, "panels": panel_ends}[part](body) for body in mechanism.bodies)
    if part in PART_FIELDS:
        return bool(getattr(mechanism, PART_FIELDS[part]))
    return any(one.declaration.section == part for one in mechanism.components)


@pytest.mark.parametrize(
    ("kind", "parts"),
    [(kind, parts) for kind in STRUCTURES for parts in GROUPS if kind not in STOPPED or parts[0] not in MOTORS],
    ids=lambda one: one if isinstance(one, str) else one[0],
)
def test_every_structure_has_every_part(case_of, kind, parts):
    """Contract: the file is read, has the parts, and its move begins; a third of the moves are carried out to their end."""
    if (kind, parts[0]) in REFUSED:
        with pytest.raises(sd.InputError, match=REFUSED[kind, parts[0]]):
            template(kind, list(parts))
        return
    case = case_of(template(kind, list(parts)))
    assert [part for part in parts if not has_part(case.mechanism, part)] == []
    whole = (list(STRUCTURES).index(kind) + GROUPS.index(parts)) % 3 == 0
    run = sd.simulate(case.mechanism.ideal(), until=case.run.until * (1.0 if whole else 1e-3), samples=3)
    assert run.attrs["status"] == "complete"


@pytest.mark.parametrize(("angle", "end"), [("70 deg", "25 deg"), ("60 deg", "15 deg"), ("20 deg", "5 deg")])
def test_an_array_stops_before_it_is_straight(angle, end):
    """Contract: the printed move of a scissor array ends at a quarter of a small angle instead of passing its change point."""
    text = template("scissor", ["servo"], [f"structure.angle={angle}"])
    assert tomllib.loads(text)["drive"]["cycloidal"]["end"] == end


def test_laws_of_a_template(tmp_path, monkeypatch):
    """Contract: a parameter of a law can be set; the restitution is left out if the damping law does not have it."""
    monkeypatch.chdir(tmp_path)
    Path("own.py").write_text(
        'import scissordyn as sd\n\n\n@sd.element(slot="damping")\ndef own(elastic):\n    return 0.9 * elastic\n'
    )
    for damping in ("none", "own.py:own"):
        changes = [f"clearance.damping={damping}", "clearance.friction.kinetic=0.12"]
        (gap,) = tomllib.loads(template("scissor", changes=changes))["clearance"]
        assert (gap["damping"], gap["friction"]) == (damping, {"law": "lugre", "kinetic": 0.12})
        assert "restitution" not in gap


def test_every_part_is_in_a_group():
    """Contract: the groups above have all parts of `new --with`."""
    assert {part for parts in GROUPS for part in parts} == set(PART_VALUES)


@pytest.mark.parametrize("kind", ["scissor", "mast", "ring", "four-bar"])
def test_a_printed_servo_follows_its_reference(case_of, kind):
    """Contract: with the gains that are printed, and a payload, the move ends where it should, within the servo's limit."""
    case = case_of(template(kind, ["servo", "tip", "payload"]))
    run = sd.simulate(case.mechanism.ideal(), until=case.run.until, samples=201)
    answer = run.scissordyn.summary()
    assert abs(run["control_error"].values).max() < 1e-3 * abs(DEPLOYMENT_TURNS[kind])
    servo = answer.actuators[0]
    assert servo.limit is not None
    assert servo.torque == pytest.approx(servo.limit / 1.5, rel=0.05)
    assert "grows along" in answer.span.change or kind == "four-bar"


@pytest.mark.parametrize("kind", STOPPED)
@pytest.mark.parametrize("part", MOTORS)
def test_a_printed_motor_moves_the_structure_to_its_stop(case_of, kind, part):
    """Contract: the motor has the torque for the move, and the stop keeps the structure from its singular position."""
    case = case_of(template(kind, [part]))
    assert has_part(case.mechanism, part)
    run = sd.simulate(case.mechanism.ideal(), until=case.run.until, samples=201)
    assert run.attrs["status"] == "complete"
    turned = np.ptp(run["angle"].sel(body=case.mechanism.input_body).values)
    # the stop is 2 % beyond the end of the motion, and yields
    assert turned == pytest.approx(1.02 * abs(DEPLOYMENT_TURNS[kind]), abs=math.radians(1.0))
    assert not any("change point" in text for text in warnings_of(run))
    assert any(isinstance(one, sd.TravelStop) for one in case_of(template(kind, [part, "travel_stop"])).mechanism.components)


@pytest.mark.parametrize("kind", ["four-bar", "slider-crank"])
def test_a_printed_motor_of_a_crank_has_no_stop(case_of, kind):
    """Contract: a crank that can turn round has no stop."""
    assert not any(isinstance(one, sd.AngleStop) for one in case_of(template(kind, ["motor"])).mechanism.components)


def test_a_printed_servo_has_the_natural_frequency_that_is_said():
    """Closed form: k_p = J w^2 and k_d = 2 z J w, with J from the kinetic energy of a run, to the two digits of the file."""
    changes = ["structure.units=5", "drive.cycloidal.end=20 deg", "drive.cycloidal.duration=3 s", "clearance.joint=all"]
    text = template("scissor", ["servo"], changes)
    gains = tomllib.loads(text)["control"][0]["controller"]
    mechanism = sd.scissor(units=5, angle=math.radians(60.0)).driven(speed=1.0)
    inertia = 2.0 * float(sd.simulate(mechanism, until=1e-3, samples=2)["kinetic_energy"][0])
    w = 2.0 * math.pi * 6.0 / 3.0  # six oscillations and a damping ratio of 0.7, as the printed file says
    for key, wanted in (("proportional", inertia * w**2), ("derivative", 2.0 * 0.7 * inertia * w)):
        assert float(gains[key].split()[0]) == pytest.approx(wanted, rel=0.05)
    file = tomllib.loads(text)
    assert (file["structure"]["units"], file["clearance"][0]["joint"], file["run"]["until"]) == (5, "all", "3.3 s")
    assert file["drive"]["cycloidal"] == {"start": "60 deg", "end": "20 deg", "duration": "3 s"}


@pytest.mark.parametrize(
    ("kind", "parts", "changes", "says"),
    [
        ("scisor", [], [], "did you mean 'scissor'"),
        ("scissor", ["servos"], [], "did you mean 'servo'"),
        ("scissor", ["servo", "motor"], [], "both drive the structure"),
        ("scissor", ["latch"], [], "--with servo,latch"),
        ("mast", ["rod", "latch"], [], "--with servo,latch"),
        ("scissor", ["servo"], ["payload.mass=3 kg"], "the file has no [payload]"),
        ("scissor", ["servo"], ["trip.mass=3 kg"], "the file has no [trip]"),
        ("scissor", ["servo"], ["drive.trapezoidal.duration=3 s"], "trapezoidal"),
        ("scissor", ["servo"], ["structure.unit=3"], "did you mean 'units'"),
    ],
)
def test_parts_that_cannot_be_are_refused(kind, parts, changes, says):
    """Contract: one line that says what to type."""
    with pytest.raises(sd.InputError, match=re.escape(says)):
        template(kind, parts, changes)


def test_directions_of_parts_are_round_where_the_move_is_along_an_axis():
    """Limit: an array that is pushed down, and a point that moves along x, whose angle is no -0."""
    assert 'direction = "-90 deg"' in template("ring", ["travel_stop"])
    assert 'direction = "0 deg"' in template("mechanism", ["travel_stop"])


def test_parts_fit_bars_that_bend(case_of):
    """Identity: as those of rigid bars of their mass, and the file can be read; its points were those of cross-sections."""
    parts, mass = ["servo", "tip", "payload", "spring"], 2700.0 * (0.05**2 - 0.046**2)
    bars = 'structure.bars={section = "tube 50x50x2 mm", material = "aluminium"}'
    bent, stiff = (
        template("scissor", parts, ["structure.bar_length=1 m", change]) for change in (bars, f"structure.bar_mass={mass} kg")
    )
    one, other = tomllib.loads(bent), tomllib.loads(stiff)
    assert (one["run"].pop("start"), other["run"].pop("start")) == ("static", "concentric")
    del one["structure"], other["structure"]
    assert one == other
    assert case_of(bent).mechanism.tracks[0].name == "tip"
