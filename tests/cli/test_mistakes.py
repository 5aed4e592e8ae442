"""Errors after typing mistakes, as those of `mistakes.toml`, and after impossible requests: one line."""

from __future__ import annotations

import inspect
import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.fit import ranges_by_parameter
from scissordyn.cli.main import COMMANDS, status_of
from scissordyn.cli.study import values_by_parameter
from scissordyn.plan.plan import plan
from scissordyn.run import sample_memory
from scissordyn.studies.ask.design import Design, design_size, design_values

# Mistakes in commands and files, each with words of its message, by kind of mistake
TABLE: dict[str, list[dict[str, Any]]] = tomllib.loads(Path(__file__).with_name("mistakes.toml").read_text(encoding="utf-8"))
MISTAKES = [(kind, mistake) for kind, mistakes in TABLE.items() for mistake in mistakes]  # Pairs of kind and mistake in `TABLE`
EXAMPLES = Path(__file__).parents[2] / "examples"  # Folder of the package's example cases
HELPS = ("; expected ", "; for example ", "did you mean ", "Did you mean ")  # Words before the advice in an error message

# Case file in which mistakes are made
CASE = """\
[structure]
kind = "scissor"
[drive]
speed = "20 rpm"
[[clearance]]
joint = "A"
clearance = "0.5 mm"
[run]
until = "1 ms"
samples = 11
"""
# Study file in which mistakes are made
STUDY = 'case = "case.toml"\nmeasures = ["peak_force"]\n[vary]\n"A.clearance" = "0.1..0.4 mm, 2 values"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a case, a study, a saved run, measured data and drawings of other programs."""
    place = tmp_path_factory.mktemp("mistakes")
    (place / "case.toml").write_text(CASE, encoding="utf-8")
    (place / "study.toml").write_text(STUDY, encoding="utf-8")
    (place / "data.csv").write_text("t,x\n0,1\n1,2\n", encoding="utf-8")
    (place / "points.csv").write_text("x,y\n0,1\n1,2\n", encoding="utf-8")
    (place / "folder").mkdir()
    assert status_of(["run", str(place / "case.toml"), "-o", str(place / "run.nc"), "--quiet"]) == 0
    return place


def line_of(mistake: dict[str, Any], capfd: pytest.CaptureFixture[str]) -> str:
    """Return the error after a mistake: of a command, of a case file that `check` reads, or of a call in Python."""
    if "python" in mistake:
        with pytest.raises((sd.ScissordynError, TypeError, AttributeError)) as raised:
            exec(mistake["python"], {"sd": sd, "arm": sd.scissor(units=2)})
        return str(raised.value)
    for name in ("case", "study"):
        if name in mistake:
            text = {"case": CASE, "study": STUDY}[name]
            for old, new in mistake.get("replace", {}).items():
                assert old in text
                text = text.replace(old, new)
            Path("mistake.toml").write_text(text + mistake[name], encoding="utf-8")
    for name, text in mistake.get("files", {}).items():
        Path(name).write_text(text, encoding="utf-8")
    default = "check mistake.toml" if "case" in mistake else "study mistake.toml -o new.db"
    status = status_of(shlex.split(mistake.get("command", default)))
    said = capfd.readouterr()
    assert status == 2, said.out
    return said.err.removeprefix("scissordyn: ").removesuffix("\n").replace(f"{Path.cwd()}/", "")


@pytest.mark.parametrize(("kind", "mistake"), MISTAKES, ids=[f"{kind}-{k}" for k, (kind, _) in enumerate(MISTAKES)])
def test_the_line(kind, mistake, folder, monkeypatch, capfd):
    """Identity: the line of the table, where lists of names are cut; it says what came, and what is allowed or to be typed."""
    monkeypatch.chdir(folder)
    line = line_of(mistake, capfd)
    assert re.fullmatch(".*".join(map(re.escape, mistake["line"].split("..., "))), line), line
    assert "\n" not in line
    assert any(help_ in line for help_ in HELPS), kind


def test_the_table_has_every_class():
    """Identity: 120 mistakes and more, each once."""
    assert len(MISTAKES) >= 120
    assert len({repr({**mistake, "line": ""}) for _, mistake in MISTAKES}) == len(MISTAKES)
    assert {re.sub("_", " ", kind) for kind in TABLE} == {
        *("units", "names", "types", "tables", "files", "commands", "physics", "studies", "python", "import")
    }


# Too long name of a file, integer with 400 digits, and too large number of points
NAME, DIGITS, MANY = "n" * 256, "9" * 400, "1000000000000"
SWEEP = "sweep case.toml -o out.db --vary A.clearance='0.05..0.4 mm'"  # Command of a study, to which options are appended
# Command of a bifurcation diagram, to which the number of values is appended
SCAN = "bifurcation periodic.toml --over A.clearance --from '0.1 mm' --to '0.2 mm' --values"
LONG = f"{DIGITS[:12]}... (400 digits)"  # Text with which a message abbreviates the integer with 400 digits
LATE = "--measure late=mine.py:late"  # Option with a user-defined measure

