"""Advance a problem by one loop: step, error control, guards, resets, quadratures, samples.

A problem is a tuple of typed pointers:

    rate(t, y, S, dy)              compute the right-hand side
    linearise(t, y, S, dy, dt)     compute the right-hand side, its partial time derivative, and what `factorize` needs
    factorize(h gamma, S)          factorize W = 1/(h gamma) - J; return a singular row or -1
    solve(r, S)                    solve r := W^-1 r
    accept(t, y, S, answer)        project y to the problem's manifold at the end of a step and count turns; write whether y
                                   changed and the longest next step, or minus the time to a singular position
    guards(t, y, S, value, rate)   compute the switching functions and their rates
    guard(t, y, k, S, value, rate) compute guard k alone, from the entries of y listed in `Work.reads`
    reset(t, y, k, S, data)        handle a crossing of guard k: change y and S, write data for the event log; return whether
                                   the guard's mode changed
    monitor(t, y, S, power, rows)  compute the integrands and the monitored values; called right after `rate` or `linearise`
                                   with the same t and y
    probe(t, y, k, S, dy, row)     compute row k of the monitored values alone, from the entries of y listed in `Work.reads`;
                                   dy is scratch
    record(t, y, S, signals)       compute the signals that the problem reads later with a delay; see `history`

S is the address of the problem's data. A guard in mode 0 is crossed when its value rises through zero, in mode 1 when it falls.
"""

from __future__ import annotations

import math

from scissordyn.integrate.control import (
    ATTEMPTS_MAX,
    STEP_MIN_FRACTION,
    after_acceptance,
    after_event,
    after_rejection,
    choose_step,
    first_step,
)
from scissordyn.integrate.crossing import end_inactive, log_crossings, step_across
from scissordyn.integrate.dense import complete, dense_value, integral_error, integrals_at, step_integral
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
from scissordyn.integrate.monitor import begin_peak, end_peak, monitor_step
from scissordyn.integrate.step import EVERYTHING, NOTHING, OUTPUTS, attempt, error_norm, fraction, place, prepare, speed
from scissordyn.integrate.tableau import EXPLICIT, ROSENBROCK
from scissordyn.kernel import kernel

ADVANCING, FINISHED, LOG_FULL, STEP_TOO_SMALL, NOT_FINITE, STUCK, HISTORY_FULL, RECORD_FULL, CHANGE_POINT = range(9)
"""Return values of `advance`: more steps remain, finished, the event log is full, failures, other stores are full.

After `CHANGE_POINT` the caller makes a step across a singular position.
"""


STALLED_MAX = 1000  # Largest number of trial steps and events without progress in time, after which a run is stuck


STEP_END_FRACTION = 0.999  # Fraction of a step beyond which a guard's zero crossing counts as at the end of the step
TURN_OVERSHOOT = 1.1  # Overshoot of a step that should end after a guard's turning point, as a multiple of the secant estimate

# Error assigned to a step with missed guard crossings, which is rejected; it about halves the step size
MISSED_CROSSING_ERROR = 100.0


@kernel
def advance(problem, S, address, most_steps):
    """Advance the problem until `clock.end`, or for `most_steps` steps; return a status such as `FINISHED`."""
    r = open_integration(address)
    T, s, w = r.method, r.state, r.work
    clock = s.clock[0]
    for _ in range(most_steps):
        if clock.time >= clock.end:
            write_samples(T, clock.time, 0.0, clock.time, s, w, r.samples)
            return FINISHED
        status = check_room(r)
        if status == ADVANCING:
            status = advance_step(problem, T, clock.time, s, w, S, r)
        if status != ADVANCING:
            return status
    return ADVANCING


