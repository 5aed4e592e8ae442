"""Evaluate the dense output of a step, nested: y(theta) = y0 + f1 (F0 + f2 (F1 + f3 (F2 + ...))), f = theta or 1 - theta.

Both families of methods share this form, so its users do not depend on the method. Explicit methods also have dense output of
the integrals of the powers; the other methods integrate powers on Gauss nodes.
"""

from __future__ import annotations

import math

from scissordyn.integrate.step import add_rows, explicit_stage, fraction, stage_state
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import kernel


@kernel
def complete(problem, T, t, h, s, w, S):
    """Compute the coefficients of the dense output of the step just made, unless they exist."""
    if w.has_dense[0] == 1:
        return
    w.has_dense[0] = 1
    if T.kind == EXPLICIT:
        explicit_dense(problem, T, t, h, s, w, S)
        s.counts[0].rates += T.nodes.size - T.stages - 1
    else:
        rosenbrock_dense(T, s.y, w.new, w.stages, w.dense)


@kernel
def explicit_dense(problem, T, t, h, s, w, S):
    """Compute further stages, and the coefficients for the state and for the integrals of the powers."""
    last = T.stages
    for stage in range(last + 1, T.nodes.size):
        stage_state(T, stage, h, s.y, w.stages, w.inside)
        explicit_stage(problem, T, stage, t, h, w.inside, s, w, S)
    for i in range(s.y.size):
        w.dense[0, i] = w.new[i] - s.y[i]
    nest(T, h, w.stages, w.dense)
    if s.clock[0].monitors == 0:
        return
    for q in range(s.total.size):
        gain = 0.0
        for k in range(last):
            gain += T.a[last, k] * w.power[k, q]
        w.gain[0, q] = h * gain
    nest(T, h, w.power, w.gain)


@kernel
def nest(T, h, K, F):
    """Compute the coefficients F[1:] of a dense output from the difference F[0] over the step and the slopes K."""
    size = F.shape[1]
    for i in range(size):
        F[1, i] = h * K[0, i] - F[0, i]
        F[2, i] = 2.0 * F[0, i] - h * (K[0, i] + K[T.stages, i])
    for d in range(T.dense.shape[0]):
        for i in range(size):
            F[3 + d, i] = 0.0
        add_rows(h, T.dense[d], T.nodes.size, K, F[3 + d])


@kernel
def rosenbrock_dense(T, y, new, K, F):
    for i in range(y.size):
        F[0, i] = new[i] - y[i]
    for d in range(T.dense.shape[0]):
        for i in range(y.size):
            F[1 + d, i] = 0.0
        add_rows(1.0, T.dense[d], T.stages, K, F[1 + d])


@kernel
def dense_value(theta, pattern, y, F, out):
    """Compute the state at a fraction theta of the step."""
    size, last = y.size, pattern.size - 1
    factor = theta if pattern[last] == 0 else 1.0 - theta
    for i in range(size):
        out[i] = factor * F[last, i]
    for k in range(last - 1, -1, -1):
        factor = theta if pattern[k] == 0 else 1.0 - theta
        for i in range(size):
            out[i] = factor * (F[k, i] + out[i])
    for i in range(size):
        out[i] += y[i]


@kernel
def inside_at(T, theta, row, s, w):
    """Write the entries that a row of guards or monitored values reads at theta into w.inside; all if none is listed."""
    first, stop = w.reads_start[row], w.reads_start[row + 1]
    if first == stop:
        dense_value(theta, T.pattern, s.y, w.dense, w.inside)
        return
    last = T.pattern.size - 1
    for place in range(first, stop):
        i = w.reads[place]
        value = (theta if T.pattern[last] == 0 else 1.0 - theta) * w.dense[last, i]
        for k in range(last - 1, -1, -1):
            value = (theta if T.pattern[k] == 0 else 1.0 - theta) * (w.dense[k, i] + value)
        w.inside[i] = value + s.y[i]


@kernel
def guard_at(problem, T, k, theta, t, h, s, w, S):
    """Evaluate guard k on the dense output at theta; write its value to w.value[k] and its rate to w.rate[k]."""
    inside_at(T, theta, k, s, w)
    problem.guard(t + fraction(w.scaling[0], theta) * h, w.inside, k, S, w.value, w.rate)


@kernel
def guards_at(problem, T, theta, t, h, s, w, S):
    """Compute the dense output at theta into w.inside, and all guards there into w.value and w.rate."""
    dense_value(theta, T.pattern, s.y, w.dense, w.inside)
    problem.guards(t + fraction(w.scaling[0], theta) * h, w.inside, S, w.value, w.rate)


@kernel
def step_integral(T, h, w, which):
    """Return the integral of a power over the step."""
    total = 0.0
    if T.kind == EXPLICIT:
        last = T.stages
        for k in range(last):
            total += T.a[last, k] * w.power[k, which]
    else:
        for node in range(T.gauss.size):
            total += T.weight[node] * w.power[node, which]
    return h * total


@kernel
def integral_error(T, h, s, w):
    """Return the weighted error of the integrals over an explicit step.

    The weight refers to the largest integral so far, and to the energy of a mass that moves by its size in the time of the run:
    round-off in the power of a start from rest may be as large as that power.
    """
    worst = 0.0
    if s.clock[0].monitors == 0 or T.kind != EXPLICIT:
        return 0.0
    size = s.clock[0].inertia / s.clock[0].end ** 2
    for q in range(s.total.size):
        first = second = 0.0
        for stage in range(T.stages + 1):
            first += T.error[0, stage] * w.power[stage, q]
            second += T.error[T.combined, stage] * w.power[stage, q]
        error = abs(h * first)
        if T.combined == 1:
            root = math.sqrt(error * error + 0.01 * h * h * second * second)
            error *= error / (root if root != 0.0 else 1.0)
        if not error <= worst:
            worst = error
        size = max(size, abs(s.total[q]) + abs(step_integral(T, h, w, q)))
    return worst / (s.clock[0].integral * size) if worst > 0.0 else worst


@kernel
def integrals_at(T, theta, h, s, w, out):
    """Compute the integrals of the powers up to theta; at the end of the step they are those of the next state, to the bit."""
    if theta == 1.0:
        for q in range(s.total.size):
            out[q] = s.total[q] + step_integral(T, h, w, q)
        return
    if T.kind == EXPLICIT:
        dense_value(theta, T.pattern, s.total, w.gain, out)
        return
    for q in range(s.total.size):
        out[q] = 0.0
    for node in range(T.gauss.size):
        value = 0.0
        for k in range(T.gauss.size - 1, -1, -1):
            value = (value + T.primitive[node, k]) * theta
        for q in range(s.total.size):
            out[q] += value * w.power[node, q]
    for q in range(s.total.size):
        out[q] = s.total[q] + h * out[q]
