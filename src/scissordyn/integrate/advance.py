"""The one loop that advances a problem: step, error control, guards, resets, quadratures, samples.

A problem is a tuple of typed pointers

    rate(t, y, S, dy)              right-hand side
    linearise(t, y, S, dy, dt)     right-hand side, its partial derivative by time, and what `factorize` needs
    factorize(h gamma, S)          W = 1/(h gamma) - J; returns a singular row or -1
    solve(r, S)                    r := W^-1 r
    accept(t, y, S, answer)        called at the end of each step: back to the problem's manifold, count turns; writes whether y
                                   changed, and the longest step that may follow, or minus the time to a singular position
    guards(t, y, S, value, rate)   switching functions and their rates
    guard(t, y, k, S, value, rate) those of guard k alone, from the entries of y that `Work.reads` lists for it
    reset(t, y, k, S, data)        guard k has been crossed: change y and S, write data for the event log; returns whether it
                                   has changed its mode
    monitor(t, y, S, power, rows)  integrands, and the rows of monitored numbers; called right after `rate` or `linearise` for
                                   the same t and y
    probe(t, y, k, S, dy, row)     row k of monitored numbers alone, from the entries of y that `Work.reads` lists for it; dy is
                                   scratch
    record(t, y, S, signals)       signals that the problem looks back at later; see `history`

with S the address of whatever they work on. A guard in mode 0 waits for its value to rise through zero, in mode 1 to fall.
"""

from __future__ import annotations

import math

from scissordyn.integrate.control import (
    ATTEMPTS,
    RESOLVED,
    after_acceptance,
    after_event,
    after_rejection,
    choose_step,
    first_step,
)
from scissordyn.integrate.crossing import crossed, end_inactive, log_crossings
from scissordyn.integrate.dense import complete, dense_value, integrals_at
from scissordyn.integrate.event import find_crossings, sign_of
from scissordyn.integrate.history import keep_history
from scissordyn.integrate.integration import (
    CROSSES,
    DATA,
    ENDED,
    FALL,
    GUARD,
    IGNORES,
    MODE,
    RISE,
    TIME,
    WHEN,
    open_integration,
)
from scissordyn.integrate.monitor import begin_peak, end_peak, monitor_step, step_integral
from scissordyn.integrate.step import EVERYTHING, NOTHING, OUTPUTS, attempt, error_norm, fraction, place, prepare, speed
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import kernel

ADVANCING, FINISHED, LOG_FULL, STEP_TOO_SMALL, NOT_FINITE, STUCK, HISTORY_FULL, RECORD_FULL, CHANGE_POINT = range(9)
"""What `advance` returns: more to do, done, the event log wants more room, the ways to fail, other stores want more room.

After `CHANGE_POINT` the caller makes a step across a singular position."""

_EXPLICIT = EXPLICIT

MOST_STALLED = 1000  # Trials and events without progress in time after which a run is stuck


AT_THE_END = 0.999  # Part of a step beyond which a crossing is the one that it ends on
TURNED = 1.1  # A step that is to end behind the turn of a guard goes this many times as far as its rate says
MISSED = 100.0  # Error with which a step is rejected whose crossings were not all found; its size is about halved


@kernel
def advance(problem, S, address, most_steps):
    """Advance until the end of the clock, or for `most_steps` steps; returns a status."""
    r = open_integration(address)
    T, s, w = r.method, r.state, r.work
    clock = s.clock[0]
    for _ in range(most_steps):
        if clock.time >= clock.end:
            write_samples(T, clock.time, 0.0, clock.time, s, w, r.samples)
            return FINISHED
        status = room(r)
        if status == ADVANCING:
            status = advance_step(problem, T, clock.time, s, w, S, r)
        if status != ADVANCING:
            return status
    return ADVANCING


@kernel
def room(r):
    """Whether all stores have room for what a step may leave."""
    s, counts = r.state, r.state.counts[0]
    if counts.events + 1 + 4 * s.mode.size > r.log.shape[0]:
        return LOG_FULL
    if r.work.delays.size > 0 and s.history_length[0] >= s.history.shape[0]:
        return HISTORY_FULL
    if r.steps.time.size > 0:
        inside = s.peak.shape[0] + 2 * r.work.rise_guard.size if r.steps.inside[0] == 1 else 0
        if counts.recorded + 1 + inside > r.steps.time.size:
            return RECORD_FULL
    return ADVANCING


