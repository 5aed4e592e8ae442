"""Roots of guards inside a step, located on the dense output.

A guard in mode 0 is crossed when its value rises through zero, in mode 1 when it falls. One that is beyond zero already,
because the last event left it there by round-off, is crossed when it turns and moves further beyond. Values and rates are
multiplied by `sign_of`, so that a crossing is always a rise.

Between two probes a guard may rise and fall again. The cubic through the values and rates at both probes, with its error as
the value halfway shows it, tells whether it can; if so, the halves are looked at in the same way. A guard beyond zero at the
end of a step, and not at its start, that was found to rise nowhere is a contradiction: the step is not taken.
"""

from __future__ import annotations

import math

from scissordyn.integrate.dense import complete, guard_at, guards_at
from scissordyn.integrate.step import speed
from scissordyn.kernel import kernel

PROBES = 6  # Points inside a step at which guards are evaluated

REACH = 0.75
"""A guard that cannot come to zero within this share of the step at the larger of its rates at both ends is not looked at."""

LOOKS = 100  # Places between two probes at which such a rise is looked for at most
CAUTION = 4.0  # The cubic's error is taken for this many times what the value halfway shows
ITERATIONS = 60  # Bracketed Newton steps need two to five; bisection alone would need fifty


@kernel
def sign_of(mode):
    """A guard's value times this is negative until it is crossed."""
    return 1.0 if mode == 0 else -1.0


@kernel
def cubic(place, a, slope_a, b, slope_b):
    """Value and slope of the cubic with values a, b and slopes at 0 and 1."""
    rest = 1.0 - place
    bend = rest * (slope_a - b + a) - place * (slope_b - b + a)
    value = rest * a + place * b + place * rest * bend
    return value, b - a + (rest - place) * bend - place * rest * (slope_a - b + a + slope_b - b + a)


@kernel
def cubic_root(a, slope_a, b, slope_b):
    """A root in (0, 1) of the cubic with values a <= 0 < b and slopes at 0 and 1."""
    low, high = 0.0, 1.0
    place = a / (a - b) if a < 0.0 else 0.5
    for _ in range(ITERATIONS):
        value, slope = cubic(place, a, slope_a, b, slope_b)
        if value > 0.0:
            high = place
        else:
            low = place
        step = value / slope if slope > 0.0 else 2.0
        if abs(step) < 1e-12:
            break
        place -= step
        if not low < place < high:
            place = 0.5 * (low + high)
        if high - low < 1e-14:
            break
    return place


@kernel
def cubic_summit(a, slope_a, b, slope_b):
    """About the largest value in (0, 1) of the cubic that rises at 0 and falls at 1: where its slope, a parabola, vanishes."""
    low, high = 0.0, 1.0
    place = value = 0.5
    for _ in range(6):
        place = 0.5 * (low + high)
        value, slope = cubic(place, a, slope_a, b, slope_b)
        if slope > 0.0:
            low = place
        else:
            high = place
    return value


@kernel
def locate(problem, T, k, low, high, a, slope_a, b, slope_b, t, h, s, w, S, sign):
    """The theta in (low, high] at which guard k rises through zero: a <= 0 < b with slopes by time are its values there."""
    step = (high - low) * h
    scaling = w.scaling[0]
    theta = low + (high - low) * cubic_root(a, step * speed(scaling, low) * slope_a, b, step * speed(scaling, high) * slope_b)
    for _ in range(ITERATIONS):
        guard_at(problem, T, k, theta, t, h, s, w, S)
        value, slope = sign * w.value[k], sign * w.rate[k] * h * speed(scaling, theta)
        if abs(value) <= 0.5 * w.precision[k]:
            break
        if value > 0.0:
            high = theta
        else:
            low = theta
        theta = theta - value / slope if slope > 0.0 else high
        if not low < theta < high:
            theta = 0.5 * (low + high)
            if not low < theta < high:
                theta = high
                break
    return theta


@kernel
def turning_point(problem, T, k, low, high, t, h, s, w, S, sign, wanted):
    """Bisection for where the rate of guard k changes its sign to `wanted`; ends early where the guard is beyond zero.

    Returns theta, and the value there.
    """
    theta, value = high, 0.0
    for _ in range(50):
        theta = 0.5 * (low + high)
        if not low < theta < high:
            break
        guard_at(problem, T, k, theta, t, h, s, w, S)
        value = sign * w.value[k]
        if wanted < 0.0 and value > 0.0:
            break
        if sign * w.rate[k] * wanted < 0.0:
            low = theta
        else:
            high = theta
    return theta, value


