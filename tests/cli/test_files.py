"""Files that the commands read, execute, refuse, copy and overwrite."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.casefile import text
from scissordyn.cli.main import status_of

EXAMPLES = Path(__file__).parents[2] / "examples"  # Folder of the package's example cases
PAPER = EXAMPLES / "paper.toml"  # Case file of the paper's array
SHORT = ("--set", "run.until=3 ms", "--set", "clearance.A.friction=none", "--samples", "31")
"""Options of a run that takes milliseconds: the first contact of the paper's case, without friction."""


Refused = Callable[..., str]


@pytest.mark.parametrize("name", ["case.toml", "case.TOML", "case.txt", "case"])
def test_the_case_file_survives(folder, refused, name):
    """Contract: whatever it is called, by whatever way it is named, and whatever the result is."""
    case = folder / name
    case.write_text(PAPER.read_text())
    (folder / "other.toml").write_text(PAPER.read_text())
    (folder / "link").symlink_to(case)
    for output in (name, "./" + name, "link", "other.toml"):
        assert "cannot write" in (line := refused("run", name, "-o", output)) or "not overwritten" in line
    (folder / "film.html").write_text(PAPER.read_text())
    assert "it is the case file" in refused("run", "film.html", "--animate", "film.html")
    assert "not overwritten" in refused("run", name, "--animate", "film.html")
    scan = ("--over", "A.clearance", "--from", "0.1 mm", "--to", "0.2 mm")
    assert "not a NetCDF file" in refused("bifurcation", name, *scan, "-o", "other.toml")
    (folder / "diagram.png").write_text(PAPER.read_text())
    assert "not a PNG file" in refused("bifurcation", name, *scan, "--plot", "diagram.png")
    assert "not a PNG file" in refused("laws", "liu", "--plot", "diagram.png")
    assert all(path.read_text() == PAPER.read_text() for path in folder.iterdir())


def test_results_may_be_replaced(folder, refused):
    """Contract: by results of their kind, except that a saved run is not replaced by itself run again."""
    for _ in range(2):
        assert status_of(["run", str(PAPER), "-o", "run.nc", "--animate", "film.html", *SHORT]) == 0
        assert status_of(["laws", "liu", "--plot", "law.png"]) == 0
    assert "it is the case file" in refused("run", "run.nc", "-o", "run.nc")
    assert sd.load("run.nc").sizes["time"] == 31


def test_what_has_no_end_is_not_read(folder, refused, monkeypatch):
    """Contract: devices, pipes, folders and huge files are refused as case files, as tables and as saved runs."""
    os.mkfifo("pipe")
    os.mkfifo("pipe.nc")
    for path in ("/dev/zero", "pipe", "/dev/null"):
        for command in ("run", "check"):
            assert "not a regular file" in refused(command, path)
    for path in ("pipe.nc", "/dev/null"):
        assert "not a" in refused("run", path)
    assert "it is a folder" in refused("check", ".")
    with Path("huge.toml").open("wb") as file:
        file.truncate(text.FILE_BYTES_MAX + 1)
    assert "'huge.toml' has more than 64 MiB" in refused("check", "huge.toml")
    table = 'drive = { table = "/dev/zero" }\n' + PAPER.read_text().replace('[drive]\nspeed = "150 rpm"', "")
    Path("table.toml").write_text(table)
    assert "not a regular file" in refused("check", "table.toml")


# Python file with a user-defined stiffness law
LAWS = """
import scissordyn as sd


@sd.element(slot="stiffness")
def soft(indentation, stiffness):
    return stiffness * indentation
"""


def test_code_of_a_saved_run_needs_consent(folder, refused):
    """Contract: a case file may name a Python file; a saved run is run again only if the user names that file."""
    (folder / "my_laws.py").write_text(LAWS)
    law = ("--set", "clearance.A.stiffness={ law = 'my_laws.py:soft', stiffness = 1e8 }")
    assert status_of(["run", str(PAPER), "-o", "run.nc", *SHORT, *law]) == 2  # a case file's folder is where names begin
    (folder / "case.toml").write_text(PAPER.read_text())
    assert status_of(["run", "case.toml", "-o", "run.nc", *SHORT, *law]) == 0
    line = refused("run", "run.nc", "-o", "again.nc")
    assert "'soft' of 'my_laws.py', which is not executed unless you allow it" in line
    assert "--allow-code my_laws.py" in line
    assert status_of(["run", "run.nc", "-o", "again.nc", "--allow-code", "my_laws.py", "--plot", "again"]) == 0
    assert sd.load("run.nc").equals(sd.load("again.nc"))
    assert "with a case file" in refused("run", "case.toml", "--allow-code", "my_laws.py")
    (folder / "my_laws.py").write_text(LAWS.replace("stiffness *", "2.0 * stiffness *"))
    assert "digest" in refused("run", "run.nc", "--allow-code", "my_laws.py")


def test_names_in_messages_are_text(folder, refused):
    """Contract: neither a name in a case file nor the name of a file can send codes to the terminal."""
    for name in ("[/red]", "\x1b[31mred\x1b[0m", "two\nlines", "\u202eleft", "\x9b31m"):
        refused("check", str(PAPER), "--set", f"drive.{name}=3")
        assert "cannot read" in refused("run", f"{name}.toml")
        assert "cannot read" in refused("run", f"{name}.nc")


def test_examples_are_listed_and_printed_as_they_are(capsys):
    """Contract: a line for each, and what to type next; then the text of the file."""
    assert status_of(["examples"]) == 0
    shown = capsys.readouterr().out
    for path in EXAMPLES.rglob("*.toml"):
        name = path.relative_to(EXAMPLES).with_suffix("").as_posix()
        assert any(line.startswith(f"{name} ") and len(line.split()) > 3 for line in shown.splitlines()), name
    assert "scissordyn examples paper > case.toml" in " ".join(shown.split())
    assert status_of(["examples", "paper"]) == 0
    assert capsys.readouterr().out == (EXAMPLES / "paper.toml").read_text()


def test_all_are_copied_and_nothing_is_overwritten(folder, refused):
    """Contract: studies find their cases; a second copy changes nothing, another file of the name is kept."""
    for _ in range(2):
        assert status_of(["examples", "-o", "mine"]) == 0
        copied, target = ({path.relative_to(top) for path in top.rglob("*.toml")} for top in (EXAMPLES, Path("mine")))
        assert copied == target
    assert Path("mine/studies/statements.py").exists()
    assert sd.read_case("mine/paper.toml").mechanism.bodies
    Path("mine/paper.toml").write_text("mine")
    assert "exists with other content" in refused("examples", "paper", "-o", "mine")
    assert Path("mine/paper.toml").read_text() == "mine"
