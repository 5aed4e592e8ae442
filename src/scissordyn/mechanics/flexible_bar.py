"""Forces of a flexible bar, a single component with several cross-sections, on its shape vectors q_k.

At points of quadrature r' = sum S_k' q_k, g = |r'|, t = r'/g, and the strain is e = g - 1 - e_0, with e_0 from a temperature.
Axial forces times weights are N = EA A e with the constant matrix A of `Shapes.stretching`. Bending has the constant matrix
K = int S_k'' S_l'' ds. Temperatures with curvature c act as moments EI c (1 + e_0)^2 at both ends:

    f_k = -EI sum K_kl q_l - sum S_k' N t + EI c (1 + e_0)^2 [S_k' J r'/g^2] from one end to the other.

A bar with g = 1 + e_0 and the curvature c then has no stress, because r'' grows with g.

Damping adds EA w tau g' to N and the moment EI tau (r' x r'')'; r' x r'' is the curvature if the strain is neglected.
"""

from __future__ import annotations

import math

from scissordyn.kernel import equals, kernel
from scissordyn.mechanics.bending_loads import note_shape_forces
from scissordyn.mechanics.lanes import LANES, combine, join, padded, part, pull, stretch, transform
from scissordyn.mechanics.time_function import motion_at

EA, EI, TAU, STRAIN, CURVATURE, LENGTH = range(6)  # Columns of a bar's parameters

QX, QY, VX, VY, FX, FY, RX, RY, HX, HY, STRETCH, INVERSE, AXIAL, ENDX, ENDY, HELD, READ = range(17)
"""Rows of `Workspace.bar`.

They are: vectors, their rates, forces; r' at the points; the vectors times -EI, followed by the forces on r'; strains at the
points, 1/|r'| and A e; r' at both ends; the vectors of static shapes one after another, and the columns they depend on.
"""


@kernel
def tables_of(bar, S):
    """Return the numbers of shapes and points, padded row widths, and where the tables of a bar begin.

    The tables are weights, slopes of the shapes at points, stretching, and the matrix for forces: the bending form, slopes and
    second derivatives by points.
    """
    M = S.model
    count, points, weights = M.bar[bar, 1], M.bar[bar, 2], M.bar[bar, 3]
    across, wide = padded(points), padded(count)
    slopes = weights + points
    stretching = slopes + count * (across + LANES)
    return count, points, across, wide, weights, slopes, stretching, stretching + points * across


