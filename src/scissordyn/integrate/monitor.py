"""Find largest values, integrals and band crossings of monitored values over a step, and integrate the powers.

An explicit method has evaluated everything at its stages. The stages of a Rosenbrock method are less accurate than its steps,
so values are evaluated on Gauss nodes of its dense output.
"""

from __future__ import annotations

import math

from scissordyn.integrate.dense import complete, dense_value, inside_at
from scissordyn.integrate.integration import (
    ENDED,
    FIRST_WITHIN,
    INTEGRAL,
    LARGEST,
    LAST_ABOVE,
    LIMIT,
    SPARE_ROWS,
    STRUCK,
    WHEN,
)
from scissordyn.integrate.step import fraction, speed
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import kernel

INNER_POINTS = SPARE_ROWS - 1  # Number of equidistant points inside an explicit step that are evaluated if a maximum is likely

VERTEX_OUTSIDE_MAX = 0.5  # A vertex outside the step by less than this fraction of the step may still be a maximum inside
END_MAXIMUM_TOL = 2e-5  # A maximum nearer to an end of the step than this fraction of the step is taken to be at the end

STAGE_HINT_FRACTION = 0.98
"""Stages above this fraction of the largest value so far suggest a maximum inside the step, because stages are less
accurate than dense output. Exceptions: all stages are further below it than they differ, or the stages are monotonic."""

STEADY_SLOPE_FRACTION = 0.5  # A value rises to the end of a step if its slope there is at least this fraction of the mean slope


MAXIMUM_TOL = 1e-7  # Accuracy of a maximum as a fraction of the step; the parabola is flat to round-off below it


@kernel
def begin_peak(now, guard, s, w):
    """Restart the largest values of a guard's row and of its companion, the row whose largest value is logged with it."""
    s.peak[guard, :] = 0.0
    s.peak[guard, WHEN] = now
    row = w.companion[guard]
    if row >= 0:
        s.peak[row, LARGEST], s.peak[row, WHEN] = 0.0, now


@kernel
def end_peak(guard, s, w, row):
    """Write the largest values of a guard's row and of its companion into a row of the event log."""
    other = w.companion[guard]
    if other >= 0:
        s.peak[guard, STRUCK], s.peak[guard, STRUCK + 1] = s.peak[other, LARGEST], s.peak[other, WHEN]
    for q in range(ENDED, row.size):
        row[q] = s.peak[guard, q - ENDED]


@kernel
def is_monitored(row, s):
    """Return whether a row of monitored values is in use: its guard is in mode 1, or its quantity is always monitored."""
    return row >= s.mode.size or s.mode[row] == 1


@kernel
def monitor_step(problem, T, t, h, s, w, S):
    """Update the monitored values over the step just made, and store those at its end."""
    if T.kind == EXPLICIT:
        monitor_stages(problem, T, t, h, s, w, S)
        last = T.stages
    else:
        monitor_nodes(problem, T, t, h, s, w, S)
        last = T.gauss.size + 1
    for row in range(s.mode.size, s.peak.shape[0]):
        if s.band[row - s.mode.size, LIMIT] < math.inf:
            follow_band(problem, T, row, t, h, s, w, S)
    for row in range(s.peak.shape[0]):
        for q in range(s.monitored.shape[1]):
            s.monitored[row, q] = w.monitored[last, row, q]


@kernel
def monitor_stages(problem, T, t, h, s, w, S):
    """Update peaks and integrals over an explicit step."""
    looked = False
    for row in range(s.peak.shape[0]):
        if not is_monitored(row, s):
            continue
        peak, highest, lowest = s.peak[row], 0.0, math.inf
        for stage in range(T.stages):
            weight = h * T.a[T.stages, stage] * speed(w.scaling[0], T.nodes[stage])
            for q in range(w.monitored.shape[2]):
                peak[INTEGRAL + q] += weight * w.monitored[stage, row, q]
            if T.followed[stage] == 1:
                highest = max(highest, w.monitored[stage, row, 0])
                lowest = min(lowest, w.monitored[stage, row, 0])
        best = max(peak[LARGEST], w.monitored[T.stages, row, 0])
        if (
            highest >= STAGE_HINT_FRACTION * best
            and 2.0 * highest - lowest >= best
            and highest > 0.0
            and may_have_maximum(T, row, peak[LARGEST], w)
        ):
            if not looked:
                probe_inside(problem, T, t, h, s, w, S)
                looked = True
            find_peak(problem, T, row, t, h, s, w, S)
        elif best > peak[LARGEST]:
            peak[LARGEST], peak[WHEN] = best, t + h


