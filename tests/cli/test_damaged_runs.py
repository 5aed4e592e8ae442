"""Damaged runs: every command that reads one says so in one line with status 2, or does what can be done."""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest

from damaged import damaged_run  # isort: skip
from scissordyn.cli.main import status_of
from scissordyn.run.store import load

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK, ALL, BLOCK = 20, 1020, 50


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Saved runs: of the paper's array with its horizon, and of a lift with end stops and a rod."""
    folder, made = tmp_path_factory.mktemp("whole"), []
    for name, until, extra in (("paper", "2 ms", ("--trust",)), ("lift", "20 ms", ())):
        made.append(folder / f"{name}.nc")
        options = ("-o", str(made[-1]), "--samples", "5", "--set", f"run.until={until}", "--quiet", *extra)
        assert status_of(["run", str(EXAMPLES / f"{name}.toml"), *options]) == 0
    return made


READING = (
    ("compare", "damaged.nc", "whole.nc"),
    ("compare", "whole.nc", "damaged.nc"),
    ("export", "damaged.nc", "table.csv"),
    ("export", "damaged.nc", "contacts.csv", "--contacts"),
    ("export", "damaged.nc", "arrays.mat"),
)
DRAWING = (
    ("compare", "whole.nc", "damaged.nc", "-o", "figures"),
    ("plot", "damaged.nc", "-o", "figures", "--only", "response,force,torque,orbit,energy"),
    ("plot", "damaged.nc", "-o", "figures", "--only", "structure"),
    ("animate", "damaged.nc", "film.html"),
)
AGAIN = ("run", "damaged.nc", "--events", "3")
DRAWN = 10  # One of so many files is drawn, which takes a second and more, and one of so many is run again


def command_of(number: int) -> tuple[str, ...]:
    """The command that a damaged file is given to."""
    turn = number // DRAWN
    return {3: DRAWING[turn % len(DRAWING)], 7: AGAIN}.get(number % DRAWN, READING[(number + turn) % len(READING)])


def tried(capfd: pytest.CaptureFixture[str], whole: list[Path], first: int, last: int) -> set[int]:
    """Statuses of a command on each of some damaged runs; all of them come in turn."""
    found = set()
    for number in range(first, last):
        sound = whole[number % 2]
        shutil.copy(sound, "whole.nc")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the libraries that write what is damaged
            damaged_run(sound, Path("damaged.nc"), number)
        command = command_of(number)
        status = status_of(command)
        shown = capfd.readouterr()
        assert status in (0, 2, 3), (number, command, shown.err)
        assert shown.err.count("\n") == (0 if status == 0 else 1), (number, command, shown.err)
        found.add(status)
    return found


def test_damaged_runs(
    capfd: pytest.CaptureFixture[str], whole: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Contract: of twenty damaged files each is refused in one line or read; some do each."""
    monkeypatch.chdir(tmp_path)
    assert {0, 2} <= tried(capfd, whole, 0, QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(QUICK, ALL, BLOCK))
def test_a_thousand_damaged_runs(
    capfd: pytest.CaptureFixture[str], whole: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, first: int
) -> None:
    """Contract: as above, for a thousand further files."""
    monkeypatch.chdir(tmp_path)
    assert 2 in tried(capfd, whole, first, first + BLOCK)


@pytest.mark.parametrize("damage", ["end", "units", "NaN", "length", "names", "statistics"])
def test_what_is_damaged_is_named(
    capfd: pytest.CaptureFixture[str], whole: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: str
) -> None:
    """Contract: every command that reads a run refuses it, and names the attribute or the variable."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(whole[0], "whole.nc")
    run, named = load(whole[0]), damage
    if damage == "end":
        run.attrs["end"] = "soon"
    elif damage == "statistics":
        run.attrs["statistics"] = "[]"
    elif damage == "units":
        named = "position"
        del run["position"].attrs["units"]
    elif damage == "NaN":
        named = "kinetic_energy"
        run["kinetic_energy"][1] = np.nan
    elif damage == "length":
        named = "contact_joint"
        run = run.drop_vars("contact_joint")
    else:
        named = "joint"
        run = run.assign_coords(joint=("joint", ["A"] * run.sizes["joint"], run["joint"].attrs))
    run.to_netcdf("damaged.nc", engine="h5netcdf")
    for command in (*READING, *DRAWING):
        assert status_of(command) == 2, command
        said = capfd.readouterr().err
        assert f"'{named}'" in said
        assert said.count("\n") == 1
