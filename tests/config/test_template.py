"""The case file that is printed to start from."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from scissordyn.config.case import ClearanceTable, DriveTable, Run, ScissorTable
from scissordyn.config.file import read_case
from scissordyn.config.table import table_of
from scissordyn.config.template import template
from scissordyn.errors import InputError

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"


def test_template_is_the_paper_case(tmp_path: Path) -> None:
    """Identity: what is printed reads back as the paper's case."""
    path = tmp_path / "case.toml"
    path.write_text(template("scissor"), encoding="utf-8")
    assert read_case(path) == read_case(PAPER)


def test_template_shows_every_key_with_its_meaning() -> None:
    """Identity: each declared key stands in the text, and each line has a remark."""
    text = template("scissor")
    for table in (ScissorTable, DriveTable, ClearanceTable, table_of(Run, until="50 ms")):
        for key in table.model_fields:
            assert f"\n{key} = " in text or f"\n# {key} = " in text
    for line in text.splitlines():
        assert not line or "# " in line
        assert line == line.rstrip()
        assert "None" not in line


def test_keys_left_out_can_be_put_in(tmp_path: Path) -> None:
    """Identity: a commented key is valid TOML once its mark is taken away."""
    lines = [line[2:] for line in template("scissor").splitlines() if line.startswith("# ") and " = " in line]
    assert len(lines) == 4
    for line in lines:
        assert len(tomllib.loads(line)) == 1


def test_unknown_structures_are_refused() -> None:
    """Identity: with the name that was meant."""
    with pytest.raises(InputError, match="did you mean 'scissor'"):
        template("scisor")