@kernel
def crossing_in(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign):
    """Where guard k is crossed between two places, from its values and rates there; -1 where that does not show it."""
    if a > 0.0:
        if slope_a > 0.0:
            return left
        if b > 0.0 and slope_b > 0.0:
            theta, value = turning_point(problem, T, k, left, right, t, h, s, w, S, sign, 1.0)
            if value > 0.0:
                return theta
            guard_at(problem, T, k, theta, t, h, s, w, S)
            start, slope = min(sign * w.value[k], 0.0), sign * w.rate[k]
            return locate(problem, T, k, theta, right, start, slope, b, slope_b, t, h, s, w, S, sign)
        return -1.0
    if b > 0.0:
        return locate(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign)
    if slope_a > 0.0 and slope_b < 0.0:
        step, scaling = (right - left) * h, w.scaling[0]
        highest = cubic_summit(a, step * speed(scaling, left) * slope_a, b, step * speed(scaling, right) * slope_b)
        if highest > 0.5 * max(a, b) - w.precision[k]:
            theta, value = turning_point(problem, T, k, left, right, t, h, s, w, S, sign, -1.0)
            if value > 0.0:
                return locate(problem, T, k, left, theta, a, slope_a, value, sign * w.rate[k], t, h, s, w, S, sign)
    return -1.0


@kernel
def may_rise(a, slope_a, b, slope_b, error, precision):
    """Whether the cubic with values a, b and slopes at 0 and 1 rises above zero, or its start, if it is off by `error` halfway.

    The error of such a cubic grows as the square of the distance from either end.
    """
    level = max(a, 0.0) + precision
    if max(a, b, a + slope_a, b - slope_b) < 0.0:
        return False
    for part in range(1, 8):
        place = 0.125 * part
        bump = 16.0 * error * (place * (1.0 - place)) ** 2
        if cubic(place, a, slope_a, b, slope_b)[0] + bump > level:
            return True
    return b > level


@kernel
def hidden_crossing(problem, T, k, left, right, b, slope_b, t, h, s, w, S, sign):
    """Where guard k rises between two places and falls again, from its values and rates there; -1 where it does not."""
    a, slope_a = sign * w.left_value[k], sign * w.left_rate[k]
    ends, scaling, depth = w.ends, w.scaling[0], 1
    ends[0, 0], ends[0, 1], ends[0, 2], ends[0, 3] = right, b, slope_b, math.inf
    for _ in range(LOOKS):
        right, b, slope_b, error = ends[depth - 1, 0], ends[depth - 1, 1], ends[depth - 1, 2], ends[depth - 1, 3]
        step = (right - left) * h
        begins, stops = step * speed(scaling, left) * slope_a, step * speed(scaling, right) * slope_b
        if may_rise(a, begins, b, stops, error, w.precision[k]) and depth < ends.shape[0]:
            middle = 0.5 * (left + right)
            guard_at(problem, T, k, middle, t, h, s, w, S)
            value, rate = sign * w.value[k], sign * w.rate[k]
            error = CAUTION * abs(value - cubic(0.5, a, begins, b, stops)[0])
            if value > w.precision[k] or may_rise(a, begins, b, stops, error, w.precision[k]):
                ends[depth - 1, 3] = ends[depth, 3] = error / 16.0
                ends[depth, 0], ends[depth, 1], ends[depth, 2] = middle, value, rate
                depth += 1
                theta = crossing_in(problem, T, k, left, middle, a, slope_a, value, rate, t, h, s, w, S, sign)
                if theta >= 0.0:
                    return theta
                continue
        left, a, slope_a, depth = right, b, slope_b, depth - 1
        if depth == 0:
            break
        right, b, slope_b = ends[depth - 1, 0], ends[depth - 1, 1], ends[depth - 1, 2]
        theta = crossing_in(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign)
        if theta >= 0.0:
            return theta
    return -1.0


