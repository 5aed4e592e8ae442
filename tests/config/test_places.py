"""Places in case files: their lines in messages, changes at their paths, and names of parts."""

import re
import tomllib

import pytest

import scissordyn as sd
from scissordyn.casefile.part import PARTS
from scissordyn.casefile.text import line_of, place_text
from scissordyn.config.file import apply_changes
from scissordyn.config.study import read_study
from scissordyn.errors import did_you_mean

# Case file whose line numbers are tested
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

SMALLEST_CASE = '[structure]\nkind = "scissor"\n[run]\nuntil = "1 ms"\n'  # Smallest case file


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
def test_the_line_of_a_place(place, line):
    """Contract: counted by hand, past texts over lines, lists over lines, comments, dotted keys and tables of a list."""
    assert line_of(TEXT, place) == line


def test_an_address_names_tables_as_the_option_set_does():
    """Contract: a table of a list by its name, without a name by its position, counted from one."""
    tree = tomllib.loads(TEXT)
    assert place_text(tree, ("clearance", 0, "friction", "kinetic")) == "clearance.A.friction.kinetic"
    assert place_text(tree, ("clearance", 1)) == "clearance.B.1"
    assert place_text(tree, ("force", 0, "name")) == "force (the first).name"
    assert place_text(tree, ("drive", 0, "harmonic")) == "drive.harmonic"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (SMALLEST_CASE.replace("scissor", "sissor"), "case.toml, line 2: structure.kind"),
        (SMALLEST_CASE + '[drive]\nspeed = "1 m"\n', "case.toml, line 6: drive.speed"),
        (SMALLEST_CASE + '[drive]\nspeed = "1 rpm"\nbodi = "x"\n', "case.toml, line 7: drive: unknown key 'bodi'"),
        (SMALLEST_CASE + '[drive]\nspeed = "1 rpm"\nbody = "x"\n', "case.toml, line 5: drive: the drive refers to body 'x'"),
        (SMALLEST_CASE + '[[clearance]]\njoint = "A"\nclearance = "1 s"\n', "case.toml, line 7: clearance.A.clearance"),
        (SMALLEST_CASE + '[[clearance]]\njoint = "A"\n', "case.toml, line 5: clearance.A: missing key 'clearance'"),
        (
            SMALLEST_CASE + '[[clearance]]\nclearance = "1 mm"\n',
            "case.toml, line 5: clearance (the first): missing key 'joint'",
        ),
        (
            SMALLEST_CASE + '[[spring]]\nname = "s"\nstart = "slider.centre"\nend = "ground.nowhere"\nstiffness = "1 N/m"\n',
            "case.toml, line 5: spring 's' refers to point 'nowhere'",
        ),
        (
            SMALLEST_CASE.replace("[run]", 'units = 2\nbars = { section = "tube 60x60x40 mm", material = "steel" }\n[run]'),
            "case.toml, line 4: structure.bars: a section 60 mm across",
        ),
        (SMALLEST_CASE + "[drive\n", "line 5"),
        ("[structure\n", "not valid TOML"),
        ('[structure]\nkind = "scissor"\n[run]\nuntil = "1 ms', "not valid TOML"),
        ('[structure]\nkind = "scissor"\n', "missing key 'run'"),
        ('[run]\nuntil = "1 ms"\n', "the table [structure] is missing"),
        ('[structure]\n[run]\nuntil = "1 ms"\n', "missing key 'kind'"),
        (SMALLEST_CASE + "[drive]\n", "0 time functions"),
        (SMALLEST_CASE + '[clearance]\njoint = "A"\n', "[[clearance]]"),
        (SMALLEST_CASE + 2 * '[[clearance]]\njoint = "A"\nclearance = "1 mm"\n', "tables for joint"),
        ("", "the table [structure] is missing"),
        ('[[body]]\nname = "a"\n', 'structure = { kind = "mechanism" }'),
        ('[structure]\nkind = "mechanism"\n[run]\nuntil = "1 ms"\n', "the mechanism has no bodies"),
    ],
)
def test_messages_say_what_is_wrong_and_its_line(case_of, text, says):
    """Contract: the line of the key, or that of its table where the key is missing, also of half-written files."""
    with pytest.raises(sd.InputError, match=re.escape(says)) as caught:
        case_of(text)
    assert "case.toml" in str(caught.value)


def test_a_value_from_the_command_line_has_no_line(case_of):
    """Contract: the file does not hold it."""
    with pytest.raises(sd.InputError, match=r"case\.toml: structure\.angle"):
        case_of(SMALLEST_CASE, ["structure.angle=30 m"])


def test_no_message_proposes_to_write_over_the_case_file(tmp_path, case_of):
    """Contract: a shell empties the file that it writes to, so only a name that is free is proposed."""
    with pytest.raises(sd.InputError) as caught:
        case_of("[structure\n")
    assert ">" not in str(caught.value)
    with pytest.raises(sd.InputError) as caught:
        sd.read_case(tmp_path / "new.toml")
    assert str(caught.value).endswith(f"for example scissordyn new scissor > {tmp_path / 'new.toml'}")


