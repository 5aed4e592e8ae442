"""The one loop that advances a problem: step, error control, guards, resets, quadratures, samples.

A problem is a tuple of typed pointers

    rate(t, y, S, dy)              right-hand side
    linearise(t, y, S, dy, dt)     right-hand side, its partial derivative by time, and what `factorize` needs
    factorize(h gamma, S)          W = 1/(h gamma) - J; returns a singular row or -1
    solve(r, S)                    r := W^-1 r
    project(t, y, S)               back to the problem's manifold; returns whether y changed
    guards(t, y, S, value, rate)   switching functions and their rates
    reset(t, y, k, S, record)      guard k has been crossed: change y and S, leave remarks in record
    powers(t, y, S, power, watch)  integrands, and per guard WATCHED numbers: one whose largest value is wanted, and all of
                                   them to be integrated while the guard's mode is 1
    record(t, y, S, signals)       what the problem wants to look back at later; see `history`

with S the address of whatever they work on. A guard in mode 0 waits for its value to rise through zero, in mode 1 to fall.
"""

from __future__ import annotations

import math

from scissordyn.integrate.history import keep_history, up_to_multiple
from scissordyn.integrate.step import (
    dense_value,
    error_norm,
    explicit_dense,
    explicit_step,
    rosenbrock_dense,
    rosenbrock_step,
)
from scissordyn.jit import kernel

__all__ = [
    "ADVANCING",
    "FINISHED",
    "HISTORY_FULL",
    "LOG_COLUMNS",
    "LOG_FULL",
    "NOT_FINITE",
    "RECORD",
    "STEP_TOO_SMALL",
    "STUCK",
    "WATCHED",
    "advance",
]

ADVANCING, FINISHED, LOG_FULL, STEP_TOO_SMALL, NOT_FINITE, STUCK, HISTORY_FULL = range(7)
"""What `advance` returns: more to do, done, the event log wants more room, the ways to fail, the history wants more room."""

RECORD = 2
"""Numbers that a reset may leave in the event log."""

WATCHED = 3
"""Watched numbers per guard."""

LOG_COLUMNS = 5 + RECORD + WATCHED
"""Time, guard, new mode, what the reset left, the largest first watched number and its time, integrals of the watched."""

PROBES = 6
"""Points inside a step at which guards are looked at."""

LANDINGS = 8
"""Attempts to end a step on a crossing; Newton's method needs two or three."""

# rows of the counters and of the clock
STEPS, REJECTED, RATES, JACOBIANS, EVENTS, SAMPLED, STALLED, FRESH = range(8)
TIME, STEP, END, AFTER_RISE, AFTER_FALL = range(5)


@kernel(inline=True)
def evaluate(problem, T, theta, t, h, w, S):
    """Dense output at theta into w.inside, guards there into w.value and w.rate."""
    dense_value(theta, T.pattern, w.y, w.dense, w.inside)
    problem.guards(t + theta * h, w.inside, S, w.value, w.rate)


@kernel(inline=True)
def sign_of(mode):
    """A guard's value times this is negative until it is crossed."""
    return 1.0 if mode == 0 else -1.0


@kernel()
def crossing(problem, T, k, low, high, t, h, w, S):
    """First theta in (low, high] at which guard k, not crossed at low and crossed at high, is crossed (bisection)."""
    sign = sign_of(w.mode[k])
    for _ in range(60):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        evaluate(problem, T, middle, t, h, w, S)
        if sign * w.value[k] > 0.0:
            high = middle
        else:
            low = middle
    return high


@kernel()
def summit(problem, T, k, low, high, t, h, w, S):
    """A theta in (low, high) at which guard k, rising at low and falling at high, is past its crossing; or -1."""
    sign = sign_of(w.mode[k])
    for _ in range(50):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        evaluate(problem, T, middle, t, h, w, S)
        if sign * w.value[k] > 0.0:
            return middle
        if sign * w.rate[k] > 0.0:
            low = middle
        else:
            high = middle
    return -1.0


