"""Advance problems whose state jumps, by time stepping with a fixed step size and no error control.

In addition to the functions of `advance`, such a problem has:

    step(t, h, y, new, S, H)                make a step of size h from y to `new`, with all contacts in it
    restore(H)                              discard the step just made, so that it can be repeated
    guards_ahead(t, y, S, H, value, rate)   compute the guards at the end of the step just made; S is left as after the step
    impact(t, h, y, S, H, gain)             compute the impacts at an instant, and what they add to totals; h is the step size
    monitor(t, h, y, S, H, power, rows)     compute integrands and monitored values as means over the step; NaN is ignored

H is the address of the contact data. If impacts are located, a step ends where the first open gap closes. Other guards act
at the ends of steps. Samples and delayed signals between two ends are interpolated linearly.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from scissordyn.integrate.advance import (
    ADVANCING,
    CHANGE_POINT,
    FINISHED,
    NOT_FINITE,
    STUCK,
    check_room,
    record_step,
    take_event,
    write_state,
)
from scissordyn.integrate.event import sign_of
from scissordyn.integrate.history import CHEBYSHEV_NODES, keep_values, up_to_multiple
from scissordyn.integrate.integration import (
    DATA,
    ENDED,
    FALL,
    FIRST_WITHIN,
    GUARD,
    INTEGRAL,
    LARGEST,
    LAST_ABOVE,
    LIMIT,
    MODE,
    RISE,
    STRUCK,
    TIME,
    WHEN,
    open_integration,
)
from scissordyn.kernel import F1, F2, I1, kernel, opener
from scissordyn.tolerance import CONVERGENCE_TOL, EVENT_TOL, SHORT_STEP_FRACTION

ANGLE, APPROACH, MASS, IMPULSE, RESTITUTION_LOSS, FRICTION_LOSS, REBOUND, CLOSED, SUDDEN, STRUCK_NOW = range(10)
"""Columns of `Touching.result` that are used here, see `mechanics.hard_contact`."""

# [-] penetration over that of the whole step, above which an impact elsewhere has made the located gap jump
JUMP_FRACTION = 1e-3

FORCED_STEP_FRACTION = 1.0 / 64.0
"""Fraction of the chosen step size. A step of this size or less is accepted with any indentation at its end."""

IN_ANY_CASE, AS_DEEP, STEP, TOO_LONG = range(-2, 2)  # Step requests and step status, see `mechanics.hard_rows`


DRIVES, NORMAL_LOSSES, TANGENTIAL_LOSSES = range(3)
"""Columns of `State.total` to which impacts add, see `mechanics.monitored.POWERS`."""


class Jumps(NamedTuple):
    """Functions of a problem whose state jumps, in addition to those of `Problem`."""

    step: Any
    restore: Any
    guards_ahead: Any
    impact: Any
    monitor: Any


class Touching(NamedTuple):
    """Contact data that the loop uses."""

    which: I1  # (k,) guards of the contacts
    result: F2  # (k, columns) results of the last step
    impact: I1  # (3,) whether the state jumped in the step; the step request or status; whether the step ends on an impact
    locate: I1  # (1,) 1 if impacts are located
    ahead: F1  # (3,) of open contacts, as in `mechanics.hard_rows.HardState`
    work: F1  # (1,) work of the drives in the last impact
    size: F1  # (1,) step size
    ending: F1  # (k,) indentations at the end of the step
    longest: F1  # (1,) step that compliant contacts allow [s]
    turn: F1  # (2,) longest step at a rotation of 1/s (decreasing with its power -4/3), and largest rotation of a step [rad]
    sudden: I1  # (guards,) 1 if velocities may jump when the guard is crossed
    smooth: I1  # (1,) number of leading state coordinates that do not jump: positions and prescribed coordinates


open_touching = opener(Touching)  # Kernel function from the address of a `Touching` to its arrays


@kernel
def advance(problem, jumps, S, H, touching, address, most_steps):
    """Advance the problem until `clock.end`, or for `most_steps` steps; return a status such as `FINISHED`."""
    r, K = open_integration(address), open_touching(touching)
    s, w = r.state, r.work
    clock = s.clock[0]
    for _ in range(most_steps):
        if clock.time >= clock.end:
            write_present(clock.time, s, r.samples)
            return FINISHED
        status = check_room(r)
        if status == ADVANCING:
            status = step_and_events(problem, jumps, clock.time, s, w, S, H, K, r)
        if status != ADVANCING:
            return status
    return ADVANCING


@kernel
def choose_size(t, s, w, K):
    """Return the size of the next step, and whether it is the last one."""
    clock, h = s.clock[0], K.size[0]
    if w.delays.size > 0:
        h = up_to_multiple(t, h, w.delays)
    h = min(h, clock.longest, K.longest[0])
    if K.ahead[1] < h:  # the step must not contain two impacts of a rebounding contact
        h = 1.2 * K.ahead[1]
    K.ahead[1] = math.inf
    if clock.end - t <= h * (1.0 + SHORT_STEP_FRACTION):
        return clock.end - t, True
    return h, False


@kernel
def step_and_events(problem, jumps, t, s, w, S, H, K, r):
    """Make one step with the contacts that close and open in it, and the other guards at its end; return a status."""
    clock, counts = s.clock[0], s.counts[0]
    write_present(t, s, r.samples)  # the start
    h, last = choose_size(t, s, w, K)
    for k in range(s.mode.size):
        w.saved_mode[k] = s.mode[k]
    if s.mode.size > K.which.size:
        problem.guards(t, s.y, S, w.start_value, w.start_rate)
    K.impact[1] = STEP
    jumps.step(t, h, s.y, w.new, S, H)
    # shorten until contacts are shallow and laws are satisfied; below a fraction of the size any result is accepted
    while K.impact[1] > STEP:
        h, last = min(0.5 * h, K.longest[0]), False
        counts.rejected += 1
        K.impact[1] = STEP if h > FORCED_STEP_FRACTION * K.size[0] else AS_DEEP if h > EVENT_TOL * K.size[0] else IN_ANY_CASE
        jumps.step(t, h, s.y, w.new, S, H)
    strikes, whole = False, h
    # end on the first event, if the step has one
    if penetration_at_end(jumps, t + h, s, w, S, H, K) > 0.0:
        h, strikes = first_event(jumps, t, h, s, w, S, H, K)
        last = last and h == whole and not strikes
    elif K.locate[0] == 1 and K.ahead[2] >= -EVENT_TOL:  # an open contact ends the step on its surface, but for round-off
        strikes = True
    K.impact[2] = 1 if strikes else 0
    now = clock.end if last else t + h
    counts.steps += 1
    counts.rates += 1
    for i in range(s.y.size):
        if not abs(w.new[i]) < math.inf:
            return NOT_FINITE
    use_step(problem, jumps, t, h, now, s, w, S, H, K, r)
    # an impact changes velocities at the end of the step, with the forces acting then
    longest = accept_state(problem, now, w.new, w, S, K)
    for i in range(s.y.size):
        s.y[i] = w.new[i]
    clock.time, clock.longest = now, longest
    clock.stalled = clock.stalled + 1 if now <= t else 0
    if strikes:
        take_impacts(jumps, now, s, w, S, H, K, r.log)
        clock.longest = accept_state(problem, now, s.y, w, S, K)
    if r.steps.time.size > 0:
        record_step(now, strikes, s, r.steps)
    if pass_guards(problem, now, s, w, S, K, r.log):  # velocities may have changed, and closed contacts respond at once
        take_impacts(jumps, now, s, w, S, H, K, r.log)
        clock.longest = accept_state(problem, now, s.y, w, S, K)
    if clock.longest < 0.0:
        return CHANGE_POINT
    return STUCK if clock.stalled > 1000 else ADVANCING


@kernel
def use_step(problem, jumps, t, h, now, s, w, S, H, K, r):
    """Write events, samples, integrals and largest values of the step from t to `now`."""
    clock, counts = s.clock[0], s.counts[0]
    for i in range(K.which.size):
        if w.saved_mode[K.which[i]] == 0 and K.result[i, IMPULSE] > 0.0:
            log_rise(t + 0.5 * h, i, s, K, r.log)
    if w.delays.size > 0:
        keep_linear(problem.record, t, h, s, w, S)
    if clock.monitors == 1:
        jumps.monitor(t + 0.5 * h, h, s.y, S, H, w.power[0], w.monitored[0])
        update_monitored(t, h, s, w, K)
    while counts.samples < r.samples.time.size and r.samples.time[counts.samples] <= now:
        write_between(r.samples.time[counts.samples], counts.samples, t, now, s, w, K, r.samples)
        counts.samples += 1
    if r.steps.time.size > 0 and r.steps.inside[0] == 1 and happens_inside(t, now, s, w, K):
        r.steps.time[counts.recorded], r.steps.end[counts.recorded] = t + 0.5 * h, 0
        write_between(t + 0.5 * h, counts.recorded, t, now, s, w, K, r.steps)
        counts.recorded += 1
    if clock.monitors == 1:
        for q in range(s.total.size):
            s.total[q] += h * w.power[0, q]
    for i in range(K.which.size):
        log_fall(t + 0.5 * h, i, s, w, K, r.log)


@kernel
def accept_state(problem, now, y, w, S, K):
    """Accept a state as the end of a step; return the largest size of the next step.

    A body that rotates at omega gains the fraction (3/8) (omega h)^4 of its speed in a step.
    """
    problem.accept(now, y, S, w.accepted)
    longest, fastest = w.accepted[1], w.accepted[2]
    if fastest > 0.0:
        longest = min(
            longest, max(min(K.turn[0] * fastest ** (-4.0 / 3.0), K.turn[1] / fastest), FORCED_STEP_FRACTION * K.size[0])
        )
    return longest


@kernel
def penetration_at_end(jumps, now, s, w, S, H, K):
    """Return the largest value beyond zero of a guard that the step crosses, in the guard's unit; negative if there is none.

    Contacts that were open at the start count only if impacts are located.
    """
    farthest = K.ahead[0] if K.locate[0] == 1 else -math.inf
    if s.mode.size == K.which.size:
        return farthest
    jumps.guards_ahead(now, w.new, S, H, w.value, w.rate)
    for i in range(K.which.size):
        w.value[K.which[i]] = -math.inf
    for k in range(s.mode.size):
        sign = sign_of(w.saved_mode[k])
        if w.value[k] > -math.inf and sign * w.start_value[k] <= 0.0:
            farthest = max(farthest, sign * w.value[k])
    return farthest


@kernel
def first_event(jumps, t, h, s, w, S, H, K):
    """Repeat a step from t so that it ends on its first event; return its size, and whether a hard contact strikes there.

    The step is halved until nothing is crossed. The size in between is found by regula falsi with the Illinois rule. If an
    impact inside the step makes the function jump, the step ends before it.
    """
    high, above = h, penetration_at_end(jumps, t + h, s, w, S, H, K)
    low, below, deep = 0.0, 0.0, above
    near = CONVERGENCE_TOL * h if K.locate[0] == 1 else EVENT_TOL * h
    # halve until nothing is crossed
    while high > near:
        tried = 0.5 * high
        beyond = repeat_step(jumps, t, tried, s, w, S, H, K)
        if beyond <= 0.0:
            low, below = tried, beyond
            break
        high, above = tried, beyond
    # the step starts on the surface, and the surface's curvature keeps it there; a run may start with an impact
    if low == 0.0 and K.locate[0] == 1 and K.ahead[0] > 0.0 and s.counts[0].steps > 0:
        jumps.restore(H)
        for k in range(s.mode.size):
            s.mode[k] = w.saved_mode[k]
        for i in range(K.which.size):
            if w.saved_mode[K.which[i]] == 0 and K.ending[i] > 0.0:
                s.mode[K.which[i]] = 1
        jumps.step(t, h, s.y, w.new, S, H)
        return h, False
    # regula falsi; the weight of an unchanged end is halved (Illinois)
    weight_above, weight_below = above, below
    while low > 0.0 and high - low > near:
        tried = high - weight_above * (high - low) / (weight_above - weight_below)
        if not low < tried < high:
            tried = 0.5 * (low + high)
        beyond = repeat_step(jumps, t, tried, s, w, S, H, K)
        if beyond > 0.0:
            high, above, weight_above, weight_below = tried, beyond, beyond, 0.5 * weight_below
        else:
            low, weight_below, weight_above = tried, beyond, 0.5 * weight_above
    # an impact elsewhere in the step makes the function jump; end before it
    jumped = low > near and above > JUMP_FRACTION * deep
    end = low if jumped else high
    repeat_step(jumps, t, end, s, w, S, H, K)
    return end, K.locate[0] == 1 and K.ahead[0] >= 0.0


@kernel
def repeat_step(jumps, t, h, s, w, S, H, K):
    """Repeat the step with another size; return the largest penetration at its end."""
    for k in range(s.mode.size):
        s.mode[k] = w.saved_mode[k]
    jumps.restore(H)
    K.impact[1] = IN_ANY_CASE
    jumps.step(t, h, s.y, w.new, S, H)
    s.counts[0].rates += 1
    return penetration_at_end(jumps, t + h, s, w, S, H, K)


@kernel
def take_impacts(jumps, now, s, w, S, H, K, log):
    """Apply the impacts at the end of a step: velocities change, contacts begin, and end at once where surfaces separate."""
    for k in range(s.mode.size):
        w.saved_mode[k] = s.mode[k]
    jumps.impact(now, K.size[0], s.y, S, H, w.power[1])
    s.total[DRIVES] += K.work[0]
    for q in range(s.total.size):
        s.total[q] += w.power[1, q]
    for i in range(K.which.size):
        guard, out = K.which[i], K.result[i]
        if not out[IMPULSE] > 0.0:
            continue
        if w.saved_mode[guard] == 0:
            log_rise(now, i, s, K, log)
        peak = s.peak[guard]
        peak[INTEGRAL] += out[IMPULSE]
        peak[INTEGRAL + 1] += out[RESTITUTION_LOSS]
        peak[INTEGRAL + 2] += out[FRICTION_LOSS]
        update_impact(now, guard, i, s, K)
        s.total[NORMAL_LOSSES] += out[RESTITUTION_LOSS]
        s.total[TANGENTIAL_LOSSES] += out[FRICTION_LOSS]
        log_fall(now, i, s, w, K, log)


@kernel
def update_impact(now, guard, i, s, K):
    """Update the largest impact of a contact."""
    if K.result[i, STRUCK_NOW] > s.peak[guard, STRUCK]:
        s.peak[guard, STRUCK], s.peak[guard, STRUCK + 1] = K.result[i, STRUCK_NOW], now


@kernel
def log_rise(now, i, s, K, log):
    """Log the start of a contact."""
    guard, out = K.which[i], K.result[i]
    row = log[s.counts[0].events]
    row[:] = 0.0
    row[TIME], row[GUARD], row[MODE] = now, guard, RISE
    row[DATA], row[DATA + 1], row[DATA + 2] = out[APPROACH], out[ANGLE], out[MASS]
    s.peak[guard, :] = 0.0
    s.peak[guard, WHEN] = now
    s.counts[0].events += 1


@kernel
def contact_ends(i, w, K):
    """Return whether a contact ends in the step just made."""
    touched = K.result[i, IMPULSE] > 0.0
    return (touched and K.result[i, CLOSED] != 1.0) or (not touched and w.saved_mode[K.which[i]] != 0)


@kernel
def log_fall(now, i, s, w, K, log):
    """Log the end of a contact, if it ends."""
    if not contact_ends(i, w, K):
        return
    guard = K.which[i]
    row = log[s.counts[0].events]
    row[:] = 0.0
    row[TIME], row[GUARD], row[MODE], row[DATA] = now, guard, FALL, K.result[i, REBOUND]
    for q in range(ENDED, row.size):
        row[q] = s.peak[guard, q - ENDED]
    s.mode[guard] = 0
    s.counts[0].events += 1


@kernel
def update_monitored(t, h, s, w, K):
    """Update largest values, integrals and band crossings of monitored values from their means over the step.

    The largest value of a contact excludes impacts.
    """
    for row in range(s.peak.shape[0]):
        value = w.monitored[0, row, 0]
        if value != value or not acts_in_step(row, s, w):
            continue
        for q in range(w.monitored.shape[2]):
            s.peak[row, INTEGRAL + q] += h * w.monitored[0, row, q]
    for i in range(K.which.size):
        guard = K.which[i]
        # impulses at an instant are not forces
        w.monitored[0, guard, 0] -= K.result[i, SUDDEN] / h
        update_impact(t + 0.5 * h, guard, i, s, K)
    for row in range(s.peak.shape[0]):
        value = w.monitored[0, row, 0]
        if value != value or not acts_in_step(row, s, w):
            continue
        peak = s.peak[row]
        if value > peak[LARGEST]:
            peak[LARGEST], peak[WHEN] = value, t + 0.5 * h
        if row >= s.mode.size:
            band = s.band[row - s.mode.size]
            if value > band[LIMIT]:
                band[LAST_ABOVE] = t + h
            elif math.isnan(band[FIRST_WITHIN]):
                band[FIRST_WITHIN] = t + 0.5 * h
        for q in range(s.monitored.shape[1]):
            s.monitored[row, q] = w.monitored[0, row, q]


@kernel
def acts_in_step(row, s, w):
    """Return whether a row of monitored values is in use: its guard is in mode 1 before or after the step, or it has none."""
    return row >= s.mode.size or s.mode[row] + w.saved_mode[row] > 0


@kernel
def pass_guards(problem, now, s, w, S, K, log):
    """Handle events of guards that are not hard contacts, at the end of the step; return whether the state jumps."""
    if s.mode.size == K.which.size:
        return False
    problem.guards(now, s.y, S, w.value, w.rate)
    for i in range(K.which.size):
        w.value[K.which[i]] = -math.inf
    jumped = False
    for k in range(s.mode.size):
        if w.value[k] > -math.inf and sign_of(s.mode[k]) * w.value[k] > 0.0:
            take_event(problem, now, k, s, w, S, log)
            jumped = jumped or K.sudden[k] == 1
    return jumped


@kernel
def keep_linear(record, t, h, s, w, S):
    """Add the step just made, of size h from t, to the history of delayed signals; the state is linear inside it."""
    for node in range(CHEBYSHEV_NODES.size):
        part = 0.5 * (1.0 + CHEBYSHEV_NODES[node])
        for i in range(s.y.size):
            w.inside[i] = (1.0 - part) * s.y[i] + part * w.new[i]
        record(t + part * h, w.inside, S, w.signals[node])
    keep_values(t, h, s, w)


@kernel
def happens_inside(t, now, s, w, K):
    """Return whether a contact ends in the step from t to `now`, or a monitored value has its largest value inside it."""
    for i in range(K.which.size):
        if contact_ends(i, w, K):
            return True
    for row in range(s.peak.shape[0]):  # noqa: SIM110 -- kernels have no generator expressions
        if t < s.peak[row, WHEN] < now:
            return True
    return False


@kernel
def write_between(when, at, t, now, s, w, K, out):
    """Write a sample between s.y and w.new; values that jump are those of the nearer end."""
    along = min(1.0, max(0.0, (when - t) / (now - t))) if now > t else 1.0
    share = along
    if K.impact[0] == 1:
        share = 0.0 if along < 0.5 else 1.0
    write_state(at, s, out)
    for i in range(s.y.size):
        weight = along if i < K.smooth[0] else share
        out.state[at, i] = (1.0 - weight) * s.y[i] + weight * w.new[i]
    if s.clock[0].monitors == 1:
        for q in range(s.total.size):
            out.total[at, q] = s.total[q] + share * (now - t) * w.power[0, q]
    if share == 0.0:
        for i in range(K.which.size):
            if w.saved_mode[K.which[i]] == 0:
                out.mode[at, K.which[i]] = 0


@kernel
def write_present(reached, s, out):
    """Write the samples up to an instant with the present state."""
    counts = s.counts[0]
    while counts.samples < out.time.size and out.time[counts.samples] <= reached:
        write_state(counts.samples, s, out)
        counts.samples += 1
