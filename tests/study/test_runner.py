"""Maps over cases."""

import os

import pytest

from scissordyn.errors import InputError
from scissordyn.study.runner import DIED, CaseResult, run_cases, worker_count


def divided(case):
    """Three of the ways in which a case may end."""
    if case == "die":
        os._exit(3)
    if case == "refuse":
        raise InputError("what came", "what is allowed")
    return 1.0 / case


def test_results_do_not_depend_on_the_workers():
    """Identity: the same values and errors, in the order of the cases, here and on two processes."""
    cases = [4.0, 0.0, 3.0, "refuse", "text", 7.0]
    seen = []
    here = run_cases(divided, cases, workers=1, progress=lambda done, total: seen.append((done, total)))
    there = run_cases(divided, cases, workers=2)
    assert [(one.index, one.value, one.error) for one in here] == [(one.index, one.value, one.error) for one in there]
    assert [one.value for one in here] == [0.25, None, 1.0 / 3.0, None, None, 1.0 / 7.0]
    assert here[1].error == "ZeroDivisionError: float division by zero"
    assert here[3].error == "what came; allowed: what is allowed"
    assert here[4].error.startswith("TypeError: ")
    assert seen == [(k, 6) for k in range(1, 7)]


def test_a_process_that_dies_costs_its_case_only():
    """Identity: every other case has its result."""
    found = run_cases(divided, [2.0, "die", 4.0, 5.0], workers=2)
    assert [one.value for one in found] == [0.5, None, 0.25, 0.2]
    assert found[1] == CaseResult(1, None, DIED, 0.0)


def test_a_function_that_cannot_be_sent():
    """Identity: each case says so."""
    found = run_cases(lambda case: case, [1, 2], workers=2)
    assert [one.value for one in found] == [None, None]
    assert all("pickle" in one.error.lower() for one in found)


def test_worker_count():
    """Identity: bounds."""
    assert worker_count(3) == 3
    assert worker_count(None) >= 1
    with pytest.raises(InputError, match="workers = 0"):
        worker_count(0)
    assert run_cases(divided, []) == []
