"""Point that runs along a flexible bar: its position, its distance from the axis, and the effect of a force across the axis.

With the point P and the axis r(s) = sum S_k(s) q_k, a = r', b = r'', t = a/|a| and n = J t:

    a . (P - r) = 0,   g = n . (P - r),   g' = n . (P' - sum S_k q_k')

because the rotation of the normal and the displacement along the axis are perpendicular to n. A force F across the axis is
therefore exactly F n on P and -S_k F n on q_k. With the rows of the maps of P and of q_k, G = n (P - S_k q_k),
T = t (P - S_k q_k) and N = n S_k' q_k,

    ds = (g N + |a| T)/D,   D = a . a - g n . b,   n . da = N + n . b ds =: A,

    dg = G,   dg' = -(t . u/|a|) A - n . c ds,   u = P' - sum S_k q_k',   c = sum S_k' q_k',

    d(F G) = G dF - F (T A/|a| + N ds).

Each span of the bar is a sum of Legendre polynomials; beyond its ends the axis is straight.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.bending_loads import note_shape_forces
from scissordyn.mechanics.flexible_bar import FX, FY, QX, QY, VX, VY, read_vectors
from scissordyn.tolerance import CONVERGENCE_TOL, NEWTON_STEPS_MAX

ALONG, ACROSS, TURNING, PX, PY, VALUE, SLOPE, SCALARS = range(8)
"""Rows of `Workspace.rail`: T, G and N by the element's columns; polynomials of the axis; Legendre polynomials and their
derivatives; scalars.
"""

NX, NY, SIZE, NB, NC, TU, DENOMINATOR = range(7)  # Scalars: n, |a|, n . b, n . c, t . u, D


@kernel
def legendre(x, size, value, slope):
    """Write the Legendre polynomials and their derivatives at x."""
    value[0], slope[0] = 1.0, 0.0
    if size > 1:
        value[1], slope[1] = x, 1.0
    for j in range(1, size - 1):
        value[j + 1] = ((2.0 * j + 1.0) * x * value[j] - j * value[j - 1]) / (j + 1.0)
        slope[j + 1] = slope[j - 1] + (2.0 * j + 1.0) * value[j]


@kernel
def write_axis(first, span, count, size, table, x, y, px, py):
    """Write the polynomials of one span of the axis."""
    for j in range(size):
        sx = sy = 0.0
        for k in range(count):
            factor = table[first + (span * count + k) * size + j]
            sx += factor * x[k]
            sy += factor * y[k]
        px[j], py[j] = sx, sy


@kernel
def find_place(i, S, at_x, at_y, x, y):
    """Return span and place of the axis nearest to a point, by Newton's method from the chords of the spans."""
    M, W = S.model, S.work
    table, first, spans, size = M.rail_table, M.rail[i, 0], M.rail[i, 1], M.rail[i, 2]
    count, R = M.bar[M.bar_of[i], 1], W.rail
    span, place = 0, 0.0
    for k in range(spans):
        dx, dy = x[k + 1] - x[k], y[k + 1] - y[k]
        part = ((at_x - x[k]) * dx + (at_y - y[k]) * dy) / (dx * dx + dy * dy)
        span, place = k, table[first + k] + part * (table[first + k + 1] - table[first + k])
        if part <= 1.0:
            break
    coefficients, length = first + spans + 1, table[first + spans] - table[first]
    written = -1
    for _ in range(NEWTON_STEPS_MAX):
        while span > 0 and place < table[first + span]:
            span -= 1
        while span < spans - 1 and place > table[first + span + 1]:
            span += 1
        if span != written:
            write_axis(coefficients, span, count, size, table, x, y, R[PX], R[PY])
            written = span
        rx, ry, ax, ay, bx, by = axis_at(first, span, place, size, table, R)
        ex, ey = at_x - rx, at_y - ry
        change = (ax * ex + ay * ey) / (ax * ax + ay * ay - bx * ex - by * ey)
        place += change
        if abs(change) <= CONVERGENCE_TOL * length:
            break
    return span, place


@kernel
def axis_at(first, span, place, size, table, R):
    """Return the axis and its two derivatives at a place of the written span; straight beyond its ends."""
    low, high = table[first + span], table[first + span + 1]
    inside = min(max(place, low), high)
    half = 0.5 * (high - low)
    xi = (inside - low) / half - 1.0
    value, slope = R[VALUE], R[SLOPE]
    legendre(xi, size, value, slope)
    rx = ry = ax = ay = bx = by = 0.0
    before, bent = 0.0, 0.0  # second derivatives of the polynomials, two orders below and at this order
    for j in range(size):
        curved = 0.0 if j < 2 else before + (2.0 * j - 1.0) * slope[j - 1]
        rx += R[PX, j] * value[j]
        ry += R[PY, j] * value[j]
        ax += R[PX, j] * slope[j]
        ay += R[PY, j] * slope[j]
        bx += R[PX, j] * curved
        by += R[PY, j] * curved
        before, bent = bent, curved
    ax, ay, bx, by = ax / half, ay / half, bx / (half * half), by / (half * half)
    if place != inside:
        bx = by = 0.0
    return rx + ax * (place - inside), ry + ay * (place - inside), ax, ay, bx, by


