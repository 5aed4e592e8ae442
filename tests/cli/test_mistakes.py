"""What is said to somebody who has mistyped, as those do of `mistakes.toml`: one line, with what to type."""

from __future__ import annotations

import inspect
import pickle
import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import scissordyn as sd
from scissordyn.cli.main import COMMANDS, status_of
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


BARE = '[structure]\nkind = "scissor"\n{}\n[run]\nuntil = "1 ms"\n'


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("bar_length = 2 m", 'type: bar_length = "2 m"'),
        ('bar_length = "0,5 mm"', 'a decimal comma; allowed: a decimal point; type: bar_length = "0.5 mm"'),
        ('[[clearance]]\njoint = "a"\nclearance = "1 mm"', "did you mean 'A'?"),
        ('[[payload]]\nat = "tip"\nmass = "1 kg"', 'or a point as "BODY.POINT"'),
        ('[drive]\nspeed = "150 rpm"\n# 2 m', ""),
    ],
)
def test_case_files(tmp_path: Path, capsys: pytest.CaptureFixture[str], lines: str, says: str) -> None:
    """Contract: the line that mends it."""
    path = tmp_path / "case.toml"
    path.write_text(BARE.format(lines))
    assert status_of(["check", str(path), "--quiet"]) == (2 if says else 0)
    assert says in capsys.readouterr().err


def test_words_of_other_programs(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Contract: a word near "simulate" means run; a missing store is not to be written as a case; pictures want a folder."""
    for words, says in (
        (["smulate", "case.toml"], "did you mean 'run'?"),
        (["rnu"], "Did you mean 'run'?"),
        (["plot", "run.nc", "-o", str(tmp_path / "p.png")], "a folder of pictures"),
    ):
        assert status_of(words) == 2
        assert says in capsys.readouterr().err
    assert status_of(["explore", str(tmp_path / "s.db")]) == 2
    assert "new scissor" not in capsys.readouterr().err
    assert not (tmp_path / "p.png").exists()


def slips() -> Iterator[tuple[str, str, str]]:
    """Every public function and class with its longest keyword, and the same with a letter left out."""
    for name in sd.__all__:
        called = getattr(sd, name)
        if not callable(called) or (isinstance(called, type) and issubclass(called, Exception)):
            continue
        parameters = inspect.signature(called).parameters.values()
        named = [each.name for each in parameters if each.kind in (each.KEYWORD_ONLY, each.POSITIONAL_OR_KEYWORD)]
        if named and not any(each.kind is each.VAR_KEYWORD for each in parameters):
            keyword = max(named, key=len)
            yield name, keyword, keyword[:-2] + keyword[-1] if len(keyword) > 3 else f"{keyword[:-1]}xx"


def test_keywords_of_everything_public() -> None:
    """Contract: an unknown keyword of a public function or class is answered with its name and the nearest keyword."""
    tried = list(slips())
    assert len(tried) > 110
    assert {"scissor", "Clearance", "LuGre", "simulate", "simulate_many", "study"} <= {name for name, _, _ in tried}
    for name, keyword, slip in tried:
        with pytest.raises(TypeError, match=rf"{name}.*'{slip}' \(did you mean '{keyword}'\?\)"):
            getattr(sd, name)(**{slip: 1})


def test_public_functions_are_pickled() -> None:
    """Contract: what answers unknown keywords is found by its name in another process."""
    for called in (sd.simulate_many, sd.save, sd.Clearance, sd.fit):
        assert pickle.loads(pickle.dumps(called)) is called


def test_each_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    """Contract: every command has one, which begins with its name."""
    for name, (_, _, example) in COMMANDS.items():
        assert example.startswith(f"scissordyn {name}")
        assert status_of([name, "--help"]) == 0
        assert f"Example: {example}" in " ".join(capsys.readouterr().out.split())


def test_a_store_in_place_of_a_case_file_is_named(tmp_path, capsys):
    """Contract: what to type for the store of a study, and no word about writing a case file over it."""
    store = tmp_path / "s.db"
    store.write_bytes(b"SQLite format 3")
    assert status_of(["check", str(store)]) == 2
    said = capsys.readouterr().err
    assert "it is the store of a study" in said
    assert f"scissordyn study report {store}" in said
    assert "new scissor" not in said


def test_a_mistyped_name_of_the_package_is_proposed():
    """Contract: the nearest public name."""
    with pytest.raises(AttributeError, match=r"no attribute 'smulate' \(did you mean 'simulate'\?\)"):
        getattr(sd, "smulate")  # noqa: B009 (a type checker knows better)
