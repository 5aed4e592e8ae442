"""Small problems with closed forms, compiled once for all tests of the integrators."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from following import Followed, follow

from scissordyn.kernel import F1, F2, I1, kernel, opener

__all__ = ["COMPLIANT", "GROWTH", "OSCILLATOR", "PENDULUM", "POWER", "RELAXING", "STAGGERED", "solve_problem"]

OSCILLATOR, COMPLIANT, GROWTH, POWER, RELAXING, STAGGERED, PENDULUM = range(7)
"""y'' = -w^2 y; m y'' = -k d^e on a floor below y = 0; y' = r y; y' = k t^(k-1); y' = r (y - cos t) - sin t;
y' = -r (y - y_2), y_2' = 1; y'' = -sin y + 0.3 sin 2t, which has no closed form, and beside it, where there is a third state,
y_3' = -r (y_3 - cos t) - sin t."""


class Numbers(NamedTuple):
    """Arrays of the problems."""

    kind: I1
    parameters: F1
    level: F1  # (guards,) of y above which a guard is positive
    sense: F1  # (guards,) 1, or -1 for one that is positive below
    restitution: F1
    longest: F1
    jacobian: F2
    matrix: F2
    mode: I1
    calls: I1


open_numbers = opener(Numbers)


@kernel
def rate(t, y, address, dy):
    S = open_numbers(address)
    kind, p = S.kind[0], S.parameters
    S.calls[0] += 1
    if kind == 0:
        dy[0], dy[1] = y[1], -p[0] * p[0] * y[0]
    elif kind == 1:
        depth = max(0.0, -y[0])
        dy[0], dy[1] = y[1], -p[2]
        if depth > 0.0 and S.mode[0] == 1:
            dy[1] += p[0] * depth ** p[1]
    elif kind == 2:
        dy[0] = p[0] * y[0]
    elif kind == 3:
        dy[0] = p[0] * t ** (p[0] - 1.0)
    elif kind == 4:
        dy[0] = p[0] * (y[0] - math.cos(t)) - math.sin(t)
    elif kind == 5:
        dy[0], dy[1] = -p[0] * (y[0] - y[1]), 1.0
    else:
        dy[0], dy[1] = y[1], -math.sin(y[0]) + 0.3 * math.sin(2.0 * t)
        if y.size == 3:
            dy[2] = -p[0] * (y[2] - math.cos(t)) - math.sin(t)


@kernel
def linearise(t, y, address, dy, dt):
    """Compute the rate, the Jacobian and the derivative by time."""
    S = open_numbers(address)
    kind, p, J = S.kind[0], S.parameters, S.jacobian
    rate(t, y, address, dy)
    dt[:] = 0.0
    J[:, :] = 0.0
    if kind == 0:
        J[0, 1], J[1, 0] = 1.0, -p[0] * p[0]
    elif kind == 1:
        J[0, 1] = 1.0
        depth = max(0.0, -y[0])
        if depth > 0.0 and S.mode[0] == 1:
            J[1, 0] = -p[0] * p[1] * depth ** (p[1] - 1.0)
    elif kind == 2:
        J[0, 0] = p[0]
    elif kind == 3:
        dt[0] = p[0] * (p[0] - 1.0) * t ** (p[0] - 2.0) if p[0] > 1.0 else 0.0
    elif kind == 4:
        J[0, 0], dt[0] = p[0], p[0] * math.sin(t) - math.cos(t)
    elif kind == 5:
        J[0, 0], J[0, 1] = -p[0], p[0]
    else:
        J[0, 1], J[1, 0], dt[1] = 1.0, -math.cos(y[0]), 0.6 * math.cos(2.0 * t)
        if y.size == 3:
            J[2, 2], dt[2] = -p[0], -p[0] * math.sin(t) - math.cos(t)


@kernel
def factorize(hg, address):
    S = open_numbers(address)
    n = S.matrix.shape[0]
    for i in range(n):
        for j in range(n):
            S.matrix[i, j] = (1.0 / hg if i == j else 0.0) - S.jacobian[i, j]
    return -1


@kernel
def solve(r, address):
    """Solve for one or two unknowns; a third unknown is not coupled to these."""
    m = open_numbers(address).matrix
    if r.size == 1:
        r[0] /= m[0, 0]
        return
    if r.size == 3:
        r[2] /= m[2, 2]
    determinant = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    first = (m[1, 1] * r[0] - m[0, 1] * r[1]) / determinant
    r[1] = (m[0, 0] * r[1] - m[1, 0] * r[0]) / determinant
    r[0] = first


@kernel
def accept(t, y, address, answer):
    """Accept the state at the end of a step unchanged, because the problem has no constraints."""
    answer[0], answer[1] = 0.0, open_numbers(address).longest[0]


@kernel
def guards(t, y, address, value, slope):
    """Compute how far y is beyond each level."""
    S = open_numbers(address)
    for k in range(S.level.size):
        value[k], slope[k] = S.sense[k] * (y[0] - S.level[k]), S.sense[k] * y[1]


@kernel
def guard(t, y, k, address, value, slope):
    S = open_numbers(address)
    value[k], slope[k] = S.sense[k] * (y[0] - S.level[k]), S.sense[k] * y[1]


@kernel
def reset(t, y, k, address, data):
    """Change the mode; with a restitution coefficient reverse the speed instead."""
    S = open_numbers(address)
    data[0] = y[1]
    if S.restitution[0] > 0.0:
        y[1] *= -S.restitution[0]
        return True
    S.mode[k] = 1 - S.mode[k]
    return True


@kernel
def monitor(t, y, address, power, rows):
    """Compute the integrands y, y^2 and squared rate, and rows with y and y^2 for each guard and for the whole time."""
    power[0], power[1], power[2] = y[0], y[0] * y[0], y[1] * y[1] if y.size > 1 else 0.0
    for row in range(rows.shape[0]):
        rows[row, 0], rows[row, 1], rows[row, 2] = y[0], y[0] * y[0], 1.0


@kernel
def probe(t, y, row, address, dy, out):
    out[0], out[1], out[2] = y[0], y[0] * y[0], 1.0


@kernel
def record(t, y, address, signals):
    signals[0] = y[0]


def solve_problem(
    name: str,
    kind: int,
    start: tuple[float, ...],
    until: float,
    *,
    parameters: tuple[float, ...] = (1.0,),
    levels: tuple[float, ...] = (),
    senses: tuple[float, ...] = (),
    restitution: float = 0.0,
    step: float = math.inf,
    crosses: bool = False,
    **options: Any,
) -> Followed:
    n, count = len(start), len(levels)
    numbers = Numbers(
        np.array([kind]),
        np.array([*parameters, 0.0, 0.0, 0.0]),
        np.array(levels),
        np.array(senses or (1.0,) * count),
        np.array([restitution]),
        np.array([step]),
        np.zeros((n, n)),
        np.zeros((n, n)),
        np.zeros(count, np.int64),
        np.zeros(1, np.int64),
    )
    monitored = {"quadratures": 3, "rows": 1, "band": np.array([math.inf])}
    return follow(
        *(globals(), numbers, name, start, until), **monitored, step=step, crosses=crosses, crossable=crosses, **options
    )
