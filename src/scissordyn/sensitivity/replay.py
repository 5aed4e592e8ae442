"""Repeat each step of a run in dual numbers, immediately after the run has made it.

The run itself uses doubles. The repetition uses the run's step sizes and contact modes and, after each step, its values: only
the derivatives are new. Time has derivatives too. If a step ends on a located event, the derivatives of its size are chosen so
that the event's guard stays zero while the parameters change. Approach speeds, initial states of friction and velocity jumps
then need no formulas of their own. After a step to a fixed instant, time has the derivatives of that instant.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from scissordyn.integrate.control import SAFETY_FACTOR, step_factor
from scissordyn.integrate.dense import complete, dense_value, integrals_at
from scissordyn.integrate.history import keep_history
from scissordyn.integrate.integration import (
    DATA,
    ENDED,
    GUARD,
    LARGEST,
    MODE,
    RISE,
    TIME,
    WHEN,
    ClockArray,
    CountsArray,
    open_integration,
)
from scissordyn.integrate.monitor import begin_peak, end_peak
from scissordyn.integrate.step import BEFORE_END, EVEN, EVERYTHING, attempt, place, speed
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import F1, F2, I1, I2, equals, kernel, opener, value_of
from scissordyn.mechanics.functions import FUNCTIONS
from scissordyn.mechanics.system import open_system
from scissordyn.sensitivity.frozen_slopes import freeze_slopes
from scissordyn.sensitivity.gap import watch_gaps
from scissordyn.sensitivity.integral import add_integrals
from scissordyn.sensitivity.part_error import PART_MIN_FRACTION, PARTS_MAX, part_error
from scissordyn.sensitivity.peak import follow_peak
from scissordyn.sensitivity.reversal import END, START, count_reversals, first_reversal, sliding
from scissordyn.tolerance import DATA_TOL, EVENT_TOL, ROUND_OFF_TOL


class Replayed(NamedTuple):
    """Functions of an initial value problem that the repetition of a step calls: those of `integrate.advance`, and others.

    `forget(S)` discards values cached for an instant, because the same instant may return with other derivatives.
    `break_at(t, S)` returns the instant at which a time function has a kink, if t is equal to it within round-off, else NaN.
    `sliding(S, target)` writes the speeds at whose zeros friction has a kink, as last evaluated.
    `freeze(S)` removes the derivatives of the linearised rates.
    """

    rate: Any
    linearise: Any
    factorize: Any
    solve: Any
    guards: Any
    accept: Any
    reset: Any
    monitor: Any
    probe: Any
    record: Any
    forget: Any
    break_at: Any
    sliding: Any
    freeze: Any


FOLLOWED, ANOTHER_MODE, NO_ROOT, FULL, JUMP, UNFINISHED = range(6)
"""Results of `follow`: step repeated; other contact modes than in the run; a guard is not zero at its event; the history of
delayed signals is full; rates jump at a multiple of a delay that is a parameter; the step needs more than `PARTS_MAX` parts.
"""

ROOT_PRECISIONS = 10.0  # Largest value of a guard at its event that counts as zero, as a multiple of its location precision

# [-] distance from an instant, as a fraction of it, at which the rates on both sides are evaluated
JUMP_PROBE = 10.0 * EVENT_TOL
JUMP_MIN = 1e-6  # [-] smallest relative change of the rates at an instant that counts as a jump


class Watched(NamedTuple):
    """Arrays in doubles, of the run whose steps are repeated: inputs of the repetition, and the errors that it reports."""

    clock: ClockArray
    counts: CountsArray
    y: F1
    mode: I1
    memory: F1
    mass: F1
    reference: F1
    scaling: I1
    slope: F1  # Rates at the start of the next step, if the clock's field `prepared` is set
    peak: F2
    log: F2
    rows: I1  # Indices of the monitored rows whose largest values get derivatives
    misfit: F1  # (1,) Largest difference between a step and its repetition, relative to the entry of y or to 1
    parameters: I1  # (1,) number of derivatives whose errors are controlled
    tolerance: F1  # (2,) allowed errors of derivatives in a step: relative, and of an integral's relative to the integral
    parts: I1  # (1,) number of parts that were rejected for the errors of the derivatives
    divided: I1  # (1,) number of equal parts in which the next step is tried first
    integrals: I2  # (rows, values) 1 for monitored values whose integrals get accurate derivatives
    quadrature: I1  # (1,) number of parts of steps that were halved for the integrals
    rough: F2  # (powers, parameters) errors of the integrals' derivatives in parts that were not halved any more
    change: F1  # (1,) relative change of each parameter for which the derivatives are used; 0 to watch no gaps
    gap: F2  # (guards, 4 + parameters) instant, value, rate, last event and derivatives of each guard after the last step
    since: F2  # (guards, parameters) since when the changed guard may have crossed zero [s], infinity, or `gap.SINCE_EVENT`
    unwatched: I1  # (guards,) mode in which a guard is not watched
    speed: F2  # (4, speeds) speeds at whose zeros friction has a kink, see `reversal`
    leeway: F1  # (guards,) displacement of a guard at an event from which a change counts as too far
    limits: F2  # (3, parameters) first instants at which this change has a certain effect on an event, see `gap` [s]


open_watched = opener(Watched)


@kernel
def with_value(x, value):
    """Return a dual number with the derivatives of x and another value."""
    return (x - value_of(x)) + value


def follow(watched: int, address: int, system: int, seed: F1) -> int:
    """Repeat the last step of a mechanism's run by `follow_step`; return its status."""
    return follow_step(MECHANICS, watched, address, system, seed)