@kernel
def check_room(r):
    """Return `ADVANCING` if all stores have room for the output of one step, or else which store is full."""
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
    """Try one step; return a status."""
    clock = s.clock[0]
    if clock.prepared != EVERYTHING:
        prepare(problem, T, t, s, w, S)
    if clock.first == 0.0:
        clock.first = clock.step = min(first_step(problem, T, t, s, w, S), clock.longest, clock.end - t)
    if clock.last_event == RISE and clock.rejected == 0 and T.kind == ROSENBROCK and clock.fixed == 0.0:
        # all stages of a step that is longer than the contact would lie behind it
        clock.step = min(clock.step, first_step(problem, T, t, s, w, S))
    # a step that should end on the fall of a contact has already been made
    h, last, guard = choose_step(problem, T, t, s, w, S)
    to_fall = guard >= 0
    ok = to_fall or attempt(problem, T, t, h, s, w, S)
    error = error_norm(T, h, s, w) if ok else math.nan
    if error == error and clock.integral > 0.0:
        integral = integral_error(T, h, s, w)
        error = error if integral <= error else integral
    if not (error <= 1.0 or (clock.fixed > 0.0 and error < math.inf)):
        failed = after_rejection(T, t, h, error, to_fall, s, w)
        if clock.stalled > STALLED_MAX:
            return STUCK
        return (STEP_TOO_SMALL if error == error else NOT_FINITE) if failed else ADVANCING
    full, w.rise_count[0] = h, 0
    if clock.crosses == IGNORES:
        guard = find_passed_guard(problem, t + h, s, w, S)
        grow = after_acceptance(T, full, error, s, w)
        return accept(problem, T, t, h, full, grow, last, guard, s, w, S, r)
    # events are located on the dense output of the accepted step
    if not find_crossings(problem, T, t, h, s, w, S, clock.crosses == CROSSES) or ends_at_once(h, s, w):
        return reject_for_crossing(T, t, h, to_fall, s, w)
    if to_fall:
        if w.crossing_count[0] > 0 and not (w.crossing_guard[0] == guard and w.crossing_place[0] > STEP_END_FRACTION):
            guard, h = end_on_event(problem, T, t, h, s, w, S)
    elif w.crossing_count[0] > 0:
        # with many clearance joints a step may continue across events, if its error allows
        across = step_across(problem, T, t, h, error, s, w, S) if clock.crosses == CROSSES else -1.0
        if across >= 0.0:
            error = across
        else:
            if not find_crossings(problem, T, t, h, s, w, S, False):
                return reject_for_crossing(T, t, h, to_fall, s, w)
            if w.crossing_count[0] > 0:
                guard, h = end_on_event(problem, T, t, h, s, w, S)
    grow = after_acceptance(T, full, error, s, w)
    return accept(problem, T, t, h, full, grow, last and guard < 0, guard, s, w, S, r)


@kernel
def find_passed_guard(problem, now, s, w, S):
    """Return a guard that is beyond zero at the end of a step that ignored its root, or -1."""
    w.crossing_count[0] = 0
    problem.guards(now, w.new, S, w.end_value, w.end_rate)
    for k in range(s.mode.size):
        sign = sign_of(s.mode[k])
        if sign * w.end_value[k] > 0.0 and sign * w.end_rate[k] > 0.0:
            return k
    return -1


@kernel
def reject_for_crossing(T, t, h, to_fall, s, w):
    """Reject a step whose end is on the wrong side of a guard's root, to halve its size; return a status."""
    failed = after_rejection(T, t, h, MISSED_CROSSING_ERROR, to_fall, s, w)
    return STUCK if s.clock[0].stalled > STALLED_MAX else STEP_TOO_SMALL if failed else ADVANCING


@kernel
def ends_at_once(h, s, w):
    """Return whether the first step of a contact also ends it.

    All stages can lie behind such a contact, so that neither the step nor its error has felt the force.
    """
    if s.clock[0].last_event != RISE or s.clock[0].fixed > 0.0:
        return False
    for c in range(w.crossing_count[0]):
        k = w.crossing_guard[c]
        if s.mode[k] == 1 and abs(w.start_value[k]) <= w.precision[k] < h * w.start_rate[k]:
            return True
    return False


@kernel
def end_on_event(problem, T, t, h, s, w, S):
    """Repeat the step so that it ends on the first crossing of the list; return that guard and the step size.

    The dense output of the shorter step is more accurate. If it shows an earlier crossing, the step ends there.
    """
    guard = -1
    for _ in range(ATTEMPTS_MAX):
        guard = w.crossing_guard[0]
        h = step_to_event(problem, T, guard, w.crossing_place[0], t, h, s, w, S)
        if h == 0.0:
            break
        find_crossings(problem, T, t, h, s, w, S, False)
        if w.crossing_count[0] == 0 or w.crossing_place[0] > STEP_END_FRACTION:
            break
    return guard, h


@kernel
def step_to_event(problem, T, guard, theta, t, h, s, w, S):
    """Repeat the step so that it ends on the crossing; return its size.

    The crossing was found on the dense output. The end of a step is more accurate than its inside, so a few Newton steps on the
    step size follow. An event at the very start leaves a step of size zero. A guard that is beyond zero and recedes is crossed
    where it turns. The step then ends after the turning point, because a receding guard causes no event.
    """
    short, shortest = fraction(w.scaling[0], theta) * h, STEP_MIN_FRACTION * max(abs(t), h)
    sign = sign_of(s.mode[guard])
    recedes = sign * w.start_rate[guard] <= 0.0
    if short <= shortest and not recedes:
        for i in range(s.y.size):
            w.new[i] = s.y[i]
        return 0.0
    turns = recedes and sign * w.start_value[guard] > w.precision[guard]
    short = max(short, shortest)
    before, rate_before = 0.0, w.start_rate[guard]
    for attempted in range(ATTEMPTS_MAX):
        if not attempt(problem, T, t, short, s, w, S):
            break
        problem.guards(t + short, w.new, S, w.value, w.rate)
        value, rate = w.value[guard], w.rate[guard]
        # beyond zero and receding: continue to where the rate turns
        if sign * value > w.precision[guard] and sign * rate <= 0.0:
            corrected = step_beyond_turn(before, rate_before, short, rate, shortest)
        elif turns or abs(value) <= w.precision[guard] or rate == 0.0:
            break
        else:
            corrected = short - value / rate
        # the new state belongs to the last size tried
        if not 0.0 < corrected <= h or attempted == ATTEMPTS_MAX - 1:
            break
        before, rate_before, short = short, rate, corrected
    return short