REFUSED = {
    "No such file or directory": ("run case.toml -o no/such/folder/run.nc", "run case.toml --animate no/such/folder/film.gif"),
    "it is a folder": ("run case.toml -o .",),
    "Not a directory": ("run case.toml -o taken/run.nc",),
    "it is the case file": ("run case.toml -o case.toml",),
    "cannot write": (
        "run case.toml -o /proc/run.nc",
        "run case.toml --plot /proc/figures",
        "laws liu --plot no/folder/law.png",
    ),
    "taken' is a file": ("run case.toml --plot taken", "run case.toml --plot taken/figures"),
    "did you mean 'gif'": ("run case.toml --animate film.gfi",),
    "did you mean 'png'": ("laws liu --plot law.pgn",),
    "material": ("laws steel --plot law.png",),
    "--events": ("run case.toml --events -1",),
    "File name too long": (
        *(f"run {NAME}.toml", f"check {NAME}.toml", f"run case.toml -o {NAME}.nc", f"run case.toml --plot {NAME}"),
        *(f"run case.toml --animate {NAME}.html", f"plot {NAME}.nc -o figures", f"compare {NAME}.nc {NAME}.nc"),
        *(f"laws flores --plot {NAME}.png", f"paper -o {NAME}", f"study {NAME}.toml -o x.db", f"study status {NAME}"),
        f"sweep case.toml -o {NAME} --vary A.clearance='0.1..0.2 mm'",
    ),
    "a number of values of 400 digits": (f"{SWEEP[:-1]}, {DIGITS} values'",),
    "a number of values of 5000 digits": (f"{SWEEP[:-1]}, {'9' * 5000} values'",),
    f"seed = {LONG}": (f"{SWEEP} --design sobol --points 4 --seed {DIGITS}",),
    "--threads": (f"{SWEEP} --threads 1000000000",),
    "--workers": (f"{SWEEP} --workers 1000000000", f"paper -o paper --workers {DIGITS}"),
    "structure.units": (f"run case.toml --set structure.units={DIGITS}",),
    f"{LONG} m": (f"run case.toml --set 'structure.bar_length={DIGITS} m'",),
    "run.samples": (f"run case.toml --samples {DIGITS}",),
    f"keep = {LONG}": (f"{SCAN} 2 --cycles 2 --keep {DIGITS}",),
    "--seconds": ("animate run.nc film.gif --seconds 1e9",),
    "two measures named 'late'": (f"{SWEEP} {LATE} {LATE}",),
}
"""Commands that are an error, by words of its message: unwritable paths, impossible file names, too long numbers."""

TOO_MANY = (
    *(f"{SWEEP} --design {kind} --points {MANY}" for kind in ("sobol", "random", "latin-hypercube", "saltelli", "morris")),
    f"{SWEEP} --design sobol --points {DIGITS}",
    f"{SWEEP[:-1]}, {MANY} values'",
    "sweep case.toml -o out.db --vary A.clearance='1..2 mm, 1000000 values' --vary drive.speed='1..2 rpm, 1000000 values'",
    *(f"{SWEEP} --members {number}" for number in (MANY, DIGITS)),
    f"{SWEEP} --uncertain 'drive.speed=1..2 rpm' --samples {MANY}",
    f"{SCAN} {MANY}",
    f"{SCAN} 2 --cycles {DIGITS}",
)
"""Commands with more cases or cycles than memory can store results for."""


@pytest.mark.parametrize(
    ("command", "says"),
    [
        *((command, says) for says, commands in REFUSED.items() for command in commands),
        *((command, "expected a whole number >= 1 and <= 10000000") for command in TOO_MANY),
    ],
)
def test_what_is_wrong_is_said(command, says, tmp_path, monkeypatch, refused):
    """Limit: one short line with status 2, although nothing can be computed here; nothing is left behind or changed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("scissordyn.run.simulate.compute_results", None)
    monkeypatch.setattr("scissordyn.run.advance.loop.advance_together", None)
    files = {
        "case.toml": (EXAMPLES / "paper.toml").read_text(),
        "taken": "",
        "mine.py": "def late(run):\n    return 1.0\n",
        **{name: (EXAMPLES / name).read_text() for name in ("mast.toml", "periodic.toml")},
    }
    for name, text in files.items():
        Path(name).write_text(text)
    line = refused(*shlex.split(command))
    assert says in line, line
    assert len(line) < 600
    assert {path.name: path.read_text() for path in tmp_path.iterdir() if path.name != "paper"} == files


def test_samples_fit_into_the_free_memory(tmp_path, monkeypatch, refused):
    """Limit: as many samples as the free memory holds twice, as arrays and as a file; one more is refused before the run."""
    case = EXAMPLES / "paper.toml"
    (tmp_path / "meminfo").write_text("MemTotal: 8000000 kB\nMemAvailable: 1000000 kB\n")
    monkeypatch.setattr(sample_memory, "MEMORY_INFO", tmp_path / "meminfo")
    monkeypatch.setattr("scissordyn.run.simulate.open_checkpoint", None)
    monkeypatch.setattr("scissordyn.run.simulate.compute", None)
    assert sample_memory.free_memory() == 1_024_000_000
    most = 1_024_000_000 // (2 * 8 * (25 + 14 * 5 + (2 + 6) * 7))
    for command in ("run", "check"):
        line = refused(command, str(case), "--set", f"run.samples={most + 1}")
        assert f"this machine has 1.02 GB free; expected at most {most} samples" in line
    sample_memory.check_samples(plan(sd.read_case(case).mechanism), most)


def test_size_of_a_grid():
    """Closed form: the number of a grid's points without its points."""
    assert design_size(Design("grid"), [sd.Interval(0.0, 1.0, count=10**9)] * 4) == 10**36


