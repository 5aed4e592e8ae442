"""Case files of the tests of this room, each in its own folder."""

from functools import partial

import pytest
from tests import build


@pytest.fixture
def case_of(tmp_path):
    """Return the case of a text, which is written to case.toml of the test's folder, with changes."""
    return partial(build.case_of, tmp_path)
