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
                                   them to be integrated while the guard's mode is 1; called right after `rate` or
                                   `linearise` for the same t and y
    record(t, y, S, signals)       what the problem wants to look back at later; see `history`

with S the address of whatever they work on. A guard in mode 0 waits for its value to rise through zero, in mode 1 to fall.
"""

from __future__ import annotations

import math

from scissordyn.integrate.books import RATES, WATCHED, total_at, watch
from scissordyn.integrate.history import keep_history, up_to_multiple
from scissordyn.integrate.pace import AFTER_START, BEFORE_END, EVEN, fraction, place, speed
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
    "advance",
]

ADVANCING, FINISHED, LOG_FULL, STEP_TOO_SMALL, NOT_FINITE, STUCK, HISTORY_FULL = range(7)
"""What `advance` returns: more to do, done, the event log wants more room, the ways to fail, the history wants more room."""

RECORD = 2
"""Numbers that a reset may leave in the event log."""

LOG_COLUMNS = 5 + RECORD + WATCHED
"""Time, guard, new mode, what the reset left, the largest first watched number and its time, integrals of the watched."""

PROBES = 6
"""Points inside a step at which guards are looked at."""

LANDINGS = 8
"""Attempts to end a step on a crossing; Newton's method needs two or three."""

LONGEST = 1.0 / 256.0
"""Longest step of a problem without a state, as a part of the whole time."""

AIM = 1.3
"""The end of a contact is tried to be reached in one step of this many times the size that worked after its start."""

NEARER = 0.6
"""Largest part of the way to the end of a contact that an even step goes."""

# rows of the counters and of the clock
STEPS, REJECTED, JACOBIANS, EVENTS, SAMPLED, STALLED, FRESH = 0, 1, 3, 4, 5, 6, 7
TIME, STEP, END, AFTER_RISE, AFTER_FALL = range(5)


@kernel(inline=True)
def evaluate(problem, T, theta, t, h, w, S):
    """Dense output at theta into w.inside, guards there into w.value and w.rate."""
    dense_value(theta, T.pattern, w.y, w.dense, w.inside)
    problem.guards(t + fraction(w.pace[0], theta) * h, w.inside, S, w.value, w.rate)


@kernel(inline=True)
def sign_of(mode):
    """A guard's value times this is negative until it is crossed."""
    return 1.0 if mode == 0 else -1.0


@kernel()
def crossing(problem, T, k, low, high, below, above, t, h, w, S):
    """A theta in (low, high] just past which guard k is crossed, from its values (times its sign) there: Illinois's rule."""
    sign, side = sign_of(w.mode[k]), 0
    for _ in range(60):
        # a guard that has just been crossed back may start on the wrong side by round-off
        middle = low + (high - low) * (below / (below - above)) if below < 0.0 else low
        if not low < middle < high:
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
        evaluate(problem, T, middle, t, h, w, S)
        value = sign * w.value[k]
        if value > 0.0:
            high, above = middle, value
            if value < 0.1 * w.precision[k]:
                break
            if side > 0:
                below *= 0.5
            side = 1
        else:
            low, below = middle, value
            if side < 0:
                above *= 0.5
            side = -1
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
        w.left_value[k], w.left_rate[k] = w.value[k], w.rate[k]
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
                if found < theta:
                    evaluate(problem, T, found, t, h, w, S)
                above = sign * (w.right_value[k] if found == theta else w.value[k])
                found = crossing(problem, T, k, left, found, sign * w.left_value[k], above, t, h, w, S)
                if guard < 0 or found < where:
                    guard, where = k, found
                    evaluate(problem, T, where, t, h, w, S)
                    for other in range(count):
                        w.first_value[other] = w.value[other]
        if guard >= 0:
            return guard, where
        for k in range(count):
            w.left_value[k], w.left_rate[k] = w.right_value[k], w.right_rate[k]
        left = theta
    return -1, 1.0