def test_one_at_a_time_takes_each_level_once():
    """Contract: the base, then the levels of one factor after the other, whichever points are asked for."""
    variations = [sd.Levels((1.0, 2.0)), sd.Interval(5.0, 7.0, count=3)]
    base = np.array([0.0, 4.0])
    whole = [[0, 4], [1, 4], [2, 4], [0, 5], [0, 6], [0, 7]]
    design = Design("one-at-a-time")
    assert design_values(design, variations, base, np.arange(6)).tolist() == whole
    assert design_values(design, variations, base, np.array([5, 2])).tolist() == [whole[5], whole[2]]


def test_names_with_equals_signs_can_be_varied():
    """Contract: the values follow the last equals sign, or one before a distribution; the parameter is named as a whole."""
    drawn = "d=e.speed=norm(loc=1, scale=0.1) rpm"
    given = ["a=b.clearance=0.1..0.2 mm", "c.mass=table(x=y.csv) kg", drawn, "gravity=9, 10 m/s^2"]
    assert values_by_parameter(given, "--vary") == {
        "a=b.clearance": "0.1..0.2 mm",
        "c.mass": "table(x=y.csv) kg",
        "d=e.speed": "norm(loc=1, scale=0.1) rpm",
        "gravity": "9, 10 m/s^2",
    }


def test_names_with_equals_signs_can_be_fitted():
    """Contract: fit splits as vary does, and takes a parameter without a range as a whole."""
    pin = sd.Revolute("a=b", ("bar", "start"), ("ground", "o"), sd.Clearance(1e-4))
    mechanism = sd.Mechanism((sd.bar("bar", length=1.0, mass=1.0, angle=0.0),), (pin,), ground=(("o", (0.0, 0.0)),))
    assert ranges_by_parameter(mechanism, ["a=b.clearance", "bar.mass"]) == {"a=b.clearance": None, "bar.mass": None}
    given = ["a=b.clearance=0.1..0.2 mm", "bar.mass = norm(loc=1, scale=0.1) kg"]
    expected = {"a=b.clearance": "0.1..0.2 mm", "bar.mass": "norm(loc=1, scale=0.1) kg"}
    assert ranges_by_parameter(mechanism, given) == expected
    for wrong in (["=1..2 kg"], ["a=b.clearance", "a=b.clearance=1 mm"]):
        with pytest.raises(sd.InputError, match="--free"):
            ranges_by_parameter(mechanism, wrong)


def slips() -> Iterator[tuple[str, str, str]]:
    """Yield each public function that checks keywords, with its longest keyword, and this keyword without one letter."""
    for name in sd.__all__:
        called = getattr(sd, name)
        if not hasattr(called, "__wrapped__"):
            continue
        parameters = inspect.signature(called).parameters.values()
        named = [each.name for each in parameters if each.kind in (each.KEYWORD_ONLY, each.POSITIONAL_OR_KEYWORD)]
        if named and not any(each.kind is each.VAR_KEYWORD for each in parameters):
            keyword = max(named, key=len)
            yield name, keyword, keyword[:-2] + keyword[-1] if len(keyword) > 3 else f"{keyword[:-1]}xx"


def test_unknown_keywords():
    """Contract: an unknown keyword of a function that compares its arguments is answered with the nearest keyword."""
    tried = list(slips())
    assert {"scissor", "simulate", "statics", "with_bending"} <= {name for name, _, _ in tried}
    for name, keyword, slip in tried:
        with pytest.raises(TypeError, match=rf"{name}.*'{slip}' \(did you mean '{keyword}'\?\)"):
            getattr(sd, name)(**{slip: 1})


def test_each_help_has_an_example(capsys):
    """Contract: every command has one, which begins with its name."""
    for name, (_, _, example) in COMMANDS.items():
        assert example.startswith(f"scissordyn {name}")
        assert status_of([name, "--help"]) == 0
        assert f"Example: {example}" in " ".join(capsys.readouterr().out.split())
