"""A study that is killed again and again ends with the rows of one that was left alone."""

from pathlib import Path

import pytest
from benchmarks.study_kills import KILLS, VICTIMS, killed_at_random


@pytest.mark.slow
def test_killed_at_random_moments(tmp_path: Path) -> None:
    """Contract: killed with -9 at 20 moments the rows are those of an undisturbed run; no finished block is done twice."""
    found = killed_at_random(tmp_path, KILLS)
    assert [kill.victim for kill in found] == [*(VICTIMS[k % 3] for k in range(KILLS)), ""]
    assert [kill.rewritten for kill in found] == [0] * len(found)
    assert {kill.same for kill in found} <= {True, None}
    assert found[-1].same
    assert sum(kill.finished for kill in found) > 0
    for kill in found:
        match kill.victim:
            case "coordinator":
                assert kill.status == -9
            case "scheduler":
                assert kill.status == 0 or (kill.status == 3 and len(kill.lines) == 1), kill.lines
            case _:
                assert (kill.status, kill.lines, kill.same) == (0, (), True)
