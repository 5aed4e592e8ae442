"""A rounded corner of one body at a straight wall of another: where it is, and how its forces change.

Letters: u centre of the corner's arc from a point of the wall's frame, a and b unit directions of the corner's body and of the
wall's, w_a and w_b their spins, R radius of the arc, n unit vector towards the wall (fixed in its body), t = n turned left.

    delta = u.n - level,   delta' = u'.n + (u.t) w_b,   v = u'.t + R w_a - (u.n + R) w_b

Both bodies are pushed at the same point, the tip of the arc u + R n, so that no momentum is lost:

    on the corner F = -F_n n - F_t t and the torque -R F_t about its centre; on the wall's body -F and the torque
    (u.n + R) F_t - (u.t) F_n about the point that u starts from.
"""

from __future__ import annotations

from scissordyn.jit import kernel
from scissordyn.mechanics.link import link_forms, push_turns

__all__ = ["corner_gap", "corner_kinematics", "corner_slopes", "push_corner"]


@kernel(inline=True)
def wall_normal(j, S, bx, by):
    """The normal n in the fixed frame."""
    return S.wall[j, 0] * bx - S.wall[j, 1] * by, S.wall[j, 1] * bx + S.wall[j, 0] * by


@kernel(inline=True)
def corner_gap(j, S, forms):
    """Indentation delta and its rate; negative in free flight."""
    ux, uy, _, _, bx, by, vx, vy, _, _, qx, qy = forms
    nx, ny = wall_normal(j, S, bx, by)
    turn = bx * qy - by * qx
    return ux * nx + uy * ny - S.wall[j, 2], vx * nx + vy * ny + (uy * nx - ux * ny) * turn


@kernel(inline=True)
def corner_kinematics(j, S, forms):
    """Write delta, delta', slip speed, n and the way towards the wall into S.joint."""
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = forms
    out, radius = S.joint, S.radius[j, 1]
    nx, ny = wall_normal(j, S, bx, by)
    depth, rate = corner_gap(j, S, forms)
    out[j, 0] = depth
    out[j, 1] = rate
    out[j, 2] = vy * nx - vx * ny + radius * (ax * py - ay * px) - (ux * nx + uy * ny + radius) * (bx * qy - by * qx)
    out[j, 6] = nx
    out[j, 7] = ny
    out[j, 8] = depth + S.radius[j, 0]


@kernel(inline=True)
def push_corner(j, S, forms, normal, tangential):
    """Add the forces of a corner to S.force."""
    ux, uy, ax, ay, bx, by, _, _, _, _, _, _ = forms
    nx, ny, radius = S.joint[j, 6], S.joint[j, 7], S.radius[j, 1]
    fx, fy = -normal * nx + tangential * ny, -normal * ny - tangential * nx
    moment = (ux * nx + uy * ny + radius) * tangential - (uy * nx - ux * ny) * normal
    push_turns(j, S, fx, fy, -radius * tangential, moment, ax, ay, bx, by, S.force, 0, S.n + S.nb)


@kernel(inline=True)
def corner_slopes(j, S, n_d, n_r):
    """Write how force and motion of a corner change, in the columns of `joint.linearise_contact`, and its turning forces."""
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = link_forms(j, S)
    normal, tangential, nx, ny = S.joint[j, 4], S.joint[j, 5], S.joint[j, 6], S.joint[j, 7]
    cx, cy, radius = S.wall[j, 0], S.wall[j, 1], S.radius[j, 1]
    row, start, count = S.link_row, S.link_start[j], S.link_start[j + 1] - S.link_start[j]
    block, spread = S.block_start[j], S.local
    turn = bx * qy - by * qx
    aside, reach = uy * nx - ux * ny, ux * nx + uy * ny + radius  # u.t and u.n + R
    for a in range(count):
        k = start + a
        r0, r1, r2, r3, r4, r5 = row[0, k], row[1, k], row[2, k], row[3, k], row[4, k], row[5, k]
        mx, my = cx * r4 - cy * r5, cy * r4 + cx * r5  # d n; d t is (-my, mx)
        swing, swing_rate = bx * r5 - by * r4, r4 * qy - r5 * qx
        outward = r0 * nx + r1 * ny + ux * mx + uy * my
        sideways = r1 * nx - r0 * ny + uy * mx - ux * my
        arm = r0 * nx + r1 * ny + aside * swing
        lever = r1 * nx - r0 * ny + radius * (ax * r3 - ay * r2) - reach * swing
        rate = vx * mx + vy * my + sideways * turn + aside * swing_rate
        spread[0, a] = -arm
        spread[1, a] = -lever
        spread[2, a] = n_d * outward + n_r * rate
        spread[3, a] = n_r * arm
        spread[4, a] = vy * mx - vx * my + radius * (r2 * py - r3 * px) - outward * turn - reach * swing_rate
        spread[5, a] = lever
        spread[6, a] = outward
        spread[7, a] = sideways
    for a in range(count):
        k = start + a
        r0, r1, r2, r3, r4, r5 = row[0, k], row[1, k], row[2, k], row[3, k], row[4, k], row[5, k]
        swing = bx * r5 - by * r4
        for b in range(count):
            i = start + b
            s4, s5 = row[4, i], row[5, i]
            mx, my = cx * s4 - cy * s5, cy * s4 + cx * s5
            twist = s4 * r5 - s5 * r4
            by_arm = r0 * mx + r1 * my + spread[7, b] * swing + aside * twist
            by_lever = r1 * mx - r0 * my + radius * (row[2, i] * r3 - row[3, i] * r2) - spread[6, b] * swing - reach * twist
            S.block_x[block + a * count + b] = -normal * by_arm - tangential * by_lever
