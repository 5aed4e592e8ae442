"""Kinematics, forces and derivatives of contacts.

This module treats journals in their bearings; `plane_contact` treats contacts between a block and its guide.

Symbols: e position of the journal's centre relative to the bearing's, n = e/|e|, t = n turned by 90 degrees to the left,
delta = |e| - c, v slip speed of the surfaces, w angular velocity, d unit direction of a body. The maps of a joint give e and
the directions d of the journal's and of the bearing's body.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.laws.evaluate import (
    elastic_force,
    friction_force,
    friction_states,
    normal_force,
    reference_speed,
    settled_states,
)
from scissordyn.mechanics.constraint_solver import expand_element
from scissordyn.mechanics.contact_mass import contact_mass
from scissordyn.mechanics.force_element import add_torques, map_values, write_wrench
from scissordyn.mechanics.hard_contour import worn_hard_gap, worn_hard_kinematics
from scissordyn.mechanics.plane_contact import plane_forces, plane_gap, plane_kinematics, plane_slopes
from scissordyn.mechanics.system import (
    APPROACH_FLOOR,
    ARM_N,
    ARM_T,
    DEPTH_BY_X,
    N_BY_V,
    N_BY_X,
    OTHER,
    OWN,
    PSI_BY_X,
    RATE_BY_X,
    SLIP_BY_V,
    SLIP_BY_X,
)
from scissordyn.mechanics.worn_contact import displaced_force, worn_gap, worn_kinematics, worn_slopes


@kernel
def gap(j, S):
    """Return the indentation |e| - c of contact j, negative in free flight, and its rate."""
    maps = map_values(j, S)
    if S.parameters.contact[j].plane == 1:
        return plane_gap(j, S, maps)
    if S.parameters.contact[j].cells > 0:
        return worn_gap(j, S, maps) if S.parameters.law[j].stiffness != 0 else worn_hard_gap(j, S, maps)
    ex, ey, _, _, _, _, ux, uy, _, _, _, _ = maps
    e = math.sqrt(ex * ex + ey * ey)
    # at e = 0 the normal is undefined; a journal that leaves in any direction moves outward
    rate = (ex * ux + ey * uy) / e if e > 0.0 else math.sqrt(ux * ux + uy * uy)
    return e - S.parameters.contact[j].clearance, rate


@kernel
def kinematics(j, S):
    """Write delta, delta', slip speed, n and |e| of contact j into Work.contact; return the maps and their rates."""
    maps = map_values(j, S)
    p, contact = S.parameters.contact[j], S.work.contact[j]
    if p.plane == 1:
        plane_kinematics(j, S, maps)
        return maps
    if p.cells > 0:
        if S.parameters.law[j].stiffness != 0:
            worn_kinematics(j, S, maps)
        else:
            worn_hard_kinematics(j, S, maps)
        return maps
    ex, ey, ax, ay, bx, by, ux, uy, px, py, qx, qy = maps
    e = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / e, ey / e) if e > 0.0 else (1.0, 0.0)
    contact.depth = e - p.clearance
    contact.rate = ux * nx + uy * ny
    # v_t = e'.t + w_J R_J - w_B (R_J + e), t = (-n_y, n_x): both bodies at the same point, so that their moments balance
    across = uy * nx - ux * ny
    contact.slip = across + (ax * py - ay * px) * p.radius - (bx * qy - by * qx) * (p.radius + e)
    if p.spinless == 1:  # v_t = e'.t + R_J n'.t - R_B n'.t with n'.t = e'.t/|e|
        contact.slip = across * contact.depth / e
    contact.nx = nx
    contact.ny = ny
    contact.distance = e
    return maps


@kernel
def damped_force(j, S, elastic, delta, rate, z, dz):
    """Return the normal force [N] of contact j from its elastic part; write the rates of the damping states into dz."""
    C = S.state
    reference = reference_speed(elastic, delta, rate, C.memory[j], C.mass[j])
    return normal_force(S.parameters.law[j].damping, elastic, delta, rate, reference, z, dz, S.parameters.damping[j])


@kernel
def elastic_of(j, S):
    """Return the elastic force of contact j [N] at its indentation > 0; `kinematics` has that of a worn bearing."""
    contact = S.work.contact[j]
    if S.parameters.contact[j].cells > 0:
        return contact.elastic
    return elastic_force(S.parameters.law[j].stiffness, contact.depth, S.parameters.elastic[j])


