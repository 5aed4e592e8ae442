"""Differentiate largest values of a step in dual numbers."""

from __future__ import annotations

import math

from scissordyn.integrate.dense import complete, inside_at
from scissordyn.integrate.integration import LARGEST
from scissordyn.integrate.step import fraction, place
from scissordyn.kernel import derivative, kernel, value_of

SLOPE_PROBE = 1e-2  # [steps] distance of the first two instants in the secant search for a maximum of a monitored value
PEAK_MOVED_MAX = 0.1  # [steps] largest distance of a recorded maximum from the root of its slope, which round-off moves
SLOPE_TOL = 1e-3  # [-] largest slope at a smooth maximum, relative to the largest in the search; a kink has a larger slope
PEAK_ROOT_STEPS = 3  # Number of secant steps in the search for a maximum, the root of a monitored value's slope


@kernel
def value_at(problem, T, row, theta, t, h, s, w, system):
    """Return a monitored value at the fraction `theta` of a step, from the dense output."""
    inside_at(T, theta, row, s, w)
    return probed(problem, t + fraction(w.scaling[0], theta) * h, w.inside, row, w, system)


@kernel
def probed(problem, t, y, row, w, system):
    """Return the monitored value of a row at a time and state."""
    spare = w.monitored[w.monitored.shape[0] - 1, row]
    problem.forget(system)
    problem.probe(t, y, row, system, w.estimate[0], spare)
    return spare[0]


@kernel
def slope_at(problem, T, row, theta, t, h, s, w, system, seed):
    """Return a monitored value at the fraction `theta` of a step, and its slope by `theta` as a plain number."""
    moved = value_at(problem, T, row, theta + seed[0], t, h, s, w, system)
    fixed = value_at(problem, T, row, theta, t, h, s, w, system)
    return fixed, derivative(moved - fixed, 0)


@kernel
def value_on_plateau(problem, T, row, start, t, h, s, w, system, seed):
    """Return a largest value that a step also has at an end away from it, as at the limit of a controller; else NaN.

    The values are equal to the last bit there: at a kink close to an end they are equal up to round-off.
    """
    here = value_of(value_at(problem, T, row, start, t, h, s, w, system))
    if start < 1.0 - SLOPE_PROBE:
        at_end = probed(problem, t + h, w.new, row, w, system)
        if value_of(at_end) == here:
            return at_end
    if start > SLOPE_PROBE:
        at_start = probed(problem, t, s.y, row, w, system)
        if value_of(at_start) == here:
            return at_start
    return here + math.nan * seed[0]


@kernel
def follow_peak(problem, T, row, when, t, h, now, s, w, system, seed):
    """Write a largest value with its derivatives: at the root of its slope, at an end of the step, or on a plateau.

    The derivatives are NaN at another kink or at a jump.
    """
    complete(problem, T, t, h, s, w, system)
    start = place(w.scaling[0], min(max((when - value_of(t)) / value_of(h), 0.0), 1.0))
    before = start
    largest, slope_before = slope_at(problem, T, row, before, t, h, s, w, system, seed)
    theta = start + (SLOPE_PROBE if start < 0.5 else -SLOPE_PROBE)
    largest, slope = slope_at(problem, T, row, theta, t, h, s, w, system, seed)
    steepest = max(abs(slope), abs(slope_before))
    smooth = (slope - slope_before) * (theta - before) < 0.0
    for _ in range(PEAK_ROOT_STEPS):
        if slope == slope_before or abs(theta - start) > PEAK_MOVED_MAX:
            break
        root = theta - slope * (theta - before) / (slope - slope_before)
        before, slope_before, theta = theta, slope, root
        if abs(theta - start) <= PEAK_MOVED_MAX:
            largest, slope = slope_at(problem, T, row, theta, t, h, s, w, system, seed)
    if not smooth or not abs(theta - start) <= PEAK_MOVED_MAX or abs(slope) > SLOPE_TOL * steepest:
        if when == now:
            largest = probed(problem, t + h, w.new, row, w, system)
        elif when == value_of(t):
            largest = probed(problem, t, s.y, row, w, system)
        else:
            largest = value_on_plateau(problem, T, row, start, t, h, s, w, system, seed)
    s.peak[row, LARGEST] = largest
