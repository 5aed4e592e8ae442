"""A loose joint: where its two surfaces are, what forces they exert, and how these change.

Columns of `System.joint`: 0 delta, 1 delta', 2 slip speed, 3 elastic, 4 normal and 5 tangential force, 6 and 7 n, 8 |e|.
Here are journals in their bearings; the corner of a block at the wall of its guide (`System.flat`) is in `wall`.

Letters: e journal against bearing centre, n = e/|e|, t = n turned left, delta = |e| - c, v slip speed of the surfaces,
w spin, d unit direction of a body. A joint's six form rows give e, d of the journal's body, d of the bearing's body.
"""

from __future__ import annotations

import math

from scissordyn.jit import kernel
from scissordyn.laws.dispatch import elastic_force, friction_force, friction_start, normal_force
from scissordyn.mechanics.link import link_forms, push_turns
from scissordyn.mechanics.system import APPROACH_FLOOR
from scissordyn.mechanics.wall import corner_gap, corner_kinematics, corner_slopes, push_corner

__all__ = ["contact_forces", "gap", "linearise_contact", "switch"]


@kernel(inline=True)
def gap(j, S):
    """|e| - c and its rate; negative in free flight."""
    forms = link_forms(j, S)
    if S.flat[j] == 1:
        return corner_gap(j, S, forms)
    ex, ey, _, _, _, _, ux, uy, _, _, _, _ = forms
    e = math.sqrt(ex * ex + ey * ey)
    # at e = 0 the normal is undefined; whichever way the journal leaves, it moves outward
    rate = (ex * ux + ey * uy) / e if e > 0.0 else math.sqrt(ux * ux + uy * uy)
    return e - S.radius[j, 0], rate


@kernel(inline=True)
def kinematics(j, S):
    """Write delta, delta', slip speed, n and |e| of joint j into S.joint; returns the forms and rates."""
    forms = link_forms(j, S)
    if S.flat[j] == 1:
        corner_kinematics(j, S, forms)
        return forms
    ex, ey, ax, ay, bx, by, ux, uy, px, py, qx, qy = forms
    out = S.joint
    e = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / e, ey / e) if e > 0.0 else (1.0, 0.0)
    out[j, 0] = e - S.radius[j, 0]
    out[j, 1] = ux * nx + uy * ny
    # v_t = e'.t + w_J R_J - w_B (R_J + e), t = (-n_y, n_x): both bodies at the same point, so that their moments balance
    out[j, 2] = uy * nx - ux * ny + (ax * py - ay * px) * S.radius[j, 1] - (bx * qy - by * qx) * (S.radius[j, 1] + e)
    out[j, 6] = nx
    out[j, 7] = ny
    out[j, 8] = e
    return forms


@kernel(inline=True)
def contact_forces(j, S, z, dz):
    """Evaluate the laws of joint j in contact, add its forces to S.force, write its state rates into dz."""
    forms = kinematics(j, S)
    out = S.joint
    delta, rate, slip = out[j, 0], out[j, 1], out[j, 2]
    elastic = normal = 0.0
    if delta > 0.0:
        elastic = elastic_force(S.law[j, 0], delta, S.elastic[j])
        normal = normal_force(S.law[j, 1], elastic, delta, rate, S.approach[j], S.damping[j])
    tangential = friction_force(S.law[j, 2], slip, normal, z, dz, S.friction[j])
    out[j, 3], out[j, 4], out[j, 5] = elastic, normal, tangential
    if S.flat[j] == 1:
        push_corner(j, S, forms, normal, tangential)
        return
    _, _, ax, ay, bx, by, _, _, _, _, _, _ = forms
    nx, ny = out[j, 6], out[j, 7]
    fx, fy = -normal * nx + tangential * ny, -normal * ny - tangential * nx
    moment_j, moment_b = -S.radius[j, 1] * tangential, (S.radius[j, 1] + out[j, 8]) * tangential
    push_turns(j, S, fx, fy, moment_j, moment_b, ax, ay, bx, by, S.force, 0, S.n + S.nb)


