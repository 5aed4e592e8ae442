"""How contacts change: derivatives of forces and state rates, spread from the maps to the columns of a contact."""

from __future__ import annotations

from scissordyn.kernel import kernel
from scissordyn.laws.evaluate import elastic_force, friction_force, normal_force
from scissordyn.mechanics.force_element import map_values
from scissordyn.mechanics.plane_contact import plane_slopes
from scissordyn.mechanics.system import ARM_N, ARM_T, N_BY_V, N_BY_X, OTHER, OWN, SLIP_BY_V, SLIP_BY_X


@kernel
def law_slopes(j, S, z, dz, up, down, by_state):
    """Partial derivatives of the laws of contact j at its present state, by central differences.

    Only a handful of scalars enter a law, so differences cost little, and a user's law needs no derivative. Returns
    d F_n / d (delta, delta'), d F_t / d (v, F_n); writes d F_t / d z and the state rates' derivatives into by_state
    rows 0 .. s-1: d dz / d z, row s: d F_t / d z, row s+1: d dz / d v, row s+2: d dz / d F_n.
    """
    P, C = S.parameters, S.state
    contact, law = S.work.contact[j], P.law[j]
    delta, rate, slip, normal = contact.depth, contact.rate, contact.slip, contact.normal
    stiffness, damping, friction = law.stiffness, law.damping, law.friction
    n_by_delta = n_by_rate = t_by_slip = t_by_normal = 0.0
    if delta > 0.0 and stiffness != 0:
        h = 1e-5 * delta
        high = elastic_force(stiffness, delta + h, P.elastic[j])
        low = elastic_force(stiffness, delta - h, P.elastic[j])
        high = normal_force(damping, high, delta + h, rate, C.memory[j], P.damping[j])
        low = normal_force(damping, low, delta - h, rate, C.memory[j], P.damping[j])
        n_by_delta = (high - low) / (2.0 * h)
        h = 1e-5 * (abs(rate) + abs(C.memory[j]))
        high = normal_force(damping, contact.elastic, delta, rate + h, C.memory[j], P.damping[j])
        low = normal_force(damping, contact.elastic, delta, rate - h, C.memory[j], P.damping[j])
        n_by_rate = (high - low) / (2.0 * h)
    states = z.size
    if friction != 0:
        h = 1e-5 * abs(slip) + 1e-9
        high = friction_force(friction, slip + h, normal, z, up, P.friction[j])
        low = friction_force(friction, slip - h, normal, z, down, P.friction[j])
        t_by_slip = (high - low) / (2.0 * h)
        for s in range(states):
            by_state[states + 1, s] = (up[s] - down[s]) / (2.0 * h)
        h = 1e-5 * normal + 1e-9
        high = friction_force(friction, slip, normal + h, z, up, P.friction[j])
        low = friction_force(friction, slip, normal - h, z, down, P.friction[j])
        t_by_normal = (high - low) / (2.0 * h)
        for s in range(states):
            by_state[states + 2, s] = (up[s] - down[s]) / (2.0 * h)
        for k in range(states):
            here = z[k]
            h = 1e-5 * abs(here) + 1e-12 * max(1.0, P.state_scale[S.model.state_start[j] + k])
            z[k] = here + h
            high = friction_force(friction, slip, normal, z, up, P.friction[j])
            z[k] = here - h
            low = friction_force(friction, slip, normal, z, down, P.friction[j])
            z[k] = here
            by_state[states, k] = (high - low) / (2.0 * h)
            for s in range(states):
                by_state[s, k] = (up[s] - down[s]) / (2.0 * h)
    return n_by_delta, n_by_rate, t_by_slip, t_by_normal


@kernel
def pin_slopes(j, S, n_d, n_r):
    """Write how force and motion of a journal change, in the columns of `linearise_contact`, and its turning forces."""
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
    """Write the derivatives of contact j's generalized forces and state rates into Work.block_x and its companions.

    What the surfaces' geometry contributes, the change of the forces while F_n and F_t stay, `pin_slopes` or `plane_slopes` has
    written into Work.block_x.
    """
    M, W = S.model, S.work
    n_d, n_r, t_v, t_n = law_slopes(j, S, z, up, up, down, by_state)
    if S.parameters.contact[j].plane == 1:
        plane_slopes(j, S, n_d, n_r)
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

    states = z.size
    at, square = M.force_state_start[j], M.state_state_start[j]
    for a in range(count):
        for s in range(states):
            i = at + a * states + s
            by_slip, by_normal = by_state[states + 1, s], by_state[states + 2, s]
            W.force_by_state[i] = local[ARM_T, a] * by_state[states, s]
            W.rate_by_x[i] = by_slip * local[SLIP_BY_X, a] + by_normal * local[N_BY_X, a]
            W.rate_by_v[i] = by_slip * local[SLIP_BY_V, a] + by_normal * local[N_BY_V, a]
    for s in range(states):
        for k in range(states):
            W.rate_by_state[square + s * states + k] = by_state[s, k]