@kernel
def contact_laws(j, S, z, dz):
    """Evaluate the laws of contact j into Work.contact, write the rates of its states into dz; return the maps."""
    P, W = S.parameters, S.work
    maps = kinematics(j, S)
    law, contact = P.law[j], W.contact[j]
    elastic = normal = 0.0
    if law.stiffness == 0:  # a hard contact: its mean forces during the step
        contact.elastic = 0.0
        contact.normal = S.state.memory[j]
        contact.tangential = z[0]
        dz[:] = 0.0
        return maps
    first = law.bristles
    pressed, pressed_rate = z[first : z.size], dz[first : z.size]
    pressed_rate[:] = 0.0
    if contact.depth > 0.0:
        elastic = elastic_of(j, S)
        normal = damped_force(j, S, elastic, contact.depth, contact.rate, pressed, pressed_rate)
    tangential = friction_force(law.friction, contact.slip, normal, z, dz, P.friction[j])
    contact.elastic = elastic
    contact.normal = normal
    contact.tangential = tangential
    return maps


@kernel
def contact_forces(j, S, z, dz):
    """Evaluate the laws of contact j, add its forces to Work.force, write the rates of its states into dz."""
    maps = contact_laws(j, S, z, dz)
    W = S.work
    p, contact = S.parameters.contact[j], W.contact[j]
    normal, tangential = contact.normal, contact.tangential
    if p.plane == 1:
        plane_forces(j, S, maps, normal, tangential)
        return
    ex, ey, ax, ay, bx, by, _, _, _, _, _, _ = maps
    nx, ny = contact.nx, contact.ny
    fx, fy = -normal * nx + tangential * ny, -normal * ny - tangential * nx
    moment_j, moment_b = -p.radius * tangential, (p.radius + contact.distance) * tangential
    if p.cells > 0:
        moment_b = (p.radius + ex * nx + ey * ny) * tangential + (ex * ny - ey * nx) * normal
    if p.journal == 1:
        moment_j, moment_b = moment_j - contact.lever * normal, moment_b + contact.lever * normal
    write_wrench(j, S, fx, fy, moment_j, moment_b)
    add_torques(j, S, fx, fy, moment_j, moment_b, ax, ay, bx, by, W.force, 0, W.force.size)


@kernel
def contact_at(t, y, j, S):
    """Write the results of contact j to Work.contact, without evaluating other parts."""
    M = S.model
    expand_element(t, y, j, S)
    start, stop = 2 * M.n + M.state_start[j], 2 * M.n + M.state_start[j + 1]
    contact_laws(j, S, y[start:stop], S.work.state_work[0])


@kernel
def no_forces(j, S):
    """Set the forces of contact j to zero."""
    contact = S.work.contact[j]
    contact.elastic = 0.0
    contact.normal = 0.0
    contact.tangential = 0.0
    write_wrench(j, S, 0.0, 0.0, 0.0, 0.0)


@kernel
def begin_contact(y, j, S, data, resting):
    """Start contact j and its internal states; return whether it started.

    A contact starts if its surfaces approach each other, or if it rests in contact when a run begins. Writes delta', the
    angle of n and the effective mass along n to `data`.
    """
    M, C = S.model, S.state
    no_forces(j, S)
    kinematics(j, S)
    contact, P, approach = S.work.contact[j], S.parameters, S.work.contact[j].rate
    if P.contact[j].cells > 0 and not approach > 0.0:  # the guard's rate, at the angle that touches, may have the other sign
        _, approach = gap(j, S)
    if not (approach > 0.0 or resting):
        return False
    C.mode[j] = 1
    law, start, stop = P.law[j], 2 * M.n + M.state_start[j], 2 * M.n + M.state_start[j + 1]
    data[0] = 0.0 if resting and approach <= APPROACH_FLOOR else approach
    data[1], data[2] = math.atan2(contact.ny, contact.nx), contact_mass(j, S)
    if law.loaded == 1:
        C.memory[j], C.mass[j] = data[0], data[2]
    else:
        C.memory[j], C.mass[j] = max(approach, APPROACH_FLOOR), 0.0
    middle = start + law.bristles
    friction_states(law.start, contact.slip, y[start:middle], P.friction[j])
    y[middle:stop] = 0.0
    if resting and law.settled != 0 and contact.depth > 0.0:
        elastic = elastic_of(j, S)
        settled_states(law.settled, elastic, contact.depth, y[middle:stop], P.damping[j])
    return True


@kernel
def renew_contacts(S):
    """Update the effective masses and approach speeds of closed contacts after a latch has locked.

    The lock changes constraints and velocities. If this increases the speed at which the surfaces of a contact approach, an
    impact begins there, and the approach speed becomes the current rate.
    """
    C, W = S.state, S.work
    for j in range(S.parameters.contact.size):
        if C.mode[j] == 1 and S.parameters.law[j].loaded == 1:
            kinematics(j, S)
            C.memory[j], C.mass[j] = max(C.memory[j], W.contact[j].rate), contact_mass(j, S)


