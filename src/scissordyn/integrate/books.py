"""Integrals of powers over a step, and the largest watched numbers.

An explicit method integrates with its own stages, which have evaluated everything anyway; a Rosenbrock method, whose stages
are less accurate than its steps, on Gauss nodes of its dense output.
"""

from __future__ import annotations

import math

from scissordyn.integrate.pace import fraction, speed
from scissordyn.integrate.step import dense_value
from scissordyn.jit import kernel

__all__ = ["RATES", "SPARE", "WATCHED", "total_at", "watch"]

WATCHED = 3
"""Watched numbers per guard."""

INSIDE = 3
"""Equidistant points inside an explicit step at which a peak is looked for once its stages hint at one."""

SPARE = INSIDE + 1
"""Rows of work space behind the watched numbers."""

NEARLY = 0.5
"""A summit that its parabola puts so little outside a step, in parts of the step, may lie inside."""

EDGE = 2e-5
"""A summit nearer to the end of a step, in parts of the step, is taken to be there."""

HINT = 0.98
"""Stages this near to the largest number so far hint at a peak: they are less accurate than the dense output."""

RATES = 2
"""Row of the counters that counts right-hand sides."""

GOLDEN = 0.3819660112501051


@kernel(inline=True)
def total_at(T, theta, h, w, which):
    """Integral of a power from the start of the step to theta."""
    if T.kind == 0:
        value = 0.0
        for k in range(T.pattern.size - 1, -1, -1):
            value = (w.gain[k, which] + value) * (theta if T.pattern[k] == 0 else 1.0 - theta)
        return value
    total = 0.0
    for node in range(T.gauss.size):
        value = 0.0
        for k in range(T.gauss.size - 1, -1, -1):
            value = (value + T.primitive[node, k]) * theta
        total += value * w.power[node, which]
    return h * total


@kernel(inline=True)
def watch(problem, T, t, h, w, S, count):
    """Follow the peaks and integrals of the watched numbers over the step just made; Rosenbrock: also note the powers."""
    if T.kind == 1:
        watch_nodes(problem, T, t, h, w, S, count)
        return
    looked = False
    for k in range(w.mode.size):
        if w.mode[k] == 0:
            continue
        highest = 0.0
        for s in range(T.stages):
            weight = h * T.a[T.stages, s] * speed(w.pace[0], T.nodes[s])
            for q in range(WATCHED):
                w.peak[k, 2 + q] += weight * w.watched[s, k, q]
            highest = max(highest, w.watched[s, k, 0])
        best = max(w.peak[k, 0], w.watched[T.stages, k, 0])
        if highest >= HINT * best:
            if not looked:
                look_inside(problem, T, t, h, w, S, count)
                looked = True
            find_peak(problem, T, k, t, h, w, S, count)
        elif best > w.peak[k, 0]:
            w.peak[k, 0], w.peak[k, 1] = best, t + h


@kernel(inline=True)
def look_inside(problem, T, t, h, w, S, count):
    """Watched numbers at the points inside an explicit step, into the rows of work space."""
    for point in range(INSIDE):
        probe(problem, T, (point + 1.0) / (INSIDE + 1.0), t, h, w, S, T.nodes.size + point, count)


@kernel()
def probe(problem, T, theta, t, h, w, S, row, count):
    """Watched numbers at theta, into a row of Work.watched."""
    dense_value(theta, T.pattern, w.y, w.dense, w.inside)
    now = t + fraction(w.pace[0], theta) * h
    problem.rate(now, w.inside, S, w.slope)
    problem.powers(now, w.inside, S, w.power_at_start, w.watched[row])
    count[RATES] += 1


@kernel(inline=True)
def row_of(T, point):
    """Row of Work.watched of the start of the step, its points inside, its end."""
    if T.kind == 1:
        return point
    if point == 0:
        return 0
    return T.nodes.size + point - 1 if point <= INSIDE else T.stages


@kernel(inline=True)
def place_of(T, point):
    """Where in the step these are."""
    if T.kind == 0:
        return point / (INSIDE + 1.0)
    if point == 0:
        return 0.0
    return T.gauss[point - 1] if point <= T.gauss.size else 1.0


@kernel(inline=True)
def vertex(T, k, first, w):
    """Abscissa of the vertex of the parabola through three neighbouring watched numbers."""
    a, b, c = place_of(T, first), place_of(T, first + 1), place_of(T, first + 2)
    middle = w.watched[row_of(T, first + 1), k, 0]
    left = (middle - w.watched[row_of(T, first), k, 0]) / (b - a)
    right = (w.watched[row_of(T, first + 2), k, 0] - middle) / (c - b)
    if right >= left:
        return a - 1.0 if right < 0.0 else c + 1.0
    return 0.5 * (a + b) + left * 0.5 * (c - a) / (left - right)


