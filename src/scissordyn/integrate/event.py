"""Locate roots of guards inside a step, on the dense output.

A guard in mode 0 is crossed when its value rises through zero, in mode 1 when it falls. A guard that the last event left beyond
zero by round-off is crossed when it turns and moves further beyond. Values and rates are multiplied by `sign_of`, so that a
crossing is always a rise.

Between two probes a guard may rise and fall again. The cubic through the values and rates at both probes, with its error at the
middle, shows whether this is possible. If so, both halves are searched in the same way. If a guard is beyond zero only at the
end of a step, but no rise was found, the step is rejected.
"""

from __future__ import annotations

import math

from scissordyn.integrate.dense import complete, guard_at, guards_at
from scissordyn.integrate.step import speed
from scissordyn.kernel import kernel
from scissordyn.tolerance import NEWTON_STEPS_MAX

PROBE_INTERVALS = 6  # Number of intervals into which a step is divided to evaluate guards at their ends

ROOT_REACH_FRACTION = 0.75
"""Fraction of a step that limits the search for roots of guards.

If no guard can reach zero within this fraction, at the larger of its rates at both ends, roots are not searched.
"""

CUBIC_ERROR_FACTOR = 4.0  # Safety factor on the error of a guard's cubic interpolation, found at the middle of the interval


@kernel
def sign_of(mode):
    """Return the factor that makes a guard's value negative until the guard is crossed."""
    return 1.0 if mode == 0 else -1.0


@kernel
def cubic(place, a, slope_a, b, slope_b):
    """Return value and slope of the cubic with given values and slopes at 0 and 1."""
    rest = 1.0 - place
    bend = rest * (slope_a - b + a) - place * (slope_b - b + a)
    value = rest * a + place * b + place * rest * bend
    return value, b - a + (rest - place) * bend - place * rest * (slope_a - b + a + slope_b - b + a)


@kernel
def cubic_root(a, slope_a, b, slope_b):
    """Return a root in (0, 1) of the cubic with values a <= 0 < b and given slopes at 0 and 1."""
    low, high = 0.0, 1.0
    place = a / (a - b) if a < 0.0 else 0.5
    for _ in range(NEWTON_STEPS_MAX):
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
    """Return about where in (0, 1) a cubic that rises at 0 and falls at 1 has its largest value, and that value."""
    low, high = 0.0, 1.0
    place = value = 0.5
    for _ in range(6):
        place = 0.5 * (low + high)
        value, slope = cubic(place, a, slope_a, b, slope_b)
        if slope > 0.0:
            low = place
        else:
            high = place
    return place, value


@kernel
def locate_root(problem, T, k, low, high, a, slope_a, b, slope_b, t, h, s, w, S, sign):
    """Return the theta in (low, high] at which guard k rises through zero.

    The values a <= 0 < b and the slopes by time are those at low and high.
    """
    step = (high - low) * h
    scaling = w.scaling[0]
    theta = low + (high - low) * cubic_root(a, step * speed(scaling, low) * slope_a, b, step * speed(scaling, high) * slope_b)
    for _ in range(NEWTON_STEPS_MAX):
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
def find_turning_point(problem, T, k, low, high, t, h, s, w, S, sign, wanted):
    """Find where the rate of guard k changes its sign to `wanted`, by bisection; end early where the guard is beyond zero.

    Return theta and the value there.
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
def find_crossing(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign):
    """Return theta at which guard k is crossed between `left` and `right`; -1 if its values and rates there show no crossing.

    The values a, b and the slopes by time are those at `left` and `right`.
    """
    if a > 0.0:
        if slope_a > 0.0:
            return left
        if b > 0.0 and slope_b > 0.0:
            theta, value = find_turning_point(problem, T, k, left, right, t, h, s, w, S, sign, 1.0)
            if value > 0.0:
                return theta
            guard_at(problem, T, k, theta, t, h, s, w, S)
            start, slope = min(sign * w.value[k], 0.0), sign * w.rate[k]
            return locate_root(problem, T, k, theta, right, start, slope, b, slope_b, t, h, s, w, S, sign)
        return -1.0
    if b > 0.0:
        return locate_root(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign)
    if slope_a > 0.0 and slope_b < 0.0:
        step, scaling = (right - left) * h, w.scaling[0]
        place, highest = cubic_summit(a, step * speed(scaling, left) * slope_a, b, step * speed(scaling, right) * slope_b)
        least = 0.5 * max(a, b) - w.precision[k]
        if not highest > least:
            # a guard with a kink, as at a thin bar, is higher than the cubic
            guard_at(problem, T, k, left + (right - left) * place, t, h, s, w, S)
            highest += CUBIC_ERROR_FACTOR * abs(sign * w.value[k] - highest)
        if highest > least:
            theta, value = find_turning_point(problem, T, k, left, right, t, h, s, w, S, sign, -1.0)
            if value > 0.0:
                return locate_root(problem, T, k, left, theta, a, slope_a, value, sign * w.rate[k], t, h, s, w, S, sign)
    return -1.0


@kernel
def may_rise(a, slope_a, b, slope_b, error, precision):
    """Return whether the cubic with values a, b and given slopes at 0 and 1 may rise above zero and above its start.

    `error` is the cubic's error at the middle; the error grows as the square of the distance from either end.
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
def find_hidden_crossing(problem, T, k, left, right, b, slope_b, t, h, s, w, S, sign):
    """Return theta at which guard k rises between `left` and `right`, to fall again before `right`; -1 if it does not."""
    a, slope_a = sign * w.left_value[k], sign * w.left_rate[k]
    ends, scaling, depth = w.ends, w.scaling[0], 1
    ends[0, 0], ends[0, 1], ends[0, 2], ends[0, 3] = right, b, slope_b, math.inf
    for _ in range(100):  # each halves one part between two probes
        right, b, slope_b, error = ends[depth - 1, 0], ends[depth - 1, 1], ends[depth - 1, 2], ends[depth - 1, 3]
        step = (right - left) * h
        begins, stops = step * speed(scaling, left) * slope_a, step * speed(scaling, right) * slope_b
        if may_rise(a, begins, b, stops, error, w.precision[k]) and depth < ends.shape[0]:
            middle = 0.5 * (left + right)
            guard_at(problem, T, k, middle, t, h, s, w, S)
            value, rate = sign * w.value[k], sign * w.rate[k]
            error = CUBIC_ERROR_FACTOR * abs(value - cubic(0.5, a, begins, b, stops)[0])
            if value > w.precision[k] or may_rise(a, begins, b, stops, error, w.precision[k]):
                ends[depth - 1, 3] = ends[depth, 3] = error / 16.0
                ends[depth, 0], ends[depth, 1], ends[depth, 2] = middle, value, rate
                depth += 1
                theta = find_crossing(problem, T, k, left, middle, a, slope_a, value, rate, t, h, s, w, S, sign)
                if theta >= 0.0:
                    return theta
                continue
        left, a, slope_a, depth = right, b, slope_b, depth - 1
        if depth == 0:
            break
        right, b, slope_b = ends[depth - 1, 0], ends[depth - 1, 1], ends[depth - 1, 2]
        theta = find_crossing(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign)
        if theta >= 0.0:
            return theta
    return -1.0


