"""Bars that bend as one part: forces on the vectors of their shapes, and how these change.

With r' = sum S_k' q_k at points of quadrature, g = |r'| and t = r'/g: axial force N = EA (g - 1 - e), e the strain of a
temperature; bending by the constant matrix K = int S_k'' S_l'' ds; moments EI c on both ends, c the curvature of temperatures:

    f_k = -EI sum K_kl q_l - sum w S_k' N t + EI c [S_k' J r'/g^2] from one end to the other.

Damping adds EA tau g' to N and the moment EI tau (r' x r'')' (r' x r'' is the curvature but for the strain).
"""

from __future__ import annotations

import math

from scissordyn.jit import kernel
from scissordyn.mechanics.time_function import motion_at

__all__ = ["add_flexible_bar", "linearise_flexible_bar"]

EA, EI, TAU, STRAIN, CURVATURE, LENGTH = range(6)
"""Places in the row of a bar's parameters."""

QX, QY, VX, VY, FX, FY, RX, RY, HX, HY = range(10)
"""Rows of `Workspace.bar`: vectors, their rates, forces; r' at the points of quadrature and both ends; the vectors times -EI,
followed by the forces on r'."""

LANES = 4
"""Rows of tables have a whole multiple of so many numbers, which processors take at once."""


@kernel(inline=True)
def read_vectors(bar, S, source, x, y):
    """Write the vectors of a bar's shapes, from positions or velocities."""
    M = S.model
    first = M.bar[bar, 0]
    for k in range(M.bar[bar, 1]):
        sx = sy = 0.0
        for e in range(M.shape_start[first + k], M.shape_start[first + k + 1]):
            value = source[M.shape_column[e]]
            sx += M.shape_row[0, e] * value
            sy += M.shape_row[1, e] * value
        x[k], y[k] = sx, sy


@kernel(inline=True)
def add_vectors(bar, S, x, y, target):
    """Add forces on the vectors of a bar's shapes to those on all columns."""
    M = S.model
    first = M.bar[bar, 0]
    for k in range(M.bar[bar, 1]):
        for e in range(M.shape_start[first + k], M.shape_start[first + k + 1]):
            target[M.shape_column[e]] += M.shape_row[0, e] * x[k] + M.shape_row[1, e] * y[k]


@kernel(inline=True)
def combine(table, first, rows, width, x, y, sx, sy):
    """Write the sums of the rows of a table, each times a vector: four columns at a time."""
    for column in range(0, width, LANES):
        a0 = a1 = a2 = a3 = b0 = b1 = b2 = b3 = 0.0
        for row in range(rows):
            at, ux, uy = first + row * width + column, x[row], y[row]
            t0, t1, t2, t3 = table[at], table[at + 1], table[at + 2], table[at + 3]
            a0 += t0 * ux
            a1 += t1 * ux
            a2 += t2 * ux
            a3 += t3 * ux
            b0 += t0 * uy
            b1 += t1 * uy
            b2 += t2 * uy
            b3 += t3 * uy
        sx[column], sx[column + 1], sx[column + 2], sx[column + 3] = a0, a1, a2, a3
        sy[column], sy[column + 1], sy[column + 2], sy[column + 3] = b0, b1, b2, b3


