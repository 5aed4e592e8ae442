"""Examples of the documentation run as they are printed: Python, case files and commands."""

from __future__ import annotations

import math
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import types
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from tests.page_numbers import Block, differing, marked, sections, typed_blocks, without_evidence

import scissordyn as sd
from reference.free_bodies import Scissor, cycloidal
from scissordyn.cli.main import app, status_of

mpl.use("Agg")

ROOT = Path(__file__).parents[1]  # Root folder of the repository
DOCS = ROOT / "docs"  # Folder of the documentation
ASKED = DOCS / "decisions" / "measured" / "questions.md"  # Page with questions and the commands that answer them
TASK = DOCS / "howto" / "choose_clearance_and_motor.md"  # Page that leads through a whole task
# Pages with commands
PAGES = sorted((*DOCS.glob("*.md"), *(DOCS / "howto").glob("*.md"), *(DOCS / "tutorials").glob("*.md"), ASKED))
TEXTS = (*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md")  # Pages with commands, README and CONTRIBUTING

# Program that makes a run with a user-defined law, needed by a page
SOFT = """
from pathlib import Path

import scissordyn as sd

arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
law = "def soft(indentation, stiffness):\\n    return stiffness * indentation**1.5\\n"
Path("my_laws.py").write_text(f"import scissordyn as sd\\n\\n\\n@sd.element(slot='stiffness')\\n{law}")
soft = arm.replace("A.stiffness", sd.law("stiffness", "my_laws.py:soft")(1e10))
sd.save(sd.simulate(soft, until=0.01), "run.nc")
"""
GIVEN = {"files.md": SOFT}
"""Code that a page assumes before its first example, by page."""

NOT_TYPED = {
    "pip install": "installs packages",
    "python3 -m venv": "makes an environment",
    "source .venv/bin/activate": "enters this environment",
    "cd scissordyn": "is for the folder of the sources",
    "make": "installs packages and takes minutes",
    "scissordyn explore": "serves a page until Ctrl-C, as in tests/explore",
    "scissordyn paper": "takes many minutes; tests/paper tests its parts",
    "python tests/compiler/test_tables.py": "writes digests of tables after an intended change",
    "SCISSORDYN_ENGINE=python": "is slow; `make bounds` runs kernels in Python",
    "solar_array.db": "takes many minutes; its answers are in docs/decisions/measured/study_results.md",
    "scissordyn motor": "is what the marker of its section runs",
    "lift_table.db": "takes minutes, as in tests/studies/test_lifts.py",
    "dask": "serves until Ctrl-C, as in tests/studies/test_cluster.py",
    "scissordyn sweep --scheduler": "needs other machines, as in tests/studies/test_cluster.py",
    "scissordyn sweep --cluster": "needs a queueing system, as in tests/studies/test_slurm.py",
}
"""Words of commands that no test executes, with the reason; blocks of `bash` need root or a home folder."""

WITH_OWN_SOURCES = ("validation.md", "claims.md", "release.md")  # Pages whose results are those of other programs or pages
SLOW = (
    *(
        "README.md",
        "analysis.md",
        "before_a_run.md",
        "bending.md",
        "choose_contact_and_friction_law.md",
        "cluster.md",
        "control.md",
    ),
    *("design_study.md", "files.md", "fit_measured_data.md", "gallery.md", "gradients.md", "own_elements.md", "studies.md"),
    "wear.md",
)
"""Pages whose commands take more than some seconds, and are tested with the slow tests."""


def name(path: Path) -> str:
    """Return the name of a page for the names of tests."""
    return str(path.relative_to(ROOT))


def blocks(text: str, language: str) -> list[str]:
    """Return the blocks of code in a language, also those of lists."""
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```", text, flags=re.MULTILINE | re.DOTALL)
    return [re.sub(rf"^{indent}", "", code, flags=re.MULTILINE) for indent, code in found]


def command_lines(block: str) -> list[str]:
    """Return the commands of a block of shell, without those that are comments; of a console those behind the prompt."""
    lines = block.replace("\\\n", " ").splitlines()
    if any(line.startswith("$ ") for line in lines):
        lines = [line[2:] for line in lines if line.startswith("$ ")]
    return [line for line in lines if shlex.split(line, comments=True)]


def commands(text: str) -> list[list[str]]:
    """Return the words of each command of the blocks of shell."""
    found = [*blocks(text, "sh"), *blocks(text, "console")]
    return [shlex.split(line, comments=True) for block in found for line in command_lines(block)]


def reason_not_typed(words: list[str]) -> str:
    """Return why a command is not typed; "" if it is."""
    return next((reason for key, reason in NOT_TYPED.items() if set(key.split()) <= set(words)), "")


Say = Callable[[list[str]], str]


@pytest.fixture
def say(tmp_path, monkeypatch, capsys):
    """Runs a command in an empty folder: what it says; nothing if that goes into the file behind ">"."""
    monkeypatch.chdir(tmp_path)

    def said(words: list[str]) -> str:
        capsys.readouterr()
        *command, target = [*words[1:-2], words[-1]] if ">" in words else [*words[1:], ""]
        assert status_of(command) == 0, words
        answer = capsys.readouterr().out
        if target:
            (tmp_path / target).write_text(answer, encoding="utf-8")
            return ""
        return answer

    return said


class Reader:
    """Types a page as a reader does, in an empty folder: its files, its Python and its commands in their order."""

    def __init__(self, say: Say, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.say, self.folder, self.capsys = say, folder, capsys
        self.module = types.ModuleType("example")
        self.printed: list[str] = []  # What the commands print

    def read(self, page: Path) -> None:
        text = page.read_text(encoding="utf-8")
        exec(GIVEN.get(page.name, ""), vars(self.module))
        for block in typed_blocks(text):
            if named := re.match(r"# (\w+\.\w+)\n", block.code):
                (self.folder / named[1]).write_text(block.code, encoding="utf-8")
            if block.language in ("sh", "console"):
                self._command(block)
            elif block.language == "python":
                self.capsys.readouterr()
                exec(compile(block.code, str(page), "exec"), vars(self.module))
                assert not differing(block.printed, self.capsys.readouterr().out)

    def _command(self, block: Block) -> None:
        said = ""
        for line in command_lines(block.code):
            words = shlex.split(line, comments=True)
            if reason_not_typed(words):
                continue
            if words[0] == "scissordyn":
                said += self.say(words) + "\n"
            else:  # a program of the system, for example to compare digits
                said += subprocess.run(["bash", "-c", line], cwd=self.folder, check=True, capture_output=True, text=True).stdout
        assert bool(block.printed.strip()) == bool(said.strip()), f"not followed by what it prints:\n{block.code}\n{said}"
        assert not differing(block.printed, said), said
        self.printed.append(said)


@pytest.fixture
def reader(say, tmp_path, monkeypatch, capsys):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    found = Reader(say, tmp_path, capsys)
    monkeypatch.setitem(sys.modules, "example", found.module)  # where the annotations of classes are looked up
    yield found
    plt.close("all")


def typed_pages() -> list[object]:
    """Return the pages with code or commands; the long ones as slow tests."""
    typed = {page: typed_blocks(page.read_text(encoding="utf-8")) for page in TEXTS if page not in (TASK, ASKED)}
    # tutorials without commands are notebooks, which the build of the site runs
    commanding = [page for page, found in typed.items() if any(block.language in ("sh", "console") for block in found)]
    found = [page for page, found in typed.items() if found and (page in commanding or page.parent.name != "tutorials")]
    assert len(found) > 20
    return [pytest.param(page, id=name(page), marks=pytest.mark.slow if page.name in SLOW else ()) for page in found]


@pytest.mark.parametrize("page", typed_pages())
def test_page_does_what_it_shows(page, reader):
    """Cross-check: everything that a page has a reader type, and what it prints, to the digits shown; results have a source."""
    reader.read(page)
    text = page.read_text(encoding="utf-8")
    marks = [one for section in sections(text) for one in marked(section) if one.startswith("scissordyn ")]
    answers = [*reader.printed, *(reader.say(shlex.split(one)) for one in marks)]
    if page.name not in WITH_OWN_SOURCES:
        assert not without_evidence(text, answers)


def test_reasons_are_of_commands():
    """Contract: each command that is not typed is on a page."""
    words = [words for page in TEXTS for words in commands(page.read_text(encoding="utf-8"))]
    assert {next(key for key in NOT_TYPED if set(key.split()) <= set(one)) for one in words if reason_not_typed(one)} == set(
        NOT_TYPED
    )


@pytest.mark.parametrize("page", TEXTS, ids=name)
def test_commands_are_understood(page):
    """Contract: each line of shell is a command with options that exist, a target of make, or installs extras that exist."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    text = page.read_text(encoding="utf-8")
    for words in commands(text):
        match words:
            case ["scissordyn", "--version"]:
                pass
            case ["scissordyn", command, *rest]:
                rest = rest[: rest.index(">")] if ">" in rest else rest
                found = app.get_command(None, command)
                assert found is not None, words
                found.make_context(command, list(rest))
                assert all((ROOT / word).exists() for word in rest if word.startswith("examples/")), words
            case ["make", target]:
                assert target in targets
            case ["pip", "install", what]:
                extra = re.search(r"\[(\w+)\]", what)
                assert what == "." or (extra is not None and extra[1] in extras), words
            case _:
                assert reason_not_typed(words) or words[0] == "sqlite3", words
    for table in blocks(text, "toml"):
        assert tomllib.loads(table)


def inline_commands(text: str) -> list[list[str]]:
    """Return the words of each command with arguments in a line of prose or in a table."""
    spans = re.findall(
        r"`(scissordyn [^`\n]+)`", "".join(part for part in re.split(r"^ *```.*?^ *```", text, flags=re.M | re.S))
    )
    return [words for words in (shlex.split(one) for one in spans) if len(words) > 2]


@pytest.mark.parametrize("page", TEXTS, ids=name)
def test_options_in_prose_exist(page):
    """Contract: commands that are named in a sentence or in a table exist, and so do their options."""
    for words in inline_commands(page.read_text(encoding="utf-8")):
        command = app.get_command(None, words[1])
        assert command is not None, words
        known = {option for parameter in command.params for option in parameter.opts}
        assert {word.partition("=")[0] for word in words if word.startswith("--")} <= known, words


ANSWERS = DOCS / "answers.md"  # Page with a table of questions and the commands that answer them
# Program that writes a drawing, which a command of the page imports
DRAWING_PROGRAM = """
import ezdxf

drawing = ezdxf.new()
drawing.header["$INSUNITS"] = 4
space = drawing.modelspace()
space.add_line((0, 0), (800, 600))
space.add_point((0, 0), dxfattribs={"layer": "ground"})
drawing.saveas("linkage.dxf")
"""
# Study file that the commands of the page need
ANSWERS_STUDY = """
case = "case.toml"
set = ["run.until=10 ms"]
require = ["peak_force < 100 kN"]

[vary]
"A.clearance" = "0.05..0.4 mm, 2 values"

[uncertain]
"A.damping.restitution" = "0.7..0.9"

[sampling]
samples = 2
"""
WITHOUT_ARGUMENTS = ("scissordyn motor", "scissordyn modes")  # Names of commands in the page, which need arguments


@pytest.mark.slow
def test_commands_of_the_answers_page(tmp_path, say):
    """Contract: each command of the tables runs in a folder with the files that the page names."""
    exec(DRAWING_PROGRAM, {})
    (tmp_path / "study.toml").write_text(ANSWERS_STUDY, encoding="utf-8")
    typed = re.findall(r"`(scissordyn [^`]+)`", ANSWERS.read_text(encoding="utf-8"))
    assert len(typed) > 20
    for line in (one for one in dict.fromkeys(typed) if one not in WITHOUT_ARGUMENTS):
        words = shlex.split(line)
        # the last rows import a drawing over the case of the others
        assert say([*words[:-1], "other.toml"] if words[1] == "import" else words) or ">" in words, line


def write_tables(page: Path, folder: Path) -> None:
    """Write the tables of a page whose first line is the name of a file, as in "# study.toml"."""
    for table in blocks(page.read_text(encoding="utf-8"), "toml"):
        if named := re.match(r"# (\w+\.toml)$", table, re.MULTILINE):
            (folder / named[1]).write_text(table, encoding="utf-8")


RUN_PAGES = (
    "README.md",
    "files.md",
    "before_a_run.md",
    "gallery.md",
    "bending.md",
    "choose_contact_and_friction_law.md",
    "studies.md",
)
"""Pages whose numbers all come from the output of their own commands, in slow tests."""

# Theory pages written by hand
THEORY = [page for page in sorted((DOCS / "theory").glob("*.md")) if page.name != "catalogue.md"]


@pytest.mark.parametrize("page", [page for page in (*TEXTS, *THEORY) if page != ASKED], ids=name)
def test_results_have_a_source(page):
    """Contract: each result is in code of its page, cites a source, or is what a marker's test, page or command gives."""
    text = page.read_text(encoding="utf-8")
    for one in (one for section in sections(text) for one in marked(section)):
        words = shlex.split(one)
        if words[0] == "scissordyn":
            command = app.get_command(None, words[1])
            assert command is not None, one
            command.make_context(words[1], words[2:])
            assert page.name in RUN_PAGES, "the commands of a marker run with those of its page"
        else:
            assert (ROOT / one).exists(), one
    if page.name not in RUN_PAGES and page.name not in WITH_OWN_SOURCES:
        assert not without_evidence(text)


def numbers_asked_elsewhere() -> dict[str, tuple[str, str]]:
    """Return for each case that prints its number a pattern of the answer, and the closed form."""
    g, lean = 9.81, math.radians(20.0)
    closed = {
        "redundant": (r"drive torque .* (\S+) N·m +20 deg", (5.0 + 1.5) * g * 0.3 * math.cos(lean)),
        "hole": (r"off by up to (\S+) µm", 500.0 + g),
        "journal": (r"largest torque (\S+) mN m", 1e3 * 3.0 * g * 0.02 * math.sin(math.atan(0.3))),
        "brake": (r"dissipated: (\S+) J", 0.5 * 0.05 * (100.0**2 - (100.0 - 2.0 / 0.05) ** 2)),
        "bounce": (r"dissipated: (\S+) mJ", 1e3 * (1.0 - 0.5**2) * g * 0.01),
        "planetary": (r"forces and torques -(\S+) mJ", 1e3 * math.tau * 0.1 * 3.7 / (1.0 + 54.0 / 20.0)),
        "motor": (r"motors and actuators (\S+) J", 0.5 * 0.05 * 100.0**2 * (1.0 - math.exp(-1.0)) ** 2),
        "lift": (r"rod force jack .* (\S+) kN +939.7 mm", 3.0 * (40.0 + 0.5 * 36.0) * g / math.tan(lean) / 1e3),
    }
    return {f"{case}.toml": (pattern, f"{value:.4g}") for case, (pattern, value) in closed.items()}


def test_questions_asked_elsewhere(tmp_path, say):
    """Closed form: the number of each case of the page, in the digits that are printed; these are in its table, too."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    text = ASKED.read_text(encoding="utf-8")
    numbers = numbers_asked_elsewhere()
    for words in commands(text):
        answer = say(words)
        if ">" not in words and (case := Path(words[2]).name) in numbers:
            pattern, closed = numbers.pop(case)
            assert re.search(pattern, " ".join(answer.split())).group(1) == closed
            assert f"| {closed} " in text
    assert not numbers
    loop, ball = (pd.read_csv(tmp_path / name).iloc[-1] for name in ("loop.csv", "ball.csv"))
    crank = math.radians(60.0 + 99.75 * 360.0)
    x, y = 0.06 * math.cos(crank) - 0.2, 0.06 * math.sin(crank)
    inner = math.acos((x * x + y * y + 0.12**2 - 0.18**2) / (2.0 * math.hypot(x, y) * 0.12))
    rocker = (math.atan2(y, x) - inner) % math.tau
    assert float(loop["angle of rocker [rad]"]) == pytest.approx(rocker, abs=1e-9)
    assert f"| {rocker:.4g} rad" in text
    energy = float(ball["kinetic_energy [J]"]) + float(ball["potential_energy [J]"])
    assert energy / 9.81 == pytest.approx(10.0, rel=1e-6)


def describe_task(folder: Path, say: Say, *changes: str) -> list[list[str]]:
    """Write the files of the page on the task of a designer, with changes of its case; its other commands."""
    write_tables(TASK, folder)
    new, *others = commands(TASK.read_text(encoding="utf-8"))
    assert new[-2:] == [">", "array.toml"]
    say([*new[:-2], *(word for change in changes for word in ("--set", change)), *new[-2:]])
    return others


def test_hand_calculations_of_the_task(tmp_path, say):
    """Cross-check: forces and moments by hand are near the pivot's force and the torque that the commands print."""
    describe_task(tmp_path, say)
    height, unit = 0.6 * math.sin(math.radians(20.0)), 0.6 * math.cos(math.radians(20.0))
    at_ground, beyond = (9.81 * unit * (12.0 * units + 1.2 * units * units / 2.0) for units in (5, 4))
    assert (round(at_ground), round(beyond)) == (415, 319)
    assert (at_ground - 75.0 + beyond) / height == pytest.approx(3169.0, rel=0.1)
    mechanism = sd.read_case(tmp_path / "array.toml").mechanism.replace("gravity", 0.0)
    run = sd.simulate(mechanism.ideal(), until=3.0, samples=301)
    assert 111.9 * 2.0 * math.pi * math.radians(50.0) / 3.0**2 == pytest.approx(float(run["peak_control_torque"][0]), rel=0.12)


def test_printed_blocks_of_the_task(reader):
    """Cross-check: what the commands of the page on the task print, where the page shows it."""
    shown = [block for block in typed_blocks(TASK.read_text(encoding="utf-8")) if block.printed]
    assert len(shown) == 2
    for block in shown:
        reader._command(block)


def test_task_of_one_unit_goes_from_new_to_a_design(tmp_path, say):
    """Cross-check: the commands of the page for one unit and few cases; the proposed point, run anew, meets what it has to."""
    others = describe_task(tmp_path, say, "structure.units=1", "drive.cycloidal.duration=0.9 s")
    for path in tmp_path.glob("*.toml"):
        text = re.sub(r"^samples = \d+$", "samples = 1", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        path.write_text(text.replace("points = 16", "points = 2"), encoding="utf-8")
    said = {words[2]: say(words) for words in others}
    assert set(said) >= {"array.toml", "study.toml", "check.toml", "ground.toml"}
    assert "scissordyn study refine" in said["study.toml"]
    study = sd.open_study(tmp_path / "study.db")
    run = sd.simulate(study.design, until=0.99, samples=51, rtol=1e-5)
    assert float(run["peak_force"].max()) < 800.0
    assert float(run["peak_track_deviation"][0]) < 3e-3
    assert (tmp_path / "study.html").read_text(encoding="utf-8").startswith("<!doctype html>")


@pytest.mark.slow
def test_task_is_answered_as_its_page_says(tmp_path, say):
    """Cross-check: all commands of the page, 25 minutes; what its answer rests on, from the stores."""
    for words in describe_task(tmp_path, say):
        say(words)
    assert int((sd.open_study(tmp_path / "study.db").points["met"] == 1.0).sum()) == 8
    for name, met, tip in (("check", 16, 1.722e-3), ("ground", 0, 2.260e-3)):
        study = sd.open_study(tmp_path / f"{name}.db")
        assert study.table["tip.peak_track_deviation [m]"].max() == pytest.approx(tip, rel=0.01)
        forces = study.table[[column for column in study.table if column.endswith(".peak_force [N]")]].max(axis=1)
        assert int((forces < 800.0).sum()) == met


BARS = DOCS / "bending.md"  # Page about flexible bars


def run_bars(folder: Path, say: Say, *names: str) -> list[str]:
    """Run the commands of the page on rigid and bending bars that have one of these names; what they say."""
    write_tables(BARS, folder)
    chosen = [words for words in commands(BARS.read_text(encoding="utf-8")) if words[1] in names]
    answers = [(words, " ".join(say(words).split())) for words in chosen]
    return [answer for words, answer in answers if ">" not in words]


def test_rigid_array_is_that_of_free_bodies(tmp_path, say):
    """Second formulation: inertia, reactions and torques of the page by the equations of each bar cut free."""
    checked, *previews = run_bars(tmp_path, say, "new", "check", "preview")
    start, end = math.radians(65.0), math.radians(25.0)
    for preview, gravity in zip(previews, ((0.0, 0.0), (0.0, -9.81), (-9.81, 0.0)), strict=True):
        array = Scissor(6, 0.9, 0.733, 0.5, 8.0, gravity)
        solved = [array.forces(*cycloidal(start, end, 4.0, t)) for t in np.linspace(0.0, 4.0, 201)]
        force, torque = max(max(pins.values()) for pins, _ in solved), max(abs(torque) for _, torque in solved)
        for pattern, value in ((r"reaction with ideal joints: ([0-9.]+) (k?)N", force), (r"up to ([0-9.]+) (k?)N m", torque)):
            number, kilo = re.search(pattern, preview).groups()
            assert float(number) * (1e3 if kilo else 1.0) == pytest.approx(value, rel=5e-4)
    inertia = re.search(r"Inertia about unit 1/bar 1: ([0-9.]+) kg m\^2 at the start", checked).group(1)
    assert float(inertia) == pytest.approx(array.inertia(start), rel=5e-4)
    assert "cannot hold" in previews[2]
    bent = sd.read_case(tmp_path / "tubes.toml").mechanism
    tube = 2700.0 * math.pi * (0.025**2 - 0.023**2) * 0.9
    assert sum(body.mass for body in bent.bodies) == pytest.approx(8.5 + 12 * tube, rel=1e-9)


@pytest.mark.parametrize(
    ("prose", "missing"),
    [
        ("The tip is off by 18.2 mm.", []),
        ("The tip is off by 18.3 mm.", ["18.3 mm"]),
        ("The tip is off by 0.0182 m.", []),
        ("The joint carries 18.2 N.", ["18.2 N"]),
        ("| tip [mm] | 18.16 | 19.16 |", ["19.16"]),
        ("A clearance of 0.1 mm.", []),
        ("The tip is off by 19 mm ([measured](decisions/measured/control.md)).", []),
        ("The tip is off by 19 mm.\n\n<!-- numbers: tests/test_run.py -->", []),
        ("The tip is off by 19 mm.\n\n<!-- numbers: scissordyn laws -->", ["19 mm"]),
    ],
)
def test_numbers_of_prose_need_evidence(prose, missing):
    """Contract: what a program prints is evidence to the digits of the prose and in its unit; a citation is a source."""
    assert without_evidence(f"# Page\n\n## Section\n\n{prose}\n", ["off by up to 18.16 mm at 3 s"]) == missing


@pytest.mark.parametrize(("shown", "same"), [("off by 1.73 mm", True), ("off by 1.75 mm", False), ("off by 1.73 N", False)])
def test_printed_blocks_are_compared_to_their_digits(shown, same):
    """Contract: words are equal, numbers to one unit of the last digit; dots stand for lines that are left out."""
    assert (not differing(f"Tracked point:\n...\n{shown}\n...\n", "Tracked point:\nmore\noff by 1.728 mm\n")) == same
