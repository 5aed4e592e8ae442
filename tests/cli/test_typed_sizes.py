"""Sizes that cannot be: refused at once in one line, with the memory and the time that they would take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scissordyn.cli.main import status_of
from scissordyn.run.start import demand
from scissordyn.run.start.demand import duration, size
from scissordyn.study.ask.design import Design, design_size, design_values
from scissordyn.study.ask.distribution import Interval, Levels

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER, PERIODIC = str(EXAMPLES / "paper.toml"), str(EXAMPLES / "periodic.toml")
DIGITS = "9" * 400
CLEARANCE = ("--vary", "A.clearance=0.05..0.4 mm")
SWEEP = ("sweep", PAPER, "-o", "out.db")
SCAN = ("bifurcation", PERIODIC, "--over", "A.clearance", "--from", "0.1 mm", "--to", "0.2 mm")
MANY = "1000000000000"


@pytest.mark.parametrize(
    ("command", "says"),
    [
        (("run", str(EXAMPLES / "mast.toml"), "--set", "structure.units=10", "--samples", "10000000"), "samples of"),
        (
            ("check", str(EXAMPLES / "mast.toml"), "--set", "structure.units=10", "--set", "run.samples=10000000"),
            "samples of",
        ),
        *(
            ((*SWEEP, *CLEARANCE, "--design", kind, "--points", MANY), "e+12 points")
            for kind in ("sobol", "random", "latin-hypercube", "saltelli", "morris")
        ),
        ((*SWEEP, *CLEARANCE, "--design", "sobol", "--points", DIGITS), "1.000e+400 points"),
        ((*SWEEP, "--vary", f"A.clearance=0.05..0.4 mm, {MANY} values"), "1.000e+12 cases"),
        (
            (*SWEEP, "--vary", "A.clearance=1..2 mm, 1000000 values", "--vary", "drive.speed=1..2 rpm, 1000000 values"),
            "1.000e+12 cases",
        ),
        ((*SWEEP, *CLEARANCE, "--members", "1000000000000"), "members of each"),
        ((*SWEEP, *CLEARANCE, "--members", DIGITS), "members of each"),
        ((*SWEEP, *CLEARANCE, "--uncertain", "drive.speed=uniform(1, 2) rpm", "--samples", MANY), "samples of each"),
        ((*SWEEP, *CLEARANCE, "--workers", "1000000000"), "1.000e+9 workers"),
        (("paper", "-o", "paper", "--workers", DIGITS), "workers"),
        ((*SCAN, "--values", MANY), "1.000e+12 values"),
        ((*SCAN, "--values", "2", "--cycles", DIGITS), "1.000e+400 cycles"),
    ],
)
def test_what_it_would_take_is_said(
    command: tuple[str, ...], says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Limit: status 2 in one line with memory, time and what this machine has; nothing is computed or left behind."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("scissordyn.run.advance.driver.advance_together", None)
    monkeypatch.setattr(demand, "machine_memory", lambda: 10**9)
    assert status_of(command) == 2
    said = capfd.readouterr().err
    assert says in said
    assert " of memory and " in said
    assert "; this machine has " in said
    assert said.count("\n") == 1
    assert len(said) < 600
    assert not [path for path in tmp_path.iterdir() if path.name != "paper"]


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ((*SWEEP, "--vary", f"A.clearance=0.05..0.4 mm, {DIGITS} values"), "a number of values of 400 digits"),
        ((*SWEEP, "--vary", f"A.clearance=0.05..0.4 mm, {'9' * 5000} values"), "a number of values of 5000 digits"),
        ((*SWEEP, *CLEARANCE, "--design", "sobol", "--points", "4", "--seed", DIGITS), "seed = 999999999999... (400 digits)"),
        ((*SWEEP, *CLEARANCE, "--threads", "1000000000"), "--threads"),
        (("run", PAPER, "--set", f"structure.units={DIGITS}"), "structure.units"),
        (("run", PAPER, "--set", f"structure.bar_length={DIGITS} m"), "999999999999... (400 digits) m"),
        (("run", PAPER, "--samples", DIGITS), "run.samples"),
        ((*SCAN, "--values", "2", "--cycles", "2", "--keep", DIGITS), "keep = 999999999999... (400 digits)"),
        (("animate", "run.nc", "film.gif", "--seconds", "1e9"), "--seconds"),
        ((*SWEEP, *CLEARANCE, "--measure", "late=mine.py:late", "--measure", "late=mine.py:late"), "two measures named 'late'"),
    ],
)
def test_numbers_without_end_are_refused(
    command: tuple[str, ...], says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Limit: numbers of hundreds and thousands of digits, and other slips: one short line with status 2."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text("def late(run):\n    return 1.0\n")
    assert status_of(command) == 2
    said = capfd.readouterr().err
    assert says in said
    assert said.count("\n") == 1
    assert len(said) < 600


def test_names_with_equals_signs_can_be_varied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Contract: the values follow the last equals sign, or one before a distribution; the parameter is named as a whole."""
    from scissordyn.cli.study import addressed

    given = ["a=b.clearance=0.1..0.2 mm", "c.mass=table(x=y.csv) kg", "d=e.speed=normal(1, 0.1) rpm", "gravity=9, 10 m/s^2"]
    assert addressed(given, "--vary") == {
        "a=b.clearance": "0.1..0.2 mm",
        "c.mass": "table(x=y.csv) kg",
        "d=e.speed": "normal(1, 0.1) rpm",
        "gravity": "9, 10 m/s^2",
    }
    monkeypatch.chdir(tmp_path)
    assert status_of([*SWEEP, "--vary", "a=b.clearance=0.1..0.2 mm"]) == 2
    assert "a=b" in capfd.readouterr().err


def test_sizes_in_words() -> None:
    """Closed form: amounts of memory and times of any length, and the number of a grid's points without its points."""
    assert [size(10**n) for n in (6, 10, 13)] == ["1 MB", "10 GB", "10 TB"]
    assert size(10**412) == "1.00e+400 TB"
    assert [duration(s) for s in (1.5, 600.0, 10_800.0, 31_557_600 * 5)] == ["1.5 s", "10 minutes", "3 hours", "5 years"]
    assert design_size(Design("grid"), [Interval(0.0, 1.0, count=10**9)] * 4) == 10**36


def test_one_at_a_time_takes_each_level_once() -> None:
    """Contract: the base, then the levels of one factor after the other, whichever points are asked for."""
    variations = [Levels((1.0, 2.0)), Interval(5.0, 7.0, count=3)]
    base = np.array([0.0, 4.0])
    whole = [[0, 4], [1, 4], [2, 4], [0, 5], [0, 6], [0, 7]]
    design = Design("one-at-a-time")
    assert design_values(design, variations, base, np.arange(6)).tolist() == whole
    assert design_values(design, variations, base, np.array([5, 2])).tolist() == [whole[5], whole[2]]
