"""Dense output: its order, and integrals up to points inside a step."""

import math

import numpy as np
from motions import GROWTH, OSCILLATOR, solve_problem

ORDERS = {"dop853": 7, "dopri5": 4, "rodas5p": 4, "rodas4p": 3}  # Order of the dense output of each method


def test_order_inside_a_step(name):
    """Order of convergence: the largest error inside one step falls as h^(p + 1), p the order of the dense output."""
    sizes = np.array([0.8, 0.4, 0.2] if name == "dop853" else [0.4, 0.2, 0.1])
    errors = []
    for h in sizes:
        result = solve_problem(
            name, OSCILLATOR, (math.sin(0.3), math.cos(0.3)), h, parameters=(1.0,), first=h, rtol=1e9, atol=1e9, samples=33
        )
        assert result.state.counts["steps"][0] == 1
        exact = np.stack([np.sin(0.3 + result.out.time), np.cos(0.3 + result.out.time)], axis=1)
        errors.append(np.max(np.abs(result.out.state - exact)))
    order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert ORDERS[name] + 0.7 < order < ORDERS[name] + 1.7


def test_integrals_of_one_step(name):
    """Order of convergence: in one step the integral of exp, and of its square, inside and at the end."""
    errors = []
    sizes = (0.4, 0.2)
    for h in sizes:
        result = solve_problem(name, GROWTH, (1.0,), h, parameters=(1.0,), first=h, rtol=1e9, atol=1e9, samples=9)
        errors.append(np.max(np.abs(result.out.total[:, 0] - np.expm1(result.out.time))))
        errors.append(np.max(np.abs(result.out.total[:, 1] - 0.5 * np.expm1(2.0 * result.out.time))))
    for which in (0, 1):
        assert math.log2(errors[which] / errors[which + 2]) > ORDERS[name] + 0.5
