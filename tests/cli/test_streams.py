"""Standard output that is full, closed or of another encoding, and names that no file system takes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scissordyn.cli.main import status_of

EXAMPLES = Path(__file__).parents[2] / "examples"
PROGRAM = f"{sys.executable} -m scissordyn"
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def shell(command: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[bytes]:
    """A command of bash, whose status is that of the program."""
    line = f"set -o pipefail; {command}"
    variables = {**os.environ, **environment}
    return subprocess.run(["bash", "-c", line], cwd=folder, env=variables, capture_output=True, timeout=300, check=False)


@pytest.mark.parametrize("command", ["laws", "--help", "--version", "new ring"])
def test_a_full_disk(command: str, tmp_path: Path) -> None:
    """Contract: what cannot be printed is an error of one line with status 2."""
    done = shell(f"{PROGRAM} {command} > /dev/full", tmp_path)
    assert done.returncode == 2
    assert done.stderr.decode().startswith("scissordyn: cannot write what is printed: No space left on device; allowed: ")
    assert done.stderr.count(b"\n") == 1


@pytest.mark.parametrize("command", ["laws | head -1", "--help | head -1", "laws >&-", "laws >&- 2>&-"])
def test_nobody_reads(command: str, tmp_path: Path) -> None:
    """Contract: a pipe that is closed early and an output that is closed are no error."""
    done = shell(f"{PROGRAM} {command}", tmp_path)
    assert done.returncode == 0
    assert done.stderr == b""


@pytest.mark.parametrize("to", ["2> /dev/full", "2>&-"])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_no_room_for_an_error(to: str, unbuffered: str, tmp_path: Path) -> None:
    """Contract: the status says it, whether Python keeps what could not be written or not."""
    assert shell(f"{PROGRAM} check nothing.toml {to}", tmp_path, PYTHONUNBUFFERED=unbuffered).returncode == 2


@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "ascii"}, ASCII])
def test_ascii_terminals(environment: dict[str, str], tmp_path: Path) -> None:
    """Contract: every letter of units is written in ASCII, and names of files as the bytes that they are."""
    case = EXAMPLES / "paper.toml"
    changes = "--set 'run.until=0.1 ms' --samples 3"
    done = shell(f"{PROGRAM} run {case} {changes} -o é.nc && {PROGRAM} laws", tmp_path, **environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"100 us simulated" in done.stdout
    assert "é.nc".encode() in done.stdout or b"e.nc" in done.stdout
    assert (tmp_path / "é.nc").exists()


@pytest.mark.parametrize(
    "command",
    [
        ("run", "{name}.toml"),
        ("check", "{name}.toml"),
        ("run", "{case}", "-o", "{name}.nc"),
        ("run", "{case}", "--plot", "{name}"),
        ("run", "{case}", "--animate", "{name}.html"),
        ("plot", "{name}.nc", "-o", "figures"),
        ("compare", "{name}.nc", "{name}.nc"),
        ("laws", "flores", "--plot", "{name}.png"),
        ("paper", "-o", "{name}"),
        ("study", "{name}.toml", "-o", "x.db"),
        ("study", "status", "{name}"),
        ("sweep", "{case}", "-o", "{name}", "--vary", "A.clearance=0.1..0.2 mm"),
    ],
)
def test_names_that_are_too_long(
    command: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Limit: a name of 256 letters is an error of one line that the system's reason is in."""
    monkeypatch.chdir(tmp_path)
    given = [word.format(name="n" * 256, case=EXAMPLES / "paper.toml") for word in command]
    assert status_of(given) == 2
    said = capfd.readouterr().err
    assert "File name too long" in said
    assert said.count("\n") == 1
