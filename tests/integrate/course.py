"""A course of numbers over time, for what looks inside steps: guards, monitored numbers, powers and signals are polynomials.

The only state is time itself, y' = 1, which every method follows exactly in steps of any length; so each root, maximum,
integral and delayed value has a closed form, and what is measured is how it is found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from tests.library import loop_of

from scissordyn.integrate import advance as loop
from scissordyn.integrate.history import make_history
from scissordyn.integrate.integration import (
    LOG_COLUMNS,
    Integration,
    Samples,
    State,
    Work,
    make_record,
    make_samples,
    make_state,
    make_work,
)
from scissordyn.integrate.tableau import Tableau, tableau
from scissordyn.kernel import F1, F2, I1, Handle, kernel, opener

TERMS = 12  # Coefficients of a polynomial, constant first; the last two are sine and cosine of 40 t, to leave every polynomial

WAVES = 40.0


class Numbers(NamedTuple):
    """Polynomials of guards, monitored rows, powers and signals; the longest step, the modes of guards, looks inside."""

    guards: F2
    rows: F2
    powers: F2
    signals: F2
    longest: F1
    hg: F1
    mode: I1
    refuses: I1
    looks: I1


open_numbers = opener(Numbers)


@kernel
def value_of(c, x):
    """Value of a row of coefficients."""
    found = c[TERMS - 2] * math.sin(WAVES * x) + c[TERMS - 1] * math.cos(WAVES * x)
    for k in range(TERMS - 2):
        found += c[k] * x**k
    return found


@kernel
def slope_of(c, x):
    found = WAVES * (c[TERMS - 2] * math.cos(WAVES * x) - c[TERMS - 1] * math.sin(WAVES * x))
    for k in range(1, TERMS - 2):
        found += k * c[k] * x ** (k - 1)
    return found


@kernel
def rate(t, y, address, dy):
    dy[0] = 1.0


@kernel
def linearise(t, y, address, dy, dt):
    dy[0], dt[0] = 1.0, 0.0


@kernel
def factorize(hg, address):
    open_numbers(address).hg[0] = hg
    return -1


@kernel
def solve(r, address):
    r[0] *= open_numbers(address).hg[0]


@kernel
def accept(t, y, address, answer):
    answer[0], answer[1] = 0.0, open_numbers(address).longest[0]


@kernel
def guards(t, y, address, value, rate):
    c = open_numbers(address).guards
    for k in range(value.size):
        value[k], rate[k] = value_of(c[k], y[0]), slope_of(c[k], y[0])


@kernel
def guard(t, y, k, address, value, rate):
    c = open_numbers(address).guards
    value[k], rate[k] = value_of(c[k], y[0]), slope_of(c[k], y[0])


@kernel
def monitor(t, y, address, power, rows):
    """Powers, and rows: a number, its square and its cube."""
    numbers = open_numbers(address)
    for q in range(power.size):
        power[q] = value_of(numbers.powers[q], y[0])
    for row in range(rows.shape[0]):
        rows[row, 0] = value_of(numbers.rows[row], y[0])
        rows[row, 1] = rows[row, 0] ** 2
        rows[row, 2] = rows[row, 0] ** 3


@kernel
def probe(t, y, row, address, dy, out):
    numbers = open_numbers(address)
    numbers.looks[0] += 1
    out[0] = value_of(numbers.rows[row], y[0])
    out[1] = out[0] ** 2
    out[2] = out[0] ** 3


@kernel
def record(t, y, address, signals):
    """Signals to look back at."""
    c = open_numbers(address).signals
    for k in range(signals.size):
        signals[k] = value_of(c[k], y[0])


@kernel
def reset(t, y, guard, address, data):
    """The other mode, unless the guard refuses: always (1), or what recedes (2)."""
    numbers = open_numbers(address)
    data[0], data[1] = slope_of(numbers.guards[guard], y[0]), t
    recedes = not data[0] > 0.0
    if numbers.refuses[guard] == 1 or (numbers.refuses[guard] == 2 and recedes):
        return False
    numbers.mode[guard] = 1 - numbers.mode[guard]
    return True


def polynomials(*rows: tuple[float, ...]) -> np.ndarray:
    """Rows of coefficients, filled up with zeros; a row of TERMS numbers has its waves, too."""
    table = np.zeros((len(rows), TERMS))
    for k, row in enumerate(rows):
        table[k, : len(row)] = row
    return table


NONE = polynomials()


def waves(sine: float = 0.0, cosine: float = 0.0, *rest: float) -> tuple[float, ...]:
    """A sine and a cosine of 40 t beside a polynomial."""
    return (*rest, *[0.0] * (TERMS - 2 - len(rest)), sine, cosine)


@dataclass
class Course:
    """What a run left."""

    method: Tableau
    state: State
    work: Work
    out: Samples
    log: np.ndarray
    ends: np.ndarray
    status: int
    handle: Handle


def run(
    name: str,
    until: float,
    *,
    guards_: np.ndarray = NONE,
    rows: np.ndarray = NONE,
    powers: np.ndarray = NONE,
    signals: np.ndarray = NONE,
    step: float = math.inf,
    first: float = 0.0,
    samples: int = 2,
    band: tuple[float, ...] | None = None,
    modes: tuple[int, ...] = (),
    refuses: tuple[int, ...] = (),
    crosses: bool = False,
    monitors: bool = True,
    delays: tuple[float, ...] = (),
    precision: float = 1e-13,
    log_rows: int = 200,
    recorded: int = 2000,
    history: int = 400,
    reads: tuple[np.ndarray, np.ndarray] | None = None,
) -> Course:
    """Advance the course; guards come with a monitored row each, the rows beyond are monitored throughout."""
    count, method = len(guards_), tableau(name)
    mode = np.array(modes or (0,) * count, np.int64)
    everything = np.vstack([guards_, rows]) if len(rows) else guards_.copy()
    refused = np.array(refuses or (0,) * count, np.int64)
    tables = guards_.copy(), everything, powers.copy(), signals.copy()
    handle = Handle(Numbers(*tables, np.array([step]), np.zeros(1), mode, refused, np.zeros(1, np.int64)))
    functions = {"rate": rate, "linearise": linearise, "factorize": factorize, "solve": solve, "accept": accept}
    functions |= {"guards": guards, "guard": guard, "reset": reset, "monitor": monitor, "probe": probe, "record": record}
    state = make_state(
        np.zeros(1),
        mode=mode,
        memory=np.zeros(count),
        reference=np.zeros(0),
        quadratures=len(powers),
        monitors=len(rows),
        band=None if band is None else np.array(band),
        history=make_history(len(signals) if delays else 0, history if delays else 0),
        history_length=np.zeros(1, np.int64),
    )
    work = make_work(
        state,
        method,
        atol=np.full(1, 1e-9),
        rtol=np.full(1, 1e-9),
        group=np.array([0, 1], np.int64),
        precision=np.full(count, precision),
        crossable=np.ones(count, np.int64),
        reads=reads,
        delays=delays,
    )
    state.clock["end"], state.clock["longest"], state.clock["crosses"] = until, step, int(crosses)
    state.clock["monitors"] = int(monitors)
    if first:
        state.clock["first"] = state.clock["step"] = first
    out, log = make_samples(np.linspace(0.0, until, samples), state), np.zeros((log_rows, LOG_COLUMNS))
    whole = Handle(Integration(method, state, work, out, make_record(recorded, state), log))
    status = np.array([loop.ADVANCING])
    for _ in range(400):
        loop_of(functions)(np.array([handle.address]), np.array([whole.address]), 100, status)
        if status[0] != loop.ADVANCING:
            break
    counts = state.counts[0]
    ends = whole.content.steps.time[: counts["recorded"]]
    return Course(method, state, work, out, log[: counts["events"]], ends, int(status[0]), handle)
