"""Sizes of steps against closed forms of the controller on problems whose error is known."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from motions import COMPLIANT, GROWTH, OSCILLATOR, POWER, solve_problem

from scissordyn.integrate.advance import FINISHED, STEP_TOO_SMALL
from scissordyn.integrate.control import fall_ahead
from scissordyn.integrate.method import tableau

FLOOR = {"levels": (0.0,), "senses": (-1.0,)}  # Guard of a ball that falls to height 0


def test_steady_step(name):
    """Closed form: on y' = r y with a relative tolerance steps come to rest where their error is 0.9^order of it.

    From h' = 0.9 h err^(-1/order) with err proportional to h^order. The error of the size is measured here by what doubling the
    tolerance does to it: h grows by 2^(1/order).
    """
    sizes = []
    for rtol in (1e-7, 2e-7):
        result = solve_problem(name, GROWTH, (1.0,), 30.0, parameters=(1.0,), rtol=rtol, atol=0.0)
        steps = np.diff(result.ends)
        h = float(np.median(steps[len(steps) // 2 : -2]))
        assert np.allclose(steps[len(steps) // 2 : -2], h, rtol=1e-3)
        sizes.append(h)
        assert result.state.counts["rejected"][0] <= 1
    order = tableau(name).order
    assert sizes[1] / sizes[0] == pytest.approx(2.0 ** (1.0 / order), rel=0.03)
    assert error_of(name, sizes[0]) / (1e-7 * math.exp(sizes[0])) == pytest.approx(0.9**order, rel=0.02)


def error_of(name, h):
    """Return the estimated error of one step of y' = y from 1, by the coefficients of the method."""
    T = tableau(name)
    stage = np.zeros(T.nodes.size)
    if T.kind == 0:
        for k in range(T.stages + 1):
            stage[k] = 1.0 + h * (T.a[k, :k] @ stage[:k])
        first, second = abs(h * (T.error @ stage))
        return float(first * first / math.sqrt(first * first + 0.01 * second * second)) if T.combined else float(first)
    for k in range(T.nodes.size):
        stage[k] = (h * (1.0 + T.a[k, :k] @ stage[:k]) + T.c[k, :k] @ stage[:k]) / (1.0 / T.gamma - h)
    return float(abs(T.error[0] @ stage))


def test_growth_is_bounded(name):
    """Closed form: without error each step is 8 times the one before; a rejected one is followed by none that is longer."""
    result = solve_problem(name, POWER, (0.0,), 1000.0, parameters=(1.0,), first=1e-3, rtol=1e-3, atol=1e-3)
    steps = np.diff(result.ends, prepend=0.0)
    assert np.allclose(steps[1:-1] / steps[:-2], 8.0, rtol=1e-6)


@pytest.mark.parametrize("name", ["dopri5", "rodas5p"])
def test_shrinking_is_bounded(name):
    """Closed form: a first step much too long is divided by 5 until its error is near the tolerance."""
    tries = []
    for most in range(1, 5):
        result = solve_problem(
            name, OSCILLATOR, (1.0, 0.0), 1e4, parameters=(1.0,), first=1e3, rtol=1e-9, atol=1e-9, most_steps=most
        )
        assert result.state.counts["rejected"][0] == most
        tries.append(float(result.state.clock["step"][0]))
    assert np.allclose(tries, 1e3 * 0.2 ** np.arange(1, 5), rtol=1e-12)


def test_a_step_after_a_rejection_does_not_grow():
    """Closed form: the step that follows a rejection is not longer than the accepted one."""
    result = solve_problem("dopri5", POWER, (0.0,), 50.0, parameters=(9.0,), rtol=1e-6, atol=1e-6, first=3.0)
    assert result.state.counts["rejected"][0] >= 1
    steps = np.diff(result.ends, prepend=0.0)
    assert steps[1] <= steps[0] * (1.0 + 1e-12)


@pytest.mark.parametrize("w", [0.1, 30.0])
def test_first_step(name, w):
    """Closed form: Hairer's first step of an oscillation, from d_0, d_1 and d_2, is accepted and scales as 1/w."""
    tolerance = 1e-8
    result = solve_problem(name, OSCILLATOR, (1.0, 0.0), 100.0 / w, parameters=(w,), rtol=0.0, atol=tolerance, most_steps=1)
    weigh = math.sqrt(0.5) / tolerance  # the root mean square of one component
    d0, d1 = weigh, w * w * weigh
    small = 0.01 * d0 / d1
    # slope at y + small y': (-w^2 small, -w^2)
    d2 = w * w * small * weigh / small
    assert result.state.clock["first"][0] == pytest.approx(
        min(100.0 * small, (0.01 / max(d1, d2)) ** (1.0 / tableau(name).order)), rel=1e-9
    )


def test_a_remainder_is_added_to_the_last_step(name):
    """Closed form: a rest below a thousandth of a step is no step of its own; a longer one is."""
    for rest, count in ((0.5e-3, 10), (2e-3, 11)):
        until = 1.0 + 0.1 * rest
        result = solve_problem(name, POWER, (0.0,), until, parameters=(1.0,), step=0.1, first=0.1)
        assert result.ends.size == count
        assert result.ends[-1] == until
        assert result.out.state[-1, 0] == pytest.approx(until, rel=1e-13)


