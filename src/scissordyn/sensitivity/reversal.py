"""Find steps in which a sliding reverses, where friction has a kink, and integrate between the reversals."""

from __future__ import annotations

from scissordyn.integrate.dense import complete, dense_value
from scissordyn.integrate.integration import INTEGRAL
from scissordyn.integrate.monitor import is_monitored
from scissordyn.integrate.step import fraction, speed
from scissordyn.interpolation import gauss_rule
from scissordyn.kernel import kernel, value_of
from scissordyn.mechanics.system import open_system

START, END, INSIDE, INSTANT = range(4)
"""Rows of `Watched.speed`: speeds at the start, at the end and inside a step, and the stretched time of their reversals."""

NODES, WEIGHTS = gauss_rule(8)  # nodes of a piece, enough for the order of the dense output


@kernel
def sliding(system, target):
    """Write the slip speeds of contacts and the rates of components as last evaluated; others for open contacts."""
    S = open_system(system)
    contacts, components = S.work.contact, S.work.coordinate_rates
    for j in range(contacts.size):
        target[j] = value_of(contacts[j].slip)
    for i in range(components.shape[0]):
        for q in range(components.shape[1]):
            target[contacts.size + components.shape[1] * i + q] = value_of(components[i, q])


@kernel
def count_reversals(speeds):
    """Return the number of speeds that have changed their sign over a step."""
    count = 0
    for k in range(speeds.shape[1]):
        if speeds[START, k] * speeds[END, k] < 0.0:
            count += 1
    return count


@kernel
def add_kinked_integrals(problem, T, t, h, speeds, s, w, system):
    """Add the integrals of powers and monitored values over a step, in pieces that end where a sliding reverses.

    Products with a force and the amount of a speed are zero there, so that the ends of the pieces need no derivatives.
    """
    complete(problem, T, t, h, s, w, system)
    problem.forget(system)
    for k in range(speeds.shape[1]):
        speeds[INSTANT, k] = 1.0
        if speeds[START, k] * speeds[END, k] < 0.0:
            speeds[INSTANT, k] = reversal(problem, T, k, t, h, speeds, s, w, system)
    first = 0.0
    while first < 1.0:
        last = 1.0
        for k in range(speeds.shape[1]):
            if first < speeds[INSTANT, k] < last:
                last = speeds[INSTANT, k]
        add_piece(problem, T, first, last, t, h, s, w, system)
        first = last


@kernel
def reversal(problem, T, k, t, h, speeds, s, w, system):
    """Return the stretched time (0 to 1) at which a speed reverses within a step, by the Illinois method."""
    evaluations = 8
    one, at_one, other, at_other = 0.0, speeds[START, k], 1.0, speeds[END, k]
    for _ in range(evaluations):
        theta = (one * at_other - other * at_one) / (at_other - at_one)
        rates_inside(problem, T, theta, t, h, s, w, system)
        problem.sliding(system, speeds[INSIDE])
        if speeds[INSIDE, k] == 0.0:
            return theta
        if speeds[INSIDE, k] * at_other < 0.0:
            one, at_one = other, at_other
        else:
            at_one = 0.5 * at_one
        other, at_other = theta, speeds[INSIDE, k]
    return other


@kernel
def rates_inside(problem, T, theta, t, h, s, w, system):
    """Evaluate the rates at a stretched time of a step, from the dense output; return the instant."""
    now = t + fraction(w.scaling[0], theta) * h
    dense_value(theta, T.pattern, s.y, w.dense, w.inside)
    problem.rate(now, w.inside, system, w.slope)
    return now


@kernel
def add_piece(problem, T, first, last, t, h, s, w, system):
    """Add the integrals of powers and monitored values between two stretched times of a step."""
    for node in range(NODES.size):
        theta = first + NODES[node] * (last - first)
        now = rates_inside(problem, T, theta, t, h, s, w, system)
        problem.monitor(now, w.inside, system, w.power[0], w.monitored[0])
        weight = WEIGHTS[node] * (last - first) * speed(w.scaling[0], theta) * h
        for row in range(s.peak.shape[0]):
            if is_monitored(row, s):
                for q in range(w.monitored.shape[2]):
                    s.peak[row, INTEGRAL + q] += weight * w.monitored[0, row, q]
        for q in range(s.total.size):
            s.total[q] += weight * w.power[0, q]
