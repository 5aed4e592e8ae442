"""Test problem for searches inside steps: guards, monitored numbers, powers and signals are polynomials of time.

The only state is time itself, y' = 1, which every method follows exactly in steps of any length; so each root, maximum,
integral and delayed value has a closed form, and what is measured is how it is found.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from following import Followed, follow

from scissordyn.kernel import F1, F2, I1, kernel, opener

# Number of coefficients of a function: powers in ascending order, then sine and cosine of 40 t, which no polynomial contains
TERMS = 12

WAVES = 40.0  # [rad per unit of x] angular frequency of the sine and cosine terms


class Numbers(NamedTuple):
    """Polynomials of guards, monitored rows, powers and signals, with the largest step size and the modes of guards."""

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
    """Return the value at x of the polynomial with the coefficients c."""
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
    """Compute the powers, and the monitored rows: a number, its square and its cube."""
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
    """Compute the signals that are recorded for delays."""
    c = open_numbers(address).signals
    for k in range(signals.size):
        signals[k] = value_of(c[k], y[0])


@kernel
def reset(t, y, guard, address, data):
    """Change the mode of a guard, unless the guard refuses: 1 refuses always, 2 refuses receding motion."""
    numbers = open_numbers(address)
    data[0], data[1] = slope_of(numbers.guards[guard], y[0]), t
    recedes = not data[0] > 0.0
    if numbers.refuses[guard] == 1 or (numbers.refuses[guard] == 2 and recedes):
        return False
    numbers.mode[guard] = 1 - numbers.mode[guard]
    return True


def polynomials(*rows: tuple[float, ...]) -> np.ndarray:
    """Return rows of coefficients, filled up with zeros; a row of `TERMS` numbers has coefficients of sine and cosine, too."""
    table = np.zeros((len(rows), TERMS))
    for k, row in enumerate(rows):
        table[k, : len(row)] = row
    return table


NONE = polynomials()  # Table without guards


def waves(sine: float = 0.0, cosine: float = 0.0, *rest: float) -> tuple[float, ...]:
    """Return the coefficients of a sine and a cosine of 40 t plus a polynomial."""
    return (*rest, *[0.0] * (TERMS - 2 - len(rest)), sine, cosine)


def run(
    name: str,
    until: float,
    *,
    guards_: np.ndarray = NONE,
    rows: np.ndarray = NONE,
    powers: np.ndarray = NONE,
    signals: np.ndarray = NONE,
    step: float = math.inf,
    band: tuple[float, ...] | None = None,
    modes: tuple[int, ...] = (),
    refuses: tuple[int, ...] = (),
    delays: tuple[float, ...] = (),
    **options: Any,
) -> Followed:
    """Integrate the problem; each guard has a monitored row, and further rows are monitored at all times."""
    mode, refused = (np.array(given or (0,) * len(guards_), np.int64) for given in (modes, refuses))
    everything = np.vstack([guards_, rows]) if len(rows) else guards_.copy()
    tables = guards_.copy(), everything, powers.copy(), signals.copy()
    return follow(
        globals(),
        Numbers(*tables, np.array([step]), np.zeros(1), mode, refused, np.zeros(1, np.int64)),
        name,
        (0.0,),
        until,
        quadratures=len(powers),
        rows=len(rows),
        band=None if band is None else np.array(band),
        signals=len(signals) if delays else 0,
        **{"rtol": 1e-9, "atol": 1e-9, "step": step, "delays": delays, "most_steps": 100, "pieces": 400} | options,
    )
