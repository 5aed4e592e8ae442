"""The integrators on problems that have nothing to do with mechanisms: orders, events, quadratures, dense output."""

import math

import numpy as np
import pytest
from motions import COMPLIANT, OSCILLATOR, PENDULUM, solve_problem

from scissordyn.integrate.integration import FALL, MODE, RISE, TIME


def test_error_follows_tolerance(name):
    """Order of convergence: the end error falls in proportion to the tolerance, within a factor of ten over four decades."""
    problem, stiff = (PENDULUM, (1.0, 0.5, 1.0), 4.0), {"parameters": (1e3,)}
    reference = solve_problem("dop853", *problem, **stiff, rtol=1e-13, atol=1e-13).out.state[-1]
    errors = []
    for tolerance in (1e-6, 1e-8, 1e-10):
        end = solve_problem(name, *problem, **stiff, rtol=tolerance, atol=tolerance).out.state[-1]
        errors.append(np.max(np.abs(end - reference)))
    assert errors[-1] < 3e-9
    assert 10.0 < errors[0] / errors[1] < 1e4
    assert 10.0 < errors[1] / errors[2] < 1e4


@pytest.mark.parametrize(
    ("name", "order", "counts"),
    [
        ("dop853", 8, (16, 24, 32, 48)),
        ("dopri5", 5, (80, 160, 320)),
        ("rodas5p", 5, (80, 160, 320)),
        ("rodas4p", 4, (160, 320)),
    ],
)
def test_order(name, order, counts):
    """Order of convergence: fitted from end errors with steps of equal length, the median over nine starts."""
    fitted = []
    for angle in np.linspace(0.5, 1.5, 9):
        problem, errors = (PENDULUM, (float(angle), 0.5), 6.0), []
        exact = solve_problem("dop853", *problem, rtol=1e-14, atol=1e-14).out.state[-1]
        for count in counts:
            fixed = solve_problem(name, *problem, rtol=1e6, atol=1e6, step=6.0 / count, first=6.0 / count)
            assert fixed.state.counts["steps"][0] == count
            errors.append(float(np.max(np.abs(fixed.out.state[-1] - exact))))
        fitted.append(-np.polyfit(np.log(counts), np.log(errors), 1)[0])
    assert order - 0.2 < float(np.median(fitted)) < order + 0.5


def test_bouncing_ball(name):
    """Closed form: impacts of a ball that bounces with restitution 0.8, its arcs, and the integral of its speed squared."""
    floor = {"parameters": (0.0, 1.0, 1.0), "levels": (0.0,), "senses": (-1.0,), "restitution": 0.8}
    ball = solve_problem(name, COMPLIANT, (1.0, 0.0), 7.0, **floor, samples=701)
    log = ball.log
    first = math.sqrt(2.0)
    speeds = first * 0.8 ** np.arange(log.shape[0])
    times = first + np.cumsum(np.concatenate([[0.0], 2.0 * 0.8 * speeds[:-1]]))
    assert log.shape[0] >= 4
    assert np.allclose(log[:, 0], times, atol=1e-9)
    assert np.allclose(log[:, 3], -speeds, atol=1e-9)
    last = int(np.sum(times < 7.0))
    arcs = np.array([2.0 * (0.8 * v) ** 3 / 3.0 for v in speeds[: last - 1]])
    rest, up = 7.0 - times[last - 1], 0.8 * speeds[last - 1]
    exact = first**3 / 3.0 + np.sum(arcs) + (up**3 - (up - rest) ** 3) / 3.0
    assert float(ball.state.total[2]) == pytest.approx(exact, rel=1e-9)
    for at in (50, 120, 320, 500):
        t = ball.out.time[at]
        k = int(np.sum(times < t))
        since = t - (times[k - 1] if k else 0.0)
        expected = 1.0 - 0.5 * t * t if k == 0 else 0.8 * speeds[k - 1] * since - 0.5 * since * since
        assert ball.out.state[at, 0] == pytest.approx(expected, abs=1e-8)


def test_a_step_ends_where_its_guard_vanishes(name):
    """Contract: at the end of a step, however coarse, the guard is zero to its precision; the inside of the step is not."""
    swing = solve_problem(name, OSCILLATOR, (1.0, 0.0), 6.0, rtol=1e-3, atol=1e-3, levels=(0.3,), senses=(-1.0,), first=1.5)
    assert list(swing.log[:, MODE]) == [RISE, FALL]
    for when in swing.log[:, TIME]:
        assert abs(swing.reached[swing.ends == when][0, 0] - 0.3) < 1e-12