@kernel
def advance_step(problem, T, t, s, w, S, r):
    """Try one step; returns a status."""
    clock = s.clock[0]
    if clock.prepared != EVERYTHING:
        prepare(problem, T, t, s, w, S)
    if clock.first == 0.0:
        clock.first = clock.step = min(first_step(problem, T, t, s, w, S), clock.longest, clock.end - t)
    # a step whose end is expected on the fall of a contact is repeated on it
    h, last, guard = choose_step(problem, T, t, s, w, S)
    to_fall = guard >= 0
    ok = to_fall or attempt(problem, T, t, h, s, w, S)
    error = error_norm(T, h, s, w) if ok else math.nan
    if not (error <= 1.0 or (clock.fixed > 0.0 and error < math.inf)):
        failed = after_rejection(T, t, h, error, to_fall, s, w)
        if clock.stalled > MOST_STALLED:
            return STUCK
        return (STEP_TOO_SMALL if error == error else NOT_FINITE) if failed else ADVANCING
    full, w.rise_count[0] = h, 0
    if clock.crosses == IGNORES:
        guard = guard_passed(problem, t + h, s, w, S)
        grow = after_acceptance(T, full, error, s, w)
        return accept(problem, T, t, h, full, grow, last, guard, s, w, S, r)
    # events on the dense output of the accepted step
    if not find_crossings(problem, T, t, h, s, w, S, clock.crosses == CROSSES):
        return again(T, t, h, to_fall, s, w)
    if to_fall:
        if w.crossing_count[0] > 0 and not (w.crossing_guard[0] == guard and w.crossing_place[0] > AT_THE_END):
            guard, h = end_on_event(problem, T, t, h, s, w, S)
    elif w.crossing_count[0] > 0:
        # with many clearance joints a step may go on across events, if its error allows it
        across = crossed(problem, T, t, h, error, s, w, S) if clock.crosses == CROSSES else -1.0
        if across >= 0.0:
            error = across
        else:
            if not find_crossings(problem, T, t, h, s, w, S, False):
                return again(T, t, h, to_fall, s, w)
            if w.crossing_count[0] > 0:
                guard, h = end_on_event(problem, T, t, h, s, w, S)
    grow = after_acceptance(T, full, error, s, w)
    return accept(problem, T, t, h, full, grow, last and guard < 0, guard, s, w, S, r)


@kernel
def guard_passed(problem, now, s, w, S):
    """A guard that is beyond zero at the end of a step that ignored its root, or -1."""
    w.crossing_count[0] = 0
    problem.guards(now, w.new, S, w.end_value, w.end_rate)
    for k in range(s.mode.size):
        sign = sign_of(s.mode[k])
        if sign * w.end_value[k] > 0.0 and sign * w.end_rate[k] > 0.0:
            return k
    return -1


@kernel
def again(T, t, h, to_fall, s, w):
    """Status after a step at whose end a guard is on the wrong side of zero: it is to be made again with half its size."""
    failed = after_rejection(T, t, h, MISSED, to_fall, s, w)
    return STUCK if s.clock[0].stalled > MOST_STALLED else STEP_TOO_SMALL if failed else ADVANCING


@kernel
def end_on_event(problem, T, t, h, s, w, S):
    """Repeat the step so that it ends on the first crossing of the list; returns that guard and the step's size.

    The dense output of the shorter step is a more accurate one: where a crossing shows in it that did not show before, the step
    ends on that.
    """
    guard = -1
    for _ in range(ATTEMPTS):
        guard = w.crossing_guard[0]
        h = step_to_event(problem, T, guard, w.crossing_place[0], t, h, s, w, S)
        if h == 0.0:
            break
        find_crossings(problem, T, t, h, s, w, S, False)
        if w.crossing_count[0] == 0 or w.crossing_place[0] > AT_THE_END:
            break
    return guard, h


