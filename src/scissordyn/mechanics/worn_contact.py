"""Contact of a journal in a worn bearing: kinematics, forces, derivatives, energy and loads by angle.

Symbols are those of `contact` and `contour`. The elastic force f follows from the contour in the frame of the bearing's body.
Its direction n need not be that of e. The depths of a worn journal, which has turned by psi relative to the bearing, are added
to those of the bearing at the same direction. With the energy U(e, psi) and its lever g, with u = e' - w_B J e, the velocity of
the journal relative to the bearing's body, and J the rotation by 90 degrees,

    g = dU/dpsi / |f|,    delta' = u . n + g psi',    v_t = u . t + R_J psi',    psi' = w_J - w_B

The journal feels the moment -g N - R_J T, and the bearing N (e x n) + g N + (R_J + e . n) T. A round journal has g = 0.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.contour import COS, SIN, add_contours, crest, deepest, press
from scissordyn.mechanics.force_element import map_values
from scissordyn.mechanics.system import (
    ARM_N,
    ARM_T,
    DEPTH_BY_X,
    LEVER_BY_X,
    N_BY_V,
    N_BY_X,
    OTHER,
    OWN,
    PSI_BY_X,
    RATE_BY_X,
    SLIP_BY_V,
    SLIP_BY_X,
    TURN_OWN,
)

LOAD_DIRECTIONS = 180
"""Number of directions by which friction loads on a worn bearing are summed: 2 deg each, less than a loaded arc."""

# sagitta of a contour cell, divided by the clearance and multiplied by the square of the number of cells
SAGITTA = 0.5 * math.pi**2


@kernel
def body_direction(bx, by):
    """Return the unit direction of a body; the global x axis if the body does not rotate."""
    length = math.sqrt(bx * bx + by * by)
    if length == 0.0:
        return 1.0, 0.0
    return bx / length, by / length


@kernel
def relative_turn(ax, ay, bx, by):
    """Return cosine and sine of the angle by which the journal's body has turned relative to the bearing's."""
    cos, sin = body_direction(bx, by)
    jx, jy = body_direction(ax, ay)
    return jx * cos + jy * sin, jy * cos - jx * sin


@kernel
def write_surface(j, S, maps, turn):
    """Write the sum of both contours of contact j to Work.surface, by angle of the bearing, and its slope [m/rad].

    The journal is turned by the angle `turn` [rad] from its position in `maps`.
    """
    _, _, ax, ay, bx, by, _, _, _, _, _, _ = maps
    cos, sin = relative_turn(ax, ay, bx, by)
    P, W = S.parameters, S.work
    add_contours(P.contour[j], P.journal[j], math.atan2(sin, cos) + turn, W.surface[j], W.slopes[j])


@kernel
def pressed(j, S, maps, ex, ey, turn):
    """Return the elastic force on the bearing [N], the largest indentation [m] and its direction, and the lever g [m].

    The journal is at the eccentricity (ex, ey), and turned by the angle `turn` [rad] from its position in `maps`.
    """
    if S.parameters.contact[j].journal == 0:
        fx, fy, depth, ux, uy = pressed_on(j, S, maps, ex, ey, S.parameters.contour[j], S.work.scratch[0:0])
        return fx, fy, depth, ux, uy, 0.0
    shares, slope = S.work.shares, S.work.slopes[j]
    write_surface(j, S, maps, turn)
    shares[:] = 0.0
    fx, fy, depth, ux, uy = pressed_on(j, S, maps, ex, ey, S.work.surface[j], shares)
    moment, force = 0.0, math.sqrt(fx * fx + fy * fy)
    for k in range(shares.size):
        moment += shares[k] * slope[k]
    return fx, fy, depth, ux, uy, moment / force if force > 0.0 else 0.0


@kernel
def pressed_on(j, S, maps, ex, ey, contour, shares):
    """Return the elastic force on a contour [N], and the largest indentation [m] and its direction."""
    _, _, _, _, bx, by, _, _, _, _, _, _ = maps
    p = S.parameters.contact[j]
    cos, sin = body_direction(bx, by)
    x, y = ex * cos + ey * sin, ey * cos - ex * sin
    depth, at = deepest(x, y, contour, p.clearance)
    ux, uy = crest(x, y, contour, at)
    fx, fy, _ = press(x, y, contour, S.parameters.foundation[j], p.clearance, p.cell_area, shares)
    return fx * cos - fy * sin, fx * sin + fy * cos, depth, ux * cos - uy * sin, ux * sin + uy * cos


@kernel
def worn_gap(j, S, maps):
    """Return the largest indentation of contact j over all angles, negative in free flight, and its rate."""
    if S.parameters.contact[j].journal == 0:
        depth, rate, _ = gap_on(j, S, maps, S.parameters.contour[j])
        return depth, rate
    _, _, ax, ay, bx, by, _, _, px, py, qx, qy = maps
    write_surface(j, S, maps, 0.0)
    depth, rate, at = gap_on(j, S, maps, S.work.surface[j])
    return depth, rate + S.work.slopes[j, at] * (ax * py - ay * px - bx * qy + by * qx)


@kernel
def gap_on(j, S, maps, contour):
    """Return the largest indentation on a contour, its rate at a constant contour, and the index of its angle."""
    ex, ey, _, _, bx, by, vx, vy, _, _, qx, qy = maps
    cos, sin = body_direction(bx, by)
    depth, at = deepest(ex * cos + ey * sin, ey * cos - ex * sin, contour, S.parameters.contact[j].clearance)
    ux, uy = contour[at, COS], contour[at, SIN]
    nx, ny, spin = ux * cos - uy * sin, ux * sin + uy * cos, bx * qy - by * qx
    return depth, (vx + spin * ey) * nx + (vy - spin * ex) * ny, at


@kernel
def worn_kinematics(j, S, maps):
    """Write delta, delta', slip speed, n, e, the elastic force and its lever of contact j into Work.contact."""
    ex, ey, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    contact = S.work.contact[j]
    fx, fy, depth, nx, ny, lever = pressed(j, S, maps, ex, ey, 0.0)
    force, p = math.sqrt(fx * fx + fy * fy), S.parameters.contact[j]
    if force > 0.0:
        # a contact smaller than a cell presses on one angle of the contour; its direction is not resolved there
        part = min(1.0, depth / (p.clearance * SAGITTA / (p.cells * p.cells)))
        nx, ny = nx + part * (fx / force - nx), ny + part * (fy / force - ny)
        length = math.sqrt(nx * nx + ny * ny)
        nx, ny = nx / length, ny / length
    spin = bx * qy - by * qx
    ux, uy = vx + spin * ey, vy - spin * ex
    contact.depth, contact.elastic, contact.lever = depth, force, lever
    contact.rate = ux * nx + uy * ny
    if p.journal == 1:
        contact.rate += lever * (ax * py - ay * px - spin)
    contact.slip = uy * nx - ux * ny + p.radius * (ax * py - ay * px - spin)
    contact.nx, contact.ny = nx, ny
    contact.distance, contact.aside = ex * nx + ey * ny, ey * nx - ex * ny


