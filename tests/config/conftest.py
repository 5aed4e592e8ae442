"""Case files of the tests of one room: written in a folder of their own, and read."""

from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from scissordyn.casefile.case import Case
from scissordyn.config.file import read_case


@pytest.fixture
def case_of(tmp_path: Path) -> Callable[..., Case]:
    """Reads a case file with a text, case.toml of the test's folder, and with changes."""

    def read(text: str, changes: Iterable[str] = ()) -> Case:
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        return read_case(path, changes)

    return read