def test_a_byte_order_mark_is_no_text(tmp_path):
    """Contract: the mark that some editors put first changes nothing."""
    (tmp_path / "case.toml").write_bytes(b"\xef\xbb\xbf" + SMALLEST_CASE.encode())
    assert sd.read_case(tmp_path / "case.toml").run.until == 1e-3


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('case = "case.toml"\nseed = 1\n', "line 2: unknown key 'seed'"),
        (
            'case = "case.toml"\n\n[design]\nkind = "grid"\npoints = 2.5\n',
            "line 5: design.points = 2.5; expected a whole number",
        ),
        ('case = "case.toml"\n[vary]\n"a.b" = 3\n', "line 2: vary: 'a.b' = 3; expected text"),
        ("members = 2\n", "missing key 'case'"),
    ],
)
def test_messages_of_study_files_say_the_line(tmp_path, text, says):
    """Contract: a study file is read as a case file is."""
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(sd.InputError) as caught:
        read_study(path)
    assert str(caught.value).startswith(f"{path}")
    assert says in str(caught.value)


def tree():
    """Return a parsed case file with two clearance joints."""
    return {
        "drive": {"speed": "150 rpm"},
        "clearance": [
            {"joint": "A", "clearance": "0.5 mm", "friction": "lugre"},
            {"joint": "unit 1/pivot", "clearance": "1 mm"},
        ],
    }


@pytest.mark.parametrize(
    ("change", "path", "value"),
    [
        ("drive.speed=250 rpm", ("drive", "speed"), "250 rpm"),
        ("drive.speed = 250 rpm", ("drive", "speed"), "250 rpm"),
        ("drive.speed='250 rpm'", ("drive", "speed"), "250 rpm"),
        ("run.samples=11", ("run", "samples"), 11),
        ("run.trust=true", ("run", "trust"), True),
        ("clearance.1.clearance=2 mm", ("clearance", 1, "clearance"), "2 mm"),
        ("clearance.unit 1/pivot.clearance=2 mm", ("clearance", 1, "clearance"), "2 mm"),
        ("clearance.A.friction.kinetic=0.1", ("clearance", 0, "friction"), {"law": "lugre", "kinetic": 0.1}),
        ("clearance.A.friction={law='ambrosio'}", ("clearance", 0, "friction"), {"law": "ambrosio"}),
        ("run.note=a=b", ("run", "note"), "a=b"),
        ("run.note=1\nother = 2", ("run", "note"), "1\nother = 2"),
        ("drive.table.time=0 1 ms", ("drive", "table"), {"time": "0 1 ms"}),
    ],
)
def test_a_change_is_made_at_its_path(change, path, value):
    """Contract: the value at the path, everything else and the original as they were."""
    before = tree()
    found = apply_changes(before, [change])
    for key in path:
        found = found[key]
    assert found == value
    assert before == tree()


@pytest.mark.parametrize("path", ["clearance", "clearance.A", "clearance.0"])
def test_a_table_that_is_the_only_one_need_not_be_named(path):
    """Identity: its keys, and keys of its laws, with its name, its place and without."""
    single = {"clearance": [{"joint": "A", "clearance": "1 mm", "friction": "lugre"}]}
    found = apply_changes(single, [f"{path}.clearance=2 mm", f"{path}.friction.kinetic=0.1", f"{path}.contact=hard"])
    assert found["clearance"] == [
        {"joint": "A", "clearance": "2 mm", "friction": {"law": "lugre", "kinetic": 0.1}, "contact": "hard"}
    ]


def test_later_changes_see_earlier_ones():
    """Contract: two changes of one value."""
    assert apply_changes(tree(), ["drive.speed=1 rpm", "drive.speed=2 rpm"])["drive"]["speed"] == "2 rpm"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("drive.speed", "an equals sign"),
        ("=3", "a path of keys"),
        ("drive..speed=3", "a path of keys"),
        ("drive.speed.x=3", "no keys below"),
        ("clearance.B.clearance=3 mm", "one of A, unit 1/pivot, 0, 1"),
        ("clearance.2.clearance=3 mm", "no table '2'"),
        ("clearance.unit 1/pivo.clearance=3 mm", "did you mean 'unit 1/pivot'"),
        ("clearance.A=3", "whole table"),
        ("clearance.clearance=1 mm", "the name of the [[clearance]] is missing"),
    ],
)
def test_a_path_that_leads_nowhere_is_refused(change, says):
    """Contract: the message quotes the change."""
    with pytest.raises(sd.InputError, match=f"--set.*{re.escape(says)}"):
        apply_changes(tree(), [change])


def test_a_change_of_all_tables_is_that_of_each():
    """Identity: "clearance.all.KEY" is "clearance.NAME.KEY" for each name; a table called "all" is meant itself."""
    single = apply_changes(tree(), ["clearance.A.friction=none", "clearance.unit 1/pivot.friction=none"])
    assert apply_changes(tree(), ["clearance.all.friction=none"]) == single
    named = {"clearance": [{"joint": "all"}, {"joint": "A"}]}
    assert apply_changes(named, ["clearance.all.clearance=1 mm"])["clearance"] == [
        {"joint": "all", "clearance": "1 mm"},
        {"joint": "A"},
    ]


@pytest.mark.parametrize(
    ("word", "part"),
    [("revolute", "joint"), ("gas_strut", "gas_spring"), ("damper", "spring"), ("cylinder", "rod"), ("gear", "coupling")],
)
def test_words_of_the_field(word, part):
    """Contract: a word of the field leads to the part that does it."""
    assert did_you_mean(word, PARTS) == f" (did you mean '{part}'?)"
    assert did_you_mean("wheel", PARTS) == ""  # a similar name of another thing
