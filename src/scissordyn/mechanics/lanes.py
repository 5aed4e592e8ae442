"""Short loops over plane vectors, which the C compiler vectorizes."""

from __future__ import annotations

import math

from scissordyn.kernel import vectorized

LANES = 8  # Number of values that a processor handles at once; rows of tables are padded to its multiples
BAND_LANES = 4  # Number of values in a row of a band matrix that are handled at once


@vectorized
def combine(table, first, rows, width, x, y, sx, sy):
    """Multiply the rows of a padded table, which begins at `first`, by vectors and sum them up."""
    for column in range(0, width, LANES):
        a = b = c = d = e = f = g = h = 0.0
        i = j = k = l = m = n = o = p = 0.0
        for row in range(rows):
            at, u, v = first + row * width + column, x[row], y[row]
            a += table[at] * u
            b += table[at + 1] * u
            c += table[at + 2] * u
            d += table[at + 3] * u
            e += table[at + 4] * u
            f += table[at + 5] * u
            g += table[at + 6] * u
            h += table[at + 7] * u
            i += table[at] * v
            j += table[at + 1] * v
            k += table[at + 2] * v
            l += table[at + 3] * v
            m += table[at + 4] * v
            n += table[at + 5] * v
            o += table[at + 6] * v
            p += table[at + 7] * v
        sx[column], sx[column + 1], sx[column + 2], sx[column + 3] = a, b, c, d
        sx[column + 4], sx[column + 5], sx[column + 6], sx[column + 7] = e, f, g, h
        sy[column], sy[column + 1], sy[column + 2], sy[column + 3] = i, j, k, l
        sy[column + 4], sy[column + 5], sy[column + 6], sy[column + 7] = m, n, o, p


@vectorized
def transform(table, first, rows, width, x, sx):
    """Multiply the rows of a padded table, which begins at `first`, by scalars and sum them up."""
    for column in range(0, width, LANES):
        # sums of eight columns stay in registers, which the compiler vectorizes
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


@vectorized
def stretch(rx, ry, free, inverse, strain, width):
    """Write the inverse lengths of vectors, and their elongations beyond 1 + `free`; for whole lanes."""
    for g in range(width):
        size = math.sqrt(rx[g] * rx[g] + ry[g] * ry[g])
        inverse[g] = 1.0 / (size if size > 0.0 else 1.0)
        strain[g] = size - 1.0 - free


@vectorized
def pull(factor, force, inverse, rx, ry, fx, fy, width):
    """Write forces along vectors, given their inverse lengths, times a factor; for whole lanes."""
    for g in range(width):
        tension = factor * force[g] * inverse[g]
        fx[g] = tension * rx[g]
        fy[g] = tension * ry[g]


def part(source, first, factor, x, y, place, count):
    """Write consecutive plane vectors, times a factor, as separate components; for whole `LANES // 2`."""
    for k in range(count):
        x[place + k] = factor * source[first + 2 * k]
        y[place + k] = factor * source[first + 2 * k + 1]


def join(target, first, factor, x, y, place, count):
    """Add separate components, times a factor, to consecutive plane vectors; for whole `LANES // 2`."""
    for k in range(count):
        target[first + 2 * k] += factor * x[place + k]
        target[first + 2 * k + 1] += factor * y[place + k]


def take_row(table, row, column, other, begin, factor, count):
    """Subtract a multiple of `count` values of row `other` from a row; `BAND_LANES` - 1 zeros must follow them."""
    for k in range(0, count, BAND_LANES):
        at, here = column + k, begin + k
        a, b = table[row, at] - factor * table[other, here], table[row, at + 1] - factor * table[other, here + 1]
        c, d = table[row, at + 2] - factor * table[other, here + 2], table[row, at + 3] - factor * table[other, here + 3]
        table[row, at], table[row, at + 1], table[row, at + 2], table[row, at + 3] = a, b, c, d


def row_times(table, row, column, x, first, count):
    """Return the sum of `count` products of a row and values of x."""
    total = 0.0
    for k in range(count):
        total += table[row, column + k] * x[first + k]
    return total


def padded(count: int) -> int:
    """Return the padded width of a row of `count` values, in whole lanes."""
    return LANES * ((count + LANES - 1) // LANES)