@kernel
def end_contact(j, S, data):
    """End contact j; write delta' and the angle of n to `data`."""
    no_forces(j, S)
    kinematics(j, S)
    contact = S.work.contact[j]
    data[0] = contact.rate
    data[1] = math.atan2(contact.ny, contact.nx)
    S.state.mode[j] = 0
    return True


@kernel
def law_slopes(j, S, z, up, down, by_state):
    """Return the partial derivatives of the laws of contact j at its current state, by central differences.

    A law has few arguments, so that differences are cheap, and a user's law needs no derivatives. Returns
    d F_n / d (delta, delta') and d F_t / d (v, F_n). With s states, `by_state` receives d dz / d z in rows 0 to s-1,
    d F_t / d z in row s, d dz / d v in s+1, d dz / d F_n in s+2, d F_n / d z in s+3, d dz / d delta in s+4,
    d dz / d delta' in s+5.
    """
    P, C = S.parameters, S.state
    contact, law, scale = S.work.contact[j], P.law[j], S.model.state_start[j]
    delta, rate, slip, normal = contact.depth, contact.rate, contact.slip, contact.normal
    stiffness, friction = law.stiffness, law.friction
    n_by_delta = n_by_rate = t_by_slip = t_by_normal = 0.0
    states, first = z.size, law.bristles
    for s in range(by_state.shape[0]):
        for k in range(states):
            by_state[s, k] = 0.0
    if delta > 0.0 and stiffness != 0:
        pressed, rising, falling = z[first:states], up[first:states], down[first:states]
        h = 1e-5 * delta
        deep, shallow = delta + h, delta - h
        if P.contact[j].cells > 0:
            maps = map_values(j, S)
            high, deep, _, _, _ = displaced_force(j, S, maps, h, 0.0, 0.0)
            low, shallow, _, _, _ = displaced_force(j, S, maps, -h, 0.0, 0.0)
        else:
            high = elastic_force(stiffness, deep, P.elastic[j])
            low = elastic_force(stiffness, shallow, P.elastic[j])
        high = damped_force(j, S, high, deep, rate, pressed, rising)
        low = damped_force(j, S, low, shallow, rate, pressed, falling)
        n_by_delta = (high - low) / (2.0 * h)
        for s in range(first, states):
            by_state[states + 4, s] = (up[s] - down[s]) / (2.0 * h)
        h = 1e-5 * (abs(rate) + abs(reference_speed(contact.elastic, delta, rate, C.memory[j], C.mass[j])))
        high = damped_force(j, S, contact.elastic, delta, rate + h, pressed, rising)
        low = damped_force(j, S, contact.elastic, delta, rate - h, pressed, falling)
        n_by_rate = (high - low) / (2.0 * h)
        for s in range(first, states):
            by_state[states + 5, s] = (up[s] - down[s]) / (2.0 * h)
        for k in range(first, states):
            here = z[k]
            h = 1e-5 * abs(here) + 1e-12 * max(1.0, P.state_scale[scale + k])
            z[k] = here + h
            high = damped_force(j, S, contact.elastic, delta, rate, pressed, rising)
            z[k] = here - h
            low = damped_force(j, S, contact.elastic, delta, rate, pressed, falling)
            z[k] = here
            by_state[states + 3, k] = (high - low) / (2.0 * h)
            for s in range(first, states):
                by_state[s, k] = (up[s] - down[s]) / (2.0 * h)
    if friction != 0:
        h = 1e-5 * abs(slip) + 1e-9
        high = friction_force(friction, slip + h, normal, z, up, P.friction[j])
        low = friction_force(friction, slip - h, normal, z, down, P.friction[j])
        t_by_slip = (high - low) / (2.0 * h)
        for s in range(first):
            by_state[states + 1, s] = (up[s] - down[s]) / (2.0 * h)
        h = 1e-5 * normal + 1e-9
        high = friction_force(friction, slip, normal + h, z, up, P.friction[j])
        low = friction_force(friction, slip, normal - h, z, down, P.friction[j])
        t_by_normal = (high - low) / (2.0 * h)
        for s in range(first):
            by_state[states + 2, s] = (up[s] - down[s]) / (2.0 * h)
        for k in range(first):
            here = z[k]
            h = 1e-5 * abs(here) + 1e-12 * max(1.0, P.state_scale[scale + k])
            z[k] = here + h
            high = friction_force(friction, slip, normal, z, up, P.friction[j])
            z[k] = here - h
            low = friction_force(friction, slip, normal, z, down, P.friction[j])
            z[k] = here
            by_state[states, k] = (high - low) / (2.0 * h)
            for s in range(first):
                by_state[s, k] = (up[s] - down[s]) / (2.0 * h)
    return n_by_delta, n_by_rate, t_by_slip, t_by_normal