@kernel
def whole_pairs(modes):
    """Return the number of shape vectors of modes that fill whole lanes of the processor's vector unit."""
    pairs = LANES // 2
    return pairs * (modes // pairs)


@kernel
def read_vectors(bar, S, source, x, y):
    """Write the shape vectors of a bar into x and y; `source` has the positions or velocities of the columns."""
    M = S.model
    fixed, column, scale = M.bar[bar, 4], M.bar[bar, 5], M.bar_scale[bar]
    whole = whole_pairs(M.bar[bar, 1] - fixed)
    part(source, column, scale, x, y, fixed, whole)
    for k in range(fixed + whole, M.bar[bar, 1]):
        at = column + 2 * (k - fixed)
        x[k], y[k] = scale * source[at], scale * source[at + 1]
    held_of, table, columns, at = S.work.bar[HELD], M.bar[bar, 6], M.bar[bar, 7], M.bar[bar, 8]
    read, wide = S.work.bar[READ], padded(2 * fixed)
    for c in range(columns):
        read[c] = source[M.bar_column[at + c]]
    transform(M.bar_table, table, columns, wide, read, held_of)
    for k in range(fixed):
        x[k], y[k] = held_of[2 * k], held_of[2 * k + 1]


@kernel
def add_vectors(bar, S, x, y, target):
    """Add forces x, y on the shape vectors of a bar to the forces on the columns."""
    M = S.model
    fixed, column, scale = M.bar[bar, 4], M.bar[bar, 5], M.bar_scale[bar]
    whole = whole_pairs(M.bar[bar, 1] - fixed)
    join(target, column, scale, x, y, fixed, whole)
    for k in range(fixed + whole, M.bar[bar, 1]):
        at = column + 2 * (k - fixed)
        target[at] += scale * x[k]
        target[at + 1] += scale * y[k]
    held_of, table, columns, at = S.work.bar[HELD], M.bar[bar, 6], M.bar[bar, 7], M.bar[bar, 8]
    read, table = S.work.bar[READ], table + columns * padded(2 * fixed)
    for k in range(fixed):
        held_of[2 * k], held_of[2 * k + 1] = x[k], y[k]
    transform(M.bar_table, table, 2 * fixed, padded(columns), held_of, read)
    for c in range(columns):
        target[M.bar_column[at + c]] += read[c]


@kernel
def warmth(t, i, S):
    """Return the factor of the temperatures of the flexible bar of component i, and its rate."""
    if S.model.function[i] < 0:
        return 1.0, 0.0
    motion_at(t, S.model.function[i], S)
    return S.work.function_value[0], S.work.function_value[1]


@kernel
def warm_bending(p, factor, factor_rate):
    """Return thermal curvature times (1 + e_0)^2, its rate, squared curvature times (1 + e_0)^2, and its rate."""
    c, c_rate = factor * p[CURVATURE], factor_rate * p[CURVATURE]
    grown, growing = 1.0 + factor * p[STRAIN], factor_rate * p[STRAIN]
    rate, square_rate = grown * (c_rate * grown + 2.0 * c * growing), 2.0 * c * grown * (c_rate * grown + c * growing)
    return c * grown * grown, rate, c * grown * c * grown, square_rate


@kernel
def write_strains(bar, S, free):
    """Write vectors, r' and 1/|r'|, the strains minus `free`, and A e."""
    table, B = S.model.bar_table, S.work.bar
    count, points, across, _, _, slopes, stretching, _ = tables_of(bar, S)
    x, y, rx, ry, e = B[QX], B[QY], B[RX], B[RY], B[STRETCH]
    read_vectors(bar, S, S.work.X, x, y)
    # r' at the points of quadrature
    combine(table, slopes, count, across, x, y, rx, ry)
    # e = |r'| - 1 - e_0
    stretch(rx, ry, free, B[INVERSE], e, across)
    transform(table, stretching, points, across, e, B[AXIAL])


@kernel
def add_flexible_bar(t, i, S):
    """Add the forces of the bar of component i to Work.force; write its powers, and its strain energy if asked to."""
    M, W, p = S.model, S.work, S.parameters.component[i]
    bar, B = M.bar_of[i], W.bar
    count, points, across, wide, weights, _, _, forces = tables_of(bar, S)
    x, y, fx, fy, hx, hy, axial = B[QX], B[QY], B[FX], B[FY], B[HX], B[HY], B[AXIAL]
    factor, factor_rate = warmth(t, i, S)
    write_strains(bar, S, factor * p[STRAIN])
    if W.with_energy[0] == 1:
        W.stored_energy[i] = strain_energy(i, factor, S)
    stiffness = p[EI]
    # -S_k' N t, N = EA A e
    pull(-p[EA], axial, B[INVERSE], B[RX], B[RY], hx[count:], hy[count:], across)
    # -EI K q
    for k in range(count):
        hx[k] = -stiffness * x[k]
        hy[k] = -stiffness * y[k]
    rows = count + points
    W.dissipation[i] = W.power_in[i] = 0.0
    if not equals(p[TAU], 0.0):
        W.dissipation[i] = write_damping(bar, S, p, weights, forces)
        rows += points
    combine(M.bar_table, forces, rows, wide, hx, hy, fx, fy)
    # temperature gradient over the depth: opposite moments at both ends
    if not equals(p[CURVATURE], 0.0):
        curvature, rate, _, square_rate = warm_bending(p, factor, factor_rate)
        turned = add_end_moments(bar, S, p[EI] * curvature)
        W.power_in[i] -= p[EI] * (rate * turned - 0.5 * square_rate * p[LENGTH])
    if not equals(factor_rate, 0.0):
        for g in range(points):
            W.power_in[i] -= factor_rate * p[STRAIN] * p[EA] * axial[g]
    add_vectors(bar, S, fx, fy, W.force)
    note_shape_forces(M.bar[bar, 0], count, fx, fy, 1.0, 1.0, S)


@kernel
def slopes_at_ends(bar, S):
    """Write r' at both ends to rows ENDX and ENDY; return the angle by which the bar turns between them."""
    B = S.work.bar
    count, _, across, _, _, slopes, _, _ = tables_of(bar, S)
    rx, ry = B[ENDX], B[ENDY]
    combine(S.model.bar_table, slopes + count * across, count, LANES, B[QX], B[QY], rx, ry)
    return math.atan2(rx[0] * ry[1] - ry[0] * rx[1], rx[0] * rx[1] + ry[0] * ry[1])


@kernel
def add_end_moments(bar, S, moment):
    """Add opposite moments at both ends to the forces; return the angle by which the bar turns between them."""
    table, B = S.model.bar_table, S.work.bar
    count, _, across, _, _, slopes, _, _ = tables_of(bar, S)
    turned = slopes_at_ends(bar, S)
    rx, ry, fx, fy = B[ENDX], B[ENDY], B[FX], B[FY]
    for end in range(2):
        force = (2.0 * end - 1.0) * moment / (rx[end] * rx[end] + ry[end] * ry[end])
        for k in range(count):
            slope = table[slopes + count * across + k * LANES + end]
            fx[k] -= force * slope * ry[end]
            fy[k] += force * slope * rx[end]
    return turned


@kernel
def strain_energy(i, factor, S):
    """Return the strain energy [J] of the bar of component i after `write_strains`; `factor` is that of its temperatures."""
    M, p, B = S.model, S.parameters.component[i], S.work.bar
    bar = M.bar_of[i]
    count, points, _, wide, _, _, _, forces = tables_of(bar, S)
    x, y, fx, fy, e, axial = B[QX], B[QY], B[FX], B[FY], B[STRETCH], B[AXIAL]
    twice = 0.0
    for g in range(points):
        twice += p[EA] * e[g] * axial[g]
    combine(M.bar_table, forces, count, wide, x, y, fx, fy)
    for k in range(count):
        twice += p[EI] * (x[k] * fx[k] + y[k] * fy[k])
    if not equals(p[CURVATURE], 0.0):
        curvature, _, square, _ = warm_bending(p, factor, 0.0)
        twice += p[EI] * (square * p[LENGTH] - 2.0 * curvature * slopes_at_ends(bar, S))
    return 0.5 * twice


@kernel
def write_damping(bar, S, p, weights, forces):
    """Add damping to the forces on r' and write those on r''; return the dissipated power."""
    M, W = S.model, S.work
    count, points, table = M.bar[bar, 1], M.bar[bar, 2], M.bar_table
    B, wide = W.bar, padded(count)
    x, y, vx, vy, rx, ry, hx, hy = B[QX], B[QY], B[VX], B[VY], B[RX], B[RY], B[HX], B[HY]
    read_vectors(bar, S, W.V, vx, vy)
    lost = 0.0
    for g in range(points):
        px, py, bx, by, qx, qy = derivatives(table, forces + (count + g) * wide, points * wide, count, x, y, vx, vy)
        size, weight = math.sqrt(rx[g] * rx[g] + ry[g] * ry[g]), p[TAU] * table[weights + g]
        # g' and (r' x r'')'
        rate = (rx[g] * px + ry[g] * py) / size
        turning = px * by - py * bx + rx[g] * qy - ry[g] * qx
        axial, moment = weight * p[EA] * rate, weight * p[EI] * turning
        lost += axial * rate + moment * turning
        hx[count + g] -= axial * rx[g] / size + moment * by
        hy[count + g] -= axial * ry[g] / size - moment * bx
        hx[count + points + g], hy[count + points + g] = moment * ry[g], -moment * rx[g]
    return lost


@kernel
def derivatives(table, first, apart, count, x, y, vx, vy):
    """Return the rate of r', r'' and its rate at a point of quadrature."""
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