@kernel
def may_have_maximum(T, row, largest, w):
    """Return whether the step may have a maximum inside, or starts above the largest value so far.

    It has none if its largest value is at an end, and the parabola through that end and the two nearest stages is steep there
    with its vertex well outside.
    """
    start, end = w.monitored[0, row, 0], w.monitored[T.stages, row, 0]
    rises, edge = end >= start, max(start, end)
    if start > largest and not rises:
        return True
    near = far = 2.0  # places and values of the two nearest stages, counted from the higher end
    first = second = 0.0
    for stage in range(1, T.stages):
        place, number = T.nodes[stage], w.monitored[stage, row, 0]
        if T.followed[stage] == 0 or not 0.0 < place < 1.0:
            continue
        if number > edge:
            return True
        if rises:
            place = 1.0 - place
        if place < near:
            far, second = near, first
            near, first = place, number
        elif place < far:
            far, second = place, number
    if far > 1.0:
        return True
    slope = (first - edge) / near
    bend = ((second - first) / (far - near) - slope) / far
    slope -= bend * near
    return not slope < -max(2.0 * VERTEX_OUTSIDE_MAX * abs(bend), STEADY_SLOPE_FRACTION * abs(end - start))


@kernel
def probe_inside(problem, T, t, h, s, w, S):
    """Compute the monitored values at `INNER_POINTS` points inside an explicit step, into the last rows of Work.monitored."""
    complete(problem, T, t, h, s, w, S)
    for point in range(INNER_POINTS):
        probe(problem, T, (point + 1.0) / (INNER_POINTS + 1.0), t, h, s, w, S, T.nodes.size + point)


@kernel
def monitor_nodes(problem, T, t, h, s, w, S):
    """Compute powers on the Gauss nodes of a Rosenbrock step, and update peaks and integrals over it."""
    complete(problem, T, t, h, s, w, S)
    last = T.gauss.size + 1
    for row in range(s.peak.shape[0]):
        for q in range(s.monitored.shape[1]):
            w.monitored[0, row, q] = s.monitored[row, q]
    for node in range(1, last + 1):
        theta = place_of(T, node)
        target = w.new if node == last else w.inside
        if node < last:
            dense_value(theta, T.pattern, s.y, w.dense, target)
        problem.rate(t + theta * h, target, S, w.slope)
        problem.monitor(t + theta * h, target, S, w.power[node - 1], w.monitored[node])
    s.counts[0].rates += last
    for row in range(s.peak.shape[0]):
        if is_monitored(row, s):
            for node in range(T.gauss.size):
                for q in range(w.monitored.shape[2]):
                    s.peak[row, INTEGRAL + q] += h * T.weight[node] * w.monitored[node + 1, row, q]
            find_peak(problem, T, row, t, h, s, w, S)


@kernel
def probe(problem, T, theta, t, h, s, w, S, place):
    """Compute all monitored values at theta, into entry `place` of Work.monitored."""
    dense_value(theta, T.pattern, s.y, w.dense, w.inside)
    now = t + fraction(w.scaling[0], theta) * h
    problem.rate(now, w.inside, S, w.slope)
    problem.monitor(now, w.inside, S, w.power_at_start, w.monitored[place])
    s.counts[0].rates += 1


@kernel
def probe_row(problem, T, row, theta, t, h, s, w, S):
    """Compute one row of monitored values at theta into the last entry of Work.monitored; return its first value."""
    spare = w.monitored[w.monitored.shape[0] - 1, row]
    inside_at(T, theta, row, s, w)
    problem.probe(t + fraction(w.scaling[0], theta) * h, w.inside, row, S, w.slope, spare)
    return spare[0]


@kernel
def last_point(T):
    """Return the index of the step's end among the points at which a maximum is searched; the start has index 0."""
    return (INNER_POINTS if T.kind == EXPLICIT else T.gauss.size) + 1


@kernel
def index_of(T, point):
    """Return the index in Work.monitored of a point at which a maximum is searched (see `last_point`)."""
    if T.kind != EXPLICIT:
        return point
    if point == 0:
        return 0
    return T.nodes.size + point - 1 if point <= INNER_POINTS else T.stages


@kernel
def place_of(T, point):
    """Return theta of a point at which a maximum is searched: 0 at the start of the step, 1 at its end."""
    if T.kind == EXPLICIT:
        return point / (INNER_POINTS + 1.0)
    if point == 0:
        return 0.0
    return T.gauss[point - 1] if point <= T.gauss.size else 1.0


@kernel
def vertex(T, row, first, w):
    """Return theta of the vertex of the parabola through the monitored values at point `first` and the two after it."""
    a, b, c = place_of(T, first), place_of(T, first + 1), place_of(T, first + 2)
    middle = w.monitored[index_of(T, first + 1), row, 0]
    left = (middle - w.monitored[index_of(T, first), row, 0]) / (b - a)
    right = (w.monitored[index_of(T, first + 2), row, 0] - middle) / (c - b)
    if right >= left:
        return a - 1.0 if right < 0.0 else c + 1.0
    return 0.5 * (a + b) + left * 0.5 * (c - a) / (left - right)


