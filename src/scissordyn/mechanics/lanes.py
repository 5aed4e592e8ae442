"""Short loops over plane vectors, which the C compiler gives to the processor's vector units."""

from __future__ import annotations

import math

LANES = 8
"""Rows of tables have a whole multiple of so many numbers, which processors take at once."""

PAIRS = LANES // 2
"""Plane vectors whose components fill the lanes."""

SHORT = 4
"""Numbers that rows of a band are taken by."""


def combine(table, first, rows, width, x, y, sx, sy):
    """Write the sums of the rows of a table, each times a vector; its rows have whole lanes and begin at `first`."""
    for column in range(width):
        sx[column] = sy[column] = 0.0
    for row in range(rows):
        for column in range(width):
            sx[column] += table[first + row * width + column] * x[row]
            sy[column] += table[first + row * width + column] * y[row]


def transform(table, first, rows, width, x, sx):
    """Write the sums of the rows of a table, each times a number; an even number of rows, which have whole lanes."""
    for column in range(width):
        sx[column] = 0.0
    for row in range(rows):
        for column in range(width):
            sx[column] += table[first + row * width + column] * x[row]


def stretch(rx, ry, free, inverse, strain, width):
    """Write one over the sizes of vectors, and by how much they are longer than 1 + `free`; for whole lanes."""
    for g in range(width):
        size = math.sqrt(rx[g] * rx[g] + ry[g] * ry[g])
        inverse[g] = 1.0 / (size if size > 0.0 else 1.0)
        strain[g] = size - 1.0 - free


def pull(factor, force, inverse, rx, ry, fx, fy, width):
    """Write forces along vectors with one over their sizes, times a factor; for whole lanes."""
    for g in range(width):
        tension = factor * force[g] * inverse[g]
        fx[g] = tension * rx[g]
        fy[g] = tension * ry[g]


def part(source, first, factor, x, y, place, count):
    """Write plane vectors, times a factor, from where they follow each other to their components; for whole `PAIRS`."""
    for k in range(count):
        x[place + k] = factor * source[first + 2 * k]
        y[place + k] = factor * source[first + 2 * k + 1]


def join(target, first, factor, x, y, place, count):
    """Add plane vectors by their components, times a factor, to where they follow each other; for whole `PAIRS`."""
    for k in range(count):
        target[first + 2 * k] += factor * x[place + k]
        target[first + 2 * k + 1] += factor * y[place + k]


def take_row(table, row, column, other, begin, factor, count):
    """Take `count` numbers of the row `other` from `begin` on, times a factor, from a row; `SHORT` - 1 zeros follow them."""
    for k in range(count):
        table[row, column + k] -= factor * table[other, begin + k]


def row_times(table, row, column, x, first, count):
    """The sum of `count` products of a row with numbers of x."""
    total = 0.0
    for k in range(count):
        total += table[row, column + k] * x[first + k]
    return total


def padded(count: int) -> int:
    """The width of a row with so many numbers, in whole lanes."""
    return LANES * ((count + LANES - 1) // LANES)


def even(count: int) -> int:
    """The least even number that is not smaller."""
    return count + count % 2
