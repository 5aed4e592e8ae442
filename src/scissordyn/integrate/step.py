"""One step of an explicit Runge-Kutta or of a Rosenbrock method, and its dense output.

Dense output is nested: y(theta) = y0 + f1 (F0 + f2 (F1 + f3 (F2 + ...))) with factors f = theta or 1 - theta. Both families
share it, so whatever looks inside a step need not know which method made it.
"""

from __future__ import annotations

import math

from scissordyn.integrate.pace import EVEN, fraction, speed
from scissordyn.jit import kernel

__all__ = ["dense_value", "error_norm", "explicit_dense", "explicit_step", "rosenbrock_dense", "rosenbrock_step"]


@kernel(inline=True)
def explicit_stage(problem, T, s, t, h, w, target, S):
    """Slope and powers by s at stage s, at the state `target`."""
    pace = w.pace[0]
    now = t + fraction(pace, T.nodes[s]) * h
    problem.rate(now, target, S, w.stages[s])
    problem.powers(now, target, S, w.power[s], w.watched[s])
    if pace == EVEN:
        return
    factor = speed(pace, T.nodes[s])
    for i in range(target.size):
        w.stages[s, i] *= factor
    for q in range(w.total.size):
        w.power[s, q] *= factor


@kernel(inline=True)
def explicit_step(problem, T, t, h, w, S):
    """Stages of w.new = y(t + h) from the slope and powers at t; stage T.stages is the end."""
    factor = speed(w.pace[0], 0.0)
    for i in range(w.y.size):
        w.stages[0, i] = factor * w.slope[i]
    for q in range(w.total.size):
        w.power[0, q] = factor * w.power_at_start[q]
    for s in range(1, T.stages + 1):
        target = w.new if s == T.stages else w.inside
        stage_state(T, s, h, w.y, w.stages, target)
        explicit_stage(problem, T, s, t, h, w, target, S)


@kernel(inline=True)
def stage_state(T, s, h, y, K, target):
    """State at which stage s is evaluated."""
    for i in range(y.size):
        total = 0.0
        for k in range(s):
            total += T.a[s, k] * K[k, i]
        target[i] = y[i] + h * total


@kernel(inline=True)
def explicit_dense(problem, T, t, h, w, S):
    """Further stages, and the coefficients of the dense outputs of the state and of the integrals of the powers."""
    last = T.stages
    for s in range(last + 1, T.nodes.size):
        stage_state(T, s, h, w.y, w.stages, w.inside)
        explicit_stage(problem, T, s, t, h, w, w.inside, S)
    for i in range(w.y.size):
        nest(T, h, w.new[i] - w.y[i], w.stages, w.dense, i)
    for q in range(w.total.size):
        gain = 0.0
        for k in range(last):
            gain += T.a[last, k] * w.power[k, q]
        nest(T, h, h * gain, w.power, w.gain, q)


@kernel(inline=True)
def nest(T, h, difference, K, F, i):
    """Coefficients F of the dense output of component i from its difference over the step and its slopes."""
    F[0, i] = difference
    F[1, i] = h * K[0, i] - difference
    F[2, i] = 2.0 * difference - h * (K[0, i] + K[T.stages, i])
    for d in range(T.dense.shape[0]):
        total = 0.0
        for k in range(T.nodes.size):
            total += T.dense[d, k] * K[k, i]
        F[3 + d, i] = h * total


@kernel(inline=True)
def rosenbrock_step(rate, solve, T, t, h, y, new, K, stage, slope, dt, S):
    """Stages of y(t + h) with W already factorized; slope is y' and dt the partial derivative of y' by time, at t."""
    size, inverse = y.size, 1.0 / h
    for s in range(T.stages):
        lift = h * T.slopes[s]
        if s > 0:
            for i in range(size):
                total = y[i]
                for k in range(s):
                    total += T.a[s, k] * K[k, i]
                new[i] = total
            rate(t + T.nodes[s] * h, new, S, stage)
        source = slope if s == 0 else stage
        for i in range(size):
            total = 0.0
            for k in range(s):
                total += T.c[s, k] * K[k, i]
            K[s, i] = source[i] + total * inverse + lift * dt[i]
        solve(K[s], S)
    for i in range(size):
        new[i] += K[T.stages - 1, i]


@kernel(inline=True)
def rosenbrock_dense(T, y, new, K, F):
    """Coefficients F of the dense output."""
    for i in range(y.size):
        F[0, i] = new[i] - y[i]
        for d in range(T.dense.shape[0]):
            total = 0.0
            for k in range(T.stages):
                total += T.dense[d, k] * K[k, i]
            F[1 + d, i] = total


@kernel(inline=True)
def dense_value(theta, pattern, y, F, out):
    """State at a fraction theta of the step."""
    for i in range(y.size):
        value = 0.0
        for k in range(pattern.size - 1, -1, -1):
            value = (F[k, i] + value) * (theta if pattern[k] == 0 else 1.0 - theta)
        out[i] = y[i] + value


@kernel(inline=True)
def error_norm(T, h, y, new, K, atol, rtol, rounding, group):
    """Largest weighted error; a component's size is the root mean square over its group's components.

    `group` holds the boundaries of the groups. For DOP853 the two estimates are combined as in Hairer's code.
    """
    worst = 0.0
    factor = h if T.kind == 0 else 1.0
    combined = False
    for k in range(T.error.shape[1]):
        if T.error[1, k] != 0.0:
            combined = True
    for g in range(group.size - 1):
        start, stop = group[g], group[g + 1]
        if stop == start:
            continue
        square = 0.0
        for i in range(start, stop):
            square += max(y[i] * y[i], new[i] * new[i])
        # an overflow would make the weight infinite and any error nothing
        if not square < math.inf:
            return math.nan
        size = math.sqrt(square / (stop - start))
        for i in range(start, stop):
            first = second = 0.0
            for k in range(T.stages + 1 if T.kind == 0 else T.stages):
                first += T.error[0, k] * K[k, i]
                if combined:
                    second += T.error[1, k] * K[k, i]
            weight = atol[i] + rtol[i] * size + rounding[i] / h
            error = abs(factor * first) / weight
            if combined:
                other = abs(factor * second) / weight
                if error != 0.0:
                    error = error * error / math.sqrt(error * error + 0.01 * other * other)
            # a NaN must not hide behind a comparison that is false
            if not error <= worst:
                worst = error
            if worst != worst:
                return worst
    return worst