def end(address: int, system: int) -> None:
    """Write the monitored values and their derivatives at the end of the run."""
    s, w = open_integration(address).state, open_integration(address).work
    MECHANICS.forget(system)
    MECHANICS.rate(s.clock[0].time, s.y, system, w.slope)
    MECHANICS.monitor(s.clock[0].time, s.y, system, w.power_at_start, s.monitored)


@kernel
def forget_time(system):
    """Discard the cached instant of the drives, so that the mechanics evaluate them again."""
    open_system(system).work.instant[0] = math.nan


@kernel
def break_at(now, system):
    """Return the instant of a kink of a time function that equals `now` within round-off, or NaN."""
    breaks = open_system(system).parameters.breaks
    for k in range(breaks.size):
        if abs(breaks[k] - now) <= ROUND_OFF_TOL * breaks[k]:
            return breaks[k]
    return math.nan


# Functions of a mechanism that repeat a step with dual numbers
MECHANICS = Replayed(
    **{name: FUNCTIONS[name] for name in Replayed._fields if name in FUNCTIONS},
    forget=forget_time,
    break_at=break_at,
    sliding=sliding,
    freeze=freeze_slopes,
)


@kernel
def follow_step(problem, watched, address, system, seed):
    """Repeat the last step of a run and its events; return a status.

    `watched` is the address of the run's arrays in doubles, `address` and `system` those of the dual numbers. `seed` is the
    dual number 0 with first derivative 1, to differentiate by time.
    """
    run, r = open_watched(watched), open_integration(address)
    s, w = r.state, r.work
    clock, counts = s.clock[0], s.counts[0]
    now, first, after = run.clock[0].time, counts.events, run.counts[0].events
    if run.counts[0].steps == counts.steps:
        if run.change[0] > 0.0 and counts.steps == 0:  # before the first step
            watch_gaps(problem, first, first, run, s, w, system, r.log)
        return FOLLOWED
    if w.delays.size > 0 and not has_room(value_of(clock.time), s, w):
        return FULL
    w.scaling[0] = run.scaling[0]
    problem.forget(system)
    moves = now > clock.time
    if moves:
        guard = int(run.log[first, GUARD]) if after > first else -1
        if not repeat_step(problem, r.method, guard, now, run, s, w, system, r.samples, seed):
            return UNFINISHED
        if after == first:  # without an event; resets may change the state
            for i in range(s.y.size):
                run.misfit[0] = max(run.misfit[0], abs(value_of(s.y[i]) - run.y[i]) / max(1.0, abs(run.y[i])))
    clock.time = with_value(clock.time, now)
    if w.delays.size > 0 and moves and not equals(clock.time, now) and jumps(problem, clock.time, s, w, system):
        return JUMP
    for at in range(first, after):
        guard = int(run.log[at, GUARD])
        if at > first or not moves:
            move_to_event(problem, guard, s, w, system)
        if abs(value_of(root_at(problem, clock.time, guard, s.y, w, system))) > ROOT_PRECISIONS * w.precision[guard]:
            return NO_ROOT
        take_event(problem, clock.time, guard, s, w, system, r.log)
    if after > first or run.clock[0].prepared != EVERYTHING:
        clock.prepared = 0
    if after > first:
        run.divided[0] = 1
    counts.steps = run.counts[0].steps
    if run.change[0] > 0.0:
        watch_gaps(problem, first, after, run, s, w, system, r.log)
    return take_values(run, s, w)