@kernel(inline=True)
def switch(t, y, j, S, record):
    """Start or end the contact of joint j; `record` gets delta' and the angle of n."""
    S.joint[j, 3] = S.joint[j, 4] = S.joint[j, 5] = 0.0
    kinematics(j, S)
    rate = S.joint[j, 1]
    record[0] = rate
    record[1] = math.atan2(S.joint[j, 7], S.joint[j, 6])
    if S.mode[j] == 0:
        S.mode[j] = 1
        S.approach[j] = max(rate, APPROACH_FLOOR)
        start, stop = 2 * S.n + S.state_start[j], 2 * S.n + S.state_start[j + 1]
        friction_start(S.law[j, 2], S.joint[j, 2], y[start:stop], S.friction[j])
    else:
        S.mode[j] = 0


@kernel(inline=True)
def law_slopes(j, S, z, dz, up, down, by_state):
    """Partial derivatives of the laws of joint j at its present state, by central differences.

    Only a handful of scalars enter a law, so differences cost little, and a user's law needs no derivative. Returns
    d F_n / d (delta, delta'), d F_t / d (v, F_n); writes d F_t / d z and the state rates' derivatives into by_state
    rows 0 .. s-1: d dz / d z, row s: d F_t / d z, row s+1: d dz / d v, row s+2: d dz / d F_n.
    """
    delta, rate, slip, normal = S.joint[j, 0], S.joint[j, 1], S.joint[j, 2], S.joint[j, 4]
    stiffness, damping, friction = S.law[j, 0], S.law[j, 1], S.law[j, 2]
    n_by_delta = n_by_rate = t_by_slip = t_by_normal = 0.0
    if delta > 0.0:
        h = 1e-5 * delta
        high = elastic_force(stiffness, delta + h, S.elastic[j])
        low = elastic_force(stiffness, delta - h, S.elastic[j])
        high = normal_force(damping, high, delta + h, rate, S.approach[j], S.damping[j])
        low = normal_force(damping, low, delta - h, rate, S.approach[j], S.damping[j])
        n_by_delta = (high - low) / (2.0 * h)
        h = 1e-5 * (abs(rate) + S.approach[j])
        high = normal_force(damping, S.joint[j, 3], delta, rate + h, S.approach[j], S.damping[j])
        low = normal_force(damping, S.joint[j, 3], delta, rate - h, S.approach[j], S.damping[j])
        n_by_rate = (high - low) / (2.0 * h)
    states = z.size
    if friction != 0:
        h = 1e-5 * abs(slip) + 1e-9
        high = friction_force(friction, slip + h, normal, z, up, S.friction[j])
        low = friction_force(friction, slip - h, normal, z, down, S.friction[j])
        t_by_slip = (high - low) / (2.0 * h)
        for s in range(states):
            by_state[states + 1, s] = (up[s] - down[s]) / (2.0 * h)
        h = 1e-5 * normal + 1e-9
        high = friction_force(friction, slip, normal + h, z, up, S.friction[j])
        low = friction_force(friction, slip, normal - h, z, down, S.friction[j])
        t_by_normal = (high - low) / (2.0 * h)
        for s in range(states):
            by_state[states + 2, s] = (up[s] - down[s]) / (2.0 * h)
        for k in range(states):
            here = z[k]
            h = 1e-5 * abs(here) + 1e-12
            z[k] = here + h
            high = friction_force(friction, slip, normal, z, up, S.friction[j])
            z[k] = here - h
            low = friction_force(friction, slip, normal, z, down, S.friction[j])
            z[k] = here
            by_state[states, k] = (high - low) / (2.0 * h)
            for s in range(states):
                by_state[s, k] = (up[s] - down[s]) / (2.0 * h)
    return n_by_delta, n_by_rate, t_by_slip, t_by_normal