@kernel()
def find_peak(problem, T, k, t, h, w, S, count):
    """Largest first watched number of guard k in the step, if it exceeds the largest so far."""
    last = (INSIDE if T.kind == 0 else T.gauss.size) + 1
    best = 0
    for point in range(1, last + 1):
        if w.watched[row_of(T, point), k, 0] > w.watched[row_of(T, best), k, 0]:
            best = point
    value, theta = w.watched[row_of(T, best), k, 0], place_of(T, best)
    inside = 0 < best < last
    if best == 0:
        inside = vertex(T, k, 0, w) > -NEARLY
    elif best == last:
        inside = vertex(T, k, last - 2, w) < 1.0 + NEARLY
    if value < w.peak[k, 0]:
        return
    if inside and not 0 < best < last:
        # the parabola is too coarse to tell on which side of the step's end the summit is
        row = w.watched.shape[0] - 1
        probe(problem, T, EDGE if best == 0 else 1.0 - EDGE, t, h, w, S, row, count)
        inside = w.watched[row, k, 0] > value
    if inside:
        low, high = place_of(T, max(best - 1, 0)), place_of(T, min(best + 1, last))
        theta, value = refine(problem, T, k, low, theta, high, value, t, h, w, S, count)
    if value > w.peak[k, 0]:
        w.peak[k, 0], w.peak[k, 1] = value, t + fraction(w.pace[0], theta) * h


@kernel()
def refine(problem, T, k, low, best, high, value, t, h, w, S, count):
    """Largest watched number around `best` by Brent's parabolas and golden sections; returns (theta, value).

    Brent, Algorithms for Minimization without Derivatives, 1973, chapter 5.
    """
    row = w.watched.shape[0] - 1
    second = third = best
    second_value = third_value = value
    move = before = 0.0
    for _ in range(40):
        middle, tolerance = 0.5 * (low + high), 1e-7
        # below this width the parabola at the summit is flat to round-off
        if abs(best - middle) <= 2.0 * tolerance - 0.5 * (high - low):
            break
        golden = True
        if abs(before) > tolerance:
            r = (best - second) * (value - third_value)
            q = (best - third) * (value - second_value)
            p, q = (best - third) * q - (best - second) * r, 2.0 * (q - r)
            if q > 0.0:
                p = -p
            q, last = abs(q), before
            before = move
            if abs(p) < abs(0.5 * q * last) and q * (low - best) < p < q * (high - best):
                move, golden = p / q, False
        if golden:
            before = (low if best >= middle else high) - best
            move = GOLDEN * before
        theta = best + (move if abs(move) >= tolerance else math.copysign(tolerance, move))
        if not low <= theta <= high:
            break
        probe(problem, T, theta, t, h, w, S, row, count)
        found = w.watched[row, k, 0]
        if found >= value:
            if theta >= best:
                low = best
            else:
                high = best
            third, third_value, second, second_value = second, second_value, best, value
            best, value = theta, found
            continue
        if theta < best:
            low = theta
        else:
            high = theta
        if found >= second_value or second == best:
            third, third_value, second, second_value = second, second_value, theta, found
        elif found >= third_value or third in (best, second):
            third, third_value = theta, found
    return best, value


@kernel(inline=True)
def watch_nodes(problem, T, t, h, w, S, count):
    """The same for a Rosenbrock method, on the Gauss nodes."""
    last = T.gauss.size + 1
    for node in range(1, last + 1):
        theta = place_of(T, node)
        dense_value(theta, T.pattern, w.y, w.dense, w.inside)
        problem.rate(t + theta * h, w.inside, S, w.slope)
        problem.powers(t + theta * h, w.inside, S, w.power[node - 1], w.watched[node])
    count[RATES] += last
    for k in range(w.mode.size):
        if w.mode[k] == 0:
            continue
        for node in range(T.gauss.size):
            weight = 0.0
            for i in range(T.gauss.size):
                weight += T.primitive[node, i]
            for q in range(WATCHED):
                w.peak[k, 2 + q] += h * weight * w.watched[node + 1, k, q]
        find_peak(problem, T, k, t, h, w, S, count)
    for k in range(w.mode.size):
        w.watched[0, k, 0] = w.watched[last, k, 0]