@kernel(inline=True)
def trial(problem, T, t, h, w, S, count):
    """One step from (t, w.y) to w.new; returns whether the arithmetic went through."""
    if T.kind == 0:
        explicit_step(problem, T, t, h, w, S)
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
        explicit_dense(problem, T, t, h, w, S)
        count[RATES] += T.nodes.size - T.stages - 1
    else:
        rosenbrock_dense(T, w.y, w.new, w.stages, w.dense)


@kernel(inline=True)
def prepare(problem, T, t, w, S, count):
    """Slope at the start of a step, and the linearisation that a Rosenbrock method needs."""
    if T.kind == 0:
        problem.rate(t, w.y, S, w.slope)
        problem.powers(t, w.y, S, w.power_at_start, w.watched[0])
        count[RATES] += 1
    else:
        problem.linearise(t, w.y, S, w.slope, w.slope_t)
        count[RATES] += 1
        count[JACOBIANS] += 1


@kernel(inline=True)
def carry(T, w):
    """Slope, powers and watched numbers at the end of an explicit step, for the start of the next."""
    last, inverse = T.stages, 1.0 / speed(w.pace[0], 1.0)
    for i in range(w.y.size):
        w.slope[i] = inverse * w.stages[last, i]
    for q in range(w.total.size):
        w.power_at_start[q] = inverse * w.power[last, q]
    for k in range(w.mode.size):
        for q in range(WATCHED):
            w.watched[0, k, q] = w.watched[last, k, q]


@kernel(inline=True)
def end_ahead(problem, t, most, w, S):
    """Guard whose contact ends next, and when at its present rate: (guard, time to it), or (-1, 0) beyond `most`."""
    found, least = -1, most
    for k in range(w.mode.size):
        if w.mode[k] == 1:
            if found < 0 and least == most:
                problem.guards(t, w.y, S, w.value, w.rate)
            if w.value[k] > w.precision[k] and w.rate[k] < 0.0 and w.value[k] < -least * w.rate[k]:
                found, least = k, -w.value[k] / w.rate[k]
    return found, least if found >= 0 else 0.0


@kernel()
def aim(problem, T, guard, t, h, most, w, S, count):
    """One slowing step to the end of a contact, first tried with size h; returns its size, or 0 if it does not get there."""
    w.pace[0] = BEFORE_END
    for _ in range(LANDINGS):
        trial(problem, T, t, h, w, S, count)
        problem.guards(t + h, w.new, S, w.value, w.rate)
        value, rate = w.value[guard], w.rate[guard]
        if abs(value) <= w.precision[guard]:
            return h
        if not rate < 0.0:
            break
        h -= value / rate
        if not 0.0 < h <= most:
            break
    w.pace[0] = EVEN
    return 0.0