@kernel(inline=True)
def first_crossing(problem, T, t, h, w, S):
    """Guard that is crossed first inside the step and where: (guard, theta), or (-1, 1)."""
    count = w.mode.size
    if count == 0:
        return -1, 1.0
    problem.guards(t, w.y, S, w.value, w.rate)
    for k in range(count):
        w.left_rate[k] = w.rate[k]
    left = 0.0
    for probe in range(1, PROBES + 1):
        theta = probe / PROBES
        evaluate(problem, T, theta, t, h, w, S)
        guard, where = -1, theta
        for k in range(count):
            w.right_value[k], w.right_rate[k] = w.value[k], w.rate[k]
        for k in range(count):
            sign = sign_of(w.mode[k])
            found = -1.0
            if sign * w.right_value[k] > 0.0:
                # one that has not crossed where another has is not the first
                if guard < 0 or sign * w.first_value[k] > 0.0:
                    found = theta
            elif sign * w.left_rate[k] > 0.0 and sign * w.right_rate[k] < 0.0:
                found = summit(problem, T, k, left, theta, t, h, w, S)
            if found > 0.0:
                found = crossing(problem, T, k, left, found, t, h, w, S)
                if guard < 0 or found < where:
                    guard, where = k, found
                    evaluate(problem, T, where, t, h, w, S)
                    for other in range(count):
                        w.first_value[other] = w.value[other]
        if guard >= 0:
            return guard, where
        for k in range(count):
            w.left_rate[k] = w.right_rate[k]
        left = theta
    return -1, 1.0


@kernel(inline=True)
def trial(problem, T, t, h, w, S, count):
    """One step from (t, w.y) to w.new; returns whether the arithmetic went through."""
    if T.kind == 0:
        explicit_step(problem.rate, T, t, h, w.y, w.new, w.stages, w.inside, S)
        count[RATES] += T.stages
        return True
    if problem.factorize(h * T.gamma, S) >= 0:
        return False
    rosenbrock_step(problem.rate, problem.solve, T, t, h, w.y, w.new, w.stages, w.inside, w.slope, w.slope_t, S)
    count[RATES] += T.stages - 1
    return True


@kernel(inline=True)
def complete(problem, T, t, h, w, S, count):
    """Dense output of the step just made."""
    if T.kind == 0:
        explicit_dense(problem.rate, T, t, h, w.y, w.new, w.stages, w.inside, w.dense, S)
        count[RATES] += T.nodes.size - T.stages - 1
    else:
        rosenbrock_dense(T, w.y, w.new, w.stages, w.dense)


@kernel(inline=True)
def prepare(problem, T, t, w, S, count):
    """Slope at the start of a step, and the linearisation that a Rosenbrock method needs."""
    if T.kind == 0:
        problem.rate(t, w.y, S, w.stages[0])
        count[RATES] += 1
    else:
        problem.linearise(t, w.y, S, w.slope, w.slope_t)
        count[RATES] += 1
        count[JACOBIANS] += 1


@kernel(inline=True)
def place_of(T, node):
    """Where in the step the rows of Work.watched were taken: its start, the Gauss nodes, its end."""
    if node == 0:
        return 0.0
    return T.gauss[node - 1] if node <= T.gauss.size else 1.0


@kernel(inline=True)
def summit_of_parabola(T, k, first, w):
    """Abscissa of the vertex of the parabola through three neighbouring watched numbers."""
    a, b, c = place_of(T, first), place_of(T, first + 1), place_of(T, first + 2)
    left = (w.watched[first + 1, k, 0] - w.watched[first, k, 0]) / (b - a)
    right = (w.watched[first + 2, k, 0] - w.watched[first + 1, k, 0]) / (c - b)
    if right >= left:
        return a - 1.0 if right < 0.0 else c + 1.0
    return 0.5 * (a + b) + left * 0.5 * (c - a) / (left - right)


@kernel(inline=True)
def watched_integral(T, h, w, k, which):
    """Integral over the step of a watched number of guard k."""
    total = 0.0
    for node in range(T.gauss.size):
        weight = 0.0
        for i in range(T.gauss.size):
            weight += T.primitive[node, i]
        total += weight * w.watched[node + 1, k, which]
    return h * total


