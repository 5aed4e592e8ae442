"""Repeat each time step with hard contacts in dual numbers, with the contact modes of the run.

The impulses of a step are solved for again, in dual numbers. Located impacts move with the parameters. An impact is a function
of the state at its instant as long as each contact keeps its mode there. `doubt` stores from when on a mode may change.
"""

from __future__ import annotations

from typing import NamedTuple

from scissordyn.integrate.integration import GUARD, open_integration
from scissordyn.integrate.time_stepping import (
    IMPULSE,
    IN_ANY_CASE,
    STEP,
    Jumps,
    accept_state,
    choose_size,
    open_touching,
    take_impacts,
    use_step,
    write_present,
)
from scissordyn.kernel import F1, I1, derivative, kernel, opener, value_of
from scissordyn.mechanics.functions import HARD_FUNCTIONS
from scissordyn.mechanics.hard_rows import SLIP, STICK, open_hard
from scissordyn.sensitivity.gap import watch_gaps
from scissordyn.sensitivity.replay import (
    ANOTHER_MODE,
    FOLLOWED,
    FULL,
    MECHANICS,
    NO_ROOT,
    ROOT_PRECISIONS,
    fixed_instant,
    has_room,
    open_watched,
    take_event,
    take_values,
    with_value,
)
from scissordyn.tolerance import EVENT_TOL

HARD = Jumps(**HARD_FUNCTIONS)  # Functions of hard contacts that repeat a step with dual numbers


class HardWatched(NamedTuple):
    """Arrays in doubles of a run with hard contacts, and addresses of its contacts in dual numbers."""

    run: int  # Address of `Watched`
    hard: int  # Address of `HardContacts` in dual numbers
    touching: int  # Address of `Touching` in dual numbers
    size: F1  # (1,) size of the last step [s]
    was: I1  # (k,) modes with which the last step or impact was solved
    mode: I1  # (k,) `HardState.mode`
    impact: I1  # (3,) `HardWork.impact`
    doubt: F1  # (parameters,) first instant at which this change may change the mode of a contact in an impact [s]


open_hard_watched = opener(HardWatched)


def follow_hard(watched: int, address: int, system: int, seed: F1) -> int:
    """Repeat the last step of a run with hard contacts by `follow_time_step`; return its status."""
    arrays = open_hard_watched(watched)
    return follow_time_step(MECHANICS, HARD, arrays, open_watched(arrays.run), address, system)


@kernel
def follow_time_step(problem, jumps, own, run, address, system):
    """Repeat the last step of a run and its events; return a status. Arguments as in `replay.follow_step`."""
    r, K = open_integration(address), open_touching(own.touching)
    s, w = r.state, r.work
    clock, counts = s.clock[0], s.counts[0]
    now, t, first, after = run.clock[0].time, clock.time, counts.events, run.counts[0].events
    if run.counts[0].steps == counts.steps:
        if run.change[0] > 0.0 and counts.steps == 0:  # before the first step
            watch_gaps(problem, first, first, run, s, w, system, r.log)
        return FOLLOWED
    if w.delays.size > 0 and not has_room(value_of(t), s, w):
        return FULL
    if counts.samples < r.samples.time.size and r.samples.time[counts.samples] <= t:
        write_present(t, s, r.samples)
    for k in range(s.mode.size):
        w.saved_mode[k] = s.mode[k]
    strikes = own.impact[2] == 1
    guard = -1 if strikes else crossed_guard(first, after, run, K)
    h, _ = choose_size(t, s, w, K)
    if not strikes and guard < 0:
        end = fixed_instant(problem, now, run, w, system, t)
        h = end - t if value_of(end) != value_of(t) else shortened(problem, jumps, t, h, own, s, w, system, K)
    h = with_value(h, own.size[0])
    step_again(problem, jumps, t, h, strikes, own, s, w, system, K)
    if strikes or guard >= 0:
        h = to_event(problem, jumps, deepest_contact(own, K) if strikes else -1, guard, t, h, own, s, w, system, K)
        if h < 0.0:
            return NO_ROOT
    reached = with_value(t + h, now)
    if has_jump(open_hard(own.hard), K):
        for k in range(own.doubt.size):
            own.doubt[k] = min(own.doubt[k], now)
    use_step(problem, jumps, t, h, reached, s, w, system, own.hard, K, r)
    problem.forget(system)
    clock.longest = accept_state(problem, reached, w.new, w, system, K)
    for i in range(s.y.size):
        s.y[i] = w.new[i]
        if after == first:
            run.misfit[0] = max(run.misfit[0], abs(value_of(s.y[i]) - run.y[i]) / max(1.0, abs(run.y[i])))
    clock.time = reached
    if strikes:
        strike(problem, jumps, own, run, s, w, system, K, r)
    if take_guards(problem, run, s, w, system, K, r):
        strike(problem, jumps, own, run, s, w, system, K, r)
    counts.steps = run.counts[0].steps
    if run.change[0] > 0.0:
        watch_gaps(problem, first, after, run, s, w, system, r.log)
    return take_hard_values(first, own, run, s, w, r.log)