@kernel(inline=True)
def sample(T, t, h, final, count, w, out):
    """Write the samples that lie in (t, t + h], or at the very end."""
    while count[SAMPLED] < out.time.size:
        at = count[SAMPLED]
        when = out.time[at]
        if when > t + h and not (final and at == out.time.size - 1):
            return
        theta = place(w.pace[0], min(1.0, max(0.0, (when - t) / h))) if h > 0.0 else 1.0
        dense_value(theta, T.pattern, w.y, w.dense, out.state[at])
        for q in range(w.total.size):
            out.total[at, q] = w.total[q] + total_at(T, theta, h, w, q)
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
    short = max(fraction(w.pace[0], theta) * h, least)
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
        if size == 0:  # without a state there is no error to choose a step by, but the books want to be integrated
            h = min(h, LONGEST * clock[END])
        last = t + h >= clock[END] or clock[END] - t - h < 1e-3 * h
        if last:
            h = clock[END] - t
        w.pace[0], aimed = EVEN, -1
        if w.touching[0] == 1 and w.first[0] == 0:
            w.pace[0] = AFTER_START
        elif T.kind == 0:
            most = min(w.reach[0], AIM * clock[AFTER_RISE], clock[END] - t)
            if delayed:
                most = up_to_multiple(t, most, w.delays)
            aimed, ahead = end_ahead(problem, t, max(most, h / NEARER), w, S)
            if 0.0 < ahead <= most:
                ahead = aim(problem, T, aimed, t, ahead, most, w, S, count)
            elif ahead > 0.0:
                h, last, ahead = min(h, NEARER * ahead), False, 0.0
            if ahead > 0.0:
                h, last = ahead, False
            else:
                aimed = -1
        ok = aimed >= 0 or trial(problem, T, t, h, w, S, count)
        error = error_norm(T, h, w.y, w.new, w.stages, w.atol, w.rtol, w.rounding, w.group) if ok else math.nan
        if not error <= 1.0:
            count[REJECTED] += 1
            factor = 0.2
            if error == error and not math.isinf(error):
                factor = max(0.2, 0.9 * error ** (-1.0 / T.order))
            if w.pace[0] == AFTER_START:  # the method steps in the root of time
                factor *= factor
            count[STALLED] += 1
            if aimed >= 0:
                w.reach[0] = h * factor
                continue
            clock[STEP] = h * factor
            if clock[STEP] <= 4e-16 * max(abs(t), abs(clock[END])):
                return STEP_TOO_SMALL if error == error else NOT_FINITE
            w.rejected[0] = 1
            continue
        complete(problem, T, t, h, w, S, count)
        grow = 8.0 if error <= 1e-12 else min(8.0, max(0.2, 0.9 * error ** (-1.0 / T.order)))
        if w.rejected[0] == 1:
            grow = min(grow, 1.0)
        # towards the end of a contact steps shrink at a steady rate (Gustafsson 1994, doi:10.1145/198429.198437)
        if w.touching[0] == 1 and w.pace[0] == EVEN and error > 1e-2 and w.trend[1] > 0.0:
            grow = min(grow, max(0.2, grow * (h / w.trend[0]) * (w.trend[1] / error) ** (1.0 / T.order)))
        w.trend[0], w.trend[1] = h, error if w.pace[0] == EVEN else 0.0
        w.rejected[0] = 0
        count[STEPS] += 1
        full = h
        if w.pace[0] == AFTER_START:
            clock[AFTER_RISE] = h * min(4.0, grow * grow)
            # what is past remains singular, as near as the step is long
            grow = min(grow, 1.0)
        elif w.first[0] >= 0:
            clock[AFTER_RISE + w.first[0]] = h * max(1.0, grow) if T.kind == 0 else 2.0 * h
        w.first[0] = -1
        guard, theta = first_crossing(problem, T, t, h, w, S)
        if aimed >= 0 and (guard < 0 or (guard == aimed and theta > 0.999)):
            guard = aimed
        elif guard >= 0:
            h = land(problem, T, guard, theta, t, h, w, S, count)
            complete(problem, T, t, h, w, S, count)
        if delayed:
            keep_history(problem.record, T, t, h, w, S)
        watch(problem, T, t, h, w, S, count)
        sample(T, t, h, last and guard < 0, count, w, out)
        for q in range(w.total.size):
            w.total[q] += total_at(T, 1.0, h, w, q)
        now = clock[END] if last and guard < 0 else t + h
        moved = problem.project(now, w.new, S)
        for i in range(size):
            w.y[i] = w.new[i]
        clock[TIME] = now
        clock[STEP] = full * grow
        count[FRESH] = 0
        if T.kind == 0 and guard < 0 and not moved:
            carry(T, w)
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
        remembered = clock[AFTER_RISE + after]
        clock[STEP] = remembered if T.kind == 0 and remembered < clock[END] else min(full, remembered)
        w.first[0] = after
        w.reach[0], w.trend[1] = math.inf, 0.0
        w.touching[0] = 0
        for k in range(w.mode.size):
            if T.kind == 0 and w.mode[k] == 1:
                w.touching[0] = 1
        count[EVENTS] += 1
    return ADVANCING
