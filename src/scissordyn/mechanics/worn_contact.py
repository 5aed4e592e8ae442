"""Contact of a journal in a worn bearing: kinematics, forces, derivatives, energy and loads by angle.

Symbols are those of `contact` and `contour`. The elastic force f follows from the contour in the frame of the bearing's body,
turned by psi. Its direction n need not be that of e. With u = e' - w_B J e, the velocity of the journal relative to the
bearing's body, and J the rotation by 90 degrees,

    delta' = u . n,    v_t = u . t + R_J (w_J - w_B)

Forces on the journal act through its centre, so that the bearing feels the moment N (e x n) + (R_J + e . n) T.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.contour import COS, SIN, crest, deepest, press
from scissordyn.mechanics.force_element import map_values
from scissordyn.mechanics.system import (
    ARM_N,
    ARM_T,
    DEPTH_BY_X,
    N_BY_V,
    N_BY_X,
    OTHER,
    OWN,
    RATE_BY_X,
    SLIP_BY_V,
    SLIP_BY_X,
    TURN_OWN,
)

LOAD_DIRECTIONS = 180
"""Number of directions by which the friction loads on a worn bearing are summed up: 2 degrees, less than a loaded contact."""

SAGITTA = 0.5 * math.pi**2  # sagitta of a cell over the clearance, times the square of the number of cells


@kernel
def bearing_direction(bx, by):
    """Return the unit direction of a bearing's body; the global x axis if the body does not rotate."""
    length = math.sqrt(bx * bx + by * by)
    if length == 0.0:
        return 1.0, 0.0
    return bx / length, by / length


@kernel
def pressed(j, S, ex, ey, bx, by):
    """Return the elastic force on the bearing [N], the largest indentation [m] and its direction."""
    p, contour = S.parameters.contact[j], S.parameters.contour[j]
    cos, sin = bearing_direction(bx, by)
    x, y = ex * cos + ey * sin, ey * cos - ex * sin
    depth, at = deepest(x, y, contour, p.clearance)
    ux, uy = crest(x, y, contour, at)
    fx, fy, _ = press(x, y, contour, S.parameters.foundation[j], p.clearance, p.cell_area, S.work.scratch[0:0])
    return fx * cos - fy * sin, fx * sin + fy * cos, depth, ux * cos - uy * sin, ux * sin + uy * cos


@kernel
def worn_gap(j, S, maps):
    """Return the largest indentation of contact j over all angles, negative in free flight, and its rate."""
    ex, ey, _, _, bx, by, vx, vy, _, _, qx, qy = maps
    cos, sin = bearing_direction(bx, by)
    contour = S.parameters.contour[j]
    depth, at = deepest(ex * cos + ey * sin, ey * cos - ex * sin, contour, S.parameters.contact[j].clearance)
    ux, uy = contour[at, COS], contour[at, SIN]
    nx, ny, spin = ux * cos - uy * sin, ux * sin + uy * cos, bx * qy - by * qx
    return depth, (vx + spin * ey) * nx + (vy - spin * ex) * ny


@kernel
def worn_kinematics(j, S, maps):
    """Write delta, delta', slip speed, n, |e| and the elastic force of contact j into Work.contact."""
    ex, ey, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    contact = S.work.contact[j]
    fx, fy, depth, nx, ny = pressed(j, S, ex, ey, bx, by)
    force, p = math.sqrt(fx * fx + fy * fy), S.parameters.contact[j]
    if force > 0.0:
        # a contact smaller than a cell presses on one angle of the contour; its direction is not resolved there
        part = min(1.0, depth / (p.clearance * SAGITTA / (p.cells * p.cells)))
        nx, ny = nx + part * (fx / force - nx), ny + part * (fy / force - ny)
        length = math.sqrt(nx * nx + ny * ny)
        nx, ny = nx / length, ny / length
    spin = bx * qy - by * qx
    ux, uy = vx + spin * ey, vy - spin * ex
    contact.depth, contact.elastic = depth, force
    contact.rate = ux * nx + uy * ny
    contact.slip = uy * nx - ux * ny + p.radius * (ax * py - ay * px - spin)
    contact.nx, contact.ny = nx, ny
    contact.distance = math.sqrt(ex * ex + ey * ey)


@kernel
def displaced_force(j, S, maps, along, across):
    """Return elastic force [N], indentation [m] and force components along n and t for a displaced journal of contact j.

    The displacements `along` n and `across`, along t, are relative to its position in `maps`.
    """
    ex, ey, _, _, bx, by, _, _, _, _, _, _ = maps
    nx, ny = S.work.contact[j].nx, S.work.contact[j].ny
    fx, fy, depth, _, _ = pressed(j, S, ex + along * nx - across * ny, ey + along * ny + across * nx, bx, by)
    return math.sqrt(fx * fx + fy * fy), depth, fx * nx + fy * ny, fy * nx - fx * ny


@kernel
def worn_energy(j, S):
    """Return the elastic energy of contact j [J]."""
    ex, ey, _, _, bx, by, _, _, _, _, _, _ = map_values(j, S)
    p = S.parameters.contact[j]
    cos, sin = bearing_direction(bx, by)
    x, y = ex * cos + ey * sin, ey * cos - ex * sin
    contour, table = S.parameters.contour[j], S.parameters.foundation[j]
    _, _, energy = press(x, y, contour, table, p.clearance, p.cell_area, S.work.scratch[0:0])
    return energy