@kernel
def lateral_slopes(j, S, z, up, down, by_state):
    """Return derivatives of a worn contact: of F_n by t and psi, of the angle of n by n, t and psi, of the lever by these.

    The slopes of the rates of the damping states by a displacement along t are written to `by_state`, in the row of the slip;
    those by psi follow the other rows.
    """
    contact, first, h = S.work.contact[j], S.parameters.law[j].bristles, 1e-5 * S.work.contact[j].depth
    states, n_a, n_p, turn_p, g_d, g_a, g_p = z.size, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for s in range(first, states):
        by_state[states + 1, s], by_state[states + 6, s] = 0.0, 0.0
    if not (contact.depth > 0.0 and contact.elastic > 0.0):
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    maps, pressed, rising, falling = map_values(j, S), z[first:states], up[first:states], down[first:states]
    scale = 1.0 / (2.0 * h)
    left, left_depth, left_normal, left_turn, left_lever = displaced_force(j, S, maps, 0.0, h, 0.0)
    right, right_depth, right_normal, right_turn, right_lever = displaced_force(j, S, maps, 0.0, -h, 0.0)
    left = damped_force(j, S, left, left_depth, contact.rate, pressed, rising)
    right = damped_force(j, S, right, right_depth, contact.rate, pressed, falling)
    n_a = (left - right) * scale
    for s in range(first, states):
        by_state[states + 1, s] = (up[s] - down[s]) * scale
    if S.parameters.contact[j].journal == 1:
        _, _, _, _, out_lever = displaced_force(j, S, maps, h, 0.0, 0.0)
        _, _, _, _, back_lever = displaced_force(j, S, maps, -h, 0.0, 0.0)
        g_d, g_a = (out_lever - back_lever) * scale, (left_lever - right_lever) * scale
        turn = h / S.parameters.contact[j].radius
        high, deep, _, high_turn, high_lever = displaced_force(j, S, maps, 0.0, 0.0, turn)
        low, shallow, _, low_turn, low_lever = displaced_force(j, S, maps, 0.0, 0.0, -turn)
        high = damped_force(j, S, high, deep, contact.rate, pressed, rising)
        low = damped_force(j, S, low, shallow, contact.rate, pressed, falling)
        n_p, g_p = 0.5 * (high - low) / turn, 0.5 * (high_lever - low_lever) / turn
        turn_p = 0.5 * (high_turn - low_turn) / turn / contact.elastic
        for s in range(first, states):
            by_state[states + 6, s] = 0.5 * (up[s] - down[s]) / turn
    # df_t/de_n = df_n/de_t, because the force is the gradient of the energy
    turn_d, turn_a = (left_normal - right_normal) * scale / contact.elastic, (left_turn - right_turn) * scale / contact.elastic
    return n_a, n_p, turn_d, turn_a, turn_p, g_d, g_a, g_p


