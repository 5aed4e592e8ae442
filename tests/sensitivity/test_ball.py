"""A bouncing ball, whose derivatives have closed forms: steps repeated in dual numbers across events with velocity jumps."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np
import pytest

from scissordyn.compiler.c import load_source
from scissordyn.compiler.unit import Unit
from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import LOG_COLUMNS, Integration, Problem, make_record, make_samples, make_state, make_work
from scissordyn.integrate.method import METHODS, tableau
from scissordyn.integrate.tableau import EXPLICIT, Tableau
from scissordyn.kernel import F1, I1, Entry, Handle, kernel, opener
from scissordyn.sensitivity.replay import FOLLOWED, Replayed, Watched, follow_step
from scissordyn.sensitivity.twin import Twin


class Ball(NamedTuple):
    """Gravity, restitution, and h gamma of a Rosenbrock step."""

    numbers: F1
    mode: I1


open_ball = opener(Ball)


@kernel
def rate(t, y, address, dy):
    dy[0], dy[1] = y[1], -open_ball(address).numbers[0]


@kernel
def accept(t, y, address, answer):
    answer[0], answer[1] = 0.0, 0.1


@kernel
def guards(t, y, address, value, rate):
    value[0], rate[0] = -y[0], -y[1]


@kernel
def guard(t, y, k, address, value, rate):
    value[0], rate[0] = -y[0], -y[1]


@kernel
def reset(t, y, guard, address, data):
    data[0] = -y[1]
    y[1] = -open_ball(address).numbers[1] * y[1]
    return True


@kernel
def factorize(hg, address):
    open_ball(address).numbers[2] = hg
    return -1


@kernel
def solve(r, address):
    hg = open_ball(address).numbers[2]
    r[1] = hg * r[1]
    r[0] = hg * (r[0] + r[1])


@kernel
def linearise(t, y, address, dy, dt):
    rate(t, y, address, dy)
    dt[0] = dt[1] = 0.0


@kernel
def monitor(t, y, address, power, rows):
    pass


@kernel
def probe(t, y, row, address, dy, out):
    pass


@kernel
def record(t, y, address, signals):
    pass


@kernel
def forget(address):
    pass


@kernel
def no_break(now, address):
    return float("nan")


@kernel
def sliding(address, target):
    pass


# Functions of a bouncing ball that the integrator calls
PROBLEM = Problem(rate, linearise, factorize, solve, accept, guards, guard, reset, monitor, probe, record)
# Functions of a bouncing ball that the repetition in dual numbers calls
REPLAYED = Replayed(
    rate, linearise, factorize, solve, guards, accept, reset, monitor, probe, record, forget, no_break, sliding, forget
)


def step(ball: int, address: int) -> int:
    """Advance the ball by one step in double precision."""
    return loop.advance(PROBLEM, ball, address, 1)


def repeat(watched: int, address: int, ball: int, seed: F1) -> int:
    """Return the same step in dual numbers."""
    return follow_step(REPLAYED, watched, address, ball, seed)


def compiled(function: object, **options: object) -> ctypes._CFuncPtr:
    unit, entry = Unit(**options), Entry(function)
    unit.entry(entry)
    found = getattr(load_source(unit.text(), "-O0"), entry.symbol)
    found.restype = ctypes.c_int64
    return found


@pytest.mark.parametrize("name", METHODS)
def test_a_bouncing_ball(name):
    """Closed form: height after three bounces, and its derivatives by height, speed, gravity and restitution at the start."""
    ball = Handle(Ball(np.array([10.0, 0.8, 0.0]), np.zeros(1, np.int64)))
    rows = {"memory": np.zeros(1), "mass": np.zeros(1), "reference": np.zeros(0), "history": np.zeros((0, 2))}
    state = make_state(
        np.array([5.0, -0.1]), quadratures=0, monitors=0, mode=ball.content.mode, history_length=np.zeros(1, np.int64), **rows
    )
    method = tableau(name)
    weights = {"atol": np.full(2, 1e-12), "rtol": np.zeros(2), "group": np.array([0, 2])}
    work = make_work(state, method, precision=np.full(1, 1e-14), crossable=np.zeros(1, np.int64), **weights)
    content = Integration(
        method, state, work, make_samples(np.zeros(0), state), make_record(0, state), np.zeros((50, LOG_COLUMNS))
    )
    state.clock["monitors"], state.clock["end"] = 0, 1.9
    integration, twin = Handle(content), Twin((Tableau, Watched), {})
    dual_ball, dual = twin.address(ball.content), twin.address(content)
    misfit, control = np.zeros(1), (np.array([4]), np.array([1e-9, 0.0]), np.zeros(1, np.int64), np.ones(1, np.int64))
    integrals = np.zeros((0, 3), np.int64), np.zeros(1, np.int64), np.zeros((0, 4))
    gaps = np.zeros((1, 8)), np.zeros((1, 4)), np.ones(1, np.int64)
    unwatched = np.zeros(1), *gaps, np.zeros((2, 0)), np.zeros(1), np.zeros((3, 4))
    parts = state.clock, state.counts, state.y, state.mode, state.memory, state.mass, state.reference
    watched = Watched(
        *parts,
        work.scaling,
        work.slope,
        state.peak,
        content.log,
        np.zeros(0, np.int64),
        misfit,
        *control,
        *integrals,
        *unwatched,
    )
    watching, seed = twin.address(watched), np.zeros((1, 9))
    twin.copy_of(state.y)[0, 1], twin.copy_of(state.y)[1, 2] = 1.0, 1.0
    twin.copy_of(ball.content.numbers)[0, 3], twin.copy_of(ball.content.numbers)[1, 4] = 1.0, 1.0
    advance, again = compiled(step), compiled(repeat, derivatives=8, doubles=(Tableau, Watched))
    again.argtypes = [ctypes.c_int64] * 3 + [ctypes.c_void_p, ctypes.c_int64]
    advance.argtypes = [ctypes.c_int64] * 2
    status = loop.ADVANCING
    while status == loop.ADVANCING:
        status = advance(ball.address, integration.address)
        assert again(watching, dual, dual_ball, seed.ctypes.data, 1) == FOLLOWED
    assert status == loop.FINISHED
    assert int(state.counts["events"][0]) == 1
    assert misfit[0] < (1e-14 if method.kind == EXPLICIT else 1e-13)
    assert state.y[0] == pytest.approx(3.13991895702715, abs=1e-12)
    exact = [0.837828112891426, 0.101531721120973, -0.103906843531788, 9.09995497612619]
    assert twin.copy_of(state.y)[0, 1:5] == pytest.approx(exact, abs=1e-11)
    # z0 + v0 t - g t^2 / 2 = 0
    time, (z, v, g) = content.log[0, 0], (5.0, -0.1, 10.0)
    fall = g * time - v
    assert twin.copy_of(content.log)[0, 0, 1:5] == pytest.approx([1 / fall, time / fall, -0.5 * time**2 / fall, 0.0], abs=1e-13)
    assert z + v * time - 0.5 * g * time**2 == pytest.approx(0.0, abs=1e-13)