@kernel(inline=True)
def watch(problem, T, t, h, w, S, count):
    """Integrate the powers over the step and follow the peaks of the watched numbers."""
    guards = w.mode.size
    for node in range(T.gauss.size):
        dense_value(T.gauss[node], T.pattern, w.y, w.dense, w.inside)
        problem.powers(t + T.gauss[node] * h, w.inside, S, w.power[node], w.watched[node + 1])
    count[RATES] += T.gauss.size + 1
    last = T.gauss.size + 1
    problem.powers(t + h, w.new, S, w.power[T.gauss.size], w.watched[last])
    for k in range(guards):
        if w.mode[k] == 0:
            continue
        for q in range(WATCHED):
            w.peak[k, 2 + q] += watched_integral(T, h, w, k, q)
        best = 0
        for node in range(1, last + 1):
            if w.watched[node, k, 0] > w.watched[best, k, 0]:
                best = node
        value, theta = w.watched[best, k, 0], place_of(T, best)
        if value < w.peak[k, 0]:
            continue
        low, high = place_of(T, max(best - 1, 0)), place_of(T, min(best + 1, last))
        inside = 0 < best < last
        if best == 0:
            inside = summit_of_parabola(T, k, 0, w) > 0.0
        elif best == last:
            inside = summit_of_parabola(T, k, last - 2, w) < 1.0
        if inside:
            theta, value = refine_peak(problem, T, k, low, theta, high, value, t, h, w, S)
        if value > w.peak[k, 0]:
            w.peak[k, 0] = value
            w.peak[k, 1] = t + theta * h
    for k in range(guards):
        w.watched[0, k, 0] = w.watched[last, k, 0]


@kernel()
def refine_peak(problem, T, k, low, middle, high, value, t, h, w, S):
    """Golden-section search for the largest watched number k around `middle`; returns (theta, value)."""
    ratio = 0.3819660112501051
    for _ in range(40):
        # below this width the parabola at the summit is flat to round-off
        if high - low < 1e-7:
            break
        probe = middle + ratio * (high - middle) if high - middle > middle - low else middle - ratio * (middle - low)
        dense_value(probe, T.pattern, w.y, w.dense, w.inside)
        problem.powers(t + probe * h, w.inside, S, w.power[T.gauss.size], w.watched[T.gauss.size + 2])
        found = w.watched[T.gauss.size + 2, k, 0]
        if found > value:
            if probe > middle:
                low = middle
            else:
                high = middle
            middle, value = probe, found
        elif probe > middle:
            high = probe
        else:
            low = probe
    return middle, value


@kernel(inline=True)
def integral(T, theta, h, w, which):
    """Integral of a power from the start of the step to theta."""
    total = 0.0
    for node in range(T.gauss.size):
        value = 0.0
        for k in range(T.gauss.size - 1, -1, -1):
            value = (value + T.primitive[node, k]) * theta
        total += value * w.power[node, which]
    return h * total


@kernel(inline=True)
def sample(T, t, h, final, count, w, out):
    """Write the samples that lie in (t, t + h], or at the very end."""
    while count[SAMPLED] < out.time.size:
        at = count[SAMPLED]
        when = out.time[at]
        if when > t + h and not (final and at == out.time.size - 1):
            return
        theta = min(1.0, max(0.0, (when - t) / h)) if h > 0.0 else 1.0
        dense_value(theta, T.pattern, w.y, w.dense, out.state[at])
        for q in range(w.total.size):
            out.total[at, q] = w.total[q] + integral(T, theta, h, w, q)
        for k in range(w.mode.size):
            out.mode[at, k] = w.mode[k]
            out.memory[at, k] = w.memory[k]
        count[SAMPLED] += 1


@kernel()
def land(problem, T, guard, theta, t, h, w, S, count):
    """Repeat the step so that it ends on the crossing; returns its size.

    The crossing was found on the dense output; the end of a step is more accurate than its inside, so a few Newton steps
    on the step size follow.
    """
    # two joints that cross within round-off leave a step that the clock cannot resolve, nor a Rosenbrock method divide by
    least = min(h, 4e-16 * max(abs(t), abs(t + h)))
    short = max(theta * h, least)
    for attempt in range(LANDINGS):
        if not trial(problem, T, t, short, w, S, count):
            break
        problem.guards(t + short, w.new, S, w.value, w.rate)
        value, rate = w.value[guard], w.rate[guard]
        if abs(value) <= w.precision[guard] or rate == 0.0:
            break
        corrected = short - value / rate
        # the last size tried is the one that the new state belongs to
        if not least <= corrected <= h or attempt == LANDINGS - 1:
            break
        short = corrected
    return short