@kernel
def pin_slopes(j, S, n_d, n_r):
    """Write the derivatives of force and motion of a journal to Work.local, and the effect of its rotation to Work.block_x."""
    M, W = S.model, S.work
    p, contact = S.parameters.contact[j], W.contact[j]
    _, _, ax, ay, bx, by, ux, uy, px, py, qx, qy = map_values(j, S)
    normal, tangential, nx, ny, e = contact.normal, contact.tangential, contact.nx, contact.ny, contact.distance
    rj = p.radius
    rb, bearing_speed = rj + e, bx * qy - by * qx
    tx, ty = -ny, nx
    across, along = ux * tx + uy * ty, ux * nx + uy * ny
    row, start, count = M.element_row, M.element_start[j], M.element_start[j + 1] - M.element_start[j]
    block = M.block_start[j]
    turning, local = across / e, W.local
    turned_x, turned_y = (normal * tx - tangential * nx) / e, (normal * ty - tangential * ny) / e
    for a in range(count):
        k = start + a
        r0, r1, r2, r3, r4, r5 = row[0, k], row[1, k], row[2, k], row[3, k], row[4, k], row[5, k]
        outward, sideways = r0 * nx + r1 * ny, r0 * tx + r1 * ty
        rotation = rj * (r3 * ax - r2 * ay) - rb * (r5 * bx - r4 * by)
        local[ARM_N, a] = -outward
        local[ARM_T, a] = -sideways - rotation
        local[N_BY_X, a] = n_d * outward + n_r * turning * sideways
        local[N_BY_V, a] = n_r * outward
        local[DEPTH_BY_X, a] = outward
        local[RATE_BY_X, a] = turning * sideways
        local[SLIP_BY_X, a] = (
            -along / e * sideways - bearing_speed * outward + rj * (r2 * py - r3 * px) - rb * (r4 * qy - r5 * qx)
        )
        local[SLIP_BY_V, a] = sideways + rotation
        if p.spinless == 1:
            free = contact.depth / e
            local[SLIP_BY_X, a] = turning * p.clearance / e * outward - free * along / e * sideways
            local[SLIP_BY_V, a] = free * sideways
        local[OWN, a] = sideways
        local[OTHER, a] = r0 * turned_x + r1 * turned_y
    for a in range(count):
        turned = local[OTHER, a]
        ja, jb = rj * tangential * row[2, start + a], rj * tangential * row[3, start + a]
        ba, bb = rb * tangential * row[4, start + a], rb * tangential * row[5, start + a]
        longer = tangential * (bx * row[5, start + a] - by * row[4, start + a])
        for b in range(count):
            k = start + b
            W.block_x[block + a * count + b] = (
                -turned * local[OWN, b]
                + (ja * row[3, k] - jb * row[2, k])
                - (ba * row[5, k] - bb * row[4, k])
                - longer * local[ARM_N, b]
            )


@kernel
def linearise_contact(j, S, z, by_state, up, down):
    """Write the derivatives of contact j's generalised forces and state rates by position, velocity and states to Work.

    `pin_slopes`, `worn_slopes` or `plane_slopes` first writes the geometric part to Work.block_x: the change of the generalised
    forces at constant F_n and F_t. `by_state`, `up` and `down` are work arrays of central differences.
    """
    M, W = S.model, S.work
    n_d, n_r, t_v, t_n = law_slopes(j, S, z, up, down, by_state)
    if S.parameters.contact[j].plane == 1:
        plane_slopes(j, S, n_d, n_r)
    elif S.parameters.contact[j].cells > 0:
        n_a, n_p, turn_d, turn_a, turn_p, g_d, g_a, g_p = lateral_slopes(j, S, z, up, down, by_state)
        worn_slopes(j, S, n_d, n_a, n_p, n_r, turn_d, turn_a, turn_p, g_d, g_a, g_p)
    else:
        pin_slopes(j, S, n_d, n_r)
    count, block, local = M.element_start[j + 1] - M.element_start[j], M.block_start[j], W.local
    for a in range(count):
        arm = local[ARM_T, a]
        both = local[ARM_N, a] + arm * t_n
        for b in range(count):
            at = block + a * count + b
            W.block_x[at] += both * local[N_BY_X, b] + arm * t_v * local[SLIP_BY_X, b]
            W.block_v[at] = both * local[N_BY_V, b] + arm * t_v * local[SLIP_BY_V, b]

    states, first = z.size, S.parameters.law[j].bristles
    at, square = M.force_state_start[j], M.state_state_start[j]
    for a in range(count):
        both = local[ARM_N, a] + local[ARM_T, a] * t_n
        for s in range(states):
            i = at + a * states + s
            if s < first:
                by_slip, by_normal = by_state[states + 1, s], by_state[states + 2, s]
                W.force_by_state[i] = local[ARM_T, a] * by_state[states, s]
                W.rate_by_x[i] = by_slip * local[SLIP_BY_X, a] + by_normal * local[N_BY_X, a]
                W.rate_by_v[i] = by_slip * local[SLIP_BY_V, a] + by_normal * local[N_BY_V, a]
            else:
                by_depth, by_rate = by_state[states + 4, s], by_state[states + 5, s]
                W.force_by_state[i] = both * by_state[states + 3, s]
                W.rate_by_x[i] = by_depth * local[DEPTH_BY_X, a] + by_rate * local[RATE_BY_X, a]
                if S.parameters.contact[j].cells > 0:
                    W.rate_by_x[i] += by_state[states + 1, s] * local[OWN, a] + by_state[states + 6, s] * local[PSI_BY_X, a]
                W.rate_by_v[i] = -by_rate * local[ARM_N, a]
    for s in range(states):
        for k in range(states):  # friction depends on the normal force and therefore on the damping states
            W.rate_by_state[square + s * states + k] = by_state[s, k] + by_state[states + 2, s] * by_state[states + 3, k]
