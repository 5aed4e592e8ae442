"""Case files of the tests of this room, each in its own folder."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from tests import build

import scissordyn as sd


@pytest.fixture
def case_of(tmp_path: Path) -> Callable[..., sd.Case]:
    """Return the case of a text, which is written to case.toml of the test's folder, with changes."""
    return partial(build.case_of, tmp_path)