@kernel
def displaced_force(j, S, maps, along, across, turn):
    """Return elastic force [N], indentation [m], force components along n and t, and lever [m] for a displaced journal.

    The displacements `along` n and `across`, along t, and the rotation `turn` are relative to its position in `maps`.
    """
    ex, ey, _, _, _, _, _, _, _, _, _, _ = maps
    nx, ny = S.work.contact[j].nx, S.work.contact[j].ny
    ex, ey = ex + along * nx - across * ny, ey + along * ny + across * nx
    fx, fy, depth, _, _, lever = pressed(j, S, maps, ex, ey, turn)
    return math.sqrt(fx * fx + fy * fy), depth, fx * nx + fy * ny, fy * nx - fx * ny, lever


@kernel
def worn_energy(j, S):
    """Return the elastic energy of contact j [J]."""
    maps = map_values(j, S)
    if S.parameters.contact[j].journal == 0:
        return energy_on(j, S, maps, S.parameters.contour[j])
    write_surface(j, S, maps, 0.0)
    return energy_on(j, S, maps, S.work.surface[j])


@kernel
def energy_on(j, S, maps, contour):
    """Return the elastic energy of contact j on a contour [J]."""
    ex, ey, _, _, bx, by, _, _, _, _, _, _ = maps
    p = S.parameters.contact[j]
    cos, sin = body_direction(bx, by)
    x, y = ex * cos + ey * sin, ey * cos - ex * sin
    _, _, energy = press(x, y, contour, S.parameters.foundation[j], p.clearance, p.cell_area, S.work.scratch[0:0])
    return energy


@kernel
def add_loads(S, power, first):
    """Write the friction loads F_n |v_t| and F_n^2 |v_t| of worn contacts to power[first:], by the direction of the force.

    Each worn contact has `LOAD_DIRECTIONS` entries for each load. The direction is that of the force on the bearing, in the
    frame of its body. A load between two directions is shared between them, so that the sum over all directions is exact. If
    the journal is worn, F_n |v_t| times cosine and sine of the journal's rotation psi relative to the bearing follow, and then
    the four loads by the direction in the frame of the journal's body. Those of hard contacts follow from `add_hard_loads`.
    """
    for q in range(first, power.size):
        power[q] = 0.0
    for j in range(S.parameters.contact.size):
        if S.state.mode[j] == 1 and S.parameters.law[j].stiffness != 0:
            contact = S.work.contact[j]
            add_contact_loads(j, S, contact.normal * abs(contact.slip), contact.normal, power, first)


