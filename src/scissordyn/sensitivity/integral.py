"""Integrate powers and monitored values over a step in dual numbers, with control of the errors of their derivatives.

A kink of an integrand, as where the damping of a contact would pull, is a jump of its derivative. The steps of a run do not end
there. Where the error of a derivative is too large, the integrals are computed on the dense output, in parts.
"""

from __future__ import annotations

import math

from scissordyn.integrate.dense import complete, step_integral
from scissordyn.integrate.integration import INTEGRAL
from scissordyn.integrate.monitor import is_monitored
from scissordyn.integrate.step import speed
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import derivative, kernel, value_of
from scissordyn.sensitivity.lobatto import COARSE_WEIGHTS, NODES, WEIGHTS
from scissordyn.sensitivity.part_error import PART_MIN_FRACTION, PARTS_MAX
from scissordyn.sensitivity.reversal import END, INSTANT, START, rates_inside, reversal
from scissordyn.tolerance import ROUND_OFF_TOL

POINT, FINE, COARSE, WHOLE, STAGES = range(5)
"""Rows of powers and monitored values: those at a node, sums of both rules over a part, over the piece, of stages."""


@kernel
def add_integrals(problem, T, t, h, run, s, w, system):
    """Add the integrals of powers and monitored values over a step, in pieces that end where a sliding reverses.

    Products with a force and the amount of a speed are zero there, so that the ends of the pieces need no derivatives.
    """
    speeds, pieces = run.speed, 1
    for k in range(speeds.shape[1]):
        speeds[INSTANT, k] = 1.0
        if speeds[START, k] * speeds[END, k] < 0.0:
            pieces += 1
    if pieces == 1 and T.kind == EXPLICIT and accurate_stages(T, h, run, s, w):
        sum_stages(T, h, s, w)
        add_part(STAGES, s, w)
        return
    complete(problem, T, t, h, s, w, system)
    problem.forget(system)
    if pieces == 1 and T.kind == EXPLICIT:
        sum_stages(T, h, s, w)
        integrate_part(problem, T, 0.0, 1.0, t, h, s, w, system)
        keep_whole(s, w)
        if rule_error(run, s, w) <= 1.0:
            add_part(STAGES, s, w)  # without a kink the stages are more accurate than dense output
            return
    for k in range(speeds.shape[1]):
        if speeds[START, k] * speeds[END, k] < 0.0:
            speeds[INSTANT, k] = reversal(problem, T, k, t, h, speeds, s, w, system)
    first = 0.0
    while first < 1.0:
        last = 1.0
        for k in range(speeds.shape[1]):
            if first < speeds[INSTANT, k] < last:
                last = speeds[INSTANT, k]
        add_piece(problem, T, first, last, t, h, run, s, w, system)
        first = last


@kernel
def accurate_stages(T, h, run, s, w):
    """Return True if the embedded errors of the integrals' derivatives over an explicit step are small enough."""
    floor, scale = energy_floor(s), value_of(h)
    for q in range(s.total.size):
        first = second = 0.0
        for stage in range(T.stages + 1):
            first += T.error[0, stage] * w.power[stage, q]
            second += T.error[T.combined, stage] * w.power[stage, q]
        part = step_integral(T, h, w, q)
        for k in range(run.parameters[0]):
            if not ratio(combined_error(T, scale * first, scale * second, k), k, s.total[q], part, floor, run) <= 1.0:
                return False
    for row in range(s.peak.shape[0]):
        for q in range(w.monitored.shape[2]):
            if not is_used(row, q, run, s):
                continue
            first = second = part = 0.0
            for stage in range(T.stages + 1):
                value = scale * speed(w.scaling[0], T.nodes[stage]) * w.monitored[stage, row, q]
                first += T.error[0, stage] * value
                second += T.error[T.combined, stage] * value
                part += T.a[T.stages, stage] * value
            for k in range(run.parameters[0]):
                if not ratio(combined_error(T, first, second, k), k, s.peak[row, INTEGRAL + q], part, 0.0, run) <= 1.0:
                    return False
    return True


@kernel
def is_used(row, q, run, s):
    """Return whether a measure uses the integral of a monitored value."""
    return run.integrals[row, q] == 1 and is_monitored(row, s)


@kernel
def combined_error(T, first, second, k):
    """Return the error of derivative k from the embedded estimates."""
    error = abs(derivative(first, k))
    if T.combined == 1 and error > 0.0:
        error *= error / math.sqrt(error * error + 0.01 * derivative(second, k) ** 2)
    return error


@kernel
def energy_floor(s):
    """Return the error of an energy that never matters: round-off of a mass that moves by its size in the time of the run."""
    return ROUND_OFF_TOL * value_of(s.clock[0].inertia) / value_of(s.clock[0].end) ** 2


@kernel
def ratio(error, k, total, part, floor, run):
    """Return an error of derivative k divided by the allowed one, which follows from an integral so far and its part."""
    slope, value = abs(derivative(total, k)) + abs(derivative(part, k)), abs(value_of(total)) + abs(value_of(part))
    allowed = run.tolerance[0] * slope + run.tolerance[1] * value + floor
    return error / allowed if error > 0.0 else 0.0