@kernel
def add_loads(S, power, first):
    """Write the friction loads F_n |v_t| and F_n^2 |v_t| of worn contacts to power[first:], by the direction of the force.

    Each worn contact has `LOAD_DIRECTIONS` entries for either load. The direction is that of the force on the bearing, in the
    frame of its body. A load between two directions is shared between them, so that the sum over all directions is exact.
    """
    for q in range(first, power.size):
        power[q] = 0.0
    at = first
    for j in range(S.parameters.contact.size):
        if S.parameters.contact[j].cells == 0:
            continue
        if S.state.mode[j] == 1:
            contact = S.work.contact[j]
            _, _, _, _, bx, by, _, _, _, _, _, _ = map_values(j, S)
            cos, sin = bearing_direction(bx, by)
            angle = math.atan2(contact.ny * cos - contact.nx * sin, contact.nx * cos + contact.ny * sin)
            place = angle * LOAD_DIRECTIONS / (2.0 * math.pi) + LOAD_DIRECTIONS
            k = int(place)
            share, rate = place - k, contact.normal * abs(contact.slip)
            low, high = at + k % LOAD_DIRECTIONS, at + (k + 1) % LOAD_DIRECTIONS
            power[low] += (1.0 - share) * rate
            power[high] += share * rate
            power[low + LOAD_DIRECTIONS] += (1.0 - share) * rate * contact.normal
            power[high + LOAD_DIRECTIONS] += share * rate * contact.normal
        at += 2 * LOAD_DIRECTIONS


@kernel
def worn_slopes(j, S, n_d, n_a, n_r, turn_d, turn_a):
    """Write the derivatives of force and motion of contact j to Work.local, and the effect of its rotation to Work.block_x.

    n_d, n_a, n_r are the derivatives of F_n by a displacement along n and along t and by delta'. turn_d and turn_a are those
    of the angle of n.
    """
    M, W = S.model, S.work
    radius, contact = S.parameters.contact[j].radius, W.contact[j]
    ex, ey, ax, ay, bx, by, vx, vy, px, py, qx, qy = map_values(j, S)
    normal, tangential, nx, ny = contact.normal, contact.tangential, contact.nx, contact.ny
    tx, ty = -ny, nx
    spin = bx * qy - by * qx
    ux, uy = vx + spin * ey, vy - spin * ex
    along, across = ux * nx + uy * ny, ux * tx + uy * ty
    e_n, e_t = ex * nx + ey * ny, ex * tx + ey * ty
    row, start, count = M.element_row, M.element_start[j], M.element_start[j + 1] - M.element_start[j]
    block, local = M.block_start[j], W.local
    for a in range(count):
        k = start + a
        r0, r1, r2, r3, r4, r5 = row[0, k], row[1, k], row[2, k], row[3, k], row[4, k], row[5, k]
        turn = bx * r5 - by * r4  # of the bearing; by X it is that of psi, by V that of w_B
        gx, gy = r0 + turn * ey, r1 - turn * ex
        g_n, g_t = gx * nx + gy * ny, gx * tx + gy * ty
        spun = r4 * qy - r5 * qx
        # change of u in the frame of the bearing
        hx, hy = spin * r1 + spun * ey + turn * uy, -spin * r0 - spun * ex - turn * ux
        tilt = turn_d * g_n + turn_a * g_t
        rolled, rolling = radius * (ax * r3 - ay * r2 - turn), radius * (r2 * py - r3 * px - spun)
        rate = tilt * across + hx * nx + hy * ny
        local[ARM_N, a], local[ARM_T, a] = -g_n, -g_t - rolled
        local[N_BY_X, a], local[N_BY_V, a] = n_d * g_n + n_a * g_t + n_r * rate, n_r * g_n
        local[DEPTH_BY_X, a], local[RATE_BY_X, a] = g_n, rate
        local[SLIP_BY_X, a], local[SLIP_BY_V, a] = hx * tx + hy * ty - tilt * along + rolling, g_t + rolled
        local[OWN, a], local[OTHER, a], local[TURN_OWN, a] = g_t, tilt + turn, turn
    for a in range(count):
        k = start + a
        r2, r3, r4, r5 = row[2, k], row[3, k], row[4, k], row[5, k]
        turn, g_n, g_t = local[TURN_OWN, a], -local[ARM_N, a], local[OWN, a]
        for b in range(count):
            k = start + b
            tilted, twist = local[OTHER, b], row[4, k] * r5 - row[5, k] * r4
            rolled = row[2, k] * r3 - row[3, k] * r2 - twist
            d_n, d_t = row[0, k] * nx + row[1, k] * ny, row[0, k] * tx + row[1, k] * ty
            # J e . n = -e . t and J e . t = e . n
            W.block_x[block + a * count + b] = -normal * (tilted * g_t + twist * e_t + turn * d_t) - tangential * (
                -tilted * g_n - twist * e_n - turn * d_n + radius * rolled
            )
