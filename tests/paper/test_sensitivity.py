"""The survey of other choices."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

from scissordyn.paper import sensitivity
from scissordyn.paper.reproduce import verdicts
from scissordyn.paper.sensitivity import DEFAULT, FACTORS, fetch_sensitivity, full_factorial, one_at_a_time, survey
from scissordyn.paper.statements import CLAUSES

OTHER = dataclasses.replace(DEFAULT, reading="B", restitution=0.5)


def test_the_default_choice_is_answered_as_in_the_report(runs):
    """Cross-check: runs without files and without a second run at a tighter tolerance lead to the same answers and words."""
    found = survey(DEFAULT, members=2)
    answered = verdicts(runs)
    assert found.agreeing == tuple(float(verdict.finding.holds) for verdict in answered)
    assert found.words == tuple(verdict.finding.words for verdict in answered)
    assert 0.0 < found.parted < 1e-6  # all of this is within the trust horizon


def test_a_survey_is_repeatable_and_kept(tmp_path, monkeypatch):
    """Identity: the same numbers each time; a call for what is there reads it, a call for more computes."""
    choices = (DEFAULT, OTHER)
    one = fetch_sensitivity(choices, tmp_path / "one.nc", members=1, workers=1)
    two = fetch_sensitivity(choices, tmp_path / "two.nc", members=1, workers=1)
    xr.testing.assert_identical(one, two)
    assert list(one["clause"].values) == [clause.key for clause in CLAUSES]
    assert not np.array_equal(one["agreeing"][0], one["agreeing"][1])

    def never(*_, **__):
        raise AssertionError("computed again")

    monkeypatch.setattr(sensitivity, "run_cases", never)
    xr.testing.assert_identical(fetch_sensitivity(choices, tmp_path / "one.nc", members=1), one)
    with pytest.raises(AssertionError, match="computed again"):
        fetch_sensitivity(choices, tmp_path / "one.nc", members=3)


def test_factors_tell_all_choices_apart():
    """Identity: the levels of a choice name it, and one at a time changes one factor."""
    for choices in (full_factorial(), one_at_a_time()):
        assert len({tuple(level(choice) for level in FACTORS.values()) for choice in choices}) == len(choices)
    changed = [sum(level(choice) != level(DEFAULT) for level in FACTORS.values()) for choice in one_at_a_time()]
    assert changed == [0] + [1] * (len(changed) - 1)
