"""Store the signals that a problem reads with a delay, as polynomials over the steps made.

A row of the history is a step: its start, its size, then for each signal the coefficients of its polynomial in s = -1 .. 1, in
ascending order. The polynomial interpolates the signal at the Chebyshev points of the dense output, including both ends.
"""

from __future__ import annotations

import math

import numpy as np

from scissordyn.integrate.dense import dense_value
from scissordyn.integrate.step import place
from scissordyn.interpolation import lagrange_polynomials
from scissordyn.kernel import kernel

SIGNAL_COEFFICIENTS = 8  # Number of coefficients of a recorded signal in each step: dense output has at most degree seven

_INNER = (0.2225209339563144, 0.6234898018587335, 0.9009688679024191)  # cos(k pi/7), k = 3, 2, 1

# Chebyshev-Lobatto nodes of a step on -1 .. 1, at which recorded signals are evaluated
CHEBYSHEV_NODES: np.ndarray = np.array((-1.0, *(-x for x in reversed(_INNER)), *_INNER, 1.0))
TRANSFORM: np.ndarray = np.array(lagrange_polynomials(CHEBYSHEV_NODES), float).T.copy()
"""Matrix from values of a signal at `CHEBYSHEV_NODES` to its coefficients; its condition number is about a thousand."""


def make_history(signals: int, steps: int = 4096) -> np.ndarray:
    return np.zeros((steps, 2 + SIGNAL_COEFFICIENTS * signals))


@kernel
def up_to_multiple(t, h, delays):
    """Return a step size of at most h that does not pass a multiple of a delay.

    A step then never reads its own signals. The start makes a kink in a derivative that returns after every delay, and no
    polynomial contains such a kink.
    """
    for k in range(delays.size):
        rest = delays[k] * (math.floor(t / delays[k]) + 1.0) - t
        if rest < 1e-9 * delays[k]:  # t is a multiple within round-off
            rest += delays[k]
        h = min(h, rest)
    return h


@kernel
def keep_history(record, T, t, h, s, w, S):
    """Add the step just made, of size h from t, to the history."""
    if not h > 0.0:
        return
    for node in range(CHEBYSHEV_NODES.size):
        part = 0.5 * (1.0 + CHEBYSHEV_NODES[node])
        dense_value(place(w.scaling[0], part), T.pattern, s.y, w.dense, w.inside)
        record(t + part * h, w.inside, S, w.signals[node])
    keep_values(t, h, s, w)


@kernel
def keep_values(t, h, s, w):
    """Add the polynomials through `Work.signals` to the history, for a step of size h from t."""
    row = s.history[s.history_length[0]]
    row[0], row[1] = t, h
    for signal in range(w.signals.shape[1]):
        for k in range(CHEBYSHEV_NODES.size):
            total = 0.0
            for node in range(CHEBYSHEV_NODES.size):
                total += TRANSFORM[k, node] * w.signals[node, signal]
            row[2 + signal * CHEBYSHEV_NODES.size + k] = total
    s.history_length[0] += 1
