"""Banded linear equations: elimination with row exchanges in a row-wise band. A full matrix is a wide band.

Entry (i, j) of the matrix stands in ``band[i, j - i + lower]``; row exchanges fill up to `lower` further columns on the right.
"""

from __future__ import annotations

from scissordyn.jit import kernel

__all__ = ["factorize", "solve", "width"]


def width(lower: int, upper: int) -> int:
    """Columns of the band array for `lower` and `upper` off-diagonals."""
    return 2 * lower + upper + 1


@kernel()
def factorize(band, lower, upper, pivots):
    """Factorize in place; writes the row exchanges into `pivots`. Returns the row of a zero pivot, or -1."""
    size = band.shape[0]
    reach = lower + upper
    for i in range(size):
        last_row = min(i + lower, size - 1)
        last_column = min(i + reach, size - 1)
        best, largest = i, abs(band[i, lower])
        for r in range(i + 1, last_row + 1):
            value = abs(band[r, i - r + lower])
            if value > largest:
                best, largest = r, value
        pivots[i] = best
        if not largest > 0.0:  # NaN counts as zero
            return i
        if best != i:
            for j in range(i, last_column + 1):
                here, there = j - i + lower, j - best + lower
                band[i, here], band[best, there] = band[best, there], band[i, here]
        inverse = 1.0 / band[i, lower]
        for r in range(i + 1, last_row + 1):
            shift = lower - r
            factor = band[r, i + shift] * inverse
            band[r, i + shift] = factor
            if factor != 0.0:
                own = lower - i
                for j in range(i + 1, last_column + 1):
                    band[r, j + shift] -= factor * band[i, j + own]
    return -1


@kernel()
def solve(band, lower, upper, pivots, x):
    """Overwrite the right-hand side x with the solution, from a factorized band."""
    size = band.shape[0]
    reach = lower + upper
    for i in range(size):
        p = pivots[i]
        if p != i:
            x[i], x[p] = x[p], x[i]
        value = x[i]
        for r in range(i + 1, min(i + lower, size - 1) + 1):
            x[r] -= band[r, i - r + lower] * value
    for i in range(size - 1, -1, -1):
        total = x[i]
        shift = lower - i
        for j in range(i + 1, min(i + reach, size - 1) + 1):
            total -= band[i, j + shift] * x[j]
        x[i] = total / band[i, lower]
