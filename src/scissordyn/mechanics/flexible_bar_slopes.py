"""Derivatives of the forces of a flexible bar by positions and velocities (`flexible_bar`)."""

from __future__ import annotations

from scissordyn.kernel import equals, kernel
from scissordyn.mechanics.flexible_bar import (
    AXIAL,
    CURVATURE,
    EA,
    EI,
    ENDX,
    ENDY,
    FX,
    FY,
    HX,
    HY,
    INVERSE,
    QX,
    QY,
    RX,
    RY,
    STRAIN,
    TAU,
    VX,
    VY,
    derivatives,
    read_vectors,
    slopes_at_ends,
    tables_of,
    warm_bending,
    warmth,
    write_strains,
)
from scissordyn.mechanics.lanes import LANES


@kernel
def linearise_flexible_bar(t, i, S, dt):
    """Write the derivatives of a bar's generalised forces to Work.block_x and Work.block_v, those by time to dt."""
    M, W, p = S.model, S.work, S.parameters.component[i]
    element, bar = S.parameters.contact.size + i, M.bar_of[i]
    points, B = M.bar[bar, 2], W.bar
    factor, factor_rate = warmth(t, i, S)
    read_vectors(bar, S, W.V, B[VX], B[VY])
    write_strains(bar, S, factor * p[STRAIN])
    write_bending_slopes(bar, S, p[EI])
    for g in range(points):
        add_stretching_slopes(g, bar, S, p, factor_rate)
        if not equals(p[TAU], 0.0):
            add_damping_slopes(g, bar, S, p)
    if not equals(p[CURVATURE], 0.0):
        add_thermal_slopes(bar, S, p, factor, factor_rate)
    if not equals(factor_rate, 0.0):
        spread_time(bar, S, dt)
    spread_flexible_bar(element, bar, S)


@kernel
def write_bending_slopes(bar, S, stiffness):
    """Write the derivatives of the bending form, and zeros elsewhere."""
    table, B, K, D = S.model.bar_table, S.work.bar, S.work.bar_by_x, S.work.bar_by_v
    count, _, _, wide, _, _, _, forces = tables_of(bar, S)
    for k in range(count):
        B[FX, k] = B[FY, k] = 0.0
        for l in range(count):
            value = -stiffness * table[forces + k * wide + l]
            K[2 * k, 2 * l] = K[2 * k + 1, 2 * l + 1] = value
            K[2 * k, 2 * l + 1] = K[2 * k + 1, 2 * l] = 0.0
            D[2 * k, 2 * l] = D[2 * k, 2 * l + 1] = D[2 * k + 1, 2 * l] = D[2 * k + 1, 2 * l + 1] = 0.0


@kernel
def add_stretching_slopes(g, bar, S, p, factor_rate):
    """Add the derivatives of -N t at a point: strains at all points change N, the direction at this point changes t."""
    table, B, K = S.model.bar_table, S.work.bar, S.work.bar_by_x
    count, points, across, wide, _, _, stretching, forces = tables_of(bar, S)
    rx, ry, inverse, axial = B[RX], B[RY], B[INVERSE], B[AXIAL]
    first, row = forces + (count + g) * wide, stretching + g * across
    tx, ty, over = rx[g] * inverse[g], ry[g] * inverse[g], p[EA] * axial[g] * inverse[g]
    ahead_x, ahead_y, warm = B[HX], B[HY], 0.0  # derivative of the axial force at this point by the vectors
    for l in range(count):
        ahead_x[l] = ahead_y[l] = 0.0
    for h in range(points):
        tangent = p[EA] * table[row + h]
        if tangent != 0.0:
            warm += tangent
            ux, uy = tangent * rx[h] * inverse[h], tangent * ry[h] * inverse[h]
            other = forces + (count + h) * wide
            for l in range(count):
                ahead_x[l] += ux * table[other + l]
                ahead_y[l] += uy * table[other + l]
    warm *= p[STRAIN] * factor_rate
    for k in range(count):
        s = table[first + k]
        B[FX, k] += warm * s * tx
        B[FY, k] += warm * s * ty
        sx, sy = s * tx, s * ty
        for l in range(count):
            turned = over * s * table[first + l]
            K[2 * k, 2 * l] -= sx * ahead_x[l] + turned * ty * ty
            K[2 * k, 2 * l + 1] -= sx * ahead_y[l] - turned * tx * ty
            K[2 * k + 1, 2 * l] -= sy * ahead_x[l] - turned * tx * ty
            K[2 * k + 1, 2 * l + 1] -= sy * ahead_y[l] + turned * tx * tx


