"""Control the step size: the first step, the next one, and a rejected one."""

from __future__ import annotations

import math

from scissordyn.integrate.history import up_to_multiple
from scissordyn.integrate.integration import IGNORES, NO_EVENT, RISE
from scissordyn.integrate.step import AFTER_START, BEFORE_END, EVEN, attempt
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import kernel
from scissordyn.tolerance import SHORT_STEP_FRACTION

SAFETY_FACTOR = 0.9  # Factor on the step size that the error estimate suggests
STEP_FACTOR_MIN = 0.2  # Smallest ratio of successive step sizes
STEP_FACTOR_MAX = 8.0  # Largest ratio of successive step sizes
FALL_STEP_FACTOR = 1.3  # Largest ratio of a step that ends on a contact's release to the last accepted step after its onset
FALL_APPROACH_FRACTION = 0.6  # Largest fraction of the time to a contact's release that a step with even time covers
ATTEMPTS_MAX = 8  # Largest number of attempts to end a step on an event; Newton's method usually needs two or three

STATELESS_FACTOR_MAX = 1.5  # Largest ratio of successive step sizes of a problem without states, whose motion has no error

STEP_MIN_FRACTION = 4e-16  # Smallest step size as a fraction of its instant; smaller ones are below the round-off of time


@kernel
def first_step(problem, T, t, s, w, S):
    """Return the first step size, from the slope and its change over a small explicit step.

    Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.4.
    """
    size = s.y.size
    if size == 0:
        # without states there is no error estimate, and the motion may start from rest
        return SHORT_STEP_FRACTION * (s.clock[0].end - t)
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
    if largest == 0.0:  # at rest, and no motion starts
        return math.inf
    return min(100.0 * small, (0.01 / largest) ** (1.0 / T.order))


@kernel
def choose_step(problem, T, t, s, w, S):
    """Return the size of the next step, whether it is the last one, and the guard on whose fall it ends, or -1.

    A step that ends on the fall of a guard has already been made on return.
    """
    clock = s.clock[0]
    h = min(clock.fixed if clock.fixed > 0.0 else clock.step, clock.longest)
    if w.delays.size > 0:
        h = up_to_multiple(t, h, w.delays)
    last = t + h >= clock.end or clock.end - t - h < SHORT_STEP_FRACTION * h
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
        most = min(most, FALL_STEP_FACTOR * clock.after_rise)
    if w.delays.size > 0:
        most = up_to_multiple(t, most, w.delays)
    guard, ahead = fall_ahead(max(most, h / FALL_APPROACH_FRACTION), s, w)
    if guard < 0:
        return h, last, -1
    if ahead > most:
        return min(h, FALL_APPROACH_FRACTION * ahead), last and h <= FALL_APPROACH_FRACTION * ahead, -1
    ahead = step_to_fall(problem, T, guard, t, ahead, most, s, w, S)
    if ahead > 0.0:
        return ahead, False, guard
    return h, last, -1


@kernel
def fall_ahead(most, s, w):
    """Return the guard in mode 1 that falls next at its present rate, and the time until then; (-1, 0) if beyond `most`."""
    falling, least = -1, most
    for k in range(s.mode.size):
        value, rate = w.start_value[k], w.start_rate[k]
        if s.mode[k] == 1 and value > w.precision[k] and rate < 0.0 and value < -least * rate:
            falling, least = k, -value / rate
    return falling, least if falling >= 0 else 0.0


@kernel
def step_to_fall(problem, T, guard, t, h, most, s, w, S):
    """Make one step, tried with size h, that ends where a contact is released; return its size, or 0 if it fails."""
    w.scaling[0] = BEFORE_END
    for _ in range(ATTEMPTS_MAX):
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
def step_factor(T, error):
    """Return the ratio of the next step size to the last one that an error suggests; the least one if it is not finite."""
    if not error < math.inf:
        return STEP_FACTOR_MIN
    if error <= 1e-12:
        return STEP_FACTOR_MAX
    return min(STEP_FACTOR_MAX, max(STEP_FACTOR_MIN, SAFETY_FACTOR * error ** (-1.0 / T.order)))


@kernel
def after_rejection(T, t, h, error, to_fall, s, w):
    """Shrink the step after its rejection; return whether its size fell to round-off."""
    clock = s.clock[0]
    s.counts[0].rejected += 1
    clock.stalled += 1
    factor = step_factor(T, error)
    if w.scaling[0] == AFTER_START:  # the method steps in the square root of time
        factor *= factor
    if to_fall:
        clock.reach = h * factor
        return False
    clock.step = h * factor
    clock.rejected = 1
    return clock.step <= STEP_MIN_FRACTION * max(abs(t), clock.first)


@kernel
def after_acceptance(T, h, error, s, w):
    """Return the largest allowed ratio of the next step size to h."""
    clock = s.clock[0]
    grow = step_factor(T, error)
    if s.y.size == 0:
        grow = min(grow, STATELESS_FACTOR_MAX)
    if clock.rejected == 1:
        grow = min(grow, 1.0)
    # towards the end of a contact steps shrink at a constant ratio (Gustafsson 1994, doi:10.1145/198429.198437)
    if clock.touching == 1 and w.scaling[0] == EVEN and error > 1e-2 and clock.previous_error > 0.0:
        steady = grow * (h / clock.previous_step) * (clock.previous_error / error) ** (1.0 / T.order)
        grow = min(grow, max(STEP_FACTOR_MIN, steady))
    clock.previous_step, clock.previous_error = h, error if w.scaling[0] == EVEN else 0.0
    clock.rejected = 0
    if w.scaling[0] == AFTER_START:
        clock.after_rise = h * min(4.0, grow * grow)
        # the singularity is as close as the step is long, so the next even step must not be longer
        grow = min(grow, 1.0)
    elif clock.last_event != NO_EVENT:
        size = h * max(1.0, grow) if T.kind == EXPLICIT else 2.0 * h
        if clock.last_event == RISE:
            clock.after_rise = size
        else:
            clock.after_fall = size
    clock.last_event = NO_EVENT
    return grow


@kernel
def after_event(T, full, event, s):
    """Set the step size after an event that ended a step of size `full`."""
    clock = s.clock[0]
    remembered = clock.after_rise if event == RISE else clock.after_fall
    if remembered > 0.0:
        clock.step = remembered if T.kind == EXPLICIT else min(full, remembered)
    else:
        clock.step = full
    clock.last_event, clock.reach, clock.previous_error = event, math.inf, 0.0
    clock.touching = 0
    for k in range(s.mode.size):
        if T.kind == EXPLICIT and s.mode[k] == 1:
            clock.touching = 1