@kernel(inline=True)
def pin_slopes(j, S, n_d, n_r):
    """Write how force and motion of a journal change, in the columns of `linearise_contact`, and its turning forces."""
    _, _, ax, ay, bx, by, ux, uy, px, py, qx, qy = link_forms(j, S)
    normal, tangential, nx, ny, e = S.joint[j, 4], S.joint[j, 5], S.joint[j, 6], S.joint[j, 7], S.joint[j, 8]
    rj = S.radius[j, 1]
    rb, bearing_spin = rj + e, bx * qy - by * qx
    tx, ty = -ny, nx
    across, along = ux * tx + uy * ty, ux * nx + uy * ny
    row, start, count = S.link_row, S.link_start[j], S.link_start[j + 1] - S.link_start[j]
    block = S.block_start[j]
    turn, spread = across / e, S.local
    swing_x, swing_y = (normal * tx - tangential * nx) / e, (normal * ty - tangential * ny) / e
    for a in range(count):
        k = start + a
        r0, r1, r2, r3, r4, r5 = row[0, k], row[1, k], row[2, k], row[3, k], row[4, k], row[5, k]
        outward, sideways = r0 * nx + r1 * ny, r0 * tx + r1 * ty
        spin = rj * (r3 * ax - r2 * ay) - rb * (r5 * bx - r4 * by)
        spread[0, a] = -outward
        spread[1, a] = -sideways - spin
        spread[2, a] = n_d * outward + n_r * turn * sideways
        spread[3, a] = n_r * outward
        spread[4, a] = -along / e * sideways - bearing_spin * outward + rj * (r2 * py - r3 * px) - rb * (r4 * qy - r5 * qx)
        spread[5, a] = sideways + spin
        spread[6, a] = sideways
        spread[7, a] = r0 * swing_x + r1 * swing_y
    for a in range(count):
        swing = spread[7, a]
        ja, jb = rj * tangential * row[2, start + a], rj * tangential * row[3, start + a]
        ba, bb = rb * tangential * row[4, start + a], rb * tangential * row[5, start + a]
        longer = tangential * (bx * row[5, start + a] - by * row[4, start + a])
        for b in range(count):
            k = start + b
            S.block_x[block + a * count + b] = (
                -swing * spread[6, b]
                + (ja * row[3, k] - jb * row[2, k])
                - (ba * row[5, k] - bb * row[4, k])
                - longer * spread[0, b]
            )


@kernel(inline=True)
def linearise_contact(j, S, z, by_state, up, down):
    """Write the derivatives of joint j's generalized forces and state rates into S.block_x and its companions.

    Everything is spread from the six forms to the joint's columns. Rows of S.local: 0 arm of F_n, 1 arm of F_t, 2 and 3
    d F_n / d X and V, 4 and 5 d v / d X and V; the others belong to the kind of joint, as does what it leaves in S.block_x:
    the forces' change while F_n and F_t stay.
    """
    n_d, n_r, t_v, t_n = law_slopes(j, S, z, up, up, down, by_state)
    if S.flat[j] == 1:
        corner_slopes(j, S, n_d, n_r)
    else:
        pin_slopes(j, S, n_d, n_r)
    count, block, spread = S.link_start[j + 1] - S.link_start[j], S.block_start[j], S.local
    for a in range(count):
        lever = spread[1, a]
        both = spread[0, a] + lever * t_n
        for b in range(count):
            at = block + a * count + b
            S.block_x[at] += both * spread[2, b] + lever * t_v * spread[4, b]
            S.block_v[at] = both * spread[3, b] + lever * t_v * spread[5, b]

    states = z.size
    at, square = S.force_state_start[j], S.state_state_start[j]
    for a in range(count):
        for s in range(states):
            i = at + a * states + s
            by_slip, by_normal = by_state[states + 1, s], by_state[states + 2, s]
            S.force_by_state[i] = spread[1, a] * by_state[states, s]
            S.rate_by_x[i] = by_slip * spread[4, a] + by_normal * spread[2, a]
            S.rate_by_v[i] = by_slip * spread[5, a] + by_normal * spread[3, a]
    for s in range(states):
        for k in range(states):
            S.rate_by_state[square + s * states + k] = by_state[s, k]
