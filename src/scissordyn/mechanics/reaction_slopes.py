"""Derivatives of the reactions that friction depends on by the state, for the matrix of implicit steps.

With N_k the reactions and u_k the rates per unit N_k, the matrix is W - sum_k u_k dN_k/dy, with W the matrix for constant
reactions. W stays banded; by Woodbury's formula

    x = W^-1 r + P (1 - V P)^-1 V W^-1 r,    P = W^-1 U,    V = dN/dy.

V is computed by central differences: a reaction depends on the whole state.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics import band, step_matrix
from scissordyn.mechanics.component import ARGUMENT_STEP
from scissordyn.mechanics.equations import accelerate
from scissordyn.tolerance import DIFFERENCE_FRACTION

STATE_STEP_MIN = 1e-11  # [m] step of a difference of reactions by an internal state whose `state_scale` is zero


@kernel
def write_slopes(t, y, S):
    """Write the derivatives of the reactions by state and time."""
    R, n = S.friction, S.model.n
    f, states = R.by_state.shape[0], R.rates.size
    for i in range(states + 1):
        here = t if i == states else y[i]
        least = ARGUMENT_STEP
        if 2 * n <= i < states:  # the scale of contact bristles is that of their law
            least = max(DIFFERENCE_FRACTION * S.parameters.state_scale[i - 2 * n], STATE_STEP_MIN)
        h = max(ARGUMENT_STEP * abs(here), least)
        for side in range(2):
            moved = here + h if side == 0 else here - h
            if i < states:
                y[i] = moved
            accelerate(moved if i == states else t, y, S, R.rates)
            for k in range(f):
                if side == 0:
                    R.upper[k] = R.size[k]
                    continue
                slope = (R.upper[k] - R.size[k]) / (2.0 * h)
                if not abs(slope) < math.inf:  # the mechanism jams close to the state
                    slope = 0.0
                if i == states:
                    R.by_time[k] = slope
                else:
                    R.by_state[k, i] = slope
        if i < states:
            y[i] = here


@kernel
def add_time_slopes(S, dt):
    """Add the effect of reactions' time derivatives to dt; `accelerate` must have been called for the state."""
    R, n = S.friction, S.model.n
    for k in range(R.by_state.shape[0]):
        for i in range(n):
            R.frozen[k, i] = R.response[k, i]
            dt[n + i] += R.frozen[k, i] * R.by_time[k]


@kernel
def factorize(hg, S):
    """Factorize the matrix of a step for `solve`; return a singular row, or -1."""
    R = S.friction
    singular = step_matrix.factorize(hg, S)
    if singular >= 0 or R.rates.size == 0:
        return singular
    f, n, states = R.by_state.shape[0], S.model.n, R.rates.size
    R.share[:, :] = 0.0
    for k in range(f):
        for i in range(states):
            R.rates[i] = R.frozen[k, i - n] if n <= i < 2 * n else 0.0
        step_matrix.solve(R.rates, S)
        for i in range(states):
            R.solved[k, i] = R.rates[i]
        for j in range(f):
            total = 1.0 if j == k else 0.0
            for i in range(states):
                total -= R.by_state[j, i] * R.rates[i]
            R.share[j, k - j + f - 1] = total
    return band.factorize(R.share, f - 1, f - 1, R.share_pivots)


@kernel
def solve(r, S):
    """Overwrite r with the inverse of the matrix times r."""
    R = S.friction
    step_matrix.solve(r, S)
    if R.rates.size == 0:
        return
    f, states = R.by_state.shape[0], R.rates.size
    for k in range(f):
        total = 0.0
        for i in range(states):
            total += R.by_state[k, i] * r[i]
        R.upper[k] = total
    band.solve(R.share, f - 1, R.share_pivots, R.upper)
    for k in range(f):
        for i in range(states):
            r[i] += R.upper[k] * R.solved[k, i]
