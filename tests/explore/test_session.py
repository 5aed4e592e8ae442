"""The explorer without a browser: fields, session, worker, drags, Python, what may be read."""

import re
import threading
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of

pytest.importorskip("tomlkit", reason="the package tomlkit is not installed")

from scissordyn.casefile.code import Code
from scissordyn.explore.answers import differences
from scissordyn.explore.case import Case, open_case, python_of
from scissordyn.explore.drag import Drag
from scissordyn.explore.field import fields_of
from scissordyn.explore.session import Session, Worker

from .browser import CASE
from .heard import until

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))  # Case files of all examples


# Case file with flexible bars
BENDING = """
[structure]
kind = "scissor"
bars = { section = "tube 60x60x1.56 mm", material = "steel" }
[drive]
speed = "60 rpm"
[[clearance]]
joint = "A"
clearance = "0.5 mm"
lubrication = { oil = "ISO VG 46", temperature = "50 degC" }
[run]
until = "1 ms"
"""


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_has_fields(path):
    """Contract: writing any field as it stands changes nothing, and the file text comes back letter by letter."""
    opened = open_case(path)
    assert opened.text() == path.read_text()
    assert len(opened.fields) == len(fields_of(opened.tree, opened.code))
    for field in opened.fields.values():
        same = opened.changed({field.key: field.text})
        assert (same.mechanism, same.options) == (opened.mechanism, opened.options)
        if len(field.value) == 1 and field.range is not None and field.range[0] <= field.value[0] <= field.range[1]:
            assert field.plain()["slider"]["low"] < field.plain()["slider"]["high"]


ROOT = Path(__file__).parents[2]  # Root folder of the repository
# Case files of the examples, of the questions and of the zoo
CASES = [
    *EXAMPLES,
    *(ROOT / "examples" / "questions").glob("*.toml"),
    *(ROOT / "src/scissordyn/collection/entries").glob("*/case.toml"),
]
QUANTITY = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)? *[^\d\s,.*][^,]*")  # Pattern of a text with a number and a unit


def written(tree, place=()):
    """Yield the paths of single numbers with units in a case file; the unit of a ratio is that of its coordinates."""
    if isinstance(tree, dict | list):
        for key, inner in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from written(inner, (*place, key))
    elif isinstance(tree, str) and QUANTITY.fullmatch(tree) and place[-1] != "ratio":
        yield place


