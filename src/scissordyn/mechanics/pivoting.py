"""Impulses of a step by Lemke's complementary pivoting, used if Newton's method finds no consistent modes.

It is applied first to the contacts whose modes keep changing, while the others keep their modes. r is the friction part of
P_T, u are normal velocities that must be >= 0. All rows except those of the pivoted contacts are eliminated. With the slip
speed U_T = s - p in parts s, p >= 0, the contact law is a linear complementarity problem (Lemke 1965; for friction Stewart
and Trinkle 1996)

    w = M z + q,    w = (u, s, mu P_N - r),    z = (P_N, mu P_N + r, p),    0 <= w _|_ z >= 0,

with three variables per contact. A pivot costs as many operations as the table has entries. If the method ends on a ray,
there may be no solution, for example if friction locks surfaces.
"""

from __future__ import annotations

from scissordyn.kernel import equals, kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.hard_rows import OPEN, SLIP, STICK, row_product, write_equations
from scissordyn.tolerance import EVENT_TOL, ROUND_OFF_TOL

PIVOTS_MAX = 20  # Largest number of pivots per variable in Lemke's method


def table_shape(contacts: int) -> tuple[int, int]:
    """Return the numbers of rows and columns of the pivoting table of some contacts."""
    return 3 * contacts, 3 * contacts + 2


@kernel
def pivot(least, m, H):
    """Compute the impulses of all rows and the modes of contacts restless since step `least`; others keep their modes.

    Return the number of pivots; negative if the method ends on a ray.
    """
    count = 0
    for i in range(H.model.which.size):
        if H.work.closed[i] == 1 and H.work.restless[i] >= least:
            H.work.active[count] = i
            count += 1
    if count == 0 or not unit_impulses(m, count, H):
        return -1
    write_table(m, count, H)
    pivots = lemke(3 * count, H)
    if pivots >= 0:
        combine(m, count, H)
    return pivots


@kernel
def unit_impulses(m, count, H):
    """Compute the impulses without the pivoted contacts, and those for a unit of each of their P_N and r.

    Return whether a solution exists.
    """
    size, reach = H.model.place.size, H.model.reach[0]
    write_equations(m, 0, H)
    H.work.units[: 2 * count, :] = 0.0
    for at in range(size):
        H.work.units[2 * count, at] = H.work.right[at]
    for c in range(count):
        i = H.work.active[c]
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        mass, turned = H.work.gram[b, reach], H.work.turning_mass[i] * H.work.gram[b, reach]
        for k in range(2 * reach + 1):
            H.work.band[a, k] = 0.0
            H.work.band[b, k] = turned * H.work.gram[b, k]
        H.work.band[a, reach] = 1.0
        H.work.band[b, reach] += mass
        H.work.units[2 * count, a], H.work.units[2 * count, b] = 0.0, mass * H.work.lag[i] - turned * H.work.free[b]
        H.work.units[c, a], H.work.units[count + c, b] = 1.0, mass
    if band.factorize(H.work.band, reach, reach, H.work.pivots) >= 0:
        return False
    for c in range(2 * count + 1):
        band.solve(H.work.band, reach, H.work.pivots, H.work.units[c])
    return True


@kernel
def write_table(m, count, H):
    """Write the dictionary w = M z + 1 z_0 + q, with its basic and nonbasic variables."""
    size = 3 * count
    for d in range(count):
        i = H.work.active[d]
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        for c in range(count):
            mu = H.work.friction[H.work.active[c]]
            for half in range(2):
                row, at = half * count + d, b if half == 1 else a
                by_r = row_product(at, H.work.units[count + c], H)
                H.work.table[row, c] = row_product(at, H.work.units[c], H) - mu * by_r
                H.work.table[row, count + c] = by_r
                H.work.table[row, 2 * count + c] = 0.0
            for k in range(3):
                H.work.table[2 * count + d, k * count + c] = 0.0
        H.work.table[d, d] += H.work.compliance[i]
        H.work.table[d, size + 1] = row_product(a, H.work.units[2 * count], H) + H.work.free[a] + H.work.offset[i]
        H.work.table[count + d, size + 1] = row_product(b, H.work.units[2 * count], H) + H.work.free[b]
        H.work.table[2 * count + d, size + 1] = 0.0
        H.work.table[count + d, 2 * count + d] = 1.0
        H.work.table[2 * count + d, d] = 2.0 * H.work.friction[i]
        H.work.table[2 * count + d, count + d] = -1.0
    for k in range(size):
        H.work.table[k, size] = 1.0
        H.work.basic[k], H.work.beside[k] = k, size + k
    H.work.beside[size] = 2 * size


