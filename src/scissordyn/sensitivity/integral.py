"""Integrate powers and monitored values over a step in dual numbers."""

from __future__ import annotations

from scissordyn.integrate.dense import complete, step_integral
from scissordyn.integrate.integration import INTEGRAL
from scissordyn.integrate.monitor import is_monitored
from scissordyn.integrate.step import speed
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.interpolation import gauss_rule
from scissordyn.kernel import kernel
from scissordyn.sensitivity.reversal import END, INSTANT, START, rates_inside, reversal

NODES, WEIGHTS = gauss_rule(8)  # nodes of a piece, enough for the order of the dense output


@kernel
def add_integrals(T, h, s, w):
    """Add the integrals of powers and monitored values over a step, with the weights of its stages or of Gauss nodes."""
    explicit = T.kind == EXPLICIT
    for k in range(T.stages if explicit else T.gauss.size):
        add_monitored(h * (T.a[T.stages, k] * speed(w.scaling[0], T.nodes[k]) if explicit else T.weight[k]), k, s, w)
    for q in range(s.total.size):
        s.total[q] += step_integral(T, h, w, q)


@kernel
def add_monitored(weight, point, s, w):
    """Add the monitored values at a point of a step, times a weight, to their integrals."""
    for row in range(s.peak.shape[0]):
        if is_monitored(row, s):
            for q in range(w.monitored.shape[2]):
                s.peak[row, INTEGRAL + q] += weight * w.monitored[point, row, q]


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
def add_piece(problem, T, first, last, t, h, s, w, system):
    """Add the integrals of powers and monitored values between two stretched times of a step."""
    for node in range(NODES.size):
        theta = first + NODES[node] * (last - first)
        now = rates_inside(problem, T, theta, t, h, s, w, system)
        problem.monitor(now, w.inside, system, w.power[0], w.monitored[0])
        weight = WEIGHTS[node] * (last - first) * speed(w.scaling[0], theta) * h
        add_monitored(weight, 0, s, w)
        for q in range(s.total.size):
            s.total[q] += weight * w.power[0, q]