@kernel(inline=True)
def padded(count):
    """The width of a row with so many numbers."""
    return LANES * ((count + LANES - 1) // LANES)


@kernel(inline=True)
def warmth(t, i, S):
    """Factor of the temperatures of component i, and its rate."""
    if S.model.function[i] < 0:
        return 1.0, 0.0
    motion_at(t, S.model.function[i], S)
    return S.work.function_value[0], S.work.function_value[1]


@kernel()
def add_flexible_bar(t, i, S):
    """Add the forces of the bar that is component i to Work.force; write its energy and powers."""
    M, W, p = S.model, S.work, S.parameters.component[i]
    bar = M.bar_of[i]
    count, points, table = M.bar[bar, 1], M.bar[bar, 2], M.bar_table
    ends, wide = padded(points + 2), padded(count)
    weights = M.bar[bar, 3]
    slopes = weights + points  # (shapes, points and both ends)
    forces = slopes + count * ends  # the bending form, slopes by points and second derivatives by points
    B = W.bar
    x, y, fx, fy, rx, ry, hx, hy = B[QX], B[QY], B[FX], B[FY], B[RX], B[RY], B[HX], B[HY]
    read_vectors(bar, S, W.X, x, y)
    combine(table, slopes, count, ends, x, y, rx, ry)
    factor, factor_rate = warmth(t, i, S)
    strain, curvature = factor * p[STRAIN], factor * p[CURVATURE]
    stored = warmed = 0.0
    for g in range(points):
        size = math.sqrt(rx[g] * rx[g] + ry[g] * ry[g])
        longer = size - 1.0 - strain
        force = p[EA] * table[weights + g] * longer
        stored += 0.5 * force * longer
        warmed += force
        force /= size
        hx[count + g] = -force * rx[g]
        hy[count + g] = -force * ry[g]
    for k in range(count):
        hx[k] = -p[EI] * x[k]
        hy[k] = -p[EI] * y[k]
    lost = bent = 0.0
    rows = count + points
    if p[TAU] > 0.0:
        lost, bent = write_damping(i, bar, S, weights, forces)
        rows += points
    combine(table, forces, rows, wide, hx, hy, fx, fy)
    for k in range(count):  # twice the energy: the virtual work of all that acts, less that of what acts on r' and r''
        bent -= fx[k] * x[k] + fy[k] * y[k]
    for g in range(points):
        bent += hx[count + g] * rx[g] + hy[count + g] * ry[g]
    W.dissipation[i], W.power_in[i] = lost, 0.0
    if curvature != 0.0 or p[CURVATURE] * factor_rate != 0.0:
        for end in range(2):
            g, sense = points + end, 2.0 * end - 1.0
            square = rx[g] * rx[g] + ry[g] * ry[g]
            moment = sense * p[EI] * curvature / square
            for k in range(count):
                slope = table[slopes + k * ends + g]
                fx[k] -= moment * slope * ry[g]
                fy[k] += moment * slope * rx[g]
        cross = rx[points] * ry[points + 1] - ry[points] * rx[points + 1]
        turned = math.atan2(cross, rx[points] * rx[points + 1] + ry[points] * ry[points + 1])
        bent += p[EI] * curvature * (curvature * p[LENGTH] - 2.0 * turned)
        W.power_in[i] -= factor_rate * p[EI] * p[CURVATURE] * (turned - curvature * p[LENGTH])
    W.power_in[i] -= factor_rate * p[STRAIN] * warmed
    W.stored_energy[i] = stored + 0.5 * bent
    add_vectors(bar, S, fx, fy, W.force)


@kernel()
def write_damping(i, bar, S, weights, forces):
    """Add what damping exerts to the forces on r', write those on r''; returns the dissipated power, and the work on r''."""
    M, W, p = S.model, S.work, S.parameters.component[i]
    count, points, table = M.bar[bar, 1], M.bar[bar, 2], M.bar_table
    B, wide = W.bar, padded(count)
    x, y, vx, vy, rx, ry, hx, hy = B[QX], B[QY], B[VX], B[VY], B[RX], B[RY], B[HX], B[HY]
    read_vectors(bar, S, W.V, vx, vy)
    lost = work = 0.0
    for g in range(points):
        px, py, bx, by, qx, qy = derivatives(table, forces + (count + g) * wide, points * wide, count, x, y, vx, vy)
        size, weight = math.sqrt(rx[g] * rx[g] + ry[g] * ry[g]), p[TAU] * table[weights + g]
        rate = (rx[g] * px + ry[g] * py) / size
        turning = px * by - py * bx + rx[g] * qy - ry[g] * qx
        axial, moment = weight * p[EA] * rate, weight * p[EI] * turning
        lost += axial * rate + moment * turning
        hx[count + g] -= axial * rx[g] / size + moment * by
        hy[count + g] -= axial * ry[g] / size - moment * bx
        mx, my = moment * ry[g], -moment * rx[g]
        hx[count + points + g], hy[count + points + g] = mx, my
        work += mx * bx + my * by
    return lost, work


@kernel(inline=True)
def derivatives(table, first, apart, count, x, y, vx, vy):
    """Rate of r', r'' and its rate at a point of quadrature."""
    px = py = bx = by = qx = qy = 0.0
    for k in range(count):
        slope, bend = table[first + k], table[first + apart + k]
        px += slope * vx[k]
        py += slope * vy[k]
        bx += bend * x[k]
        by += bend * y[k]
        qx += bend * vx[k]
        qy += bend * vy[k]
    return px, py, bx, by, qx, qy


@kernel()
def linearise_flexible_bar(t, i, S, dt):
    """Write the derivatives of a bar's generalized forces to Work.block_x and Work.block_v; what time alone changes to dt."""
    M, W, p = S.model, S.work, S.parameters.component[i]
    element, bar = S.parameters.contact.size + i, M.bar_of[i]
    count, points, table = M.bar[bar, 1], M.bar[bar, 2], M.bar_table
    ends, wide, weights = padded(points + 2), padded(count), M.bar[bar, 3]
    slopes = weights + points
    forces = slopes + count * ends
    B, K, D = W.bar, W.bar_by_x, W.bar_by_v
    x, y, vx, vy, rx, ry = B[QX], B[QY], B[VX], B[VY], B[RX], B[RY]
    read_vectors(bar, S, W.X, x, y)
    read_vectors(bar, S, W.V, vx, vy)
    combine(table, slopes, count, ends, x, y, rx, ry)
    factor, factor_rate = warmth(t, i, S)
    for k in range(count):
        B[FX, k] = B[FY, k] = 0.0
        for l in range(count):
            value = -p[EI] * table[forces + k * wide + l]
            K[2 * k, 2 * l] = K[2 * k + 1, 2 * l + 1] = value
            K[2 * k, 2 * l + 1] = K[2 * k + 1, 2 * l] = 0.0
            D[2 * k, 2 * l] = D[2 * k, 2 * l + 1] = D[2 * k + 1, 2 * l] = D[2 * k + 1, 2 * l + 1] = 0.0
    for g in range(points):
        size, weight = math.sqrt(rx[g] * rx[g] + ry[g] * ry[g]), table[weights + g]
        tx, ty = rx[g] / size, ry[g] / size
        over = p[EA] * weight * (size - 1.0 - factor * p[STRAIN]) / size
        along = p[EA] * weight
        warm = along * p[STRAIN] * factor_rate
        first = forces + (count + g) * wide
        px, py, bx, by, qx, qy = derivatives(table, first, points * wide, count, x, y, vx, vy)
        for k in range(count):
            B[FX, k] += warm * table[first + k] * tx
            B[FY, k] += warm * table[first + k] * ty
        rate, turning = tx * px + ty * py, px * by - py * bx + rx[g] * qy - ry[g] * qx
        lost, moment = p[TAU] * along, p[TAU] * p[EI] * weight
        # the derivatives of -(N t) by r', by the position and, damped, by the rate
        xx = -(along * tx * tx + over * (1.0 - tx * tx)) - lost * (tx * (px - tx * rate) + rate * (1.0 - tx * tx)) / size
        xy = -(along - over) * tx * ty - lost * (tx * (py - ty * rate) - rate * tx * ty) / size
        yx = -(along - over) * tx * ty - lost * (ty * (px - tx * rate) - rate * tx * ty) / size
        yy = -(along * ty * ty + over * (1.0 - ty * ty)) - lost * (ty * (py - ty * rate) + rate * (1.0 - ty * ty)) / size
        for k in range(count):
            s, b = table[first + k], table[first + points * wide + k]
            cx, cy = s * by - b * ry[g], b * rx[g] - s * bx  # of r' x r'' by the vectors
            for l in range(count):
                u, c = table[first + l], table[first + points * wide + l]
                su = s * u
                K[2 * k, 2 * l] += su * xx
                K[2 * k, 2 * l + 1] += su * xy
                K[2 * k + 1, 2 * l] += su * yx
                K[2 * k + 1, 2 * l + 1] += su * yy
                if moment > 0.0:
                    ex, ey = u * by - c * ry[g], c * rx[g] - u * bx
                    wx, wy = u * qy - c * py, c * px - u * qx
                    turn = turning * (s * c - b * u)
                    K[2 * k, 2 * l] -= moment * cx * wx
                    K[2 * k, 2 * l + 1] -= moment * (cx * wy + turn)
                    K[2 * k + 1, 2 * l] -= moment * (cy * wx - turn)
                    K[2 * k + 1, 2 * l + 1] -= moment * cy * wy
                    D[2 * k, 2 * l] -= moment * cx * ex + lost * su * tx * tx
                    D[2 * k, 2 * l + 1] -= moment * cx * ey + lost * su * tx * ty
                    D[2 * k + 1, 2 * l] -= moment * cy * ex + lost * su * tx * ty
                    D[2 * k + 1, 2 * l + 1] -= moment * cy * ey + lost * su * ty * ty
    if p[CURVATURE] != 0.0:
        for end in range(2):
            g, sense = points + end, 2.0 * end - 1.0
            square = rx[g] * rx[g] + ry[g] * ry[g]
            moment, warm = (
                sense * p[EI] * p[CURVATURE] * factor / (square * square),
                sense * p[EI] * p[CURVATURE] * factor_rate / square,
            )
            xx = 2.0 * moment * rx[g] * ry[g]
            xy = moment * (ry[g] * ry[g] - rx[g] * rx[g])
            for k in range(count):
                s = table[slopes + k * ends + g]
                B[FX, k] -= warm * s * ry[g]
                B[FY, k] += warm * s * rx[g]
                for l in range(count):
                    su = s * table[slopes + l * ends + g]
                    K[2 * k, 2 * l] += su * xx
                    K[2 * k, 2 * l + 1] += su * xy
                    K[2 * k + 1, 2 * l] += su * xy
                    K[2 * k + 1, 2 * l + 1] -= su * xx
    if factor_rate != 0.0:
        spread_time(bar, S, dt)
    spread_flexible_bar(element, bar, S)


@kernel(inline=True)
def spread_time(bar, S, dt):
    """Add what the time function alone changes to dt."""
    M, B = S.model, S.work.bar
    first = M.bar[bar, 0]
    for k in range(M.bar[bar, 1]):
        for e in range(M.shape_start[first + k], M.shape_start[first + k + 1]):
            if M.shape_column[e] < M.n:
                dt[M.n + M.shape_column[e]] += M.shape_row[0, e] * B[FX, k] + M.shape_row[1, e] * B[FY, k]


@kernel(inline=True)
def spread_flexible_bar(element, bar, S):
    """From derivatives by the vectors of shapes to those by the columns of the element."""
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
