"""Gauss quadrature of elastic forces: its nodes, and the energy of a law that has only a force kernel."""

from __future__ import annotations

from scissordyn.interpolation import gauss_rule
from scissordyn.kernel import call_at, kernel
from scissordyn.tolerance import CONVERGENCE_TOL

NODES, WEIGHTS = gauss_rule(16)
"""Gauss's rule of 16 points on [0, 1]. With delta = d s^2 the powers 3/2, 10/9 and 1 of delta become smooth in s."""

LEVEL_MAX = 40  # Largest number of bisections of a quadrature interval; the smallest is 2^-40 of the range
PIECES_MAX = 4000  # Largest number of quadrature intervals of a law


@kernel
def piece(pointer, low, high, delta, p):
    """Return the integral of a force over s in [low, high], per unit of delta."""
    total = 0.0
    for k in range(NODES.size):
        s = low + (high - low) * NODES[k]
        total += WEIGHTS[k] * call_at(pointer, (delta * s * s,), (), (), (), p, ()) * 2.0 * s
    return total * (high - low)


@kernel
def quadrature_energy(pointer, delta, p):
    """Return the work [J] of an elastic force up to delta [m], by bisection where the force has kinks.

    The intervals are [k, k + 1]/2^level. After one is done, the next begins at the end of the largest interval that it
    completes.
    """
    tolerance = CONVERGENCE_TOL * abs(piece(pointer, 0.0, 1.0, delta, p))
    total, level, k, count = 0.0, 0, 0, 0
    while True:
        width = 0.5**level
        low = k * width
        whole = piece(pointer, low, low + width, delta, p)
        halves = piece(pointer, low, low + 0.5 * width, delta, p) + piece(pointer, low + 0.5 * width, low + width, delta, p)
        count += 1
        # a NaN compares as false and ends the halving
        if abs(halves - whole) > tolerance and level < LEVEL_MAX and count < PIECES_MAX:
            level += 1
            k *= 2
            continue
        total += halves
        k += 1
        while level > 0 and k % 2 == 0:
            k //= 2
            level -= 1
        if level == 0:
            return total * delta
