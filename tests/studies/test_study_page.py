"""docs/studies.md: its code runs, and its lists are complete."""

import dataclasses
import re
from pathlib import Path

import pytest
from tests.build import EXAMPLES

import scissordyn as sd
from reference.paper_case import paper_case
from scissordyn.cli.main import status_of
from scissordyn.config.study import StudyText, read_study, study_of
from scissordyn.plot.study import feasibility_map
from scissordyn.studies.answer.verdict import by_point
from scissordyn.studies.ask.design import DESIGNS
from scissordyn.studies.compute.execute import execute

PAGE = (Path(__file__).parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")  # Text of the page about studies


def snippets(language):
    """Return the blocks of code in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with the case and the function of the page."""
    monkeypatch.chdir(tmp_path)
    for name in ("array.toml", "paper.toml"):
        (tmp_path / name).write_text(paper_case("2 ms"))
    (tmp_path / "mine.py").write_text(snippets("python")[0])
    return tmp_path


@pytest.mark.parametrize("number", [0, 1])
def test_study_files(number, folder, capsys):
    """Contract: each study file runs, and its report can be written."""
    text = [each for each in snippets("toml") if re.search("^case = ", each, re.MULTILINE)][number]
    if number == 0:  # a measure of the Dataset refuses members, which the page says
        assert status_of([*_written(folder, f"members = 2\n{text}"), "-o", "refused.db"]) == 2
        assert "members = 1" in capsys.readouterr().err
    assert status_of([*_written(folder, text), "-o", "study.db"]) == 0
    shown = capsys.readouterr().out
    assert "all requirements" in shown
    assert ("Pareto front" in shown) == (number == 1)
    if number == 1:  # a chosen number that is a goal keeps its unit too
        assert "rad/s" not in shown
        assert status_of(["study", "extend", "study.db", "--points", "64"]) == 2
        assert (
            "a larger number of generations in the study file; for example scissordyn study study.toml"
            in capsys.readouterr().err
        )
    (folder / "mine.py").unlink()  # no function of the user's is needed to read a study
    capsys.readouterr()
    assert status_of(["study", "status", "study.db"]) == 0
    assert "left for one worker" not in capsys.readouterr().out  # nothing is pending
    assert status_of(["study", "export", "study.db", "-o", "study.csv"]) == 0
    assert status_of(["study", "report", "study.db", "-o", "report.html"]) == 0
    assert (folder / "report.html").read_text().startswith("<!doctype html>")


def _written(folder, text):
    (folder / "study.toml").write_text(text)
    return ["study", "study.toml"]


def test_python(folder, capsys):
    """Contract: the Python code runs and prints a fraction."""
    exec(snippets("python")[1], {})
    assert re.match(r"all requirements: \d+% of the range \(\d+% to \d+%\)\n\{'A\.clearance'", capsys.readouterr().out)


@pytest.mark.parametrize("file", sorted((EXAMPLES / "studies").glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_studies(file):
    """Contract: each example study can be read, its functions exist, and the gallery names it."""
    described = study_of(read_study(file))
    assert described.cases >= 64 or (described.optimisation is not None and described.optimisation.every)
    assert all(callable(own.callable()) for own in described.own_measures)
    results = (Path(__file__).parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert file.stem in results or file.stem.startswith("statements_")


def test_every_design_is_listed():
    """Contract: the table of designs is complete."""
    assert all(f"`{kind}`" in PAGE for kind in DESIGNS if kind != "adaptive")


# Command of a study, to which options are appended
SWEEP = ("sweep", "array.toml", "-o", "a.db", "--vary", "A.clearance=0.1..0.4 mm, 3 values")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("sweep", "array.toml", "-o", "a.db"), "nothing varies"),
        ((*SWEEP, "--samples", "3"), "for example --uncertain"),
        ((*SWEEP, "--design", "morris"), "for example --points 32"),
        ((*SWEEP, "--measure", "late = none.py:late"), "measure 'late': no file 'none.py'; expected a Python file"),
        ((*SWEEP, "--measure", "late = array.toml:late"), "measure 'late' from 'array.toml:late'; expected a Python file"),
        ((*SWEEP, "--cluster", "none.yaml"), "cannot read 'none.yaml': No such file or directory; expected YAML"),
        ((*SWEEP, "--require", "peak_forse < 500 N"), "did you mean 'peak_force'"),
        ((*SWEEP, "--require", "tip.eror < 3 mm"), "did you mean 'error'"),
        ((*SWEEP, "--measure", "late [kN m = mine.py:late"), "a name, a unit in brackets, and a function in a file"),
        ((*SWEEP, "--measure", "late [knots] = mine.py:late"), "unknown unit 'knots'"),
        ((*SWEEP, "--measure", "late [N] = mine.py:late", "--require", "late < 5 mm"), "'mm' is not a unit of [N]"),
        ((*SWEEP, "--measure", "tip.error"), "no track 'tip' with a peak_track_deviation; expected a case with a track"),
        ((*SWEEP, "--require", "B.peak_force < 500 N"), "no joint 'B' with a peak_force; expected A"),
        ((*SWEEP, "--threads", "1", "--workers", "2"), "--threads and --workers"),
        (("study", "statos", "a.db"), "did you mean 'status'"),
        (("study", "status", "mine"), "is not a study"),
        (("study", "status"), "without a store"),
        (
            ("study", "study.toml", "-o", "a.db", "--points", "8"),
            "--points without extend; expected study extend, study refine",
        ),
        (("study", "status", "a.db", "--plot", "figures"), "--plot without report"),
        (
            ("study", "status", "a.db", "-o", "b.db"),
            "-o without a study file; expected a study file, study refine, study report",
        ),
        (("study", "resume", "a.db", "-o", "b.db"), "-o without a study file"),
        (("study", "resume", "a.db", "--block", "8"), "--block without a study file; expected a study file, study refine"),
        (("study", "report", "a.db", "3"), "a case number without replay; expected study replay; for example scissordyn study"),
        (("study", "export", "a.db", "--threads", "2"), "--threads without a study file; expected a study file, study resume"),
        (("study", "replay", "a.db", "0", "--workers", "2"), "--workers without a study file"),
        (("study", "refine", "a.db", "-o", "b.db", "--budget", "1 min"), "--budget without a study file"),
        (("study", "study.toml", "a.db", "3"), "a case number without replay"),
        (("study", "bad.toml", "-o", "a.db"), "unknown key 'varry' (did you mean 'vary'?)"),
        (("study", "sampling.toml", "-o", "a.db"), "sampling 'sobel' (did you mean 'sobol'?); expected random, latin"),
        (("study", "study.toml", "-o", "s3://bucket/a.db"), "a file on a disk"),
    ],
)
def test_bad_input(arguments, says, folder, capsys):
    """Contract: one line, status 2, and no store."""
    (folder / "bad.toml").write_text('case = "array.toml"\n[varry]\n')
    (folder / "study.toml").write_text('case = "array.toml"\n[vary]\n"A.clearance" = "0.1..0.2 mm"\n')
    (folder / "sampling.toml").write_text('case = "array.toml"\n[sampling]\nkind = "sobel"\n')
    (folder / "mine").mkdir()
    (folder / "mine" / "file").write_text("")
    assert status_of(arguments) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not (folder / "a.db").exists()


# Case file with a servo
SERVO = """
[structure]
kind = "scissor"

[drive]
cycloidal = { start = "30 deg", end = "60 deg", duration = "0.2 s" }

[[control]]
name = "servo"
controller = { name = "feed-forward", proportional = "2000 N m/rad", derivative = "100 N m s/rad", limit = "100 N m" }

[[track]]
name = "tip"
body = "unit 1/bar 1"
point = "end"

[[clearance]]
joint = "all"
clearance = "0.1 mm"
friction = "none"

[run]
until = "2 ms"
"""


def test_example_of_the_introduction(folder, capsys):
    """Contract: one value of all clearances, torque limits as levels, the error of a tracked point, a required force."""
    (folder / "case.toml").write_text(SERVO)
    arguments = ["sweep", "case.toml", "--vary", "clearance.all.clearance=0.05..0.4 mm"]
    arguments += ["--vary", "servo.controller.limit=50, 100, 200 N m", "--measure", "peak_force", "--measure", "tip.error"]
    arguments += ["--require", "peak_force < 500 N", "-o", "study.db"]
    assert status_of(arguments) == 0
    shown = capsys.readouterr().out
    assert "30 cases complete" in shown
    assert " tip.peak_track_deviation " in shown  # and not that of whatever point deviates most
    found = sd.open_study(folder / "study.db").dataset
    assert found["peak_track_deviation"].dims == ("case", "track")
    assert sorted(set(found["servo.controller.limit"].values.tolist())) == [50.0, 100.0, 200.0]
    assert float(found["peak_track_deviation"].min()) > 0.0


def test_pictures_have_the_units_of_the_text(folder):
    """Contract: a speed that was written in rpm is shown in rpm, and no number depends on that."""
    vary = {"A.clearance": "0.1..0.4 mm, 2 values", "drive.speed": "100, 200 rpm"}
    described = study_of(StudyText(case=str(folder / "array.toml"), vary=vary, measures=("peak_force",)))
    bare = tuple(dataclasses.replace(factor, unit="", scale=1.0) for factor in described.factors)
    assert dataclasses.replace(described, factors=bare).fingerprint() == described.fingerprint()
    store = execute(described, folder / "a.db", block=4)
    assert store.study() == described
    axes = feasibility_map(by_point(described, store.results()), colour="peak_force")[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("A.clearance [mm]", "drive.speed [rpm]")
    assert axes.get_ylim()[0] < 101.0 < 199.0 < axes.get_ylim()[1] < 300.0


def test_commands_of_a_study(folder, capsys):
    """Contract: sweep, status, extend, retry, export and replay; another study and an unknown case are refused."""
    sweep = ("sweep", "array.toml", "-o", "a.db", "--vary", "A.clearance=0.1..0.4 mm", "--design", "sobol", "--points", "4")
    assert status_of(sweep) == 0
    assert status_of([*sweep, "--set", "run.until=1 ms"]) == 2
    assert "another study (differs in options)" in capsys.readouterr().err
    assert status_of(["study", "extend", "a.db", "--points", "8"]) == 0
    assert status_of(["study", "status", "a.db"]) == 0
    assert "8 points x 1 cases: 8 complete, 0 failed, 0 pending" in capsys.readouterr().out
    assert status_of(["study", "export", "a.db", "-o", "a.csv"]) == 0
    assert len((folder / "a.csv").read_text().splitlines()) == 9
    assert status_of(["study", "replay", "a.db", "5", "-o", "run.nc"]) == 0
    assert (folder / "run.nc").exists()
    assert status_of(["study", "replay", "a.db", "8"]) == 2
    capsys.readouterr()
    assert status_of(["study", "replay", "a.db"]) == 2
    assert "'study replay' without a case; expected 0 to 7; for example scissordyn study replay" in capsys.readouterr().err
    failing = ("sweep", "array.toml", "-o", "b.db", "--vary", "A.clearance=0.1..0.4 mm", "--set", "run.most_steps=5")
    capsys.readouterr()
    assert status_of(failing) == 3
    shown = capsys.readouterr()
    assert "all 10 cases failed" in shown.err
    assert "cases 10; cause stopped at" in shown.out
    assert status_of(["study", "retry", "b.db"]) == 3
