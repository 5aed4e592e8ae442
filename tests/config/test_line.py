"""Lines and places in messages about case files."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from scissordyn.config.file import read_case
from scissordyn.config.study import read_study
from scissordyn.config.text import line_of, place_text
from scissordyn.errors import InputError

TEXT = '''# a case
[structure]
kind = "scissor"   # [run]
note = """
[run]
until = 3
"""
"odd = key" = [
    1,  # ]
    2,
]

[drive.harmonic]
mean = "1 deg"
[[clearance]]
joint = "A"
clearance = "1 mm"
friction = { law = "lugre", kinetic = 0.1 }

[[clearance]]
joint = "B.1"
damping.law = "flores"
[clearance.friction]
law = "lugre"
[[force]]
[ run ]
until = "1 ms"
'''

LEAST = '[structure]\nkind = "scissor"\n[run]\nuntil = "1 ms"\n'


@pytest.mark.parametrize(
    ("place", "line"),
    [
        (("structure",), 2),
        (("structure", "kind"), 3),
        (("structure", "missing"), 2),
        (("structure", "note"), 4),
        (("structure", "odd = key"), 8),
        (("drive", "harmonic", "mean"), 14),
        (("drive", 0, "harmonic"), 0),
        (("clearance", 0), 15),
        (("clearance", 0, "friction", "kinetic"), 18),
        (("clearance", 1, "joint"), 21),
        (("clearance", 1, "damping", "law"), 22),
        (("clearance", 1, "friction", "law"), 24),
        (("force", 0, "name"), 25),
        (("run", "until"), 27),
        (("elsewhere",), 0),
    ],
)
def test_the_line_of_a_place(place: tuple[int | str, ...], line: int) -> None:
    """Contract: counted by hand, past texts over lines, lists over lines, comments, dotted keys and tables of a list."""
    assert line_of(TEXT, place) == line


def test_an_address_names_tables_as_the_option_set_does() -> None:
    """Contract: a table of a list by its name, without a name by its position, counted from one."""
    tree = tomllib.loads(TEXT)
    assert place_text(tree, ("clearance", 0, "friction", "kinetic")) == "clearance.A.friction.kinetic"
    assert place_text(tree, ("clearance", 1)) == "clearance.B.1"
    assert place_text(tree, ("force", 0, "name")) == "force (the first).name"
    assert place_text(tree, ("drive", 0, "harmonic")) == "drive.harmonic"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (LEAST.replace("scissor", "sissor"), "case.toml, line 2: structure.kind"),
        (LEAST + '[drive]\nspeed = "1 m"\n', "case.toml, line 6: drive.speed"),
        (LEAST + '[drive]\nspeed = "1 rpm"\nbodi = "x"\n', "case.toml, line 7: drive: unknown key 'bodi'"),
        (LEAST + '[drive]\nspeed = "1 rpm"\nbody = "x"\n', "case.toml, line 5: drive: the drive refers to body 'x'"),
        (LEAST + '[[clearance]]\njoint = "A"\nclearance = "1 s"\n', "case.toml, line 7: clearance.A.clearance"),
        (LEAST + '[[clearance]]\njoint = "A"\n', "case.toml, line 5: clearance.A: missing key 'clearance'"),
        (LEAST + '[[clearance]]\nclearance = "1 mm"\n', "case.toml, line 5: clearance (the first): missing key 'joint'"),
        (
            LEAST + '[[spring]]\nname = "s"\nstart = "slider.centre"\nend = "ground.nowhere"\nstiffness = "1 N/m"\n',
            "case.toml, line 5: spring 's' refers to point 'nowhere'",
        ),
        (LEAST + "[drive\n", "line 5"),
    ],
)
def test_messages_say_the_line(tmp_path: Path, text: str, says: str) -> None:
    """Contract: the line of the key, or that of its table where the key is missing."""
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        read_case(tmp_path / "case.toml")
    assert says in str(caught.value)


def test_a_value_from_the_command_line_has_no_line(tmp_path: Path) -> None:
    """Contract: the file does not hold it."""
    (tmp_path / "case.toml").write_text(LEAST)
    with pytest.raises(InputError) as caught:
        read_case(tmp_path / "case.toml", ["structure.angle=30 m"])
    assert "case.toml: structure.angle" in str(caught.value)


def test_no_message_proposes_to_write_over_the_case_file(tmp_path: Path) -> None:
    """Contract: a shell empties the file that it writes to, so only a name that is free is proposed."""
    (tmp_path / "case.toml").write_text("[structure\n")
    with pytest.raises(InputError) as caught:
        read_case(tmp_path / "case.toml")
    assert ">" not in str(caught.value)
    with pytest.raises(InputError) as caught:
        read_case(tmp_path / "new.toml")
    assert str(caught.value).endswith(f"type: scissordyn new scissor > {tmp_path / 'new.toml'}")


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    """Contract: the mark that some editors put first changes nothing."""
    (tmp_path / "case.toml").write_bytes(b"\xef\xbb\xbf" + LEAST.encode())
    assert read_case(tmp_path / "case.toml").run.until == 1e-3


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('case = "case.toml"\nseed = 1\n', "line 2: unknown key 'seed'"),
        (
            'case = "case.toml"\n\n[design]\nkind = "grid"\npoints = 2.5\n',
            "line 5: design.points = 2.5; allowed: a whole number",
        ),
        ('case = "case.toml"\n[vary]\n"a.b" = 3\n', "line 2: vary: 'a.b' = 3; allowed: text"),
        ("members = 2\n", "missing key 'case'"),
    ],
)
def test_messages_of_study_files_say_the_line(tmp_path: Path, text: str, says: str) -> None:
    """Contract: a study file is read as a case file is."""
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_study(path)
    assert str(caught.value).startswith(f"{path}")
    assert says in str(caught.value)