@kernel
def add_piece(problem, T, first, last, t, h, run, s, w, system):
    """Add the integrals between two stretched times of a step, in parts whose derivatives are accurate."""
    shortest = PART_MIN_FRACTION * (last - first)
    size = last - first
    for count in range(PARTS_MAX):
        final = size > last - first - shortest or count == PARTS_MAX - 1
        if final:
            size = last - first
        integrate_part(problem, T, first, size, t, h, s, w, system)
        if count == 0:
            keep_whole(s, w)
        error = rule_error(run, s, w)
        if error > 1.0 and size > shortest and count < PARTS_MAX - 1:
            size *= 0.5
            run.quadrature[0] += 1
            continue
        if error > 1.0 and count == PARTS_MAX - 1:
            keep_errors(run, s, w)
        add_part(FINE, s, w)
        if final:
            return
        first += size
        size *= 2.0


@kernel
def keep_whole(s, w):
    """Keep the integrals over a piece, to which errors of its parts are relative."""
    for q in range(s.total.size):
        w.power[WHOLE, q] = w.power[FINE, q]
    for row in range(s.peak.shape[0]):
        for q in range(w.monitored.shape[2]):
            w.monitored[WHOLE, row, q] = w.monitored[FINE, row, q]


@kernel
def integrate_part(problem, T, first, size, t, h, s, w, system):
    """Integrate powers and monitored values over a part of a step by both rules, from the dense output."""
    for q in range(s.total.size):
        w.power[FINE, q] = w.power[COARSE, q] = 0.0
    for row in range(s.peak.shape[0]):
        for q in range(w.monitored.shape[2]):
            w.monitored[FINE, row, q] = w.monitored[COARSE, row, q] = 0.0
    for node in range(NODES.size):
        theta = first + NODES[node] * size
        now = rates_inside(problem, T, theta, t, h, s, w, system)
        problem.monitor(now, w.inside, system, w.power[POINT], w.monitored[POINT])
        weight = size * speed(w.scaling[0], theta) * h
        fine, coarse = WEIGHTS[node] * weight, COARSE_WEIGHTS[node] * weight
        for q in range(s.total.size):
            w.power[FINE, q] += fine * w.power[POINT, q]
            w.power[COARSE, q] += coarse * w.power[POINT, q]
        for row in range(s.peak.shape[0]):
            if is_monitored(row, s):
                for q in range(w.monitored.shape[2]):
                    w.monitored[FINE, row, q] += fine * w.monitored[POINT, row, q]
                    w.monitored[COARSE, row, q] += coarse * w.monitored[POINT, row, q]


@kernel
def rule_error(run, s, w):
    """Return the largest distance of both rules in the derivatives of integrals over a part, divided by the allowed one."""
    floor, worst = energy_floor(s), 0.0
    for q in range(s.total.size):
        whole, apart = w.power[WHOLE, q], w.power[FINE, q] - w.power[COARSE, q]
        for k in range(run.parameters[0]):
            worst = max(worst, ratio(abs(derivative(apart, k)), k, s.total[q], whole, floor, run))
    for row in range(s.peak.shape[0]):
        for q in range(w.monitored.shape[2]):
            if not is_used(row, q, run, s):
                continue
            whole, apart = w.monitored[WHOLE, row, q], w.monitored[FINE, row, q] - w.monitored[COARSE, row, q]
            for k in range(run.parameters[0]):
                worst = max(worst, ratio(abs(derivative(apart, k)), k, s.peak[row, INTEGRAL + q], whole, 0.0, run))
    return worst


@kernel
def keep_errors(run, s, w):
    """Add the errors of the powers' integrals over a part that are larger than allowed to `run.rough`."""
    floor = energy_floor(s)
    for q in range(s.total.size):
        apart = w.power[FINE, q] - w.power[COARSE, q]
        for k in range(run.parameters[0]):
            error = abs(derivative(apart, k))
            if ratio(error, k, s.total[q], w.power[WHOLE, q], floor, run) > 1.0:
                run.rough[q, k] += error


@kernel
def sum_stages(T, h, s, w):
    """Write the integrals over an explicit step, with the weights of its stages, into the rows `STAGES`."""
    for row in range(s.peak.shape[0]):
        for q in range(w.monitored.shape[2]):
            part = 0.0 * h
            for stage in range(T.stages):
                part += h * T.a[T.stages, stage] * speed(w.scaling[0], T.nodes[stage]) * w.monitored[stage, row, q]
            w.monitored[STAGES, row, q] = part
    for q in range(s.total.size):
        w.power[STAGES, q] = step_integral(T, h, w, q)


@kernel
def add_part(which, s, w):
    """Add the integrals over a part, from the rows `which`."""
    for q in range(s.total.size):
        s.total[q] += w.power[which, q]
    for row in range(s.peak.shape[0]):
        if is_monitored(row, s):
            for q in range(w.monitored.shape[2]):
                s.peak[row, INTEGRAL + q] += w.monitored[which, row, q]