@kernel
def write_shapes(first, span, spans, place, count, size, table, value, slope, shape, turn):
    """Write the shapes and their slopes at a place, from the Legendre polynomials there."""
    low, high = table[first + span], table[first + span + 1]
    beyond, half = place - min(max(place, low), high), 0.5 * (high - low)
    coefficients = first + spans + 1
    for k in range(count):
        bent = sloped = 0.0
        for j in range(size):
            factor = table[coefficients + (span * count + k) * size + j]
            bent += factor * value[j]
            sloped += factor * slope[j]
        turn[k] = sloped / half
        shape[k] = bent + beyond * turn[k]


@kernel
def sense_rail(i, S, maps):
    """Write distance, its rate and the place of component i, and the data for its force."""
    M, W, bar = S.model, S.work, S.model.bar_of[i]
    B, R, count = W.bar, W.rail, M.bar[bar, 1]
    x, y, vx, vy, shape, turn = B[QX], B[QY], B[VX], B[VY], B[FX], B[FY]
    read_vectors(bar, S, W.X, x, y)
    read_vectors(bar, S, W.V, vx, vy)
    at_x, at_y, speed_x, speed_y = maps[0], maps[1], maps[6], maps[7]
    first, spans, size = M.rail[i, 0], M.rail[i, 1], M.rail[i, 2]
    span, place = find_place(i, S, at_x, at_y, x, y)
    rx, ry, ax, ay, bx, by = axis_at(first, span, place, size, M.rail_table, R)
    write_shapes(first, span, spans, place, count, size, M.rail_table, R[VALUE], R[SLOPE], shape, turn)
    long = math.sqrt(ax * ax + ay * ay)
    tx, ty = ax / long, ay / long
    gap = -ty * (at_x - rx) + tx * (at_y - ry)
    ux, uy, cx, cy = speed_x, speed_y, 0.0, 0.0
    for k in range(count):
        ux -= shape[k] * vx[k]
        uy -= shape[k] * vy[k]
        cx += turn[k] * vx[k]
        cy += turn[k] * vy[k]
    across = -ty * bx + tx * by
    R[SCALARS, NX], R[SCALARS, NY], R[SCALARS, SIZE] = -ty, tx, long
    R[SCALARS, NB], R[SCALARS, NC], R[SCALARS, TU] = across, -ty * cx + tx * cy, tx * ux + ty * uy
    R[SCALARS, DENOMINATOR] = long * long - gap * across
    W.coordinates[i, 0], W.coordinates[i, 1] = gap, place
    W.coordinate_rates[i, 0] = -ty * ux + tx * uy


@kernel
def write_rows(element, i, S):
    """Write T, G and N by the columns of the element of component i, after `sense_rail`."""
    M, W, bar = S.model, S.work, S.model.bar_of[i]
    R, shape, turn = W.rail, W.bar[FX], W.bar[FY]
    nx, ny = R[SCALARS, NX], R[SCALARS, NY]
    start, stop = M.element_start[element], M.element_start[element + 1]
    for e in range(start, stop):
        ux, uy = M.element_row[0, e], M.element_row[1, e]
        R[ACROSS, e - start] = nx * ux + ny * uy
        R[ALONG, e - start] = ny * ux - nx * uy
        R[TURNING, e - start] = 0.0
    first, at = M.bar[bar, 0], M.rail[i, 3] - M.shape_start[M.bar[bar, 0]]
    for k in range(M.bar[bar, 1]):
        for e in range(M.shape_start[first + k], M.shape_start[first + k + 1]):
            column = M.rail_place[at + e]
            ux, uy = M.shape_row[0, e], M.shape_row[1, e]
            across = nx * ux + ny * uy
            R[ACROSS, column] -= shape[k] * across
            R[ALONG, column] -= shape[k] * (ny * ux - nx * uy)
            R[TURNING, column] += turn[k] * across


@kernel
def add_rail_force(element, i, S, force):
    """Add a force across the axis to Work.force, after `sense_rail`."""
    M, W = S.model, S.work
    write_rows(element, i, S)
    start = M.element_start[element]
    for e in range(start, M.element_start[element + 1]):
        W.force[M.element_column[e]] += force * W.rail[ACROSS, e - start]
    bar, shape, scalars = M.bar_of[i], W.bar[FX], W.rail[SCALARS]
    note_shape_forces(M.bar[bar, 0], M.bar[bar, 1], shape, shape, -force * scalars[NX], -force * scalars[NY], S)


@kernel
def linearise_rail(element, i, S, force, by_gap, by_rate):
    """Write the derivatives of the forces to Work.block_x and Work.block_v, after `sense_rail`."""
    M, W = S.model, S.work
    write_rows(element, i, S)
    R, gap = W.rail, W.coordinates[i, 0]
    long, nb, nc, tu, below = R[SCALARS, SIZE], R[SCALARS, NB], R[SCALARS, NC], R[SCALARS, TU], R[SCALARS, DENOMINATOR]
    count, block = M.element_start[element + 1] - M.element_start[element], M.block_start[element]
    for b in range(count):
        moved = (gap * R[TURNING, b] + long * R[ALONG, b]) / below
        turned = R[TURNING, b] + nb * moved
        changed = by_gap * R[ACROSS, b] - by_rate * (tu / long * turned + nc * moved)
        for a in range(count):
            bent = R[ALONG, a] / long * turned + R[TURNING, a] * moved
            W.block_x[block + a * count + b] = R[ACROSS, a] * changed - force * bent
            W.block_v[block + a * count + b] = by_rate * R[ACROSS, a] * R[ACROSS, b]