def test_a_discontinuity_in_the_error(name):
    """Limit: a slope that is infinite at the start, y' = t^(-1/2)/2, cannot be resolved, and this is said."""
    result = solve_problem(name, POWER, (0.0,), 1.0, parameters=(0.5,), rtol=1e-10, atol=1e-10)
    assert result.status != FINISHED


def test_too_small_a_step():
    """Limit: an error that no step meets ends the run at its start with a status."""
    result = solve_problem("dop853", OSCILLATOR, (0.3, 1.0), 1.0, parameters=(1.0,), rtol=1e-40, atol=0.0)
    assert result.status == STEP_TOO_SMALL


def falling(k, exponent, v):
    """Return depth and duration of an impact on a compliant floor without gravity, by energy."""
    depth = ((exponent + 1.0) * 0.5 * v * v / k) ** (1.0 / (exponent + 1.0))
    a = 1.0 / (exponent + 1.0)
    half = depth / v * math.sqrt(math.pi) * math.gamma(1.0 + a) / math.gamma(0.5 + a)
    return depth, 2.0 * half


@pytest.mark.parametrize("exponent", [1.5, 1.0])
def test_one_impact(name, exponent):
    """Closed form: duration and depth of a Hertzian impact, v t = d sqrt(pi) G(1 + a)/G(1/2 + a); the speed turns."""
    k, v = 1e8, 2.0
    result = solve_problem(*(name, COMPLIANT, (1e-3, -v), 4e-3), parameters=(k, exponent, 0.0), **FLOOR, rtol=1e-11, atol=1e-13)
    _, duration = falling(k, exponent, v)
    assert result.status == FINISHED
    assert np.array_equal(result.log[:, 2], [1.0, 0.0])
    assert result.log[0, 0] == pytest.approx(1e-3 / v, rel=1e-10)
    assert result.log[1, 0] - result.log[0, 0] == pytest.approx(duration, rel=3e-8)
    assert result.log[1, 3] == pytest.approx(v, rel=1e-8)
    assert result.out.state[-1, 1] == pytest.approx(v, rel=1e-8)


def test_the_contact_that_ends_next():
    """Closed form: of what touches and recedes, value over speed; the first of the guards as well as any other."""
    guards = SimpleNamespace(
        start_value=np.array([0.1, 0.3, 0.01, 0.02]), start_rate=np.array([-2.0, -1.0, 1.0, -4.0]), precision=np.full(4, 1e-9)
    )
    for mode, guard, when in (
        ((1, 1, 1, 0), 0, 0.05),
        ((0, 1, 1, 0), 1, 0.3),
        ((1, 1, 1, 1), 3, 0.005),
        ((0, 0, 1, 0), -1, 0.0),
    ):
        assert fall_ahead(10.0, SimpleNamespace(mode=np.array(mode)), guards) == (guard, pytest.approx(when))
    assert fall_ahead(0.04, SimpleNamespace(mode=np.ones(1, int)), guards) == (-1, 0.0)


@pytest.mark.parametrize("name", ["dop853", "dopri5"])
def test_steps_of_an_impact(name):
    """Measured bound: in the root of time a Hertzian impact takes under 12 steps of order 8 at 1e-8, under 60 of order 5."""
    result = solve_problem(*(name, COMPLIANT, (1e-3, -2.0), 4e-3), parameters=(1e8, 1.5, 0.0), **FLOOR, rtol=1e-8, atol=1e-12)
    inside = (result.ends > result.log[0, 0]) & (result.ends <= result.log[1, 0])
    assert np.sum(inside) < (12 if name == "dop853" else 60)


def test_bounces_on_a_compliant_floor(name):
    """Closed form: under gravity impacts repeat with period 2 v/g + duration; the energy stays.

    The duration under gravity is found by a quadrature of the energy equation.
    """
    from scipy.integrate import quad
    from scipy.optimize import brentq

    k, g, v = 1e6, 9.81, 1.0

    def kinetic(d):
        return 0.5 * v * v + g * d - k * d**2.5 / 2.5

    depth = brentq(kinetic, 1e-9, 0.1, xtol=1e-16)
    # d = depth sin^2: no singularity at the turning point
    half, _ = quad(
        lambda a: 2.0 * depth * math.sin(a) * math.cos(a) / math.sqrt(max(2.0 * kinetic(depth * math.sin(a) ** 2), 1e-300)),
        *(0.0, 0.5 * math.pi),
        epsabs=1e-13,
    )
    period = 2.0 * v / g + 2.0 * half
    result = solve_problem(*(name, COMPLIANT, (0.0 + 1e-12, -v), 1.0), parameters=(k, 1.5, g), **FLOOR, rtol=1e-11, atol=1e-13)
    rises = result.log[result.log[:, 2] == 1.0]
    assert np.allclose(np.diff(rises[:, 0]), period, rtol=1e-7)
    assert np.allclose(rises[:, 3], -v, rtol=1e-8)
