"""One step of each method, and what its error is measured by."""

import math

import numpy as np
import pytest
from motions import GROWTH, OSCILLATOR, POWER, RELAXING, STAGGERED, solve_problem

from scissordyn.integrate.advance import FINISHED, NOT_FINITE
from scissordyn.integrate.method import tableau
from scissordyn.integrate.step import AFTER_START, BEFORE_END, EVEN, fraction, place, speed

ORDERS = {"dop853": 8, "dopri5": 5, "rodas5p": 5, "rodas4p": 4}  # Order of each method
WIDE = {"rtol": 1e9, "atol": 1e9}  # Tolerances with which no step is rejected


def one_step(name, kind, start, h, **options):
    """Return the state after one step of size h."""
    result = solve_problem(name, kind, start, h, first=h, **{**WIDE, **options})
    assert result.status == FINISHED
    assert result.state.counts["steps"][0] == 1
    return result.out.state[-1]


@pytest.mark.parametrize("h", [0.1, 0.5])
def test_a_step_is_a_taylor_polynomial(name, h):
    """Closed form: one step of y' = r y is exp up to the order; for an explicit method a polynomial of its stages."""
    T, r = tableau(name), -1.3
    (found,) = one_step(name, GROWTH, (2.0,), h, parameters=(r,))
    z, order = h * r, ORDERS[name]
    if T.kind == 0:
        stage = np.ones(T.stages + 1)
        for k in range(1, T.stages + 1):
            stage[k] = 1.0 + z * (T.a[k, :k] @ stage[:k])
        assert found == pytest.approx(2.0 * stage[T.stages], rel=1e-14)
    taylor = sum(z**k / math.factorial(k) for k in range(order + 1))
    assert abs(found / 2.0 - taylor) < 3.0 * abs(z) ** (order + 1) / math.factorial(order)
    assert abs(found / 2.0 - math.exp(z)) < 3.0 * abs(z) ** (order + 1) / math.factorial(order)


def test_quadratures_in_time(name):
    """Closed form: y' = k t^(k-1) is integrated exactly up to the order of the method: nodes and derivative by time."""
    for k in range(1, ORDERS[name] + 1):
        (found,) = one_step(name, POWER, (0.0,), 1.7, parameters=(float(k),))
        assert found == pytest.approx(1.7**k, rel=1e-11)


@pytest.mark.parametrize("name", ["rodas5p", "rodas4p"])
def test_stiff_steps(name):
    """Limit: a stiff method follows the slow solution cos t of y' = r (y - cos t) - sin t, r = -1e7, with long steps."""
    result = solve_problem(name, RELAXING, (1.0,), 2.0, parameters=(-1e7,), rtol=1e-7, atol=1e-7, step=0.1, samples=41)
    assert np.allclose(result.out.state[:, 0], np.cos(result.out.time), atol=1e-6)
    assert result.state.counts["steps"][0] < 100
    # infinitely fast decay is gone after one step
    (found,) = one_step(name, GROWTH, (1.0,), 1.0, parameters=(-1e12,))
    assert abs(found) < 1e-9


def test_error_of_a_group(name):
    """Closed form: the error weighs atol + rtol * rms of a component's group, and the largest ratio counts.

    y = (0, 1), y' = (r (y_2 - y_1), 1): with one group the small component's error is measured by the large one's size.
    """
    apart = solve_problem(name, STAGGERED, (1000.0, 1000.0), 1.0, parameters=(3.0,), rtol=1e-9, atol=0.0, group=(0, 1, 2))
    exact = 1000.0 + 1.0 - (1.0 - math.exp(-3.0)) / 3.0
    assert apart.out.state[-1, 0] == pytest.approx(exact, rel=3e-9)
    assert apart.out.state[-1, 1] == pytest.approx(1001.0, rel=1e-13)


