"""Find steps in which a sliding reverses, where friction has a kink, and the instants of reversals."""

from __future__ import annotations

from scissordyn.integrate.dense import complete, dense_value
from scissordyn.integrate.step import fraction
from scissordyn.kernel import kernel, value_of
from scissordyn.mechanics.system import open_system

START, END, INSIDE, INSTANT = range(4)
"""Rows of `Watched.speed`: speeds at the start, at the end and inside a step, and the stretched time of their reversals."""


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
def reversal(problem, T, k, t, h, speeds, s, w, system):
    """Return the stretched time (0 to 1) at which a speed reverses within a step, by the Illinois method."""
    evaluations = 8
    older, at_older, newer, at_newer = 0.0, speeds[START, k], 1.0, speeds[END, k]
    for _ in range(evaluations):
        theta = (older * at_newer - newer * at_older) / (at_newer - at_older)
        rates_inside(problem, T, theta, t, h, s, w, system)
        problem.sliding(system, speeds[INSIDE])
        if speeds[INSIDE, k] == 0.0:
            return theta
        if speeds[INSIDE, k] * at_newer < 0.0:
            older, at_older = newer, at_newer
        else:
            at_older = 0.5 * at_older
        newer, at_newer = theta, speeds[INSIDE, k]
    return newer


@kernel
def first_reversal(problem, T, t, h, speeds, s, w, system):
    """Return the time from the start of a step to the first reversal of a speed."""
    complete(problem, T, t, h, s, w, system)
    problem.forget(system)
    first = 1.0
    for k in range(speeds.shape[1]):
        if speeds[START, k] * speeds[END, k] < 0.0:
            first = min(first, reversal(problem, T, k, t, h, speeds, s, w, system))
    problem.forget(system)
    return fraction(w.scaling[0], first) * value_of(h)


@kernel
def rates_inside(problem, T, theta, t, h, s, w, system):
    """Evaluate the rates at a stretched time of a step, from the dense output; return the instant."""
    now = t + fraction(w.scaling[0], theta) * h
    dense_value(theta, T.pattern, s.y, w.dense, w.inside)
    problem.rate(now, w.inside, system, w.saved)
    return now