@kernel
def shortened(problem, jumps, t, h, own, s, w, system, K):
    """Return the size of the run's step as a dual number; h may be shortened for compliant contacts, or without derivatives."""
    K.impact[1] = STEP
    while K.impact[1] == STEP and value_of(h) > (1.0 + EVENT_TOL) * own.size[0]:
        problem.forget(system)
        jumps.step(t, h, s.y, w.new, system, own.hard)
        if K.impact[1] > STEP:
            h, K.impact[1] = min(0.5 * h, K.longest[0]), STEP
        else:
            jumps.restore(own.hard)
            K.impact[1] = IN_ANY_CASE
    return h if abs(value_of(h) - own.size[0]) <= EVENT_TOL * own.size[0] else with_value(0.0 * h, own.size[0])


@kernel
def has_jump(H, K):
    """Return whether velocities or forces jump within a step: an impact, or a contact that slips after it stuck."""
    for i in range(K.which.size):
        slips = H.work.closed[i] == 1 and H.state.mode[i] >= SLIP and H.work.kept_stuck[i] == 1
        if slips and H.parameters.static[i] > H.parameters.kinetic[i]:
            return True
    return K.impact[0] == 1


@kernel
def is_hard(guard, K):
    """Return whether a guard is that of a hard contact."""
    for i in range(K.which.size):  # noqa: SIM110
        if K.which[i] == guard:
            return True
    return False


@kernel
def crossed_guard(first, after, run, K):
    """Return the guard of the first new event of another part, such as a stop; -1 without such an event."""
    for at in range(first, after):
        if not is_hard(int(run.log[at, GUARD]), K):
            return int(run.log[at, GUARD])
    return -1


@kernel
def step_again(problem, jumps, t, h, strikes, own, s, w, system, K):
    """Make a step in dual numbers with the modes that the run had at its start."""
    for k in range(s.mode.size):
        s.mode[k] = w.saved_mode[k]
    for i in range(K.which.size):
        if own.was[i] == 1 and not strikes:
            s.mode[K.which[i]] = 1
    K.impact[1] = IN_ANY_CASE
    problem.forget(system)
    jumps.step(t, h, s.y, w.new, system, own.hard)


@kernel
def deepest_contact(own, K):
    """Return the index of the open contact whose surfaces are nearest to each other, or overlap most, at the end of a step."""
    closed, best = open_hard(own.hard).work.closed, -1
    for i in range(K.which.size):
        if closed[i] == 0 and (best < 0 or K.ending[i] > K.ending[best]):
            best = i
    return best


