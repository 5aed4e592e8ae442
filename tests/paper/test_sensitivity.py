"""The survey of other choices."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

from scissordyn.errors import ScissordynError
from scissordyn_paper import sensitivity
from scissordyn_paper.periodic import PERIODIC
from scissordyn_paper.reproduce import verdicts
from scissordyn_paper.sensitivity import (
    DEFAULT,
    FACTORS,
    Survey,
    fetch_sensitivity,
    fetch_surveys,
    full_factorial,
    one_at_a_time,
    survey,
)
from scissordyn_paper.statements import CLAUSES
from scissordyn_paper.verdict import Finding

OTHER = dataclasses.replace(DEFAULT, driven_bar="slider", restitution=0.5)


def test_the_default_choice_is_answered_as_in_the_report(runs):
    """Cross-check: runs without files and without a second run at a tighter tolerance lead to the same answers and words."""
    found = survey(DEFAULT, members=2)
    answered = verdicts(runs)
    assert found.agreeing == tuple(float(verdict.finding.holds) for verdict in answered)
    assert found.words == tuple(verdict.finding.words for verdict in answered)
    assert 0.0 < found.spread < 1e-6  # all of this is within the predictability horizon


def test_a_survey_is_repeatable_and_kept(tmp_path, monkeypatch):
    """Identity: the same numbers each time; a call for what is there reads it, a call for more computes."""
    choices = (DEFAULT, OTHER)
    one = fetch_sensitivity(choices, tmp_path / "one.nc", members=1, engine=1)
    two = fetch_sensitivity(choices, tmp_path / "two.nc", members=1, engine=1)
    xr.testing.assert_identical(one, two)
    assert list(one["clause"].values) == [clause.key for clause in CLAUSES]
    assert not np.array_equal(one["agreeing"][0], one["agreeing"][1])

    def never(*_, **__):
        raise AssertionError("computed again")

    monkeypatch.setattr(sensitivity, "survey", never)
    xr.testing.assert_identical(fetch_sensitivity(choices, tmp_path / "one.nc", members=1), one)
    with pytest.raises(ScissordynError, match="AssertionError: computed again"):
        fetch_sensitivity(choices, tmp_path / "one.nc", members=3)


def test_several_surveys_are_done_in_one_go(tmp_path):
    """Contract: each has its own file, its own choices and members, and is what it is alone."""
    steps = []
    asked = (
        Survey((DEFAULT,), tmp_path / "one.nc", members=2),
        Survey((OTHER, DEFAULT, OTHER), tmp_path / "two.nc", members=1),
    )
    one, two = fetch_surveys(*asked, engine=2, progress=lambda *step: steps.append(step))
    assert {step[0] for step in steps} == {"choices, 2 members each", "choices, 1 members each"}
    assert sorted(step[1:] for step in steps) == [(1, 1), (1, 2), (2, 2)]
    assert one["summary"].values.tolist() == [DEFAULT.words]
    assert two["summary"].values.tolist() == [OTHER.words, DEFAULT.words, OTHER.words]
    alone = fetch_sensitivity((OTHER, DEFAULT, OTHER), tmp_path / "alone.nc", members=1, engine=1)
    xr.testing.assert_identical(two, alone)


def test_settled_answers_replace_those_of_two_oscillations(tmp_path):
    """Contract: for the periodic drive the named clauses have the given answers, others the surveyed ones."""
    choices = (DEFAULT, PERIODIC)
    plain = fetch_sensitivity(choices, tmp_path / "survey.nc", members=1, engine=1)
    at = [clause.key for clause in CLAUSES].index("5e")
    opposite = Finding(not plain["agreeing"].values[1, at], "as given", {})
    given = fetch_sensitivity(choices, tmp_path / "survey.nc", settled={"5e": opposite}, members=1, engine=1)
    assert (given["agreeing"].values[1, at], str(given["words"].values[1, at])) == (float(opposite.holds), "as given")
    others = np.arange(len(CLAUSES)) != at
    np.testing.assert_array_equal(given["agreeing"].values[:, others], plain["agreeing"].values[:, others])
    assert given["agreeing"].values[0, at] == plain["agreeing"].values[0, at]


def test_factors_distinguish_all_choices():
    """Contract: the levels of a choice name it, and one at a time changes one factor."""
    for choices in (full_factorial(), one_at_a_time()):
        assert len({tuple(level(choice) for level in FACTORS.values()) for choice in choices}) == len(choices)
    changed = [sum(level(choice) != level(DEFAULT) for level in FACTORS.values()) for choice in one_at_a_time()]
    assert changed == [0] + [1] * (len(changed) - 1)