@kernel
def has_room(now, s, w):
    """Return whether the history has room for all parts of a step; drop the steps that no delay reaches any more."""
    rows, length = s.history, s.history_length[0]
    if length + PARTS_MAX <= rows.shape[0]:
        return True
    longest = old = 0
    for k in range(w.delays.size):
        if w.delays[k] > w.delays[longest]:
            longest = k
    while old < length - 1 and rows[old, 0] + rows[old, 1] < now - (1.0 + EVENT_TOL) * w.delays[longest]:
        old += 1
    for k in range(old, length):
        for i in range(rows.shape[1]):
            rows[k - old, i] = rows[k, i]
    s.history_length[0] = length - old
    return length - old + PARTS_MAX <= rows.shape[0]


@kernel
def repeat_step(problem, T, guard, now, run, s, w, system, samples, seed):
    """Repeat a step, in several parts if the derivatives need shorter steps than the values; return False for too many."""
    clock = s.clock[0]
    end = clock.time
    if guard < 0:
        end = fixed_instant(problem, now, run, w, system, clock.time)
    whole = now - value_of(clock.time)
    shortest, short = PART_MIN_FRACTION * whole, 0.01
    size, left, kinked, reverses, frozen = whole, whole, False, False, T.kind == EXPLICIT
    if run.scaling[0] == EVEN:
        size = whole / run.divided[0]
    for _ in range(PARTS_MAX):
        if clock.prepared == 0:
            prepare_step(problem, T, s, w, system)
            problem.sliding(system, run.speed[START])
        last = size > (1.0 - PART_MIN_FRACTION) * left
        # only the first or last part, at the onset or end of a contact, uses the scaling by the square root of time
        scaling = run.scaling[0]
        if (scaling == BEFORE_END and not last) or (scaling != BEFORE_END and left < whole):
            scaling = EVEN
        w.scaling[0] = scaling
        t = clock.time
        h = with_value(end - t, left) if last else with_value(0.0 * t, size)
        completed = attempt(problem, T, t, h, s, w, system)
        problem.sliding(system, run.speed[END])
        reverses = reverses or count_reversals(run.speed) > 0
        error = part_error(T, h, reverses, run, s, w) if completed else math.inf
        grow = step_factor(T, error)
        if scaling != EVEN:
            grow *= grow
        if size > shortest and not error <= 1.0:
            run.parts[0] += 1
            if not frozen and size < short * whole:  # try the same part without derivatives of the slopes
                problem.freeze(system)
                frozen = True
                continue
            kinked = completed and not kinked and count_reversals(run.speed) > 0
            if kinked:  # the next part ends just before the kink, the one after it just behind the kink
                size = max(shortest, first_reversal(problem, T, t, h, run.speed, s, w, system) - 0.5 * shortest)
            else:
                size = size / math.ceil(1.0 / grow)
            continue
        frozen = T.kind == EXPLICIT
        if last and guard >= 0:
            h = to_event(problem, T, guard, t, h, s, w, system)
        reached = now if last else value_of(t + h)
        ends = last and (guard >= 0 or now == run.clock[0].end)
        use_inside(problem, T, t, h, reached, ends, run, s, w, system, samples, seed)
        problem.forget(system)
        problem.accept(with_value(t + h, reached), w.new, system, w.accepted)
        carry_on(T, s, w)
        for k in range(run.speed.shape[1]):
            run.speed[START, k] = run.speed[END, k]
        for i in range(s.y.size):
            s.y[i] = w.new[i]
        clock.time = with_value(t + h, reached)
        allowed = grow * size if size > shortest else whole
        if last:
            run.divided[0] = 1 if SAFETY_FACTOR * whole <= allowed else math.ceil(whole / allowed)
            return True
        left = now - reached
        size = shortest if kinked else left / math.ceil(left / allowed)
        kinked = False
    return False