@kernel
def to_event(problem, jumps, contact, guard, t, h, own, s, w, system, K):
    """Repeat a step so that it ends on its event while the parameters change; return the size as a dual number.

    The event is the impact of a hard contact or, if `contact` is -1, that of another guard. The size is negative if the guard
    is not zero there. The guard's derivatives are linear in those of the size, so that a trial gives the factor.
    """
    strikes = contact >= 0
    here = K.which[contact] if strikes else guard
    before = time_to_root(jumps, contact, here, t + h, own, w, system, K)
    if not abs(value_of(before) * value_of(w.rate[here])) <= ROOT_PRECISIONS * w.precision[here]:
        return with_value(h, -1.0)
    before = with_value(before, 0.0)
    jumps.restore(own.hard)
    step_again(problem, jumps, t, h + before, strikes, own, s, w, system, K)
    rest = time_to_root(jumps, contact, here, t + h + before, own, w, system, K)
    largest, factor = 0.0, 1.0
    for k in range(own.doubt.size):
        if abs(derivative(before, k)) > largest:
            largest = abs(derivative(before, k))
            factor = derivative(before, k) / (derivative(before, k) - derivative(rest, k))
    jumps.restore(own.hard)
    step_again(problem, jumps, t, h + factor * before, strikes, own, s, w, system, K)
    return h + factor * before


@kernel
def time_to_root(jumps, contact, guard, t, own, w, system, K):
    """Return the time from the end of a step to the impact of a hard contact or, if `contact` is -1, to the root of a guard."""
    jumps.guards_ahead(t, w.new, system, own.hard, w.value, w.rate)
    if contact >= 0:  # its gap with the step's own motion of the drives
        return -K.ending[contact] / value_of(w.rate[guard])
    return -w.value[guard] / value_of(w.rate[guard])


@kernel
def strike(problem, jumps, own, run, s, w, system, K, r):
    """Apply the impacts at the end of a step; store the instant if the modes of contacts in it are in doubt."""
    problem.forget(system)
    take_impacts(jumps, s.clock[0].time, s, w, system, own.hard, K, r.log)
    problem.guards(s.clock[0].time, s.y, system, w.value, w.rate)
    H = open_hard(own.hard)
    first = H.model.place.size - H.model.damped.size - 2 * H.model.which.size
    for i in range(K.which.size):
        a, b = H.model.place[first + 2 * i], H.model.place[first + 2 * i + 1]
        if K.result[i, IMPULSE] > 0.0:
            doubt_mode(H.work.impulse[a], own, run)
            if H.state.mode[i] == STICK:
                doubt_mode(H.work.friction[i] * H.work.impulse[a] - abs(H.work.impulse[b]), own, run)
            elif H.parameters.kinetic[i] > 0.0:
                doubt_mode(H.work.velocity[b], own, run)
        elif H.work.closed[i] == 0:
            doubt_mode(w.value[K.which[i]], own, run)
    problem.forget(system)
    s.clock[0].longest = accept_state(problem, s.clock[0].time, s.y, w, system, K)


@kernel
def doubt_mode(margin, own, run):
    """Store the present instant for each parameter whose change brings a margin, which is zero between two modes, to zero."""
    for k in range(own.doubt.size):
        if abs(value_of(margin)) < run.change[0] * abs(derivative(margin, k)):
            own.doubt[k] = min(own.doubt[k], run.clock[0].time)


@kernel
def take_guards(problem, run, s, w, system, K, r):
    """Handle the events of other parts at the end of a step; return whether velocities may jump."""
    jumped = False
    for at in range(s.counts[0].events, run.counts[0].events):
        guard = int(run.log[at, GUARD])
        if is_hard(guard, K):
            break
        take_event(problem, s.clock[0].time, guard, s, w, system, r.log)
        jumped = jumped or K.sudden[guard] == 1
    return jumped


@kernel
def take_hard_values(first, own, run, s, w, log):
    """Replace the values of the dual numbers by those of the run, from which they differ by round-off; return a status."""
    mode, events = open_hard(own.hard).state.mode, s.counts[0].events
    if events != run.counts[0].events:
        return ANOTHER_MODE
    for i in range(mode.size):
        if mode[i] != own.mode[i]:
            return ANOTHER_MODE
    for at in range(first, events):
        for column in range(log.shape[1]):
            log[at, column] = with_value(log[at, column], run.log[at, column])
    for row in range(s.peak.shape[0]):
        for column in range(s.peak.shape[1]):
            s.peak[row, column] = with_value(s.peak[row, column], run.peak[row, column])
    return take_values(run, s, w)
