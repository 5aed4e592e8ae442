"""The commands, from what is typed to what is printed, written and returned."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests.process import Duplicate, run_program

import scissordyn as sd
from cli.test_files import PAPER, SHORT
from scissordyn.casefile.configuration import read_configuration
from scissordyn.cli import run as run_module
from scissordyn.cli.main import status_of
from scissordyn.processor import limit_library_threads
from scissordyn.record.results import Run
from scissordyn.record.xarray_dataset import as_dataset

EXAMPLES = PAPER.parent  # Folder of the package's example cases

LOOP = """
ground = [{ name = "left", position = "0, 0 m" }, { name = "right", position = "2.001, 0 m" }]
body = [
    { name = "one", mass = "1 kg", length = "1 m", position = "0, 0 m" },
    { name = "two", mass = "1 kg", length = "1 m", position = "1.0005, 0 m" },
]
joint = [
    { name = "O", journal = "one.start", bearing = "ground.left" },
    { name = "B", journal = "one.end", bearing = "two.start" },
    { name = "C", journal = "two.end", bearing = "ground.right" },
]
clearance = [{ joint = "B", clearance = "2 mm" }, { joint = "C", clearance = "2 mm" }]
run = { until = "10 ms", start = "as-placed", samples = 11 }
structure = { kind = "mechanism", gravity = "9.81 m/s^2" }
"""
"""Case file of two bars between two ground pins that are 1 mm too far apart, which a clearance of 2 mm permits."""


def test_run_shows_its_contacts_and_saves(folder, capsys):
    """Cross-check: the first contact of docs/reference.md, as printed; and the file holds the same."""
    assert status_of(["run", str(PAPER), "-o", "run.nc", *SHORT]) == 0
    shown = capsys.readouterr()
    assert "1.3651" in shown.out
    assert "0.7351" in shown.out
    assert "-107.82" in shown.out
    assert "Saved to run.nc" in shown.out
    assert max(map(len, shown.out.splitlines())) <= 100
    assert shown.err == ""
    run = sd.load("run.nc")
    assert run.attrs["status"] == "complete"
    assert run.sizes["time"] == 31
    assert float(run["contact_start"][0]) == pytest.approx(0.001365125913, abs=1e-11)
    assert [path.name for path in folder.iterdir()] == ["run.nc"]


def test_a_saved_run_can_be_run_again(folder, refused):
    """Identity: the same numbers, bit for bit; half a file, another kind of file and no file are refused."""
    assert status_of(["run", str(PAPER), "-o", "first.nc", *SHORT]) == 0
    assert status_of(["run", "first.nc", "-o", "second.nc"]) == 0
    xr.testing.assert_equal(sd.load("first.nc"), sd.load("second.nc"))
    assert "saved run" in refused("run", "first.nc", "--samples", "5")
    whole = Path("first.nc").read_bytes()
    for name in ("half.nc", "half-without-a-name"):
        Path(name).write_bytes(whole[: len(whole) // 2])
    Path("text.nc").write_text("time = 3")
    for name in ("half.nc", "half-without-a-name", "text.nc", "none.nc"):
        assert f"cannot read '{name}'" in refused("run", name, "-o", "again.nc")
    assert not Path("again.nc").exists()


def test_the_number_of_contacts_shown_is_chosen(folder, answer):
    """Contract: rows of the table, and a note of the others."""
    changes = ("--set", "run.until=6 ms", "--set", "clearance.A.friction=none")
    assert "... and 1 more contact (--events 3 shows all)" in answer("run", PAPER, *changes, "--events", 2)
    assert "more contact" not in answer("run", PAPER, *changes, "--events", 3)
    assert not list(folder.iterdir())


def test_interrupted_runs_keep_what_was_computed(folder, capsys, monkeypatch):
    """Contract: Ctrl-C inside the run saves the part before it, marked, with exit status 130."""

    @contextmanager
    def impatient(until: float) -> Iterator[Callable[[float], None]]:
        def stop(time: float) -> None:
            raise KeyboardInterrupt

        yield stop

    monkeypatch.setattr(run_module, "progress_bar", impatient)
    assert status_of(["run", str(PAPER), "-o", "part.nc", "--set", "run.rtol=1e-10"]) == 130
    shown = capsys.readouterr()
    assert "marked interrupted" in shown.out
    assert shown.err.startswith("scissordyn: stopped at t = ")
    run = sd.load("part.nc")
    assert run.attrs["status"] == "interrupted"
    assert 0.0 < run.attrs["end"] < 0.05
    assert 1 < run.sizes["time"] < 2001
    assert status_of(["run", "part.nc"]) == 130  # from its start again, which is reported
    told = capsys.readouterr().err
    assert "'part.nc' was interrupted at" in told
    assert "it is computed from its start again; with" in told
    assert "with -o FILE --checkpoint '60 s' a run can go on" in told
    checkpoint = ["-o", "part.nc", "--checkpoint", "60 s", "--set", "run.rtol=1e-10"]
    assert status_of(["run", str(PAPER), *checkpoint]) == 130
    assert capsys.readouterr().err.endswith(": interrupted; the same command continues from there\n")


def test_interrupted_before_anything_was_computed(folder, capsys, monkeypatch):
    """Contract: Ctrl-C elsewhere writes nothing, says so in a line and returns 130."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("scissordyn.config.file.read_case", stop)
    assert status_of(["run", str(PAPER), "-o", "run.nc"]) == 130
    assert capsys.readouterr().err == "scissordyn: interrupted\n"
    assert not list(folder.iterdir())


