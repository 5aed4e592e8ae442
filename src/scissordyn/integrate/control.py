"""The size of a step: the first one, the next one, and one that was rejected."""

from __future__ import annotations

import math

from scissordyn.integrate.history import up_to_multiple
from scissordyn.integrate.integration import IGNORES, NO_EVENT, RISE
from scissordyn.integrate.step import AFTER_START, BEFORE_END, EVEN, attempt
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import kernel

_EXPLICIT = EXPLICIT

SAFETY = 0.9
SMALLEST_FACTOR = 0.2
LARGEST_FACTOR = 8.0  # A step's size changes by no more than these factors
AIM = 1.3  # The end of a contact is tried to be reached in one step of this many times the size that worked after its start
NEARER = 0.6  # Largest part of the way to the end of a contact that an even step goes
ATTEMPTS = 8  # Attempts to end a step on an event; Newton's method needs two or three

SMALL_START, LARGEST_FACTOR_WITHOUT_STATE = 1e-3, 1.5
"""Without a state there is no error that steps go by, only their longest size, which follows the speed at their start: the
first one is this part of the whole time, and they grow no faster, so that a motion from rest or back is not stepped over."""

RESOLVED = 4e-16
"""A step below this part of its instant is not one: the clock cannot resolve it, nor a Rosenbrock method divide by it."""

REMAINDER = 1e-3  # A rest of the whole time shorter than this part of the step is added to it


@kernel
def first_step(problem, T, t, s, w, S):
    """A first step size, from the slope and its change over a small explicit step.

    Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.4.
    """
    size = s.y.size
    if size == 0:
        return SMALL_START * (s.clock[0].end - t)
    value = slope = bend = 0.0
    for g in range(w.group.size - 1):
        start, stop = w.group[g], w.group[g + 1]
        square = 0.0
        for i in range(start, stop):
            square += s.y[i] * s.y[i]
        level = math.sqrt(square / max(1, stop - start))
        for i in range(start, stop):
            w.saved[i] = w.atol[i] + w.rtol[i] * level
            value += (s.y[i] / w.saved[i]) ** 2
            slope += (w.slope[i] / w.saved[i]) ** 2
    value, slope = math.sqrt(value / size), math.sqrt(slope / size)
    if not slope < math.inf:
        return 1e-6
    small = 0.01 * value / slope if value > 1e-5 and slope > 1e-5 else 1e-6
    for i in range(size):
        w.inside[i] = s.y[i] + small * w.slope[i]
    problem.rate(t + small, w.inside, S, w.new)
    s.counts[0].rates += 1
    for i in range(size):
        bend += ((w.new[i] - w.slope[i]) / w.saved[i]) ** 2
    bend = math.sqrt(bend / size) / small
    largest = max(slope, bend)
    if not largest < math.inf:
        return small
    if largest == 0.0:  # at rest, and nothing begins to move
        return math.inf
    return min(100.0 * small, (0.01 / largest) ** (1.0 / T.order))


@kernel
def choose_step(problem, T, t, s, w, S):
    """The size of the step to come, whether it is the last, and the guard on whose fall it ends, or -1.

    In the latter case the step has been made.
    """
    clock = s.clock[0]
    h = min(clock.fixed if clock.fixed > 0.0 else clock.step, clock.longest)
    if w.delays.size > 0:
        h = up_to_multiple(t, h, w.delays)
    last = t + h >= clock.end or clock.end - t - h < REMAINDER * h
    if last:
        h = clock.end - t
    w.scaling[0] = EVEN
    if clock.touching == 0 or clock.fixed > 0.0 or clock.crosses == IGNORES:
        return h, last, -1
    if clock.last_event == RISE:
        w.scaling[0] = AFTER_START
        return h, last, -1
    most = min(clock.reach, clock.end - t, clock.longest)
    if clock.after_rise > 0.0:
        most = min(most, AIM * clock.after_rise)
    if w.delays.size > 0:
        most = up_to_multiple(t, most, w.delays)
    guard, ahead = fall_ahead(max(most, h / NEARER), s, w)
    if guard < 0:
        return h, last, -1
    if ahead > most:
        return min(h, NEARER * ahead), last and h <= NEARER * ahead, -1
    ahead = step_to_fall(problem, T, guard, t, ahead, most, s, w, S)
    if ahead > 0.0:
        return ahead, False, guard
    return h, last, -1