@kernel
def find_next_crossing(problem, T, k, left, right, t, h, s, w, S, sign):
    """Return theta at which guard k is first crossed between the probes `left` and `right`; -1 if it is not.

    Its values and rates at both probes are in w.left_value, w.left_rate, w.right_value and w.right_rate.
    """
    a, slope_a = sign * w.left_value[k], sign * w.left_rate[k]
    b, slope_b = sign * w.right_value[k], sign * w.right_rate[k]
    theta = find_crossing(problem, T, k, left, right, a, slope_a, b, slope_b, t, h, s, w, S, sign)
    if theta < 0.0:
        return find_hidden_crossing(problem, T, k, left, right, b, slope_b, t, h, s, w, S, sign)
    if theta == left:
        return theta
    guard_at(problem, T, k, theta, t, h, s, w, S)
    value, rate = sign * w.value[k], sign * w.rate[k]
    if value <= w.precision[k]:
        value = 0.0
    earlier = find_hidden_crossing(problem, T, k, left, theta, value, rate, t, h, s, w, S, sign)
    return theta if earlier < 0.0 else earlier


@kernel
def all_far(h, s, w):
    """Return whether no guard comes close to zero in the step, judged by the values and rates at its ends."""
    for k in range(s.mode.size):
        sign = sign_of(s.mode[k])
        reach = ROOT_REACH_FRACTION * h * max(abs(w.left_rate[k]), abs(w.end_rate[k]))
        if not (sign * w.left_value[k] < -reach and sign * w.end_value[k] < -reach):
            return False
    return True


@kernel
def insert_crossing(guard, theta, w):
    """Insert a crossing into the ordered list."""
    at = w.crossing_count[0]
    while at > 0 and w.crossing_place[at - 1] > theta:
        w.crossing_guard[at], w.crossing_place[at] = w.crossing_guard[at - 1], w.crossing_place[at - 1]
        at -= 1
    w.crossing_guard[at], w.crossing_place[at] = guard, theta
    w.crossing_count[0] += 1


@kernel
def list_crossings(problem, T, k, left, right, t, h, s, w, S, every):
    """List the crossings of guard k between two probes: all of them, or only the first."""
    theta = find_next_crossing(problem, T, k, left, right, t, h, s, w, S, sign_of(w.saved_mode[k]))
    while theta >= left and w.crossing_count[0] < w.crossing_guard.size:
        insert_crossing(k, theta, w)
        w.saved_mode[k] = 1 - w.saved_mode[k]
        if not every or not left < theta < right:
            return
        left = theta
        guard_at(problem, T, k, left, t, h, s, w, S)
        w.left_value[k], w.left_rate[k] = w.value[k], w.rate[k]
        theta = find_next_crossing(problem, T, k, left, right, t, h, s, w, S, sign_of(w.saved_mode[k]))


@kernel
def guards_agree(s, w):
    """Return whether each guard ends the step on the side of zero that its mode and its listed crossings imply."""
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

    In the latter case only the first entry is in order. w.saved_mode is overwritten. Return whether the guards at the end of
    the step agree with the list.
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
    for probe in range(1, PROBE_INTERVALS + 1):
        right = probe / PROBE_INTERVALS
        if probe < PROBE_INTERVALS:
            guards_at(problem, T, right, t, h, s, w, S)
        for k in range(count):
            w.right_value[k] = w.value[k] if probe < PROBE_INTERVALS else w.end_value[k]
            w.right_rate[k] = w.rate[k] if probe < PROBE_INTERVALS else w.end_rate[k]
        for k in range(count):
            list_crossings(problem, T, k, left, right, t, h, s, w, S, every)
        if w.crossing_count[0] > 0 and not every:
            return True
        for k in range(count):
            w.left_value[k], w.left_rate[k] = w.right_value[k], w.right_rate[k]
        left = right
    return guards_agree(s, w)
