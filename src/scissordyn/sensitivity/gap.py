"""Find events of guards that a change of a parameter adds, removes or moves too far."""

from __future__ import annotations

import math

from scissordyn.integrate.event import cubic, sign_of
from scissordyn.integrate.integration import DATA, GUARD, TIME
from scissordyn.kernel import derivative, kernel, value_of

SINCE_EVENT = -math.inf  # Value of `Watched.since` for a guard that has been close to zero since its last event

INSTANT, VALUE, RATE, EVENT, SLOPES = range(5)
"""Columns of `Watched.gap`: instant, value and rate of a guard after the last step, its last event, and first derivative."""

NEAR, FAR, GRAZING = range(3)
"""Rows of `Watched.limits`: an event that a change adds or removes, one that it moves too far, and one that grazes."""


@kernel
def watch_gaps(problem, first, after, run, s, w, system, log):
    """Compare each guard with its change at the end of a step; `first` and `after` are the range of its events in `log`.

    A guard is negative until it is crossed. A changed run may have crossed it where the sum of its value and its change is
    positive. If it turns back there without an event, the changed run has one more. If it is there all the time between two
    events, the changed run may have none.
    """
    t = s.clock[0].time
    problem.forget(system)
    problem.guards(t, s.y, system, w.value, w.rate)
    problem.forget(system)
    now = value_of(t)
    for guard in range(s.mode.size):
        old, since, sign = run.gap[guard], run.since[guard], sign_of(s.mode[guard])
        value, rate = sign * w.value[guard], sign * w.rate[guard]
        at, watched = event_row(guard, first, after, run), run.unwatched[guard] != s.mode[guard]
        before, size = old[RATE], now - old[INSTANT]
        # an event crosses zero
        end, end_rate = (0.0, abs(run.log[at, DATA])) if at >= 0 else (value_of(value), value_of(rate))
        turns = before * end_rate <= 0.0 and before != end_rate
        part, extreme = 1.0, end
        if turns and (at >= 0 or after == first):
            part = before / (before - end_rate)  # where the linear rate is zero
            extreme, _ = cubic(part, old[VALUE], size * before, end, size * end_rate)
            if before > 0.0 and extreme > 0.0:  # the cubic is inaccurate: there is no event
                part, extreme = 1.0, end
        for k in range(since.size):
            slope = derivative(value, k) - value_of(rate) * derivative(t, k)
            end_slope = -end_rate * derivative(log[at, TIME], k) if at >= 0 else slope
            reach_before, reach = old[VALUE] + run.change[0] * abs(old[SLOPES + k]), end + run.change[0] * abs(end_slope)
            extreme_reach = extreme + run.change[0] * abs((1.0 - part) * old[SLOPES + k] + part * end_slope)
            if since[k] == SINCE_EVENT and turns and before < 0.0 and extreme_reach <= 0.0:
                since[k] = math.inf
            if at >= 0:
                begun = old[INSTANT] if since[k] == math.inf else since[k]
                if since[k] == SINCE_EVENT:
                    begun = old[EVENT]
                    run.limits[NEAR, k] = min(run.limits[NEAR, k], begun)
                begun = max(begun, now - event_shift(log[at], k, run))
                if run.change[0] * abs(end_slope) > run.leeway[guard]:
                    run.limits[FAR, k] = min(run.limits[FAR, k], begun)
                elif run.change[0] * abs(derivative(log[at, DATA], k)) > 0.5 * end_rate:
                    run.limits[GRAZING, k] = min(run.limits[GRAZING, k], begun)
                since[k] = SINCE_EVENT
            elif watched:
                top = extreme_reach if turns and before > 0.0 else reach
                if since[k] == math.inf and max(top, reach) > 0.0:
                    begun = 0.0
                    if reach_before < 0.0 < top:  # the root of a parabola with the rate at its end
                        steep = 0.0 if turns and before > 0.0 else size * end_rate
                        bend = reach_before - top + steep
                        begun = part * (1.0 - 2.0 * top / (steep + math.sqrt(steep * steep - 4.0 * bend * top)))
                    since[k] = old[INSTANT] + begun * size
                if turns and before > 0.0 and top > 0.0:
                    run.limits[NEAR, k] = min(run.limits[NEAR, k], old[EVENT] if since[k] == SINCE_EVENT else since[k])
                if reach <= 0.0:
                    since[k] = math.inf
            if not watched:
                since[k] = math.inf
            old[SLOPES + k] = slope
        old[INSTANT], old[VALUE], old[RATE] = now, value_of(value), value_of(rate)
        if at >= 0:
            old[EVENT] = now


@kernel
def event_shift(row, k, run):
    """Return how much earlier a changed run may have an event, from the derivatives of its row of the log.

    The guard is a parabola.
    """
    shift = run.change[0] * derivative(row[TIME], k)
    steeper = run.change[0] * derivative(row[DATA], k) / value_of(row[DATA])
    if shift > 0.0:
        steeper = -steeper
    return 2.0 * abs(shift) / (1.0 + math.sqrt(max(1.0 + 2.0 * steeper, 0.0)))


@kernel
def event_row(guard, first, after, run):
    """Return the first row of a guard in a range of the log, or -1."""
    for at in range(first, after):
        if int(run.log[at, GUARD]) == guard:
            return at
    return -1
