"""What cannot be read as a run."""

from __future__ import annotations

from pathlib import Path

import pytest

import scissordyn as sd


@pytest.mark.parametrize(("name", "reads"), [("case.toml", "sd.read_case"), ("study.db", "sd.open_study")])
def test_another_file_names_what_reads_it(tmp_path: Path, name: str, reads: str) -> None:
    """Limit: a case file or a study in place of a run leads to the function for it."""
    path = tmp_path / name
    path.write_text("", encoding="utf-8")
    with pytest.raises(sd.InputError, match=rf"as a run: .*type: {reads}\('.*{name}'\)"):
        sd.load(path)
