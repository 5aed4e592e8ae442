"""Problems that have nothing to do with mechanisms, and a run of one of them: for the tests of the integrators."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from tests.library import loop_of

from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import (
    LOG_COLUMNS,
    Integration,
    make_record,
    make_samples,
    make_state,
    make_work,
)
from scissordyn.integrate.tableau import tableau
from scissordyn.kernel import F1, F2, Handle, kernel, opener


class Numbers(NamedTuple):
    """What the problems below work on."""

    jacobian: F2
    matrix: F2
    restitution: F1
    longest: F1


open_numbers = opener(Numbers)


@kernel
def oscillation(t, y, address, dy):
    """A driven pendulum, which has no closed form, and beside it one stiff state that follows cos t."""
    dy[0] = y[1]
    dy[1] = -math.sin(y[0]) + 0.3 * math.sin(2.0 * t)
    dy[2] = -1e3 * (y[2] - math.cos(t)) - math.sin(t)


@kernel
def oscillation_slopes(t, y, address, dy, dt):
    """The same with its Jacobian."""
    numbers = open_numbers(address)
    oscillation(t, y, address, dy)
    dt[0] = 0.0
    dt[1] = 0.6 * math.cos(2.0 * t)
    dt[2] = -1e3 * math.sin(t) - math.cos(t)
    numbers.jacobian[:, :] = 0.0
    numbers.jacobian[0, 1] = 1.0
    numbers.jacobian[1, 0] = -math.cos(y[0])
    numbers.jacobian[2, 2] = -1e3


@kernel
def factorize(hg, address):
    """W = 1/hg - J."""
    numbers = open_numbers(address)
    for i in range(3):
        for j in range(3):
            numbers.matrix[i, j] = (1.0 / hg if i == j else 0.0) - numbers.jacobian[i, j]
    return -1


@kernel
def solve(r, address):
    """The blocks (0, 1) and (2) are independent."""
    m = open_numbers(address).matrix
    determinant = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    first = (m[1, 1] * r[0] - m[0, 1] * r[1]) / determinant
    r[1] = (m[0, 0] * r[1] - m[1, 0] * r[0]) / determinant
    r[0] = first
    r[2] /= m[2, 2]


@kernel
def pendulum(t, y, address, dy):
    """The driven pendulum alone."""
    oscillation(t, y, address, dy)
    dy[2] = 0.0


@kernel
def pendulum_slopes(t, y, address, dy, dt):
    """The same with its Jacobian."""
    oscillation_slopes(t, y, address, dy, dt)
    dy[2] = dt[2] = 0.0
    open_numbers(address).jacobian[2, 2] = 0.0


@kernel
def fall(t, y, address, dy):
    """A ball under unit gravity; the third state stays."""
    dy[0] = y[1]
    dy[1] = -1.0
    dy[2] = 0.0


@kernel
def fall_slopes(t, y, address, dy, dt):
    """The same with its Jacobian."""
    numbers = open_numbers(address)
    fall(t, y, address, dy)
    dt[:] = 0.0
    numbers.jacobian[:, :] = 0.0
    numbers.jacobian[0, 1] = 1.0


@kernel
def stay(t, y, address, answer):
    """No manifold to return to; steps of any length, or of one that is asked for."""
    answer[0], answer[1] = 0.0, open_numbers(address).longest[0]


@kernel
def height(t, y, address, value, rate):
    """Rises through zero when the ball reaches the floor."""
    if value.size > 0:
        value[0], rate[0] = -y[0], -y[1]


@kernel
def own_height(t, y, k, address, value, rate):
    """The same for one guard."""
    height(t, y, address, value, rate)


@kernel
def bounce(t, y, guard, address, data):
    """Newton's restitution."""
    data[0] = y[1]
    y[1] *= -open_numbers(address).restitution[0]
    return True


@kernel
def energies(t, y, address, power, rows):
    """The ball's speed squared to integrate, its height to monitor throughout."""
    power[0] = y[1] * y[1]
    last = rows.shape[0] - 1
    rows[last, 0], rows[last, 1] = y[0], y[1] * y[1]


@kernel
def own_energy(t, y, row, address, dy, out):
    """The height alone, which is the last row."""
    out[:] = 0.0
    out[0], out[1] = y[0], y[1] * y[1]


@kernel
def forget(t, y, address, signals):
    """Nothing to look back at."""


def run(name, rate, linearise, start, until, tolerance, samples, *, floor, step=math.inf, band=math.inf):
    """Advance one of the problems; returns samples, log and the state at the end."""
    numbers = Numbers(np.zeros((3, 3)), np.zeros((3, 3)), np.array([0.8]), np.array([step]))
    handle, method = Handle(numbers), tableau(name)
    functions = {"rate": rate, "linearise": linearise, "factorize": factorize, "solve": solve, "accept": stay}
    functions |= {"guards": height, "guard": own_height, "reset": bounce}
    problem = loop_of({**functions, "monitor": energies, "probe": own_energy, "record": forget})
    guards = 1 if floor else 0
    state = make_state(
        np.array(start),
        mode=np.zeros(guards, np.int64),
        memory=np.zeros(guards),
        reference=np.zeros(0),
        quadratures=1,
        monitors=1,
        band=np.array([band]),
    )
    work = make_work(
        state,
        method,
        atol=np.full(3, tolerance),
        rtol=np.full(3, tolerance),
        group=np.array([0, 1, 2, 3], np.int64),
        precision=np.full(guards, 1e-13),
        crossable=np.zeros(guards, np.int64),
    )
    state.clock["end"], state.clock["longest"] = until, step
    if math.isfinite(step):
        state.clock["first"] = state.clock["step"] = step
    out = make_samples(np.linspace(0.0, until, samples), state)
    log = np.zeros((100, LOG_COLUMNS))
    whole = Handle(Integration(method, state, work, out, make_record(0, state), log))
    status = np.array([loop.ADVANCING])
    while status[0] == loop.ADVANCING:
        problem(np.array([handle.address]), np.array([whole.address]), 10000, status)
    assert status[0] == loop.FINISHED
    return out, log[: state.counts["events"][0]], state