@kernel
def add_contact_loads(j, S, rate, normal, power, first):
    """Add the loads of contact j with the friction load `rate` and a normal force to power[first:]."""
    p, contact, at = S.parameters.contact[j], S.work.contact[j], first
    if p.loads == 0:
        return
    for k in range(j):
        at += S.parameters.contact[k].loads * LOAD_DIRECTIONS
    _, _, ax, ay, bx, by, _, _, _, _, _, _ = map_values(j, S)
    cos, sin = body_direction(bx, by)
    angle = math.atan2(contact.ny * cos - contact.nx * sin, contact.nx * cos + contact.ny * sin)
    add_load(power, at, angle, rate, 1.0, normal)
    if p.loads > 2:
        cos, sin = relative_turn(ax, ay, bx, by)
        turned, half = angle - math.atan2(sin, cos), at + 4 * LOAD_DIRECTIONS
        add_load(power, at + 2 * LOAD_DIRECTIONS, angle, rate, cos, sin)
        add_load(power, half, turned, rate, 1.0, normal)
        add_load(power, half + 2 * LOAD_DIRECTIONS, turned, rate, cos, sin)


@kernel
def add_load(power, at, angle, rate, first, second):
    """Add a rate times two factors to the two directions next to an angle from -2 pi to 2 pi."""
    place = angle * LOAD_DIRECTIONS / (2.0 * math.pi) + LOAD_DIRECTIONS
    k = int(place)
    share = place - k
    low, high = at + k % LOAD_DIRECTIONS, at + (k + 1) % LOAD_DIRECTIONS
    power[low] += (1.0 - share) * rate * first
    power[high] += share * rate * first
    power[low + LOAD_DIRECTIONS] += (1.0 - share) * rate * second
    power[high + LOAD_DIRECTIONS] += share * rate * second


@kernel
def worn_slopes(j, S, n_d, n_a, n_p, n_r, turn_d, turn_a, turn_p, g_d, g_a, g_p):
    """Write the derivatives of force and motion of contact j to Work.local, and the effect of its rotation to Work.block_x.

    n_d, n_a, n_p, n_r are the derivatives of F_n by a displacement along n and along t, by psi and by delta'. Those of the
    angle of n are turn_d, turn_a, turn_p, and those of the lever g_d, g_a, g_p.
    """
    M, W = S.model, S.work
    radius, contact = S.parameters.contact[j].radius, W.contact[j]
    ex, ey, ax, ay, bx, by, vx, vy, px, py, qx, qy = map_values(j, S)
    normal, tangential, nx, ny, lever = contact.normal, contact.tangential, contact.nx, contact.ny, contact.lever
    tx, ty = -ny, nx
    spin = bx * qy - by * qx
    ux, uy, turning = vx + spin * ey, vy - spin * ex, ax * py - ay * px - spin
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
        psi, psi_rate = ax * r3 - ay * r2 - turn, r2 * py - r3 * px - spun
        tilt, longer = turn_d * g_n + turn_a * g_t + turn_p * psi, g_d * g_n + g_a * g_t + g_p * psi
        rate = tilt * across + hx * nx + hy * ny + longer * turning + lever * psi_rate
        out = g_n + lever * psi
        local[ARM_N, a], local[ARM_T, a] = -out, -g_t - radius * psi
        local[N_BY_X, a], local[N_BY_V, a] = n_d * g_n + n_a * g_t + n_p * psi + n_r * rate, n_r * out
        local[DEPTH_BY_X, a], local[RATE_BY_X, a] = g_n, rate
        local[SLIP_BY_X, a], local[SLIP_BY_V, a] = hx * tx + hy * ty - tilt * along + radius * psi_rate, g_t + radius * psi
        local[OWN, a], local[OTHER, a], local[TURN_OWN, a] = g_t, tilt + turn, turn
        local[PSI_BY_X, a], local[LEVER_BY_X, a] = psi, longer
    for a in range(count):
        k = start + a
        r2, r3, r4, r5 = row[2, k], row[3, k], row[4, k], row[5, k]
        turn, psi, g_n, g_t = local[TURN_OWN, a], local[PSI_BY_X, a], local[DEPTH_BY_X, a], local[OWN, a]
        for b in range(count):
            k = start + b
            tilted, twist = local[OTHER, b], row[4, k] * r5 - row[5, k] * r4
            bent = row[2, k] * r3 - row[3, k] * r2 - twist
            d_n, d_t = row[0, k] * nx + row[1, k] * ny, row[0, k] * tx + row[1, k] * ty
            # J e . n = -e . t and J e . t = e . n
            W.block_x[block + a * count + b] = -normal * (
                tilted * g_t + twist * e_t + turn * d_t + local[LEVER_BY_X, b] * psi + lever * bent
            ) - tangential * (-tilted * g_n - twist * e_n - turn * d_n + radius * bent)