@kernel
def fall_ahead(most, s, w):
    """Guard in mode 1 that falls next, and when at its present rate: (guard, time to it), or (-1, 0) beyond `most`."""
    falling, least = -1, most
    for k in range(s.mode.size):
        value, rate = w.start_value[k], w.start_rate[k]
        if s.mode[k] == 1 and value > w.precision[k] and rate < 0.0 and value < -least * rate:
            falling, least = k, -value / rate
    return falling, least if falling >= 0 else 0.0


@kernel
def step_to_fall(problem, T, guard, t, h, most, s, w, S):
    """One slowing step to the fall of a guard, first tried with size h; returns its size, or 0 if it does not get there."""
    w.scaling[0] = BEFORE_END
    for _ in range(ATTEMPTS):
        attempt(problem, T, t, h, s, w, S)
        problem.guards(t + h, w.new, S, w.value, w.rate)
        value, rate = w.value[guard], w.rate[guard]
        if abs(value) <= w.precision[guard]:
            return h
        if not rate < 0.0:
            break
        h -= value / rate
        if not 0.0 < h <= most:
            break
    w.scaling[0] = EVEN
    return 0.0


@kernel
def after_rejection(T, t, h, error, to_fall, s, w):
    """Shrink the step; returns whether it fell to round-off."""
    clock = s.clock[0]
    s.counts[0].rejected += 1
    clock.stalled += 1
    factor = SMALLEST_FACTOR
    if error == error and not math.isinf(error):
        factor = max(SMALLEST_FACTOR, SAFETY * error ** (-1.0 / T.order))
    if w.scaling[0] == AFTER_START:  # the method steps in the root of time
        factor *= factor
    if to_fall:
        clock.reach = h * factor
        return False
    clock.step = h * factor
    clock.rejected = 1
    return clock.step <= RESOLVED * max(abs(t), clock.first)


@kernel
def after_acceptance(T, h, error, s, w):
    """How much larger than h the next step may be."""
    clock = s.clock[0]
    grow = LARGEST_FACTOR
    if error > 1e-12:
        grow = min(LARGEST_FACTOR, max(SMALLEST_FACTOR, SAFETY * error ** (-1.0 / T.order)))
    if s.y.size == 0:
        grow = LARGEST_FACTOR_WITHOUT_STATE
    if clock.rejected == 1:
        grow = min(grow, 1.0)
    # towards the end of a contact steps shrink at a steady rate (Gustafsson 1994, doi:10.1145/198429.198437)
    if clock.touching == 1 and w.scaling[0] == EVEN and error > 1e-2 and clock.previous_error > 0.0:
        steady = grow * (h / clock.previous_step) * (clock.previous_error / error) ** (1.0 / T.order)
        grow = min(grow, max(SMALLEST_FACTOR, steady))
    clock.previous_step, clock.previous_error = h, error if w.scaling[0] == EVEN else 0.0
    clock.rejected = 0
    if w.scaling[0] == AFTER_START:
        clock.after_rise = h * min(4.0, grow * grow)
        # the singularity is as near as the step is long, so the next even step is no longer
        grow = min(grow, 1.0)
    elif clock.last_event != NO_EVENT:
        size = h * max(1.0, grow) if T.kind == _EXPLICIT else 2.0 * h
        if clock.last_event == RISE:
            clock.after_rise = size
        else:
            clock.after_fall = size
    clock.last_event = NO_EVENT
    return grow


@kernel
def after_event(T, full, event, s):
    """Step size after an event that ended a step of size `full`."""
    clock = s.clock[0]
    remembered = clock.after_rise if event == RISE else clock.after_fall
    if remembered > 0.0:
        clock.step = remembered if T.kind == _EXPLICIT else min(full, remembered)
    else:
        clock.step = full
    clock.last_event, clock.reach, clock.previous_error = event, math.inf, 0.0
    clock.touching = 0
    for k in range(s.mode.size):
        if T.kind == _EXPLICIT and s.mode[k] == 1:
            clock.touching = 1
