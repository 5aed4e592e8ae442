"""The command that lists, prints and copies the examples."""

from __future__ import annotations

from pathlib import Path

from scissordyn.cli.main import status_of
from scissordyn.config.file import read_case

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_every_example_is_listed_with_what_it_is(capsys):
    """Contract: a line for each, and what to type next."""
    assert status_of(["examples"]) == 0
    shown = capsys.readouterr().out
    for path in EXAMPLES.rglob("*.toml"):
        name = path.relative_to(EXAMPLES).with_suffix("").as_posix()
        assert any(line.startswith(f"{name} ") and len(line.split()) > 3 for line in shown.splitlines()), name
    assert "scissordyn examples paper > case.toml" in " ".join(shown.split())


def test_one_is_printed_as_it_is(capsys):
    """Contract: the text of the file."""
    assert status_of(["examples", "paper"]) == 0
    assert capsys.readouterr().out == (EXAMPLES / "paper.toml").read_text()


def test_all_are_copied_and_nothing_is_overwritten(tmp_path, capsys):
    """Contract: studies find their cases; a second copy changes nothing, another file of the name is kept."""
    target = tmp_path / "mine"
    assert status_of(["examples", "-o", str(target)]) == 0
    assert {path.relative_to(target) for path in target.rglob("*.toml")} == {
        path.relative_to(EXAMPLES) for path in EXAMPLES.rglob("*.toml")
    }
    assert (target / "studies" / "statements.py").exists()
    assert read_case(target / "paper.toml").mechanism.bodies
    assert status_of(["examples", "-o", str(target)]) == 0
    (target / "paper.toml").write_text("mine")
    capsys.readouterr()
    assert status_of(["examples", "paper", "-o", str(target)]) == 2
    assert "exists and is another file" in capsys.readouterr().err
    assert (target / "paper.toml").read_text() == "mine"


def test_a_mistyped_example_is_proposed(capsys):
    """Bad input: one line with the nearest name."""
    assert status_of(["examples", "papr"]) == 2
    assert "did you mean 'paper'?" in capsys.readouterr().err
