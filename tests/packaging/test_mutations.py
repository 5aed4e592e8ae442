"""Tests of the tables of mutations: every entry names an expression, a file or a test that exists."""

from fnmatch import fnmatch
from pathlib import Path

import pytest
from tests.mutators import changes_of
from tests.noticing import NAMED, NOTICING, SAME_ANSWER

TESTS = Path(__file__).parents[1]  # Folder of the tests
PACKAGE = TESTS.parent / "src" / "scissordyn"  # Folder of the package's sources


@pytest.mark.parametrize(("file", "function", "kind", "text"), [*NAMED, *SAME_ANSWER])
def test_changes_exist(file, function, kind, text):
    assert (function, kind, text) in {(change.function, change.kind, change.text) for change in changes_of(PACKAGE, file)}


@pytest.mark.parametrize("pattern", NOTICING)
def test_patterns_match_files_and_name_tests(pattern):
    assert any(fnmatch(str(path.relative_to(PACKAGE)), pattern) for path in PACKAGE.rglob("*.py"))
    assert not [test for test in NOTICING[pattern] if not (TESTS / test).is_file()]