@kernel
def step_beyond_turn(before, rate_before, short, rate, shortest):
    """Return a step size at which the rate has changed its sign, by the secant through two step sizes."""
    ahead = short
    if abs(rate) < abs(rate_before):
        ahead = min(short, TURN_OVERSHOOT * (short - before) * rate / (rate_before - rate))
    return short + max(ahead, shortest)


@kernel
def accept(problem, T, t, h, full, grow, last, guard, s, w, S, r):
    """Accept the step just made, with the events inside it and at its end; return a status."""
    clock, counts = s.clock[0], s.counts[0]
    counts.steps += 1
    now = clock.end if last else t + h
    across = clock.crosses == CROSSES and guard < 0
    if across:
        log_crossings(problem, T, t, h, s, w, S, r.log, True)
    else:
        w.crossing_count[0] = 0
    # uses of the inside of the step, before the state is updated
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
    # project back to the constraints (R7)
    problem.accept(now, w.new, S, w.accepted)
    for i in range(s.y.size):
        s.y[i] = w.new[i]
    clock.time, clock.step, clock.longest = now, full * grow, w.accepted[1]
    clock.prepared = NOTHING
    # the very last step may differ from its end by round-off
    if guard < 0 and now == t + h and w.accepted[0] == 0.0 and w.rise_count[0] + w.crossing_count[0] == 0:
        carry_over(T, s, w)
    clock.stalled = clock.stalled + 1 if now <= t else 0
    if r.steps.time.size > 0:
        record_step(now, guard >= 0, s, r.steps)
    if guard >= 0:
        take_events(problem, T, now, full, guard, s, w, S, r.log)
    if clock.longest < 0.0:
        return CHANGE_POINT
    return STUCK if clock.stalled > STALLED_MAX else ADVANCING


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
    """Record the instants of a step at which values are largest so far, and at which guards are crossed."""
    for row in range(s.peak.shape[0]):
        if t < s.peak[row, WHEN] < now:
            record_at(problem, T, s.peak[row, WHEN], t, h, s, w, S, steps)
    for c in range(w.rise_count[0]):
        record_at(problem, T, t + fraction(w.scaling[0], w.rise_place[c]) * h, t, h, s, w, S, steps)
    for c in range(w.crossing_count[0]):
        record_at(problem, T, t + fraction(w.scaling[0], w.crossing_place[c]) * h, t, h, s, w, S, steps)


@kernel
def record_at(problem, T, when, t, h, s, w, S, steps):
    """Record an instant inside a step."""
    complete(problem, T, t, h, s, w, S)
    at = s.counts[0].recorded
    steps.time[at], steps.end[at] = when, 0
    write_sample(T, when, t, h, at, s, w, steps)
    s.counts[0].recorded += 1


@kernel
def carry_over(T, s, w):
    """Reuse values at the end of a step as those at the start of the next step."""
    for k in range(s.mode.size):
        w.start_value[k], w.start_rate[k] = w.end_value[k], w.end_rate[k]
    s.clock[0].prepared = OUTPUTS
    if T.kind == EXPLICIT:
        last, inverse = T.stages, 1.0 / speed(w.scaling[0], 1.0)
        for i in range(s.y.size):
            w.slope[i] = inverse * w.stages[last, i]
        for q in range(s.total.size):
            w.power_at_start[q] = inverse * w.power[last, q]
        s.clock[0].prepared = EVERYTHING


@kernel
def take_events(problem, T, now, full, guard, s, w, S, log):
    """Take the event of a guard at the end of a step, and the events of guards crossed at the same instant."""
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
    """Reset and log the event of a guard; return `RISE`, `FALL`, or -1 if the guard's mode did not change."""
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
    """Write the samples up to the instant `reached` by a step of size h from t."""
    counts = s.counts[0]
    while counts.samples < out.time.size and out.time[counts.samples] <= reached:
        if h > 0.0:
            write_sample(T, out.time[counts.samples], t, h, counts.samples, s, w, out)
        else:
            write_state(counts.samples, s, out)
        counts.samples += 1


@kernel
def write_sample(T, when, t, h, at, s, w, out):
    """Write a sample inside the step just made, before its end is accepted."""
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
