"""``scissordyn gradient``: the table, JSON, the saved file and the picture."""

import json

import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of

# Case file of a ball in a clearance joint
CASE = """
[structure]
kind = "mechanism"
gravity = "0 m/s^2"

[[ground]]
name = "middle"
position = "0, 0 m"

[[body]]
name = "ball"
mass = "1 kg"
inertia = "1e-3 kg m^2"
points = { centre = "0, 0 m" }
position = "0, 0 m"
velocity = "0.5, 0 m/s"

[[joint]]
name = "hole"
journal = "ball.centre"
bearing = "ground.middle"

[[clearance]]
joint = "hole"
clearance = "1 mm"
journal_radius = "10 mm"
friction = "none"
reference = "onset"

[run]
until = "3.5 ms"
start = "as-placed"
"""


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return str(path)


def test_table_file_and_picture(case, tmp_path, capsys):
    """Contract: the parameter with the largest elasticity comes first."""
    saved, drawn = tmp_path / "gradient.nc", tmp_path / "bars.svg"
    words = ["gradient", case, "--of", "hole.first_contact", "--by", "hole.restitution", "--by", "hole.clearance"]
    assert status_of([*words, "-o", str(saved), "--plot", str(drawn)]) == 0
    text = capsys.readouterr().out
    assert "hole.first_contact = 2 ms" in text
    assert text.index("hole.clearance") < text.index("hole.restitution")
    assert "\n1 run in " in text
    lines = {words[0]: words[1:] for words in map(str.split, text.splitlines()) if words}
    assert lines["hole.clearance"][:2] == ["1", "mm"]
    assert lines["hole.restitution"] == ["0.9", "0", "0"]  # no unit "1"
    found = sd.load(saved)
    assert found["elasticity"].sel(parameter="hole.clearance").item() == pytest.approx(1.0, abs=1e-9)
    assert "<svg" in drawn.read_text(encoding="utf-8")


def test_json_of_all_parameters(case, capsys):
    """Contract: without --by every parameter that acts is taken, and one line is printed."""
    assert status_of(["gradient", case, "--of", "hole.first_contact", "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    of = json.loads(line)["measures"]["hole.first_contact"]
    assert of["value"] == pytest.approx(2e-3)
    assert of["elasticity"]["joint.hole.clearance"] == pytest.approx(1.0, abs=1e-9)
    assert of["derivative"]["body.ball.velocity.x"] == pytest.approx(-4e-3, rel=1e-9)


def test_step_of_the_case_is_not_used(case, capsys):
    """Contract: a warning says so; hard contact uses it."""
    words = ["gradient", case, "--of", "hole.first_contact", "--by", "hole.clearance", "--set", "run.step=0.1 ms"]
    assert status_of(words) == 0
    assert "Warning: the step of the case is not used" in capsys.readouterr().out.replace("\n", " ")
    assert status_of([*words, "--set", "clearance.0.contact=hard"]) == 0
    assert "Warning" not in capsys.readouterr().out


def test_a_measure_is_needed(case, capsys):
    """Contract: one line says what is missing."""
    assert status_of(["gradient", case, "--by", "hole.clearance"]) == 2
    assert "a gradient without a measure" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["hole.first_contact", "--by", "hole.clearance", "--set", "run.most_steps=5"], "5 steps are not enough"),
        (["hole.first_contact", "--by", "hole"], "'hole' names a part, not a parameter"),
    ],
)
def test_refused(case, words, told, capsys):
    """Contract: options of the case hold, and a part is not a parameter."""
    assert status_of(["gradient", case, "--of", *words]) != 0
    assert told in capsys.readouterr().err