def test_estimated_error_is_that_of_the_step(name):
    """Cross-check: the error norm of a step is its estimate by the tableau over its weight, for a step of y' = r y."""
    T, h, atol, rtol = tableau(name), 0.25, 1e-6, 1e-4
    z = -2.0 * h
    stage, slope = np.zeros(T.nodes.size), np.zeros(T.nodes.size)
    if T.kind == 0:
        for k in range(T.stages + 1):
            stage[k] = 1.0 + z * (T.a[k, :k] @ stage[:k])
        first, second = abs(z * (T.error @ np.where(np.arange(T.nodes.size) <= T.stages, stage, 0.0)))
        new = stage[T.stages]
    else:
        for k in range(T.nodes.size):
            # (1/(gamma) - z) u = z (1 + a u) + c u, times h
            slope[k] = (z * (1.0 + T.a[k, :k] @ slope[:k]) + T.c[k, :k] @ slope[:k]) / (1.0 / T.gamma - z)
        first, second = abs(T.error @ slope)
        new = 1.0 + T.a[-1] @ slope + slope[-1]
    expected = first * first / math.sqrt(first * first + 0.01 * second * second) if T.combined else first
    # the estimate in units of its weight is 1 for the tolerance at which the step is just accepted
    size = max(1.0, abs(new))
    for factor, accepted in ((0.999, False), (1.001, True)):
        scale = factor * expected / (atol + rtol * size)
        result = solve_problem(
            name, GROWTH, (1.0,), h, parameters=(-2.0,), first=h, rtol=rtol * scale, atol=atol * scale, most_steps=1
        )
        assert (result.state.counts["steps"][0] == 1) == accepted
        assert (result.state.counts["rejected"][0] == 0) == accepted


def test_overflow_is_a_status(name):
    """Limit: a solution beyond all numbers ends the run with a status, and what was reached is finite."""
    result = solve_problem(name, GROWTH, (1e150,), 50.0, parameters=(1.0,), rtol=1e-4, atol=1e-4)
    assert result.status == NOT_FINITE
    assert np.all(np.isfinite(result.state.y))
    # squares overflow beyond 1.34e154
    assert result.state.clock["time"][0] == pytest.approx(math.log(1.34e4), abs=0.1)


def test_counts_of_evaluations(name):
    """Contract: the rates that a run counts are those that its problem was asked for."""
    result = solve_problem(name, OSCILLATOR, (1.0, 0.0), 3.0, parameters=(2.0,), samples=50, rtol=1e-7, atol=1e-7)
    assert result.state.counts["rates"][0] == result.numbers.calls[0]


@pytest.mark.parametrize("scaling", [EVEN, AFTER_START, BEFORE_END])
def test_time_inside_a_step(scaling):
    """Identity: from 0 to 1, at the speed that the derivative says, and back again."""
    assert (fraction(scaling, 0.0), fraction(scaling, 1.0)) == (0.0, 1.0)
    for s in np.linspace(0.05, 0.95, 7):
        h = 1e-6
        slope = (fraction(scaling, s + h) - fraction(scaling, s - h)) / (2.0 * h)
        assert speed(scaling, s) == pytest.approx(slope, abs=1e-9)
        assert place(scaling, fraction(scaling, s)) == pytest.approx(s, abs=1e-12)


def test_slow_ends():
    """Closed form: time is the square of s from the start, and one less the square of 1 - s towards the end."""
    assert fraction(AFTER_START, 0.3) == pytest.approx(0.09)
    assert fraction(BEFORE_END, 0.7) == pytest.approx(1.0 - 0.09)
    assert speed(AFTER_START, 0.0) == speed(BEFORE_END, 1.0) == 0.0


def test_errors_whose_squares_are_zero(name: str) -> None:
    """Limit: a state of 1e-170 that decays has an error below the smallest square, and no step is rejected for it."""
    result = solve_problem(name, GROWTH, (1e-170,), 1.0, first=0.1, rtol=1e-9, atol=1e-9, parameters=(-3.0,))
    assert (result.status, result.state.counts["rejected"][0]) == (FINISHED, 0)