@kernel
def prepare_step(problem, T, s, w, system):
    """Compute the rates at the start of a step; for an explicit method also the monitored values, else the linearised rates."""
    clock = s.clock[0]
    clock.prepared = 1
    if T.kind != EXPLICIT:
        problem.linearise(clock.time, s.y, system, w.slope, w.slope_t)
        return
    problem.rate(clock.time, s.y, system, w.slope)
    if clock.monitors == 1:
        problem.monitor(clock.time, s.y, system, w.power_at_start, s.monitored)


@kernel
def fixed_instant(problem, now, run, w, system, t):
    """Return the end of a step as a dual number.

    The end of the run has no derivatives. A kink of a time function and a multiple of a delay have their own. Any other
    instant has the derivatives of the start t.
    """
    if now == run.clock[0].end:
        return 0.0 * t
    instant = problem.break_at(now, system)
    if instant == instant:
        return instant
    for k in range(w.delays.size):
        multiple = math.floor(now / value_of(w.delays[k]) + 0.5)
        if multiple > 0 and abs(multiple * w.delays[k] - now) < EVENT_TOL * w.delays[k]:
            return multiple * w.delays[k]
    return t


@kernel
def jumps(problem, t, s, w, system):
    """Return whether the rates jump at an instant, as where a controller begins to act after its delay."""
    scale = value_of(t) * JUMP_PROBE
    problem.rate(t - scale, s.y, system, w.inside)
    problem.rate(t + scale, s.y, system, w.new)
    size = change = 0.0
    for i in range(s.y.size):
        size = max(size, abs(value_of(w.new[i])))
        change = max(change, abs(value_of(w.new[i] - w.inside[i])))
    return change > JUMP_MIN * size


@kernel
def to_event(problem, T, guard, t, h, s, w, system):
    """Repeat a step so that its guard stays zero at its end while the parameters change; return the size as a dual number.

    The derivatives of the size come from the guard's rate along the exact motion. The end of the step follows that motion only
    within the error of the step; the rest of the guard's derivatives is removed by a motion along the rates.
    """
    h = h + to_root(problem, guard, t + h, w.new, w, system)
    problem.forget(system)
    attempt(problem, T, t, h, s, w, system)
    rest = to_root(problem, guard, t + h, w.new, w, system)
    problem.rate(t + h, w.new, system, w.inside)
    for i in range(s.y.size):
        w.new[i] += rest * w.inside[i]
    return h + rest


@kernel
def to_root(problem, guard, t, y, w, system):
    """Return a dual number of value 0 with the derivatives of the time from t to the root of a guard."""
    root = root_at(problem, t, guard, y, w, system)
    return (value_of(root) - root) / value_of(w.rate[guard])


@kernel
def root_at(problem, t, guard, y, w, system):
    """Return the value of a guard at its event as a dual number (its value is nearly zero); write its rate to `w.rate`."""
    problem.forget(system)
    problem.guards(t, y, system, w.value, w.rate)
    return w.value[guard]


@kernel
def move_to_event(problem, guard, s, w, system):
    """Move the derivatives of time to the root of another guard at the same instant, and the state along its motion."""
    clock = s.clock[0]
    h = to_root(problem, guard, clock.time, s.y, w, system)
    problem.rate(clock.time, s.y, system, w.slope)
    for i in range(s.y.size):
        s.y[i] += h * w.slope[i]
    clock.time += h


@kernel
def carry_on(T, s, w):
    """Reuse the rates, powers and monitored values at the end of an explicit step for the start of the next one, if equal.

    They differ after a projection onto the constraints, and at the end of a contact.
    """
    s.clock[0].prepared = 0
    if T.kind != EXPLICIT or w.accepted[0] != 0.0 or w.scaling[0] == BEFORE_END:
        return
    last, inverse = T.stages, 1.0 / speed(w.scaling[0], 1.0)
    for i in range(s.y.size):
        w.slope[i] = inverse * w.stages[last, i]
    if s.clock[0].monitors == 1:
        for q in range(s.total.size):
            w.power_at_start[q] = inverse * w.power[last, q]
        for row in range(s.monitored.shape[0]):
            for q in range(s.monitored.shape[1]):
                s.monitored[row, q] = w.monitored[last, row, q]
    s.clock[0].prepared = 1


