"""Contact of a rounded corner of one body with a plane guide surface of another: position, forces, derivatives.

u is the centre of the corner's arc relative to a point of the surface's frame; a and b are unit directions of the corner's body
and the surface's body, w_a and w_b their angular velocities. R is the radius of the arc, n the unit vector towards the surface
(fixed in its body), t = n rotated left.

    delta = u.n - level,   delta' = u'.n + (u.t) w_b,   v = u'.t + R w_a - (u.n + R) w_b

Both bodies are pushed at the same point, the tip of the arc u + R n, so that momentum is conserved:

    on the corner F = -F_n n - F_t t and the torque -R F_t about its centre; on the surface's body -F and the torque
    (u.n + R) F_t - (u.t) F_n about the point where u starts.
"""

from __future__ import annotations

from scissordyn.kernel import kernel
from scissordyn.mechanics.force_element import add_torques, map_values, write_wrench
from scissordyn.mechanics.system import ARM_N, ARM_T, DEPTH_BY_X, N_BY_V, N_BY_X, OTHER, OWN, RATE_BY_X, SLIP_BY_V, SLIP_BY_X


@kernel
def surface_normal(j, S, bx, by):
    """Return the normal n in the fixed frame."""
    p = S.parameters.contact[j]
    return p.normal_x * bx - p.normal_y * by, p.normal_y * bx + p.normal_x * by


@kernel
def plane_gap(j, S, maps):
    """Return the indentation delta and its rate; delta is negative in free flight."""
    ux, uy, _, _, bx, by, vx, vy, _, _, qx, qy = maps
    nx, ny = surface_normal(j, S, bx, by)
    turn = bx * qy - by * qx
    return ux * nx + uy * ny - S.parameters.contact[j].level, vx * nx + vy * ny + (uy * nx - ux * ny) * turn


@kernel
def plane_kinematics(j, S, maps):
    """Write delta, delta', slip speed and n to Work.contact, and the distance delta + clearance."""
    p, contact = S.parameters.contact[j], S.work.contact[j]
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    radius = p.radius
    nx, ny = surface_normal(j, S, bx, by)
    depth, rate = plane_gap(j, S, maps)
    contact.depth = depth
    contact.rate = rate
    contact.slip = vy * nx - vx * ny + radius * (ax * py - ay * px) - (ux * nx + uy * ny + radius) * (bx * qy - by * qx)
    contact.nx = nx
    contact.ny = ny
    contact.distance = depth + p.clearance


@kernel
def plane_forces(j, S, maps, normal, tangential):
    """Add the forces of a corner to Work.force."""
    p, contact, target = S.parameters.contact[j], S.work.contact[j], S.work.force
    ux, uy, ax, ay, bx, by, _, _, _, _, _, _ = maps
    nx, ny, radius = contact.nx, contact.ny, p.radius
    fx, fy = -normal * nx + tangential * ny, -normal * ny - tangential * nx
    moment = (ux * nx + uy * ny + radius) * tangential - (uy * nx - ux * ny) * normal
    write_wrench(j, S, fx, fy, -radius * tangential, moment)
    add_torques(j, S, fx, fy, -radius * tangential, moment, ax, ay, bx, by, target, 0, target.size)


@kernel
def plane_slopes(j, S, n_d, n_r):
    """Write derivatives of force and motion of a corner, in the columns of `linearise_contact`, and its rotating forces."""
    M, W = S.model, S.work
    p, contact = S.parameters.contact[j], W.contact[j]
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = map_values(j, S)
    normal, tangential, nx, ny = contact.normal, contact.tangential, contact.nx, contact.ny
    cx, cy, radius = p.normal_x, p.normal_y, p.radius
    row, start, count = M.element_row, M.element_start[j], M.element_start[j + 1] - M.element_start[j]
    block, local = M.block_start[j], W.local
    turn = bx * qy - by * qx
    aside, reach = uy * nx - ux * ny, ux * nx + uy * ny + radius  # u.t and u.n + R
    for a in range(count):
        k = start + a
        r0, r1, r2, r3, r4, r5 = row[0, k], row[1, k], row[2, k], row[3, k], row[4, k], row[5, k]
        mx, my = cx * r4 - cy * r5, cy * r4 + cx * r5  # d n; d t is (-my, mx)
        rotation, rotation_rate = bx * r5 - by * r4, r4 * qy - r5 * qx
        outward = r0 * nx + r1 * ny + ux * mx + uy * my
        sideways = r1 * nx - r0 * ny + uy * mx - ux * my
        arm = r0 * nx + r1 * ny + aside * rotation
        moment_arm = r1 * nx - r0 * ny + radius * (ax * r3 - ay * r2) - reach * rotation
        rate = vx * mx + vy * my + sideways * turn + aside * rotation_rate
        local[ARM_N, a] = -arm
        local[ARM_T, a] = -moment_arm
        local[N_BY_X, a] = n_d * outward + n_r * rate
        local[N_BY_V, a] = n_r * arm
        local[DEPTH_BY_X, a] = outward
        local[RATE_BY_X, a] = rate
        local[SLIP_BY_X, a] = vy * mx - vx * my + radius * (r2 * py - r3 * px) - outward * turn - reach * rotation_rate
        local[SLIP_BY_V, a] = moment_arm
        local[OWN, a] = outward
        local[OTHER, a] = sideways
    for a in range(count):
        k = start + a
        r0, r1, r2, r3, r4, r5 = row[0, k], row[1, k], row[2, k], row[3, k], row[4, k], row[5, k]
        rotation = bx * r5 - by * r4
        for b in range(count):
            i = start + b
            s4, s5 = row[4, i], row[5, i]
            mx, my = cx * s4 - cy * s5, cy * s4 + cx * s5
            twist = s4 * r5 - s5 * r4
            by_arm = r0 * mx + r1 * my + local[OTHER, b] * rotation + aside * twist
            by_moment_arm = (
                r1 * mx - r0 * my + radius * (row[2, i] * r3 - row[3, i] * r2) - local[OWN, b] * rotation - reach * twist
            )
            W.block_x[block + a * count + b] = -normal * by_arm - tangential * by_moment_arm