@kernel
def next_crossing(problem, T, k, left, right, t, h, s, w, S, sign):
    """Where guard k is first crossed between two probes, from its values and rates there; -1 where it is not."""
    a, slope_a = sign * w.left_value[k], sign * w.left_rate[k]
    b, slope_b = sign * w.right_value[k], sign * w.right_rate[k]
    theta = crossing_in(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign)
    if theta < 0.0:
        return hidden_crossing(problem, T, k, left, right, b, slope_b, t, h, s, w, S, sign)
    if theta == left:
        return theta
    guard_at(problem, T, k, theta, t, h, s, w, S)
    value, rate = sign * w.value[k], sign * w.rate[k]
    if value <= w.precision[k]:
        value = 0.0
    earlier = hidden_crossing(problem, T, k, left, theta, value, rate, t, h, s, w, S, sign)
    return theta if earlier < 0.0 else earlier


@kernel
def all_far(h, s, w):
    """Whether no guard comes near zero in the step, judged by its ends."""
    for k in range(s.mode.size):
        sign = sign_of(s.mode[k])
        reach = REACH * h * max(abs(w.left_rate[k]), abs(w.end_rate[k]))
        if not (sign * w.left_value[k] < -reach and sign * w.end_value[k] < -reach):
            return False
    return True


@kernel
def insert(guard, theta, w):
    """Add a crossing to the list, in order."""
    at = w.crossing_count[0]
    while at > 0 and w.crossing_place[at - 1] > theta:
        w.crossing_guard[at], w.crossing_place[at] = w.crossing_guard[at - 1], w.crossing_place[at - 1]
        at -= 1
    w.crossing_guard[at], w.crossing_place[at] = guard, theta
    w.crossing_count[0] += 1


@kernel
def list_crossings(problem, T, k, left, right, t, h, s, w, S, every):
    """Add to the list the crossings of guard k between two probes, or the first of them."""
    theta = next_crossing(problem, T, k, left, right, t, h, s, w, S, sign_of(w.saved_mode[k]))
    while theta >= left and w.crossing_count[0] < w.crossing_guard.size:
        insert(k, theta, w)
        w.saved_mode[k] = 1 - w.saved_mode[k]
        if not every or not left < theta < right:
            return
        left = theta
        guard_at(problem, T, k, left, t, h, s, w, S)
        w.left_value[k], w.left_rate[k] = w.value[k], w.rate[k]
        theta = next_crossing(problem, T, k, left, right, t, h, s, w, S, sign_of(w.saved_mode[k]))


@kernel
def consistent(s, w):
    """Whether each guard ends the step on the side of zero that its mode and the crossings in the list tell."""
    for k in range(s.mode.size):
        sign, most = sign_of(w.saved_mode[k]), w.precision[k]
        if w.saved_mode[k] == s.mode[k]:
            most = max(most, sign * w.start_value[k])
        if sign * w.end_value[k] > most:
            return False
    return True


@kernel
def find_crossings(problem, T, t, h, s, w, S, every):
    """List the crossings of guards inside the step (t, t + h) in order: all of them, or those up to the first probe with any.

    Of the latter only the first of the list is the first in time; w.saved_mode is overwritten. Returns whether the guards at
    the end of the step agree with the list.
    """
    w.crossing_count[0] = 0
    count = s.mode.size
    if count == 0:
        return True
    for k in range(count):
        w.left_value[k], w.left_rate[k] = w.start_value[k], w.start_rate[k]
    problem.guards(t + h, w.new, S, w.end_value, w.end_rate)
    if all_far(h, s, w):
        return True
    complete(problem, T, t, h, s, w, S)
    for k in range(count):
        w.saved_mode[k] = s.mode[k]
    left = 0.0
    for probe in range(1, PROBES + 1):
        right = probe / PROBES
        if probe < PROBES:
            guards_at(problem, T, right, t, h, s, w, S)
        for k in range(count):
            w.right_value[k] = w.value[k] if probe < PROBES else w.end_value[k]
            w.right_rate[k] = w.rate[k] if probe < PROBES else w.end_rate[k]
        for k in range(count):
            list_crossings(problem, T, k, left, right, t, h, s, w, S, every)
        if w.crossing_count[0] > 0 and not every:
            return True
        for k in range(count):
            w.left_value[k], w.left_rate[k] = w.right_value[k], w.right_rate[k]
        left = right
    return consistent(s, w)