@kernel
def step_to_event(problem, T, guard, theta, t, h, s, w, S):
    """Repeat the step so that it ends on the crossing; returns its size.

    The crossing was found on the dense output; the end of a step is more accurate than its inside, so a few Newton steps
    on the step size follow. An event at the very start of the step leaves a step of no size. A guard that is beyond zero and
    recedes is crossed where it turns: that step ends behind the turn, as what does not approach is no event.
    """
    short, shortest = fraction(w.scaling[0], theta) * h, RESOLVED * max(abs(t), h)
    sign = sign_of(s.mode[guard])
    recedes = sign * w.start_rate[guard] <= 0.0
    if short <= shortest and not recedes:
        for i in range(s.y.size):
            w.new[i] = s.y[i]
        return 0.0
    turns = recedes and sign * w.start_value[guard] > w.precision[guard]
    short = max(short, shortest)
    before, rate_before = 0.0, w.start_rate[guard]
    for attempted in range(ATTEMPTS):
        if not attempt(problem, T, t, short, s, w, S):
            break
        problem.guards(t + short, w.new, S, w.value, w.rate)
        value, rate = w.value[guard], w.rate[guard]
        # beyond zero and receding: to where the rate turns
        if sign * value > w.precision[guard] and sign * rate <= 0.0:
            corrected = beyond_turn(before, rate_before, short, rate, shortest)
        elif turns or abs(value) <= w.precision[guard] or rate == 0.0:
            break
        else:
            corrected = short - value / rate
        # the last size tried is the one that the new state belongs to
        if not 0.0 < corrected <= h or attempted == ATTEMPTS - 1:
            break
        before, rate_before, short = short, rate, corrected
    return short


@kernel
def beyond_turn(before, rate_before, short, rate, shortest):
    """Where a rate that still has its old sign after `short` has the other one, by the secant through two sizes of a step."""
    ahead = short
    if abs(rate) < abs(rate_before):
        ahead = min(short, TURNED * (short - before) * rate / (rate_before - rate))
    return short + max(ahead, shortest)


@kernel
def accept(problem, T, t, h, full, grow, last, guard, s, w, S, r):
    """Take over the step just made, with what happens in it and at its end; returns a status."""
    clock, counts = s.clock[0], s.counts[0]
    counts.steps += 1
    now = clock.end if last else t + h
    across = clock.crosses == CROSSES and guard < 0
    if across:
        log_crossings(problem, T, t, h, s, w, S, r.log, True)
    else:
        w.crossing_count[0] = 0
    # what reads the inside of the step, before the state moves on
    if h > 0.0:
        if w.delays.size > 0:
            complete(problem, T, t, h, s, w, S)
            keep_history(problem.record, T, t, h, s, w, S)
        if clock.monitors == 1:
            monitor_step(problem, T, t, h, s, w, S)
        if counts.samples < r.samples.time.size and r.samples.time[counts.samples] <= now:
            complete(problem, T, t, h, s, w, S)
            write_samples(T, t, h, now, s, w, r.samples)
        if r.steps.time.size > 0 and r.steps.inside[0] == 1:
            record_inside(problem, T, t, h, now, s, w, S, r.steps)
        if clock.monitors == 1:
            for q in range(s.total.size):
                s.total[q] += step_integral(T, h, w, q)
    if across:
        log_crossings(problem, T, t, h, s, w, S, r.log, False)
        end_inactive(problem, now, s, w, S)
    # back to the constraints (R7)
    problem.accept(now, w.new, S, w.accepted)
    for i in range(s.y.size):
        s.y[i] = w.new[i]
    clock.time, clock.step, clock.longest = now, full * grow, w.accepted[1]
    clock.prepared = NOTHING
    # the last step of all may end a rounding beside its own end
    if guard < 0 and now == t + h and w.accepted[0] == 0.0 and w.rise_count[0] + w.crossing_count[0] == 0:
        carry(T, s, w)
    clock.stalled = clock.stalled + 1 if now <= t else 0
    if r.steps.time.size > 0:
        record_step(now, guard >= 0, s, r.steps)
    if guard >= 0:
        take_events(problem, T, now, full, guard, s, w, S, r.log)
    if clock.longest < 0.0:
        return CHANGE_POINT
    return STUCK if clock.stalled > MOST_STALLED else ADVANCING


@kernel
def record_step(now, event, s, steps):
    if not event and s.counts[0].steps % steps.every[0] > 0:
        return
    at = s.counts[0].recorded
    steps.time[at], steps.end[at] = now, 1
    write_state(at, s, steps)
    s.counts[0].recorded += 1