@kernel
def lemke(size, H):
    """Pivot until z_0 is zero; return the number of pivots, or -1."""
    # z_0 enters where q is most negative
    row = 0
    for k in range(size):
        if H.work.table[k, size + 1] < H.work.table[row, size + 1]:
            row = k
    if H.work.table[row, size + 1] >= 0.0:
        return 0
    column = size
    for pivots in range(PIVOTS_MAX * size):
        leaving = H.work.basic[row]
        exchange(row, column, size, H)
        if leaving == 2 * size:
            return pivots
        entering = leaving + size if leaving < size else leaving - size
        column = 0
        while H.work.beside[column] != entering:
            column += 1
        row = leaving_row(column, size, H)
        if row < 0:
            return -1
    return -1


@kernel
def leaving_row(column, size, H):
    """Return the row whose variable reaches zero first as that of a column grows; -1 if none does."""
    largest, best, row = 0.0, 0.0, -1
    for k in range(size):
        largest = max(largest, -H.work.table[k, column])
    for k in range(size):
        entry = -H.work.table[k, column]
        if entry <= ROUND_OFF_TOL * largest:
            continue
        ratio = max(H.work.table[k, size + 1], 0.0) / entry
        tied = row >= 0 and abs(ratio - best) <= ROUND_OFF_TOL * best
        if row < 0 or (ratio < best and not tied):
            row, best = k, ratio
        elif tied and H.work.basic[row] != 2 * size and (H.work.basic[k] == 2 * size or entry > -H.work.table[row, column]):
            row, best = k, min(ratio, best)
    return row


@kernel
def exchange(row, column, size, H):
    """Exchange the nonbasic variable of a column with the basic variable of a row."""
    inverse = 1.0 / H.work.table[row, column]
    for k in range(size + 2):
        H.work.table[row, k] *= -inverse
    H.work.table[row, column] = inverse
    for i in range(size):
        factor = H.work.table[i, column]
        if i == row or equals(factor, 0.0):
            continue
        H.work.table[i, column] = 0.0
        for k in range(size + 2):
            H.work.table[i, k] += factor * H.work.table[row, k]
    H.work.basic[row], H.work.beside[column] = H.work.beside[column], H.work.basic[row]


@kernel
def combine(m, count, H):
    """Compute impulses, velocities and modes from the basic variables."""
    size = 3 * count
    for k in range(size):
        H.work.table[k, size] = 0.0  # values of z, by index
    for k in range(size):
        if size <= H.work.basic[k] < 2 * size:
            H.work.table[H.work.basic[k] - size, size] = max(H.work.table[k, size + 1], 0.0)
    largest = 0.0
    for c in range(count):
        largest = max(largest, H.work.table[c, size])
    for at in range(H.model.place.size):
        H.work.impulse[at] = H.work.units[2 * count, at]
    # P_T = r lies between -mu P_N and mu P_N; at its limit the contact slips
    for c in range(count):
        i = H.work.active[c]
        p_n = H.work.table[c, size]
        if p_n <= ROUND_OFF_TOL * largest:
            p_n = H.work.table[c, size] = H.work.table[count + c, size] = 0.0
        tangential = H.work.table[count + c, size] - H.work.friction[i] * p_n
        limit = H.work.friction[i] * p_n
        slips = SLIP if tangential > 0.0 else SLIP + 1
        H.state.mode[i] = OPEN if p_n == 0.0 else STICK if abs(tangential) < limit * (1.0 - EVENT_TOL) else slips
        for at in range(H.model.place.size):
            H.work.impulse[at] += p_n * H.work.units[c, at] + tangential * H.work.units[count + c, at]
    for at in range(H.model.place.size):
        H.work.velocity[at] = H.work.free[at] + row_product(at, H.work.impulse, H)