@kernel
def add_damping_slopes(g, bar, S, p):
    """Add the derivatives of the damping forces at a point."""
    table, B, K, D = S.model.bar_table, S.work.bar, S.work.bar_by_x, S.work.bar_by_v
    count, points, _, wide, weights, _, _, forces = tables_of(bar, S)
    rx, ry, inverse, first = B[RX], B[RY], B[INVERSE, g], forces + (count + g) * wide
    px, py, bx, by, qx, qy = derivatives(table, first, points * wide, count, B[QX], B[QY], B[VX], B[VY])
    tx, ty, weight = rx[g] * inverse, ry[g] * inverse, p[TAU] * table[weights + g]
    rate, turning = tx * px + ty * py, px * by - py * bx + rx[g] * qy - ry[g] * qx
    lost, moment = p[EA] * weight, p[EI] * weight
    xx = lost * (tx * (px - tx * rate) + rate * ty * ty) * inverse
    xy = lost * (tx * (py - ty * rate) - rate * tx * ty) * inverse
    yx = lost * (ty * (px - tx * rate) - rate * tx * ty) * inverse
    yy = lost * (ty * (py - ty * rate) + rate * tx * tx) * inverse
    for k in range(count):
        s, b = table[first + k], table[first + points * wide + k]
        cx, cy = s * by - b * ry[g], b * rx[g] - s * bx  # derivative of r' x r'' by the vectors
        for l in range(count):
            u, c = table[first + l], table[first + points * wide + l]
            ex, ey = u * by - c * ry[g], c * rx[g] - u * bx
            wx, wy = u * qy - c * py, c * px - u * qx
            su, turn = s * u, turning * (s * c - b * u)
            K[2 * k, 2 * l] -= moment * cx * wx + su * xx
            K[2 * k, 2 * l + 1] -= moment * (cx * wy + turn) + su * xy
            K[2 * k + 1, 2 * l] -= moment * (cy * wx - turn) + su * yx
            K[2 * k + 1, 2 * l + 1] -= moment * cy * wy + su * yy
            D[2 * k, 2 * l] -= moment * cx * ex + lost * su * tx * tx
            D[2 * k, 2 * l + 1] -= moment * cx * ey + lost * su * tx * ty
            D[2 * k + 1, 2 * l] -= moment * cy * ex + lost * su * tx * ty
            D[2 * k + 1, 2 * l + 1] -= moment * cy * ey + lost * su * ty * ty


@kernel
def add_thermal_slopes(bar, S, p, factor, factor_rate):
    """Add the derivatives of the moments at both ends."""
    table, B, K = S.model.bar_table, S.work.bar, S.work.bar_by_x
    count, _, across, _, _, slopes, _, _ = tables_of(bar, S)
    slopes_at_ends(bar, S)
    rx, ry, first = B[ENDX], B[ENDY], slopes + count * across
    curvature, rate, _, _ = warm_bending(p, factor, factor_rate)
    for end in range(2):
        square = rx[end] * rx[end] + ry[end] * ry[end]
        force = (2.0 * end - 1.0) * p[EI] / square
        moment, warm = force * curvature / square, force * rate
        xx = 2.0 * moment * rx[end] * ry[end]
        xy = moment * (ry[end] * ry[end] - rx[end] * rx[end])
        for k in range(count):
            s = table[first + k * LANES + end]
            B[FX, k] -= warm * s * ry[end]
            B[FY, k] += warm * s * rx[end]
            for l in range(count):
                su = s * table[first + l * LANES + end]
                K[2 * k, 2 * l] += su * xx
                K[2 * k, 2 * l + 1] += su * xy
                K[2 * k + 1, 2 * l] += su * xy
                K[2 * k + 1, 2 * l + 1] -= su * xx


@kernel
def spread_time(bar, S, dt):
    """Add the partial derivative by time to dt."""
    M, B = S.model, S.work.bar
    first = M.bar[bar, 0]
    for k in range(M.bar[bar, 1]):
        for e in range(M.shape_start[first + k], M.shape_start[first + k + 1]):
            if M.shape_column[e] < M.n:
                dt[M.n + M.shape_column[e]] += M.shape_row[0, e] * B[FX, k] + M.shape_row[1, e] * B[FY, k]


@kernel
def spread_flexible_bar(element, bar, S):
    """Convert derivatives by the vectors of shapes to derivatives by the columns of the element."""
    M, W = S.model, S.work
    start, block = M.element_start[element], M.block_start[element]
    columns = M.element_start[element + 1] - start
    K, D, first, count = W.bar_by_x, W.bar_by_v, M.bar[bar, 0], M.bar[bar, 1]
    for a in range(columns * columns):
        W.block_x[block + a] = 0.0
        W.block_v[block + a] = 0.0
    for k in range(count):
        for e in range(M.shape_start[first + k], M.shape_start[first + k + 1]):
            a = M.shape_place[e]
            ax, ay = M.shape_row[0, e], M.shape_row[1, e]
            for l in range(count):
                xx = ax * K[2 * k, 2 * l] + ay * K[2 * k + 1, 2 * l]
                xy = ax * K[2 * k, 2 * l + 1] + ay * K[2 * k + 1, 2 * l + 1]
                vx = ax * D[2 * k, 2 * l] + ay * D[2 * k + 1, 2 * l]
                vy = ax * D[2 * k, 2 * l + 1] + ay * D[2 * k + 1, 2 * l + 1]
                for h in range(M.shape_start[first + l], M.shape_start[first + l + 1]):
                    at = block + a * columns + M.shape_place[h]
                    W.block_x[at] += xx * M.shape_row[0, h] + xy * M.shape_row[1, h]
                    W.block_v[at] += vx * M.shape_row[0, h] + vy * M.shape_row[1, h]
