"""Elimination of linear constraints: the pivots, and the constraints that determine an expression."""

import numpy as np
import pytest

from scissordyn.plan.elimination import Elimination


def test_pivot_is_the_largest_coefficient():
    """Closed form: the largest coefficient is the pivot, the last one of equal coefficients."""
    for coefficients, pivot in (((5.0, 1e-6, 2.0), 0), ((1e-6, 3.0, 2.0), 1), ((2.0, -2.0, 2.0), 2), ((1.0, 1.0, 0.5), 1)):
        system = Elimination([True] * 3, 1)
        system.impose({0: coefficients[0], 1: coefficients[1], 2: coefficients[2], 3: 7.0}, "pin")
        start, columns, values = system.rows()
        assert np.flatnonzero(system.solved_at >= 0).tolist() == [pivot]
        row = dict(zip(columns[start[pivot] : start[pivot + 1]].tolist(), values[start[pivot] : start[pivot + 1]], strict=True))
        assert row[3] == pytest.approx(-7.0 / coefficients[pivot])


def test_constraints_that_determine_an_expression():
    """Closed form: x0 = x1 and x1 = x2 give x0 - x2; a constraint on other unknowns is not listed."""
    system = Elimination([True] * 4, 1)
    system.impose({0: 1.0, 1: -1.0}, "first")
    system.impose({3: 1.0, 4: 2.0}, "other")
    system.impose({1: 1.0, 2: -1.0}, "second")
    system.rows()
    assert system.causes_of([{0: 1.0, 2: -1.0}]) == ["first", "second"]
    assert system.causes_of([{3: 1.0}]) == ["other"]
    assert system.causes_of([{0: 1.0, 1: -1.0}], before=1) == ["first"]
    assert system.causes_of([{0: 1.0, 2: -1.0}], before=2) == ["first"]