def test_runs_that_cannot_be_finished_keep_what_they_have(folder, capsys):
    """Contract: a run out of steps is saved with its cause, with exit status 3."""
    assert status_of(["run", str(PAPER), "-o", "part.nc", "--set", "run.most_steps=100"]) == 3
    shown = capsys.readouterr()
    assert "100 steps are not enough" in shown.err
    assert shown.err.count("\n") == 1
    run = sd.load("part.nc")
    assert run.attrs["status"] == "failed"
    assert "100 steps are not enough" in run.attrs["cause"]


@pytest.mark.parametrize("command", ["run", "check"])
def test_bad_cases_are_refused_in_one_line(folder, refused, command):
    """Contract: the message of the reader, nothing computed, nothing written."""
    output = ["-o", "run.nc"] if command == "run" else []
    line = refused(command, str(PAPER), *output, "--set", "clearance.A.clearence=1 mm")
    assert "unknown key 'clearence' (did you mean 'clearance'?)" in line
    (folder / "half.toml").write_text(PAPER.read_text()[:430])
    assert "half.toml" in refused(command, "half.toml", *output)
    assert "cannot read 'none.toml'" in refused(command, "none.toml", *output)
    assert [path.name for path in folder.iterdir()] == ["half.toml"]


def test_a_fault_of_ours_is_one_line(capsys, monkeypatch):
    """Contract: an unexpected error is named, without a traceback unless the user asks for it."""

    def broken(*_: object) -> None:
        raise ZeroDivisionError("two\nlines")

    monkeypatch.setattr("scissordyn.cli.check_lines.read_case", broken)
    monkeypatch.delenv("SCISSORDYN_TRACEBACK", raising=False)
    assert status_of(["check", str(PAPER)]) == 1
    line = capsys.readouterr().err
    assert line.startswith("scissordyn: ZeroDivisionError: two lines;")
    assert line.count("\n") == 1
    monkeypatch.setenv("SCISSORDYN_TRACEBACK", "1")
    assert status_of(["check", str(PAPER)]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_check_says_what_would_be_run(folder, answer):
    """Contract: mechanism, drive, joint and method of the paper's case."""
    shown = answer("check", PAPER)
    joint = ("Joint A: clearance 0.5 mm", "friction lugre")
    assert all(text in shown for text in ("5 bodies, 5 ideal joints and 1 clearance joint", "speed 150 rpm", *joint, "rodas5p"))
    assert not list(folder.iterdir())


def test_curves_take_no_second_run(folder):
    """Identity: samples = "auto" takes the steps of a run with equally spaced samples, and has its samples among its own."""
    command = ["run", str(PAPER), *SHORT[:4], "-q", "--samples"]
    assert status_of([*command, "101", "-o", "plain.nc"]) == 0
    assert status_of([*command, "auto", "-o", "auto.nc"]) == 0
    plain, auto = sd.load("plain.nc"), sd.load("auto.nc")
    assert auto.sizes["time"] > 2001
    np.testing.assert_array_equal(auto["position"].sel(time=plain["time"]), plain["position"])
    steps = [json.loads(run.attrs["statistics"])["steps"] for run in (plain, auto)]
    assert steps[0] == steps[1]


@pytest.mark.parametrize(
    ("case", "options", "number"),
    [
        ("four_bar", ("--set", "run.until=60 ms"), "auto"),
        ("four_bar", ("--set", "run.until=20 ms", "--samples", "2001"), 2001),
        ("solar_array", ("--set", "run.until=20 ms", "--set", "run.samples=31"), 31),
        ("press", ("--set", "run.until=20 ms"), "auto"),
    ],
)
def test_a_run_is_drawn_with_the_samples_that_are_saved(folder, monkeypatch, case, options, number):
    """Identity: pictures beside a run, pictures of its file, and the file have the same samples; `samples` is respected."""
    drawn: list[Run] = []
    monkeypatch.setattr("scissordyn.plot.report.draw_all", lambda run, *_, **__: drawn.append(run) or [])
    assert status_of(["run", str(EXAMPLES / f"{case}.toml"), *options, "-q", "-o", "run.nc", "--plot", "a"]) == 0
    assert status_of(["plot", "run.nc", "-o", "b"]) == 0
    assert status_of(["run", "run.nc", "-q", "-o", "again.nc", "--plot", "c"]) == 0
    saved = sd.load("run.nc")
    chosen = read_configuration(saved).options
    assert chosen is not None
    assert chosen.samples == number
    assert len(drawn) == 3
    for run in (*drawn, sd.load("again.nc")):
        xr.testing.assert_equal(as_dataset(run), saved)


@pytest.mark.parametrize("case", ["paper", "four_bar", "slider_crank"])
def test_check_estimates_no_duration(folder, answer, case):
    """Identity: `check` says the same of a run of 1e9 s as of one of milliseconds: its beginning is not extrapolated."""
    records = []
    for until in ("1 ms", "1e9 s"):
        command = ["check", EXAMPLES / f"{case}.toml", "--set", "drive.speed=0 rpm", "--set", f"run.until={until}"]
        assert " on this machine" not in answer(*command)
        record = json.loads(answer(*command, "--json"))
        records.append({key: value for key, value in record.items() if key not in ("until", "span")})
    assert records[0] == records[1]


def test_check_takes_what_a_run_takes(folder, answer):
    """Identity: a loop that its loose pin alone closes has no ideal assembly; check warns of that and agrees with run."""
    (folder / "loop.toml").write_text(LOOP)
    answer("run", "loop.toml")
    assert "Warning: without clearance: the mechanism as placed cannot be assembled" in answer("check", "loop.toml")


@pytest.mark.parametrize("name", ["film.gif", "film.html"])
def test_a_film_is_made_when_asked_for(folder, capsys, name):
    """Contract: the file that is named is there, of its kind, and nothing else."""
    assert status_of(["run", str(PAPER), "--animate", name, *SHORT]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == name
    assert [path.name for path in folder.iterdir()] == [name]
    assert (folder / name).read_bytes().startswith(b"GIF89a" if name == "film.gif" else b"<!DOCTYPE html>")


def test_help_is_shown_when_nothing_is_typed(answer):
    """Contract: the four commands."""
    shown = answer()
    assert all(f" {command} " in shown for command in ("run", "check", "new", "laws"))


def run_on_terminal(terminal, *words):
    """Run the program with its arguments, with a terminal for its errors."""
    os.dup2(terminal, 2)
    sys.stderr = os.fdopen(2, "w", closefd=False)
    run_program(*words)


def test_a_bar_moves_on_a_terminal_only(folder):
    """Contract: a process on a pseudo-terminal draws a bar on stderr; through a pipe stderr stays empty."""
    with Duplicate(run_program, "run", PAPER, *SHORT) as piped:
        out, err = piped.communicate()
    assert (piped.returncode, err) == (0, "")
    assert "1.3651" in out
    ours, theirs = pty.openpty()
    drawn = b""
    with Duplicate(run_on_terminal, theirs, "run", PAPER, *SHORT) as process:
        os.close(theirs)
        with contextlib.suppress(OSError):  # the far end of a pseudo-terminal closes with an error
            while part := os.read(ours, 4096):
                drawn += part
    os.close(ours)
    assert process.returncode == 0
    assert b"of 3 ms" in drawn


# Programs, a module that each loads, and those that neither it nor the programs before it load
IMPORTS = [
    (
        "from scissordyn.cli.main import *; [app.get_command(None, name) for name in COMMANDS]",
        "scissordyn.cli.main",
        "numba numpy scipy xarray pint pydantic matplotlib rich.console",
    ),
    (
        "from scissordyn import simulate, Mechanism, read_case, load",
        "scissordyn.config.file",
        "scipy xarray pandas h5py pint matplotlib pydantic scissordyn.collection scissordyn.config.schema",
    ),
    (
        "import pathlib, scissordyn.explore.page, scissordyn.run.simulate; from scissordyn.explore.case import open_case; "
        "from scissordyn.plot.canvas import declared_scene; "
        f"declared_scene(open_case(pathlib.Path({str(PAPER)!r})).mechanism)",
        "scissordyn.explore.page",
        "xarray pandas dask pint matplotlib.pyplot",
    ),
    ("import scissordyn.plot.report", "matplotlib", "matplotlib.pyplot"),
    (
        "import scissordyn.studies.answer.trend, scissordyn.lifetime.life, scissordyn as sd; sd.study, sd.fit, sd.wear",
        "scissordyn.studies.answer.trend",
        "scipy.stats matplotlib.pyplot",
    ),
]


def test_imports_load_what_they_need():
    """Contract: helps, `import scissordyn`, pictures and the page in the browser load nothing that they do not need."""
    code = "import sys\n" + "\n".join(f"{program}; print(*sys.modules)" for program, _, _ in IMPORTS)
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60).stdout
    for (program, needed, absent), loaded in zip(IMPORTS, map(str.split, printed.splitlines()), strict=True):
        assert needed in loaded, program
        assert not set(absent.split()) & set(loaded), program


def test_commands_go_without_heavy_libraries(folder):
    """Identity: what is loaded for a few rigid bodies, whose run is shown, and saved and drawn where that is asked for."""
    commands = {f"check {PAPER}": "", f"run {PAPER} ": "", f"run {PAPER} -o run.nc --plot . ": "h5py matplotlib"}
    code = "import sys; from scissordyn.cli.main import status_of\n"
    for command in commands:
        options = SHORT if command.endswith(" ") else ()
        code += f"status_of({[*command.split(), *options]}); print('loaded', *sys.modules)\n"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300).stdout
    found = [line.split() for line in printed.splitlines() if line.startswith("loaded ")]
    for library, loaded in zip(commands.values(), found, strict=True):
        assert {"h5py", "matplotlib"} & set(loaded) == set(library.split())
        assert not {"scipy", "xarray", "pandas", "dask", "pint"} & set(loaded)


def test_commands_give_linear_algebra_one_thread(monkeypatch):
    """Contract: a number of threads that the user has set stays."""
    monkeypatch.setattr(os, "environ", {"OPENBLAS_NUM_THREADS": "3"})
    assert limit_library_threads() == ["OMP_NUM_THREADS", "MKL_NUM_THREADS"]
    assert os.environ == {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "3", "MKL_NUM_THREADS": "1"}


def test_pictures_are_drawn_when_asked_for(folder, capsys):
    """Contract: the files that are named are there, pictures, and nothing else."""
    assert status_of(["run", str(PAPER), "--plot", "new/figures", *SHORT]) == 0
    named = [Path(line) for line in capsys.readouterr().out.splitlines() if line.endswith(".png")]
    assert sorted(named) == sorted(Path("new/figures").iterdir())
    assert len(named) >= 5
    assert status_of(["laws", "flores", "--plot", "law.png"]) == 0
    assert "Drawn into law.png" in capsys.readouterr().out
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in (*named, Path("law.png")))
