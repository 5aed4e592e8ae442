"""Friction in ideal joints, which depends on the reaction of its joint in each evaluation.

Friction is linear in the magnitudes N of the reactions, f_k = N_k f_k(1). At a given position and velocity the reactions are
linear in friction: r = r_0 + sum_k N_k R_k, with R_k the response to f_k(1). One equation per joint with friction remains,

    N_j = |r_j(N)|.

Newton's method solves them from the reactions without friction, independent of earlier evaluations; its matrix there is the
identity. While the determinant stays positive, the solution continues the one without friction. Where the determinant
vanishes, the reactions grow without limit: the joint jams.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.bending_loads import load_bending
from scissordyn.mechanics.body_maps import load_couplings, mapped, pressure_size, push, push_apart
from scissordyn.mechanics.component import REACTION, evaluate, sense, write_context
from scissordyn.mechanics.constraint_solver import rod_force, solve_constraints, subtract_gradients
from scissordyn.mechanics.force_element import add_forces, map_values, write_wrench
from scissordyn.mechanics.port import port_forces, port_wrench
from scissordyn.mechanics.reactions import DETERMINED_RATIO_MIN, sides_of_one, solve_sides
from scissordyn.tolerance import CONSTRAINT_TOL, NEWTON_STEPS_MAX

JAMMED, UNDETERMINED = 1, 2
"""Faults: no reactions balance friction; the reactions are not unique because there are too many joints."""


@kernel
def find_reactions(t, y, S):
    """Write the reactions that friction depends on, NaN if the mechanism jams; `settle` must have run without friction."""
    M, R = S.model, S.friction
    f, contacts = R.component.size, S.parameters.contact.size
    for k in range(f):
        write_wrench(contacts + R.component[k], S, 0.0, 0.0, 0.0, 0.0)
    place_bodies(S)
    move_bodies(0, S.work.A, 0.0, 0.0, S)
    load_bodies(0, S.work.multiplier, S)
    load_bending(0, S.work.A, S)
    for k in range(f):
        start, stop = M.state_start[contacts + R.component[k]], M.state_start[contacts + R.component[k] + 1]
        respond(t, k, y[2 * M.n + start : 2 * M.n + stop], S)
    press(S)
    sides_of_one(
        R.balance,
        R.gravity,
        R.direction,
        R.position,
        R.acceleration,
        R.angular_acceleration,
        R.load,
        R.matrix,
        R.rows,
        R.right,
        R.reaction,
    )
    solve_sides(R.balance.band, R.matrix, R.reaction)
    smallest = largest = R.matrix[0, 0, 0]
    for row in range(R.matrix.shape[0]):
        smallest, largest = min(smallest, R.matrix[row, 0, 0]), max(largest, R.matrix[row, 0, 0])
    if smallest <= DETERMINED_RATIO_MIN * largest:
        R.fault[0] = UNDETERMINED
    elif smallest > 0.0:
        R.fault[0] = 0 if balance_sizes(R) else JAMMED
    # otherwise the state is NaN because of a fault in an earlier evaluation
    if R.fault[0] != 0:
        for k in range(f):
            R.size[k] = math.nan


@kernel
def place_bodies(S):
    """Write the positions of the bodies, equal in all lanes."""
    R = S.friction
    for body in range(R.maps.rotation.size):
        cx, cy, ux, uy = mapped(R.maps, body, S.work.X)
        for lane in range(R.load.shape[0]):
            R.position[lane, body, 0], R.position[lane, body, 1] = cx, cy
            R.direction[lane, body, 0], R.direction[lane, body, 1] = ux, uy
            for axis in range(3):
                R.load[lane, body, axis] = 0.0


@kernel
def move_bodies(lane, A, gx, gy, S):
    """Write the accelerations of the bodies into a lane: those that the accelerations A of the columns cause, plus (gx, gy)."""
    R = S.friction
    for body in range(R.maps.rotation.size):
        px, py, qx, qy = mapped(R.maps, body, A)
        R.acceleration[lane, body, 0], R.acceleration[lane, body, 1] = px + gx, py + gy
        R.angular_acceleration[lane, body] = R.direction[lane, body, 0] * qy - R.direction[lane, body, 1] * qx


@kernel
def load_bodies(lane, multiplier, S):
    """Add the forces of rods, latches and couplings to the loads, and in lane 0 those of contacts and components."""
    M, W, R = S.model, S.work, S.friction
    B, acting, contacts = R.maps, W.wrench.shape[0], S.parameters.contact.size
    for e in range(0 if lane == 0 else acting, B.body.shape[0]):
        fx = fy = torque_a = torque_b = 0.0
        if e >= acting:
            fx, fy = rod_force(B.rod[e - acting], B.rod_scale[e - acting], multiplier, S)
        elif e >= contacts or S.state.mode[e] == 1:  # the last force of an open contact is not reset
            fx, fy, torque_a, torque_b = W.wrench[e, 0], W.wrench[e, 1], W.wrench[e, 2], W.wrench[e, 3]
        push(lane, B.body[e, 0], B.arm[e, 0, 0], B.arm[e, 0, 1], fx, fy, torque_a, R)
        push(lane, B.body[e, 1], B.arm[e, 1, 0], B.arm[e, 1, 1], -fx, -fy, torque_b, R)
    for latch in range(M.latch.shape[0]):
        k, e = M.latch[latch, 0], contacts + M.latch[latch, 2]
        locking = -multiplier[k] * (1.0 - W.inactive[k])
        push(lane, B.body[e, 0], 0.0, 0.0, 0.0, 0.0, locking, R)
        push(lane, B.body[e, 1], 0.0, 0.0, 0.0, 0.0, -locking, R)
    load_couplings(lane, multiplier, B, R)


@kernel
def respond(t, k, z, S):
    """Write lane 1 + k: effect of friction k at a unit reaction on accelerations, rods and loads."""
    M, W, R = S.model, S.work, S.friction
    i, lane = R.component[k], k + 1
    element, port, out = S.parameters.contact.size + i, M.component_port[i], W.answer
    maps = map_values(element, S)
    sense(i, S, maps)
    write_context(t, i, S)
    W.context[REACTION] = 1.0
    evaluate(i, S, z, M.force_kernel[i], out)
    fx, fy, gx, gy, hx, hy = port_forces(port, maps, W.coordinates[i], out)
    R.force[:] = 0.0
    add_forces(element, S, fx, fy, gx, gy, hx, hy, R.force, 0, R.force.size)
    m = R.multiplier.size
    for c in range(m):
        total = 0.0
        for j in range(M.constraint_start[c], M.constraint_start[c + 1]):
            if M.constraint_column[j] < M.n:
                total += W.gradient[j] * R.force[M.constraint_column[j]]
        R.multiplier[c] = total
    solve_constraints(S, R.multiplier)
    R.change[:] = 0.0
    for j in range(M.n):
        R.change[j] = R.force[j]
    subtract_gradients(S, R.multiplier, R.change, 0)
    for j in range(M.n):
        R.response[k, j] = R.change[j]
    for e in range(R.maps.pressure.shape[0]):
        R.pressing[e, lane] = R.multiplier[R.maps.pressure[e, 0]]
    # the equations subtract gravity, which is not part of a response
    move_bodies(lane, R.change, R.gravity[0], R.gravity[1], S)
    load_bodies(lane, R.multiplier, S)
    load_bending(lane, R.change, S)
    force_x, force_y, torque_a, torque_b = port_wrench(port, maps, M.travel_direction[i], out, fx, fy)
    B = R.maps
    push(lane, B.body[element, 0], B.arm[element, 0, 0], B.arm[element, 0, 1], force_x, force_y, torque_a, R)
    push(lane, B.body[element, 1], B.arm[element, 1, 0], B.arm[element, 1, 1], -force_x, -force_y, torque_b, R)


@kernel
def press(S):
    """Write the multipliers of couplings with teeth or belts, and the loads of their unit workless forces to the last lanes."""
    R = S.friction
    f, pressures = R.component.size, R.maps.pressure.shape[0]
    R.change[:] = 0.0
    for e in range(pressures):
        lane = 1 + f + e
        R.pressing[e, 0] = S.work.multiplier[R.maps.pressure[e, 0]]
        move_bodies(lane, R.change, R.gravity[0], R.gravity[1], S)
        push_apart(lane, e, 1.0, R.maps, R)


@kernel
def press_at(R):
    """Write the force between the wheels of each pair of teeth or belt, and its derivative by the multiplier of the coupling.

    The force does no work. The multiplier includes the effect of the current friction.
    """
    for e in range(R.maps.pressure.shape[0]):
        multiplier = R.pressing[e, 0]
        for k in range(R.component.size):
            multiplier += R.size[k] * R.pressing[e, k + 1]
        R.pressure[e, 0], R.pressure[e, 1] = pressure_size(0, e, multiplier, R.maps, R)


@kernel
def reaction_of(row, R):
    """Return the ideal reaction of a row for the current magnitudes of friction and pressure."""
    f = R.component.size
    total = R.reaction[row, 0]
    for k in range(f):
        total += R.size[k] * R.reaction[row, k + 1]
    for e in range(R.maps.pressure.shape[0]):
        total += R.pressure[e, 0] * R.reaction[row, 1 + f + e]
    return total


@kernel
def reaction_slope(row, k, R):
    """Return the derivative of a reaction by magnitude k."""
    total = R.reaction[row, k + 1]
    for e in range(R.maps.pressure.shape[0]):
        total += R.pressure[e, 1] * R.pressing[e, k + 1] * R.reaction[row, 1 + R.component.size + e]
    return total


@kernel
def balance_sizes(R):
    """Solve N_j = |r_j(N)| by Newton's method; return whether the solution continues the one without friction.

    Pressures of teeth and belts depend on the absolute forces of their couplings, which friction changes: r_j(N) is linear
    between the zeros of these forces.
    """
    f = R.component.size
    lower = f - 1
    for k in range(f):
        R.size[k] = 0.0
    for _ in range(NEWTON_STEPS_MAX):
        most = largest = 0.0
        R.slope[:, :] = 0.0
        press_at(R)
        for j in range(f):
            first, second = R.unknown[j, 0], R.unknown[j, 1]
            a, b = reaction_of(first, R), reaction_of(second, R) if second >= 0 else 0.0
            # a pin depends on the magnitude of its force; a guide on its force, or on the larger couple at its edges
            ea, eb, size = 0.0, 0.0, 0.0
            if R.guide[j] == 0:
                size = math.sqrt(a * a + b * b)
                if size > 0.0:
                    ea, eb = a / size, b / size
            elif abs(a) >= R.moment[j] * abs(b):
                size, ea = abs(a), 1.0 if a >= 0.0 else -1.0
            else:
                size, eb = R.moment[j] * abs(b), R.moment[j] if b >= 0.0 else -R.moment[j]
            R.step[j] = size - R.size[j]
            largest = max(largest, size)
            for k in range(f):
                slope = ea * reaction_slope(first, k, R)
                if second >= 0:
                    slope += eb * reaction_slope(second, k, R)
                R.slope[j, k - j + lower] = (1.0 if j == k else 0.0) - slope
        if band.factorize(R.slope, lower, lower, R.pivots) >= 0:
            return False
        sign = 1.0
        for j in range(f):
            sign *= (1.0 if R.slope[j, lower] > 0.0 else -1.0) * (1.0 if R.pivots[j] == j else -1.0)
        band.solve(R.slope, lower, R.pivots, R.step)
        for j in range(f):
            R.size[j] += R.step[j]
            most = max(most, abs(R.step[j]))
        if not most > CONSTRAINT_TOL * largest:
            least = 0.0
            for j in range(f):
                least = min(least, R.size[j])
            return sign > 0.0 and least >= -CONSTRAINT_TOL * largest
    return False
