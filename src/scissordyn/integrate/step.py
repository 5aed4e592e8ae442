"""Make one step of an explicit Runge-Kutta or a Rosenbrock method, and compute its error.

Letters: T is the method, s the state and w the scratch of an integration, S the address passed to the problem's functions.

Time runs evenly inside an explicit step, or slowly at the end where a contact begins or ends. The force of most contacts grows
as the power 3/2 of the indentation, so a solution has half powers of the time from onset and to release. It is smooth in
s = sqrt(time), and a method keeps its order: t = t0 + h s^2 after onset, t = t0 + h (1 - (1 - s)^2) before release, s = 0 .. 1.
"""

from __future__ import annotations

import math

from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import kernel

NOTHING, OUTPUTS, EVERYTHING = range(3)
"""Values available at the start of a step: none, guards and monitored values, or these and the slope."""


EVEN, AFTER_START, BEFORE_END = range(3)
"""Stretching of the time inside a step: none, or slow after its start or before its end, as a square."""


@kernel
def fraction(scaling, s):
    """Return the fraction of the step's duration that has passed at the stretched time s (0 to 1)."""
    if scaling == EVEN:
        return s
    return s * s if scaling == AFTER_START else s * (2.0 - s)


@kernel
def speed(scaling, s):
    """Return the derivative of `fraction` by s."""
    if scaling == EVEN:
        return 1.0
    return 2.0 * s if scaling == AFTER_START else 2.0 * (1.0 - s)


@kernel
def place(scaling, part):
    """Return the stretched time s (0 to 1) at which the fraction `part` of the step's duration has passed."""
    if scaling == EVEN:
        return part
    return math.sqrt(part) if scaling == AFTER_START else 1.0 - math.sqrt(max(0.0, 1.0 - part))


@kernel
def prepare(problem, T, t, s, w, S):
    """Compute slope, monitored values and guards at the start of a step, and the linearisation for a Rosenbrock method."""
    clock, counts = s.clock[0], s.counts[0]
    counts.rates += 1
    if T.kind == EXPLICIT:
        problem.rate(t, s.y, S, w.slope)
    else:
        problem.linearise(t, s.y, S, w.slope, w.slope_t)
        counts.jacobians += 1
    if clock.prepared == NOTHING:
        if clock.monitors == 1:
            problem.monitor(t, s.y, S, w.power_at_start, s.monitored)
        problem.guards(t, s.y, S, w.start_value, w.start_rate)
    clock.prepared = EVERYTHING


@kernel
def attempt(problem, T, t, h, s, w, S):
    """Make one step from (t, s.y) to w.new; return whether the factorization succeeded."""
    counts = s.counts[0]
    w.has_dense[0] = 0
    if T.kind == EXPLICIT:
        explicit_step(problem, T, t, h, s, w, S)
        counts.rates += T.stages
        return True
    if problem.factorize(h * T.gamma, S) >= 0:
        return False
    rosenbrock_step(problem, T, t, h, s, w, S)
    counts.rates += T.stages - 1
    return True


