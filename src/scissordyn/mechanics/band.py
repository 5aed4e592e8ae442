"""Banded linear equations, by elimination with or without row exchanges. A full matrix is a wide band.

Entry (i, j) of the matrix is ``band[i, j - i + lower]``. Row exchanges fill up to `lower` further columns on the right. Without
exchanges the elimination takes half as many operations and starts at the first row that has changed since the last call.
"""

from __future__ import annotations

from scissordyn.kernel import equals, kernel
from scissordyn.mechanics.lanes import BAND_LANES, row_times, take_row


def width(lower: int, upper: int) -> int:
    """Return the number of columns of the band array for `lower` and `upper` off-diagonals."""
    return 2 * lower + upper + BAND_LANES


@kernel
def factorize(band, lower, upper, pivots):
    """Factorize a banded matrix in place, with row exchanges; return the row of a zero pivot, or -1.

    `pivots` receives the row exchanged with each row, then the last column of each row.
    """
    size, reached = band.shape[0], 0
    for i in range(size):
        last_row = min(i + lower, size - 1)
        best, largest = i, abs(band[i, lower])
        for r in range(i + 1, last_row + 1):
            value = abs(band[r, i - r + lower])
            if value > largest:
                best, largest = r, value
        # the row that is exchanged to this place has entries up to this column
        reached = max(reached, min(best + upper, size - 1))
        pivots[i], pivots[size + i] = best, reached
        if not largest > 0.0:  # NaN counts as zero
            return i
        if best != i:
            for j in range(i, reached + 1):
                here, there = j - i + lower, j - best + lower
                band[i, here], band[best, there] = band[best, there], band[i, here]
        inverse = 1.0 / band[i, lower]
        for r in range(i + 1, last_row + 1):
            factor = band[r, i - r + lower] * inverse
            band[r, i - r + lower] = factor
            if not equals(factor, 0.0):
                take_row(band, r, i + 1 - r + lower, i, lower + 1, factor, reached - i)
    return -1


@kernel
def solve(band, lower, pivots, x):
    """Overwrite the right-hand side x with the solution, using a factorized band."""
    size = band.shape[0]
    for i in range(size):
        p = pivots[i]
        if p != i:
            x[i], x[p] = x[p], x[i]
        value = x[i]
        for r in range(i + 1, min(i + lower, size - 1) + 1):
            x[r] -= band[r, i - r + lower] * value
    for i in range(size - 1, -1, -1):
        total, shift = x[i], lower - i
        for j in range(i + 1, pivots[size + i] + 1):
            total -= band[i, j + shift] * x[j]
        x[i] = total / band[i, lower]


@kernel
def eliminate(band, reach, first, x):
    """Bring a matrix and its right-hand side x to upper triangular form without row exchanges.

    Return the row of a zero pivot, or -1. `reach` is the half bandwidth. Rows before `first` must be those of the last call.
    Rows from `first` on contain the matrix, with zeros outside its band.
    """
    size = band.shape[0]
    for k in range(max(0, first - reach), size):
        pivot = band[k, reach]
        if not abs(pivot) > 0.0:
            return k
        inverse = 1.0 / pivot
        for r in range(max(first, k + 1), min(k + reach, size - 1) + 1):
            factor = band[r, k - r + reach] * inverse
            if not equals(factor, 0.0):
                take_row(band, r, k + 1 - r + reach, k, reach + 1, factor, reach)
                x[r] -= factor * x[k]
    return -1


@kernel
def substitute(band, reach, x, solution):
    """Write the solution of the triangular equations that `eliminate` has left in `band` and x."""
    size = band.shape[0]
    for i in range(size - 1, -1, -1):
        solution[i] = (x[i] - row_times(band, i, reach + 1, solution, i + 1, min(reach, size - 1 - i))) / band[i, reach]


@kernel
def product(band, reach, row, vector):
    """Return the product of a row of a banded matrix and a vector."""
    first = max(0, row - reach)
    return row_times(band, row, first - row + reach, vector, first, min(vector.size, row + reach + 1) - first)