@kernel
def record_inside(problem, T, t, h, now, s, w, S, steps):
    """Keep the instants of a step at which values are largest so far, and at which guards are crossed."""
    for row in range(s.peak.shape[0]):
        if t < s.peak[row, WHEN] < now:
            record_at(problem, T, s.peak[row, WHEN], t, h, s, w, S, steps)
    for c in range(w.rise_count[0]):
        record_at(problem, T, t + fraction(w.scaling[0], w.rise_place[c]) * h, t, h, s, w, S, steps)
    for c in range(w.crossing_count[0]):
        record_at(problem, T, t + fraction(w.scaling[0], w.crossing_place[c]) * h, t, h, s, w, S, steps)


@kernel
def record_at(problem, T, when, t, h, s, w, S, steps):
    """Keep an instant inside a step."""
    complete(problem, T, t, h, s, w, S)
    at = s.counts[0].recorded
    steps.time[at], steps.end[at] = when, 0
    write_sample(T, when, t, h, at, s, w, steps)
    s.counts[0].recorded += 1


@kernel
def carry(T, s, w):
    """What is known at the end of a step, for the start of the next."""
    for k in range(s.mode.size):
        w.start_value[k], w.start_rate[k] = w.end_value[k], w.end_rate[k]
    s.clock[0].prepared = OUTPUTS
    if T.kind == _EXPLICIT:
        last, inverse = T.stages, 1.0 / speed(w.scaling[0], 1.0)
        for i in range(s.y.size):
            w.slope[i] = inverse * w.stages[last, i]
        for q in range(s.total.size):
            w.power_at_start[q] = inverse * w.power[last, q]
        s.clock[0].prepared = EVERYTHING


@kernel
def take_events(problem, T, now, full, guard, s, w, S, log):
    """The event of a guard at the end of a step, and those of guards that are crossed at the same instant."""
    event = take_event(problem, now, guard, s, w, S, log)
    if event < 0:
        return
    problem.guards(now, s.y, S, w.value, w.rate)
    for k in range(s.mode.size):
        sign = sign_of(s.mode[k])
        if k != guard and sign * w.value[k] > -w.precision[k] and sign * w.rate[k] > 0.0:
            take_event(problem, now, k, s, w, S, log)
    after_event(T, full, event, s)


@kernel
def take_event(problem, now, guard, s, w, S, log):
    """Reset after the event of a guard, and log it; returns `RISE`, `FALL`, or -1 if the guard did not change its mode."""
    counts = s.counts[0]
    row = log[counts.events]
    event = RISE if s.mode[guard] == 0 else FALL
    if not problem.reset(now, s.y, guard, S, row[DATA:ENDED]):
        return -1
    row[TIME], row[GUARD], row[MODE] = now, guard, event
    end_peak(guard, s, w, row)
    if event == RISE:
        begin_peak(now, guard, s, w)
    s.monitored[guard, 0] = 0.0
    counts.events += 1
    return event


@kernel
def write_samples(T, t, h, reached, s, w, out):
    """Write the samples up to the instant that a step of size h from t has reached."""
    counts = s.counts[0]
    while counts.samples < out.time.size and out.time[counts.samples] <= reached:
        if h > 0.0:
            write_sample(T, out.time[counts.samples], t, h, counts.samples, s, w, out)
        else:
            write_state(counts.samples, s, out)
        counts.samples += 1


@kernel
def write_sample(T, when, t, h, at, s, w, out):
    """Write a sample inside the step just made, before its end is taken over."""
    theta = place(w.scaling[0], min(1.0, max(0.0, (when - t) / h)))
    write_state(at, s, out)
    dense_value(theta, T.pattern, s.y, w.dense, out.state[at])
    if s.clock[0].monitors == 1:
        integrals_at(T, theta, h, s, w, out.total[at])
    for c in range(w.rise_count[0]):
        if theta < w.rise_place[c]:
            out.mode[at, w.rise_guard[c]] = 0
    for c in range(w.crossing_count[0]):
        if theta > w.crossing_place[c]:
            out.mode[at, w.crossing_guard[c]] = 0


@kernel
def write_state(at, s, out):
    for i in range(s.y.size):
        out.state[at, i] = s.y[i]
    for q in range(s.total.size):
        out.total[at, q] = s.total[q]
    for k in range(s.mode.size):
        out.mode[at, k] = s.mode[k]
        out.memory[at, k] = s.memory[k]
        out.mass[at, k] = s.mass[k]
    for i in range(s.reference.size):
        out.reference[at, i] = s.reference[i]
