"""Words of the field in place of ours."""

import pytest

from scissordyn.config.part import PARTS
from scissordyn.errors import did_you_mean


@pytest.mark.parametrize(
    ("word", "part"),
    [("revolute", "joint"), ("gas_strut", "gas_spring"), ("damper", "spring"), ("cylinder", "rod"), ("gear", "coupling")],
)
def test_words_of_the_field(word: str, part: str) -> None:
    """Contract: a word of the field leads to the part that does it."""
    assert did_you_mean(word, PARTS) == f" (did you mean '{part}'?)"


def test_no_hint_where_there_is_no_such_part() -> None:
    """Contract: a similar name of another thing is no hint."""
    assert did_you_mean("wheel", PARTS) == ""
