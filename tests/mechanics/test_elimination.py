"""Which unknowns linear constraints are solved for, and whose constraints determine an expression."""

import numpy as np
import pytest

from scissordyn.plan.elimination import Elimination


def test_the_largest_coefficient_is_solved_for_and_the_last_of_equal_ones() -> None:
    """Closed form: a division by a small number would enlarge round-off."""
    for coefficients, pivot in (((5.0, 1e-6, 2.0), 0), ((1e-6, 3.0, 2.0), 1), ((2.0, -2.0, 2.0), 2), ((1.0, 1.0, 0.5), 1)):
        system = Elimination([True] * 3, 1)
        system.impose({0: coefficients[0], 1: coefficients[1], 2: coefficients[2], 3: 7.0}, "pin")
        start, columns, values = system.rows()
        assert np.flatnonzero(system.solved_at >= 0).tolist() == [pivot]
        row = dict(zip(columns[start[pivot] : start[pivot + 1]].tolist(), values[start[pivot] : start[pivot + 1]], strict=True))
        assert row[3] == pytest.approx(-7.0 / coefficients[pivot])


def test_only_the_constraints_with_a_part_in_an_expression_are_named() -> None:
    """Closed form: x0 = x1 and x1 = x2 give x0 - x2; the fourth unknown has nothing to do with it."""
    system = Elimination([True] * 4, 1)
    system.impose({0: 1.0, 1: -1.0}, "first")
    system.impose({3: 1.0, 4: 2.0}, "other")
    system.impose({1: 1.0, 2: -1.0}, "second")
    system.rows()
    assert system.causes_of([{0: 1.0, 2: -1.0}]) == ["first", "second"]
    assert system.causes_of([{3: 1.0}]) == ["other"]
    assert system.causes_of([{0: 1.0, 1: -1.0}], before=1) == ["first"]
    assert system.causes_of([{0: 1.0, 2: -1.0}], before=2) == ["first"]