@kernel
def use_inside(problem, T, t, h, now, ends, run, s, w, system, samples, seed):
    """Write samples, integrals and largest values within a step, with their derivatives."""
    counts = s.counts[0]
    if w.delays.size > 0:
        complete(problem, T, t, h, s, w, system)
        keep_history(problem.record, T, t, h, s, w, system)
    for k in range(run.rows.size):
        row = run.rows[k]
        when = run.peak[row, WHEN]
        new = run.peak[row, LARGEST] > 0.0 and run.peak[row, LARGEST] != value_of(s.peak[row, LARGEST])
        # a value that is largest at the end of a step usually rises further: the next step decides
        if new and value_of(t) <= when <= now and (when < now or ends):
            follow_peak(problem, T, row, when, t, h, now, s, w, system, seed)
            largest = run.peak[row, LARGEST]
            if not abs(value_of(s.peak[row, LARGEST]) - largest) <= DATA_TOL * largest:
                s.peak[row, LARGEST] = math.nan * seed[0]  # the run has it on the other side of a jump
            s.peak[row, LARGEST] = with_value(s.peak[row, LARGEST], largest)
    first = counts.samples
    while counts.samples < samples.time.size and samples.time[counts.samples] <= now:
        if counts.samples == first and s.clock[0].monitors == 1 and T.kind != EXPLICIT:
            follow_nodes(problem, T, t, h, s, w, system)
        complete(problem, T, t, h, s, w, system)
        part = (samples.time[counts.samples] - t) / h
        theta = place(w.scaling[0], part if part < 1.0 else with_value(part, 1.0))
        dense_value(theta, T.pattern, s.y, w.dense, samples.state[counts.samples])
        for k in range(s.mode.size):
            samples.memory[counts.samples, k], samples.mass[counts.samples, k] = s.memory[k], s.mass[k]
        for i in range(s.reference.size):
            samples.reference[counts.samples, i] = s.reference[i]
        if s.clock[0].monitors == 1:
            integrals_at(T, theta, h, s, w, samples.total[counts.samples])
        counts.samples += 1
    if s.clock[0].monitors == 1:
        add_integrals(problem, T, t, h, run, s, w, system)
        for sample in range(first, counts.samples):
            if samples.time[sample] == now:
                for q in range(s.total.size):
                    samples.total[sample, q] = s.total[q]


@kernel
def follow_nodes(problem, T, t, h, s, w, system):
    """Compute powers and monitored values on the Gauss nodes of a Rosenbrock step."""
    complete(problem, T, t, h, s, w, system)
    for node in range(T.gauss.size):
        now = t + T.gauss[node] * h
        dense_value(T.gauss[node], T.pattern, s.y, w.dense, w.inside)
        problem.rate(now, w.inside, system, w.slope)
        problem.monitor(now, w.inside, system, w.power[node], w.monitored[node])


@kernel
def take_event(problem, now, guard, s, w, system, log):
    """Handle the event of a guard: reset its mode and add a row to the log."""
    row = log[s.counts[0].events]
    rises = s.mode[guard] == 0
    problem.forget(system)
    problem.reset(now, s.y, guard, system, row[DATA:ENDED])
    row[TIME] = now
    row[GUARD] = float(guard)
    end_peak(guard, s, w, row)
    if rises:
        row[MODE] = float(RISE)
        begin_peak(now, guard, s, w)
    s.counts[0].events += 1


@kernel
def take_values(run, s, w):
    """Replace the values of the dual numbers by those of the run, from which they differ by round-off; return a status."""
    for i in range(s.y.size):
        s.y[i] = with_value(s.y[i], run.y[i])
    if s.clock[0].prepared == 1:
        for i in range(s.y.size):
            w.slope[i] = with_value(w.slope[i], run.slope[i])
    for k in range(s.mode.size):
        if s.mode[k] != run.mode[k]:
            return ANOTHER_MODE
        s.memory[k] = with_value(s.memory[k], run.memory[k])
        s.mass[k] = with_value(s.mass[k], run.mass[k])
    for k in range(s.reference.size):
        s.reference[k] = with_value(s.reference[k], run.reference[k])
    return FOLLOWED