@pytest.mark.parametrize("path", CASES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_number_with_a_unit_has_a_field(path):
    """Contract: of every example, question and mechanism of the zoo, wherever in a table the number stands."""
    opened = open_case(path)
    places = {".".join(map(str, place)) for place in written(opened.tree)}
    assert places
    assert places <= opened.fields.keys()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_python_makes_the_same_mechanism(path):
    """Identity: the code that is copied describes the mechanism of the case, every number bit for bit."""
    opened = open_case(path)
    made = {}
    code = python_of(opened)
    exec(code.rpartition("run = ")[0], made)
    assert made["mechanism"] == opened.mechanism
    assert f"until={opened.options.until!r}" in code


def test_saved_run_is_a_case(case, tmp_path):
    """Contract: a saved run is the case file of its mechanism; a change is that of `Mechanism.replace`, and can be saved."""
    run = sd.simulate(case.mechanism, until=1e-3, samples=11)
    opened = open_case(sd.save(run, tmp_path / "run.nc"))
    key = next(key for key, field in opened.fields.items() if (field.group, field.name) == ("clearance A", "clearance"))
    assert opened.changed({key: "0.2 mm"}).mechanism == case.mechanism.replace("A.clearance", 0.2e-3)
    assert opened.changed({"body.0.length": "2.1 m"}).mechanism.bodies[0].points["end"] == (2.1, 0.0)
    (tmp_path / "again.toml").write_text(opened.changed({key: "0.2 mm"}).text())
    assert open_case(tmp_path / "again.toml").mechanism == case.mechanism.replace("A.clearance", 0.2e-3)
    with pytest.raises(sd.InputError, match="out of bounds"):
        opened.changed({key: "-1 mm"})


def test_changed_file_keeps_its_comments(case):
    """Contract: only the value differs; a number that was not written is added to its table."""
    assert case.changed({"structure.angle": "35 deg"}).text() == CASE.replace("30 deg", "35 deg")
    added = case.changed({"clearance.1.damping.restitution": "0.7"})
    assert "# two of them" in added.text()
    assert added.mechanism == case.mechanism.replace("unit 1/pivot.damping.restitution", 0.7)
    again = open_case_text(added.text())
    assert again.mechanism == added.mechanism


def open_case_text(text):
    """Return the case of a case file with this text."""
    return Case("text", text, Code(Path()))


def test_units_of_fields_are_those_of_their_texts(case):
    """Closed form: the unit behind one number or two."""
    assert (case.field("clearance.0.clearance").unit, case.field("drive.speed").unit) == ("mm", "rpm")
    assert case.field("run.samples").unit == ""
    jack = open_case(EXAMPLES[0].with_name("lift.toml")).field("rod.0.motion.cycloidal.end")
    assert (jack.text, jack.unit) == ("710 mm", "mm")
    carried = Case.of("x", case.mechanism, case.options)
    assert carried.field("body.2.position").unit == "m"


def test_section_material_and_oil_are_fields(tmp_path):
    """Contract: texts with what is allowed, temperatures in kelvin, and a case that changes with them."""
    (tmp_path / "case.toml").write_text(BENDING, encoding="utf-8")
    case = open_case(tmp_path / "case.toml")
    plain = {key: field.plain() for key, field in case.fields.items()}
    oil, warm = plain["clearance.0.lubrication.oil"], plain["clearance.0.lubrication.temperature"]
    assert (oil["text"], oil["slider"]) == ("ISO VG 46", None)
    assert "ISO VG 32" in oil["allowed"]
    assert (warm["text"], warm["unit"], warm["factor"]) == ("323.15 K", "K", 1.0)
    texts = {
        "structure.bars.section": "tube 60x60x2 mm",
        "structure.bars.material": "aluminium",
        "clearance.0.lubrication.oil": "ISO VG 32",
        "clearance.0.lubrication.temperature": "40 degC",
    }
    changed = case.changed(texts)
    lubrication = changed.mechanism.joint("A").clearance.lubrication
    assert (lubrication.oil.name, lubrication.temperature) == ("ISO VG 32", pytest.approx(313.15))
    mass = [
        sum(body.mass for body in each.mechanism.bodies if body.name.startswith("unit 1/bar 1")) for each in (case, changed)
    ]
    assert mass[1] / mass[0] == pytest.approx(2700.0 / 7850.0 * (60.0**2 - 56.0**2) / (60.0**2 - 56.88**2))
    assert 'material = "aluminium"' in changed.text()
    assert differences([case, changed])[1].startswith(
        "structure, bars section tube 60x60x2 mm, structure, bars material aluminium"
    )
    more = case.changed({"structure.bars.modes": "3"})
    assert (case.field("structure.bars.modes").text, more.field("structure.bars.modes").text) == ("auto", "3")
    assert {part.modes for part in more.mechanism.components if isinstance(part, sd.FlexibleBar)} == {3}
    with pytest.raises(sd.InputError, match="wall"):
        case.changed({"structure.bars.section": "tube 60x60x40 mm"})


def test_session_keeps_the_last_good_run(case):
    """Contract: a wrong number leaves case and run as they are and is noted; undo brings the state before a change back."""
    session = Session(case, lambda what: None)
    until(lambda: not session.computing)
    good = session.good
    assert not session.change({"structure.bar_length": "-1 m"})
    typed, why = session.wrong["structure.bar_length"]
    assert typed == "-1 m"
    assert "out of bounds" in why
    assert session.good is good
    assert not session.state()["undo"]
    assert session.change({"structure.bar_length": "2.2 m"})
    assert not session.wrong
    until(lambda: not session.computing)
    assert session.good is not good
    session.undo()
    assert session.case is case
    session.undo(again=True)
    assert session.case.field("structure.bar_length").text == "2.2 m"
    session.worker.close()


def test_slider_on_its_way_is_one_change(case):
    """Contract: after many steps of a slider one undo leads back."""
    session = Session(case, lambda what: None)
    for speed in (151, 152, 153):
        session.change({"drive.speed": f"{speed} rpm"}, final=False)
    session.change({"drive.speed": "154 rpm"})
    assert session.case.field("drive.speed").text == "154 rpm"
    session.undo()
    assert session.case is case
    assert not session.state()["undo"]
    session.worker.close()


def test_latest_order_wins(case):
    """Contract: of many orders at once the last one is reported, and an order that is going on ends for a newer one."""
    reported = []
    began = threading.Event()

    def progress(number, fraction):
        began.set()

    worker = Worker(reported.append, progress)
    worker.order(case.changed({"run.until": "50 s"}))  # takes minutes
    assert began.wait(60.0)
    last = 0
    for speed in range(100, 110):
        last = worker.order(case.changed({"drive.speed": f"{speed} rpm"}))
    until(lambda: reported)
    worker.close()
    assert {outcome.number for outcome in reported} == {last}  # with the instants of its contacts once more
    assert reported[0].run is not None
    assert reported[0].case.field("drive.speed").text == "109 rpm"


def test_wrong_mechanism_is_reported(case):
    """Contract: what cannot be assembled is an error of the session's run, not of its thread."""
    mechanism = sd.four_bar(ground=0.2, crank=0.06, coupler=0.18, rocker=0.12)
    broken = mechanism.replace("body.coupler.points", {**mechanism.body("coupler").points, "end": (9.0, 0.0)})
    session = Session(Case.of("x", broken, case.options), lambda what: None)
    until(lambda: not session.computing)
    assert "cannot be assembled" in session.message
    assert session.good is None
    session.worker.close()


@pytest.mark.parametrize(
    ("example", "kind", "name", "changed"),
    [
        ("paper", "pin", "unit 1/upper", {"structure.bar_length", "structure.angle"}),
        ("paper", "length", "unit 2/bar 1", {"structure.bar_length"}),
        ("four_bar", "pin", "crank pin", {"structure.crank", "structure.angle"}),
        ("slider_crank", "pin", "crank pin", {"structure.crank", "structure.angle"}),
    ],
)
def test_drag_reaches_the_pointer(example, kind, name, changed):
    """Identity: the joint is where the pointer is, to 1e-3 of the size, by the numbers that an engineer would change."""
    opened = open_case(EXAMPLES[0].with_name(f"{example}.toml"))
    drag = Drag(opened, kind, name)
    reach = 0.03 * drag.size
    for part in (0.5, 1.0, 1.0):
        drag.move_target(part * reach, part * reach)
    assert set(drag.texts) == changed
    wanted = np.array([reach, reach]) if kind == "pin" else drag.present - drag.origin
    assert np.allclose(drag.present - drag.origin, wanted, atol=1e-3 * drag.size)
    assert np.linalg.norm(drag.present - drag.origin) > 0.5 * reach
    assert drag.case.mechanism == opened.changed(drag.texts).mechanism


def test_fixed_pin_cannot_be_dragged():
    """Contract: a pin that no number of the case moves is refused with a message."""
    with pytest.raises(sd.InputError, match="no length or angle of the case moves joint 'O'"):
        Drag(open_case(EXAMPLES[0].with_name("paper.toml")), "pin", "O")


@pytest.mark.parametrize("named", ['friction = "law.py:f"', 'friction = { law = "../law.py:f" }'])
def test_no_other_file_is_read(tmp_path, named, capsys):
    """Contract: a case that names a Python file is refused before the file is looked at, unless it is allowed by name."""
    folder = tmp_path / "inner"
    folder.mkdir()
    path = folder / "case.toml"
    path.write_text(CASE.replace('clearance = "0.5 mm"', f'clearance = "0.5 mm"\n{named}'))
    for place in (folder, tmp_path):
        (place / "law.py").write_text("raise SystemExit('it was executed')\n")
    assert status_of(["explore", str(path), "--no-browser"]) == 2
    error = capsys.readouterr().err
    assert "which the explorer reads or executes only with permission" in error
    assert "--allow" in error


def test_other_address_says_what_it_means(case_file, monkeypatch, capsys):
    """Contract: only an address that others can reach gives a warning."""
    pytest.importorskip("websockets", reason="the package websockets is not installed")
    monkeypatch.setattr("scissordyn.explore.serve.serve", lambda *given, **named: None)
    for options, warned in (([], False), (["--address", "0.0.0.0"], True)):
        assert status_of(["explore", str(case_file), "--no-browser", *options]) == 0
        assert ("Nothing is encrypted" in (error := capsys.readouterr().err)) == warned == (error != "")


@pytest.mark.parametrize(
    ("written", "options", "words", "announced"),
    [
        ("150 rmp", [], "drive.speed", "http://127.0.0.1:"),
        ("150 rpm", ["--address", "192.0.2.1"], "cannot listen on 192.0.2.1", ""),
        ("150 rpm", ["--address", ""], "--address 127.0.0.1", ""),
        ("150 rpm", ["--address", " "], "--address 127.0.0.1", ""),
    ],
)
def test_what_cannot_be_served_is_one_line(case_file, written, options, words, announced, capsys):
    """Contract: a wrong case ends the server; an address that is none, or of another machine, is refused before anything."""
    pytest.importorskip("websockets", reason="the package websockets is not installed")
    case_file.write_text(CASE.replace("150 rpm", written))
    assert status_of(["explore", str(case_file), "--no-browser", *options]) == 2
    out, error = capsys.readouterr()
    assert words in error
    assert len(error.splitlines()) == 1
    assert out.startswith(announced)
    assert bool(out) == bool(announced)