@kernel
def add_rows(factor, coefficients, count, K, target):
    """Add the first rows of K, times a factor and their coefficients, to a vector.

    Four rows and two columns are processed together, so that the compiler vectorises the loop.
    """
    size, whole = target.size, 4 * (count // 4)
    pairs = 2 * (size // 2)
    for k in range(0, whole, 4):
        a, b = factor * coefficients[k], factor * coefficients[k + 1]
        c, d = factor * coefficients[k + 2], factor * coefficients[k + 3]
        if a != 0.0 or b != 0.0 or c != 0.0 or d != 0.0:
            for i in range(0, pairs, 2):
                j = i + 1
                even = target[i] + a * K[k, i] + b * K[k + 1, i] + c * K[k + 2, i] + d * K[k + 3, i]
                odd = target[j] + a * K[k, j] + b * K[k + 1, j] + c * K[k + 2, j] + d * K[k + 3, j]
                target[i], target[j] = even, odd
            for i in range(pairs, size):
                target[i] = target[i] + a * K[k, i] + b * K[k + 1, i] + c * K[k + 2, i] + d * K[k + 3, i]
    for k in range(whole, count):
        a = factor * coefficients[k]
        if a != 0.0:
            for i in range(size):
                target[i] += a * K[k, i]


@kernel
def stage_state(T, stage, h, y, K, target):
    """Compute the state at which a stage is evaluated."""
    for i in range(y.size):
        target[i] = 0.0
    add_rows(1.0, T.a[stage], stage, K, target)
    for i in range(y.size):
        target[i] = y[i] + h * target[i]


@kernel
def explicit_stage(problem, T, stage, t, h, target, s, w, S):
    """Compute the slope of a stage and the powers there, both as derivatives by s, at the state `target`."""
    scaling = w.scaling[0]
    now = t + fraction(scaling, T.nodes[stage]) * h
    problem.rate(now, target, S, w.stages[stage])
    if T.followed[stage] == 1 and s.clock[0].monitors == 1:
        problem.monitor(now, target, S, w.power[stage], w.monitored[stage])
    if scaling == EVEN:
        return
    factor = speed(scaling, T.nodes[stage])
    for i in range(target.size):
        w.stages[stage, i] *= factor
    for q in range(w.power_at_start.size):
        w.power[stage, q] *= factor


@kernel
def explicit_step(problem, T, t, h, s, w, S):
    """Compute the stages of w.new = y(t + h) from the slope and powers at t; stage T.stages is the end."""
    factor = speed(w.scaling[0], 0.0)
    for i in range(s.y.size):
        w.stages[0, i] = factor * w.slope[i]
    if s.clock[0].monitors == 1:
        for q in range(s.total.size):
            w.power[0, q] = factor * w.power_at_start[q]
        for row in range(s.monitored.shape[0]):
            for q in range(s.monitored.shape[1]):
                w.monitored[0, row, q] = s.monitored[row, q]
    for stage in range(1, T.stages + 1):
        target = w.new if stage == T.stages else w.inside
        stage_state(T, stage, h, s.y, w.stages, target)
        explicit_stage(problem, T, stage, t, h, target, s, w, S)


@kernel
def rosenbrock_step(problem, T, t, h, s, w, S):
    """Compute the stages of w.new = y(t + h) with factorized W.

    w.slope is y' and w.slope_t its partial derivative by time, both at t.
    """
    size, inverse = s.y.size, 1.0 / h
    new, K = w.new, w.stages
    for stage in range(T.stages):
        if stage > 0:
            stage_state(T, stage, 1.0, s.y, K, new)
            problem.rate(t + T.nodes[stage] * h, new, S, w.inside)
        source = w.slope if stage == 0 else w.inside
        by_time = h * T.slopes[stage]
        for i in range(size):
            K[stage, i] = source[i] + by_time * w.slope_t[i]
        add_rows(inverse, T.c[stage], stage, K, K[stage])
        problem.solve(K[stage], S)
    for i in range(size):
        new[i] += K[T.stages - 1, i]


@kernel
def error_norm(T, h, s, w):
    """Return the largest weighted error; a component's size is the root mean square over its group.

    For DOP853 the two estimates are combined as in Hairer's code.
    """
    y, new, K, estimate = s.y, w.new, w.stages, w.estimate
    worst = 0.0
    stages = T.stages + 1 if T.kind == EXPLICIT else T.stages
    for which in range(1 + T.combined):
        for i in range(y.size):
            estimate[which, i] = 0.0
        add_rows(1.0, T.error[which], stages, K, estimate[which])
    for g in range(w.group.size - 1):
        start, stop = w.group[g], w.group[g + 1]
        if stop == start:
            continue
        square = 0.0
        for i in range(start, stop):
            square += max(y[i] * y[i], new[i] * new[i])
        # an overflow would make the weight infinite and hide any error
        if not square < math.inf:
            return math.nan
        size = math.sqrt(square / (stop - start))
        weigh_errors(T, h, size, start, stop, s, w)
        for i in range(start, stop):
            # a comparison with NaN is false and must not hide the NaN
            if not estimate[0, i] <= worst:
                worst = estimate[0, i]
                if worst != worst:
                    return worst
    return worst


@kernel
def weigh_errors(T, h, size, start, stop, s, w):
    """Convert the error estimates of a group to weighted errors, without branches."""
    first, second = w.estimate[0, start:stop], w.estimate[1, start:stop]
    absolute, relative, rounding = w.atol[start:stop], w.rtol[start:stop], w.rounding[start:stop]
    if T.combined == 0:
        factor = h if T.kind == EXPLICIT else 1.0
        for i in range(first.size):
            first[i] = abs(factor * first[i]) / (absolute[i] + relative[i] * size + rounding[i] / h)
        return
    for i in range(first.size):
        weight = absolute[i] + relative[i] * size + rounding[i] / h
        error, other = abs(h * first[i]) / weight, abs(h * second[i]) / weight
        root = math.sqrt(error * error + 0.01 * other * other)
        # avoids 0/0 for errors whose squares are zero
        first[i] = error * error / (root if root != 0.0 else 1.0)
