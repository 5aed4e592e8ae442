"""Short loops over plane vectors, which the C compiler gives to the processor's vector units."""

from __future__ import annotations

import math

LANES = 8  # Rows of tables have a whole multiple of so many numbers, which processors take at once
PAIRS = LANES // 2  # Plane vectors whose components fill the lanes
SHORT = 4  # Numbers that rows of a band are taken by


def combine(table, first, rows, width, x, y, sx, sy):
    """Write the sums of the rows of a table, each times a vector; its rows have whole lanes and begin at `first`."""
    transform(table, first, rows, width, x, sx)
    transform(table, first, rows, width, y, sy)


def transform(table, first, rows, width, x, sx):
    """Write the sums of the rows of a table, each times a number; its rows have whole lanes and begin at `first`."""
    for column in range(0, width, LANES):
        # sums of eight columns stay in registers, of which the compiler makes vectors
        a = b = c = d = e = f = g = h = 0.0
        for row in range(rows):
            at, factor = first + row * width + column, x[row]
            a += table[at] * factor
            b += table[at + 1] * factor
            c += table[at + 2] * factor
            d += table[at + 3] * factor
            e += table[at + 4] * factor
            f += table[at + 5] * factor
            g += table[at + 6] * factor
            h += table[at + 7] * factor
        sx[column], sx[column + 1], sx[column + 2], sx[column + 3] = a, b, c, d
        sx[column + 4], sx[column + 5], sx[column + 6], sx[column + 7] = e, f, g, h


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
    for k in range(0, count, SHORT):
        at, here = column + k, begin + k
        a, b = table[row, at] - factor * table[other, here], table[row, at + 1] - factor * table[other, here + 1]
        c, d = table[row, at + 2] - factor * table[other, here + 2], table[row, at + 3] - factor * table[other, here + 3]
        table[row, at], table[row, at + 1], table[row, at + 2], table[row, at + 3] = a, b, c, d


def row_times(table, row, column, x, first, count):
    """The sum of `count` products of a row with numbers of x."""
    total = 0.0
    for k in range(count):
        total += table[row, column + k] * x[first + k]
    return total


def padded(count: int) -> int:
    """The width of a row with so many numbers, in whole lanes."""
    return LANES * ((count + LANES - 1) // LANES)
