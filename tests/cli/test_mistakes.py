"""What somebody is told who makes one of the typical mistakes of `mistakes.toml`: one line, with what to type."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path
from typing import Any

import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.errors import ScissordynError

TABLE: dict[str, list[dict[str, Any]]] = tomllib.loads(Path(__file__).with_name("mistakes.toml").read_text(encoding="utf-8"))
MISTAKES = [(kind, mistake) for kind, mistakes in TABLE.items() for mistake in mistakes]
HELPS = ("; allowed: ", "; type: ", "did you mean ", "Did you mean ")

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
STUDY = 'case = "case.toml"\nmeasures = ["peak_force"]\n[vary]\n"A.clearance" = "0.1..0.4 mm, 2 values"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a case, a study, a saved run, measured data and drawings of other programs."""
    place = tmp_path_factory.mktemp("mistakes")
    (place / "case.toml").write_text(CASE, encoding="utf-8")
    (place / "study.toml").write_text(STUDY, encoding="utf-8")
    (place / "data.csv").write_text("t,x\n0,1\n1,2\n", encoding="utf-8")
    (place / "points.csv").write_text("x,y\n0,1\n1,2\n", encoding="utf-8")
    (place / "folder").mkdir()
    assert status_of(["run", str(place / "case.toml"), "-o", str(place / "run.nc"), "--quiet"]) == 0
    return place


def line_of(mistake: dict[str, Any], capfd: pytest.CaptureFixture[str]) -> str:
    """What is said to a mistake: of a command, of a case file that `check` reads, or of a call in Python."""
    if "python" in mistake:
        with pytest.raises((ScissordynError, TypeError, AttributeError)) as raised:
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
def test_the_line(
    kind: str, mistake: dict[str, Any], folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Identity: the line of the table, where lists of names are cut; it says what came, and what is allowed or to be typed."""
    monkeypatch.chdir(folder)
    line = line_of(mistake, capfd)
    assert re.fullmatch(".*".join(map(re.escape, mistake["line"].split("..., "))), line), line
    assert "\n" not in line
    assert any(help_ in line for help_ in HELPS), kind


def test_the_table_has_every_class() -> None:
    """Identity: 120 mistakes and more, each once."""
    assert len(MISTAKES) >= 120
    assert len({repr({**mistake, "line": ""}) for _, mistake in MISTAKES}) == len(MISTAKES)
    assert {re.sub("_", " ", kind) for kind in TABLE} == {
        *("units", "names", "types", "tables", "files", "commands", "physics", "studies", "python", "import"),
    }
