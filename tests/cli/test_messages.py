"""Messages name the key, the file and the line that are at fault, and what to write there."""

import pytest

from scissordyn.cli.main import status_of

GROUND = '[[ground]]\nname = "O"\nposition = "0, 0 m"\n'  # Table of a ground point, part of a case file
JOINT = '[[joint]]\nname = "O"\njournal = "crank.start"\nbearing = "ground.O"\n'  # Table of a joint, part of a case file
RUN = '[run]\nuntil = "1 ms"\n'  # Table [run], part of a case file


def body(name, x):
    return f'[[body]]\nname = "{name}"\nmass = "1 kg"\nlength = "0.5 m"\nposition = "{x}, 0 m"\n'


def mechanism(*parts):
    return '[structure]\nkind = "mechanism"\n' + GROUND + body("crank", 0.0) + JOINT + "".join(parts) + RUN


def said(text, capsys, tmp_path, command="check"):
    """Run a command on a case with this text; return status and output."""
    case = tmp_path / "case.toml"
    case.write_text(text)
    status = status_of([command, str(case)])
    return status, " ".join("".join(capsys.readouterr()).split())


@pytest.mark.parametrize(
    ("table", "place"),
    [
        ('[drive]\nspeed = "300 rpm"\n', "drive"),
        ('[[drive]]\ncycloidal = { start = "0 deg", end = "9 deg", duration = "1 s" }\n', "drive"),
        ('[[control]]\nname = "servo"\ncontroller = { name = "pid", proportional = "1 N m/rad" }\n', "control"),
    ],
)
def test_a_drive_without_a_body_names_the_key(table, place, tmp_path, capsys):
    status, error = said(mechanism(table), capsys, tmp_path)
    assert status == 2
    assert f": {place}" in error
    assert "missing key 'body', and [structure] has no input_body; expected one of crank; for example body = \"crank\"" in error
    assert "()" not in error


@pytest.mark.parametrize("command", ["check", "run", "preview"])
def test_a_mechanism_that_cannot_be_assembled_names_its_file(command, tmp_path, capsys):
    far = '[[ground]]\nname = "P"\nposition = "9, 0 m"\n[[joint]]\nname = "P"\njournal = "crank.end"\nbearing = "ground.P"\n'
    text = (
        mechanism(far).replace(GROUND, GROUND + far.split("[[joint]]")[0]).replace(far, "[[joint]]" + far.split("[[joint]]")[1])
    )
    status, error = said(text, capsys, tmp_path, command)
    assert status == 2
    assert f"scissordyn: {tmp_path}/case.toml: " in error


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        ((), ""),
        ((body("alone", 2.0),), "body 'alone' is connected to nothing else: it moves alone"),
        (
            (body("a", 2.0), body("b", 2.5), '[[joint]]\nname = "ab"\njournal = "b.start"\nbearing = "a.end"\n'),
            "bodies 'a', 'b' are connected to each other, but to nothing else",
        ),
        ((body("hung", 2.0), '[[spring]]\nname = "s"\nstart = "ground.O"\nend = "hung.start"\nstiffness = "1 N/mm"\n'), ""),
        (
            (body("pushed", 2.0), '[[force]]\nname = "f"\npoint = "pushed.end"\nforce = "1, 0 N"\n'),
            "body 'pushed' is connected to nothing else: it moves alone",
        ),
    ],
)
def test_check_names_bodies_that_nothing_connects(parts, expected, tmp_path, capsys):
    status, printed = said(mechanism(*parts), capsys, tmp_path)
    assert status == 0
    assert f"Warning: {expected}." in printed if expected else "connected" not in printed


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_mechanism_that_nothing_moves(command, tmp_path, capsys):
    text = mechanism().replace("[structure]", '[structure]\ngravity = "0 m/s^2"')
    assert "Warning: nothing moves the mechanism" in said(text, capsys, tmp_path, command)[1]
    assert "nothing moves" not in said(mechanism(), capsys, tmp_path, command)[1]


@pytest.mark.parametrize(
    ("typed", "likely"), [("5 kNm", "kN m"), ("5 Nm", "N m"), ("5 Nmm", "N mm"), ("5 MNm", "MN m"), ("5 mNmm", "mN mm")]
)
def test_a_unit_without_its_blank_is_suggested_with_it(typed, likely, tmp_path, capsys):
    table = f'[[torque]]\nname = "t"\nbody = "crank"\ntorque = "{typed}"\n'
    status, error = said(mechanism(table), capsys, tmp_path)
    assert status == 2
    assert f"(did you mean '{likely}'?)" in error
    assert said(mechanism(table.replace(typed, f"5 {likely}")), capsys, tmp_path)[0] == 0


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ('{ law = "lugre",\n kinetic = 0.1 }', "has a line break"),
        ('{\n law = "lugre" }', "has a line break"),
        ('{ law = "lugre" # dry\n}', "has a line break"),
        ('{ law = "lugre", # dry\n kinetic = 0.1 }', "has a line break"),
        ('{ law = "lugre", }', "has a comma before its closing brace"),
    ],
)
def test_an_inline_table_of_later_toml_is_named(table, expected, tmp_path, capsys):
    text = f'[structure]\nkind = "scissor"\n[drive]\nspeed = "1 rpm"\n[[clearance]]\njoint = "A"\nfriction = {table}\n{RUN}'
    status, error = said(text, capsys, tmp_path)
    assert status == 2
    assert f"an inline table {{ ... }} of line 7 {expected}" in error