@kernel()
def advance(problem, T, S, clock, count, w, out, log, most_steps):
    """Advance until the end of the samples, or for `most_steps` steps; returns a status.

    Parameters
    ----------
    problem : Problem
    T : Tableau
    S : int
        Address that the problem's functions are handed.
    clock : ndarray, shape (5,)
        Present time, next step size, end time, and first step sizes that worked after a rise and after a fall.
    count : ndarray of int, shape (8,)
        Counters: steps, rejected, rates, Jacobians, events, samples written, events without progress, work arrays ready.
    w : Work
    out : Samples
    log : ndarray, shape (rows, LOG_COLUMNS)
    most_steps : int
    """
    size = w.y.size
    for _ in range(most_steps):
        t = clock[TIME]
        if t >= clock[END]:
            if count[SAMPLED] < out.time.size:
                sample(T, t, 0.0, True, count, w, out)
            return FINISHED
        if count[EVENTS] >= log.shape[0]:
            return LOG_FULL
        delayed = w.delays.size > 0
        if delayed and w.kept[0] >= w.history.shape[0]:
            return HISTORY_FULL
        if count[FRESH] == 0:
            prepare(problem, T, t, w, S, count)
            count[FRESH] = 1
        h = up_to_multiple(t, clock[STEP], w.delays) if delayed else clock[STEP]
        last = t + h >= clock[END] or clock[END] - t - h < 1e-3 * h
        if last:
            h = clock[END] - t
        ok = trial(problem, T, t, h, w, S, count)
        error = error_norm(T, h, w.y, w.new, w.stages, w.atol, w.rtol, w.group) if ok else math.nan
        if not error <= 1.0:
            count[REJECTED] += 1
            factor = 0.2
            if error == error and not math.isinf(error):
                factor = max(0.2, 0.9 * error ** (-1.0 / T.order))
            clock[STEP] = h * factor
            count[STALLED] += 1
            if clock[STEP] <= 4e-16 * max(abs(t), abs(clock[END])):
                return STEP_TOO_SMALL if error == error else NOT_FINITE
            w.rejected[0] = 1
            continue
        complete(problem, T, t, h, w, S, count)
        grow = 8.0 if error <= 1e-12 else min(8.0, max(0.2, 0.9 * error ** (-1.0 / T.order)))
        if w.rejected[0] == 1:
            grow = min(grow, 1.0)
        w.rejected[0] = 0
        count[STEPS] += 1
        if w.first[0] >= 0:
            clock[AFTER_RISE + w.first[0]] = h
            w.first[0] = -1
        guard, theta = first_crossing(problem, T, t, h, w, S)
        full = h
        if guard >= 0:
            h = land(problem, T, guard, theta, t, h, w, S, count)
            complete(problem, T, t, h, w, S, count)
        if delayed:
            keep_history(problem.record, T, t, h, w, S)
        watch(problem, T, t, h, w, S, count)
        sample(T, t, h, last and guard < 0, count, w, out)
        for q in range(w.total.size):
            w.total[q] += integral(T, 1.0, h, w, q)
        now = clock[END] if last and guard < 0 else t + h
        moved = problem.project(now, w.new, S)
        for i in range(size):
            w.y[i] = w.new[i]
        clock[TIME] = now
        clock[STEP] = full * grow
        count[FRESH] = 0
        if T.kind == 0 and guard < 0 and not moved:
            for i in range(size):
                w.stages[0, i] = w.stages[T.stages, i]
            count[FRESH] = 1
        count[STALLED] = count[STALLED] + 1 if now <= t else 0
        if count[STALLED] > 1000:
            return STUCK
        if guard < 0:
            continue
        row = log[count[EVENTS]]
        row[0], row[1], row[2] = now, guard, 1.0 - w.mode[guard]
        problem.reset(now, w.y, guard, S, row[3 : 3 + RECORD])
        for q in range(2 + WATCHED):
            row[3 + RECORD + q] = w.peak[guard, q]
        after = int(1 - row[2])
        if w.mode[guard] == 1:
            w.peak[guard, :] = 0.0
            w.peak[guard, 1] = now
        w.watched[0, guard, 0] = 0.0
        clock[STEP] = min(full, 2.0 * clock[AFTER_RISE + after])
        w.first[0] = after
        count[EVENTS] += 1
    return ADVANCING