@kernel
def find_peak(problem, T, row, t, h, s, w, S):
    """Update the largest first value of a row if the step exceeds it."""
    last = last_point(T)
    best = 0
    for point in range(1, last + 1):
        if w.monitored[index_of(T, point), row, 0] > w.monitored[index_of(T, best), row, 0]:
            best = point
    value, theta = w.monitored[index_of(T, best), row, 0], place_of(T, best)
    inside = 0 < best < last
    if best == 0:
        inside = vertex(T, row, 0, w) > -VERTEX_OUTSIDE_MAX
    elif best == last:
        inside = vertex(T, row, last - 2, w) < 1.0 + VERTEX_OUTSIDE_MAX
    peak = s.peak[row]
    if value < peak[LARGEST]:
        return
    if inside and not 0 < best < last:
        # the parabola is too coarse to decide on which side of the step's end the maximum is
        inside = probe_row(problem, T, row, END_MAXIMUM_TOL if best == 0 else 1.0 - END_MAXIMUM_TOL, t, h, s, w, S) > value
    if inside:
        low, high = place_of(T, max(best - 1, 0)), place_of(T, min(best + 1, last))
        theta, value = refine_peak(problem, T, row, low, theta, high, value, t, h, s, w, S)
    if value > peak[LARGEST]:
        peak[LARGEST], peak[WHEN] = value, t + fraction(w.scaling[0], theta) * h


@kernel
def refine_peak(problem, T, row, low, best, high, value, t, h, s, w, S):
    """Find the largest monitored value around `best` with Brent's parabolas and golden sections; return (theta, value).

    Brent, Algorithms for Minimization without Derivatives, 1973, chapter 5.
    """
    second = third = best
    second_value = third_value = value
    move = before = 0.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        if abs(best - middle) <= 2.0 * MAXIMUM_TOL - 0.5 * (high - low):
            break
        golden = True
        if abs(before) > MAXIMUM_TOL:
            r = (best - second) * (value - third_value)
            q = (best - third) * (value - second_value)
            p, q = (best - third) * q - (best - second) * r, 2.0 * (q - r)
            if q > 0.0:
                p = -p
            q, last = abs(q), before
            before = move
            if abs(p) < abs(0.5 * q * last) and q * (low - best) < p < q * (high - best):
                move, golden = p / q, False
        if golden:
            before = (low if best >= middle else high) - best
            move = 0.5 * (3.0 - math.sqrt(5.0)) * before  # golden section
        theta = best + (move if abs(move) >= MAXIMUM_TOL else math.copysign(MAXIMUM_TOL, move))
        if not low <= theta <= high:
            break
        height = probe_row(problem, T, row, theta, t, h, s, w, S)
        if height >= value:
            if theta >= best:
                low = best
            else:
                high = best
            third, third_value, second, second_value = second, second_value, best, value
            best, value = theta, height
            continue
        if theta < best:
            low = theta
        else:
            high = theta
        if height >= second_value or second == best:
            third, third_value, second, second_value = second, second_value, theta, height
        elif height >= third_value or third in (best, second):
            third, third_value = theta, height
    return best, value


@kernel
def follow_band(problem, T, row, t, h, s, w, S):
    """Record when a monitored value is last above its limit, and when it is first at or below it."""
    band = s.band[row - s.mode.size]
    limit, last = band[LIMIT], last_point(T)
    start, end = w.monitored[0, row, 0], w.monitored[index_of(T, last), row, 0]
    if math.isnan(band[FIRST_WITHIN]) and start <= limit:
        band[FIRST_WITHIN] = t
    highest = max(start, end)
    if T.kind == EXPLICIT:
        for stage in range(1, T.stages):
            highest = max(highest, w.monitored[stage, row, 0])
        if min(start, end) > limit or highest <= limit:
            if start > limit:
                band[LAST_ABOVE] = t + h
            return
        probe_inside(problem, T, t, h, s, w, S)
    for point in range(1, last + 1):
        before, after = w.monitored[index_of(T, point - 1), row, 0], w.monitored[index_of(T, point), row, 0]
        if after > limit:
            band[LAST_ABOVE] = t + fraction(w.scaling[0], place_of(T, point)) * h
        elif before > limit:
            theta = locate_band_exit(problem, T, row, place_of(T, point - 1), place_of(T, point), limit, t, h, s, w, S)
            band[LAST_ABOVE] = t + fraction(w.scaling[0], theta) * h
            if math.isnan(band[FIRST_WITHIN]):
                band[FIRST_WITHIN] = band[LAST_ABOVE]


@kernel
def locate_band_exit(problem, T, row, low, high, limit, t, h, s, w, S):
    """Return theta at which a monitored value falls through its limit between `low` and `high`, by bisection."""
    for _ in range(30):
        middle = 0.5 * (low + high)
        if probe_row(problem, T, row, middle, t, h, s, w, S) > limit:
            low = middle
        else:
            high = middle
    return high
