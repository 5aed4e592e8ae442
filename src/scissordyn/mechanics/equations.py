"""Equations of motion in natural coordinates with unit mass matrix.

With d = rows X the maps of the quadratic constraints sum(w |d|^2/2) = value, X = (x, b(t)), Phi = sum(w d^T rows), and
correspondingly for other functions of d (`constraint_part`):

    x'' + Phi^T lambda = f - M_xb b'',    sum(w (d . d'' + |d'|^2)) = value''.

The state is y = (x, x', internal states). All functions read and write the arrays of a `System` S.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.actuator import recorded_signal
from scissordyn.mechanics.bending_loads import clear_shape_forces
from scissordyn.mechanics.component import add_component, linearise_component
from scissordyn.mechanics.constraint_part import part_bend, part_curvature, part_slope
from scissordyn.mechanics.constraint_solver import (
    expand,
    factorize_constraints,
    map_directions,
    solve_constraints,
    subtract_gradients,
)
from scissordyn.mechanics.contact import contact_forces, linearise_contact
from scissordyn.mechanics.joint_friction import find_reactions
from scissordyn.mechanics.step_matrix import acts


@kernel
def accelerate(t, y, S, dy):
    """Write y' into dy: the right-hand side of the equations of motion."""
    M, P, C, W = S.model, S.parameters, S.state, S.work
    n, nb = M.n, M.nb
    expand(t, y, S)
    for i in range(n + nb):
        W.force[i] = P.weight[i]
    contacts = P.contact.size
    clear_shape_forces(S)
    # f: weight, contacts, components
    for j in range(contacts):
        start, stop = 2 * n + M.state_start[j], 2 * n + M.state_start[j + 1]
        if C.mode[j] == 1:
            contact_forces(j, S, y[start:stop], dy[start:stop])
        else:
            for i in range(start, stop):
                dy[i] = 0.0
    for i in range(M.component_port.size):
        if S.friction.place[i] < 0:
            start, stop = 2 * n + M.state_start[contacts + i], 2 * n + M.state_start[contacts + i + 1]
            add_component(t, i, S, y[start:stop], dy[start:stop])
    friction = S.friction.component
    if friction.size > 0:  # friction depends on the reactions, which are computed without it and then with it
        settle(S, dy)
        find_reactions(t, y, S)
        for k in range(friction.size):
            i = friction[k]
            start, stop = 2 * n + M.state_start[contacts + i], 2 * n + M.state_start[contacts + i + 1]
            add_component(t, i, S, y[start:stop], dy[start:stop])
    settle(S, dy)


@kernel
def settle(S, dy):
    """Write velocities, and the accelerations and multipliers for the forces in Work.force."""
    M, C, W = S.model, S.state, S.work
    n, nb = M.n, M.nb
    for i in range(n):
        dy[i] = W.V[i]
        dy[n + i] = W.force[i]
    # -M_xb b'' of (R5)
    for row in range(M.coupled.size):
        i = M.coupled[row]
        for k in range(1, nb):
            dy[n + i] -= M.inertia[i, k] * W.basis[2, k]
    for i in range(nb):
        W.A[n + i] = W.basis[2, i]
    if W.multiplier.size > 0:
        map_directions(S, W.X, W.direction)
        map_directions(S, W.V, W.direction_rate)
        singular = factorize_constraints(S) >= 0
        for latch in range(M.latch.shape[0]):  # a latch that could not lock
            singular = singular or math.isnan(C.memory[M.component_guard[M.latch[latch, 2]]])
        # right-hand side of (R6): quadratic terms of the rates minus the second derivative of the value
        for k in range(W.multiplier.size):
            W.multiplier[k] = math.nan if singular else -W.value[2, k]
        for p in range(M.part_constraint.size):
            ux, uy = W.direction_rate[p, 0], W.direction_rate[p, 1]
            hx, hy = part_curvature(M.part_reference[p], W.direction[p, 0], W.direction[p, 1], ux, uy)
            W.multiplier[M.part_constraint[p]] += W.part_weight[p] * (hx * ux + hy * uy)
        # plus Phi times the accelerations without constraints
        for k in range(W.multiplier.size):
            total = W.multiplier[k]
            for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
                column = M.constraint_column[i]
                total += W.gradient[i] * (dy[n + column] if column < n else W.A[column])
            W.multiplier[k] = total
        solve_constraints(S, W.multiplier)
        subtract_gradients(S, W.multiplier, dy, n)
    for i in range(n):
        W.A[i] = dy[n + i]


@kernel
def linearise(t, y, S, dy, dt):
    """Write y' into dy and its partial time derivative into dt, and prepare `factorize`."""
    M, W = S.model, S.work
    n, nb = M.n, M.nb
    accelerate(t, y, S, dy)
    map_directions(S, W.A, W.direction_acceleration)
    # time enters through b(t): the inertia through its third derivative, elements and constraints below
    for i in range(2 * n):
        dt[i] = 0.0
    for i in range(n):
        for k in range(1, nb):
            dt[n + i] -= M.inertia[i, k] * W.basis[3, k]
    linearise_elements(t, y, S, dt)
    if W.multiplier.size > 0:
        linearise_constraints(S, dt)


@kernel
def linearise_elements(t, y, S, dt):
    """Linearise contacts and components; add to dt the effect of b(t) on their forces and states."""
    M, W = S.model, S.work
    n, contacts = M.n, S.parameters.contact.size
    for j in range(M.element_start.size - 1):
        start, stop = M.state_start[j], M.state_start[j + 1]
        for i in range(start, stop):
            dt[2 * n + i] = 0.0
        if not acts(j, S):
            continue
        states, z = stop - start, y[2 * n + start : 2 * n + stop]
        if j < contacts:
            linearise_contact(j, S, z, W.state_jacobian[: states + 7, :states], W.state_work[0], W.state_work[1])
        else:
            linearise_component(t, j - contacts, S, z, dt, 2 * n + start)
        first, count = M.element_start[j], M.element_start[j + 1] - M.element_start[j]
        for b in range(count):
            column = M.element_column[first + b] - n
            if column <= 0:  # a free column, or the constant 1
                continue
            w, a = W.basis[1, column], W.basis[2, column]
            for i in range(count):
                row = M.element_column[first + i]
                if row < n:
                    at = M.block_start[j] + i * count + b
                    dt[n + row] += W.block_x[at] * w + W.block_v[at] * a
            for s in range(states):
                at = M.force_state_start[j] + b * states + s
                dt[2 * n + start + s] += W.rate_by_x[at] * w + W.rate_by_v[at] * a


@kernel
def linearise_constraints(S, dt):
    """Store the constraint data for `factorize`; add to dt the effect of b(t) on the multipliers."""
    M, W = S.model, S.work
    n, m = M.n, W.multiplier.size
    # copies, because the stages of a step overwrite these
    for k in range(m):
        W.frozen_multiplier[k] = W.multiplier[k]
        W.work[k] = -W.value[3, k]
    for i in range(W.gradient.size):
        W.frozen_gradient[i] = W.gradient[i]
    for p in range(M.part_constraint.size):  # d (Phi^T) / dt lambda, and the terms of the constraints themselves
        for axis in range(2):
            W.frozen_direction[p, axis] = W.direction[p, axis]
            W.frozen_rate[p, axis] = W.direction_rate[p, axis]
        ex = ey = fx = fy = gx = gy = 0.0
        for i in range(M.part_start[p], M.part_start[p + 1]):
            column = M.constraint_column[i] - n
            if column > 0:
                rx, ry = M.constraint_row[0, i], M.constraint_row[1, i]
                ex += rx * W.basis[1, column]
                ey += ry * W.basis[1, column]
                fx += rx * W.basis[2, column]
                fy += ry * W.basis[2, column]
                gx += rx * W.basis[3, column]
                gy += ry * W.basis[3, column]
        k, weight, kind = M.part_constraint[p], W.part_weight[p], M.part_reference[p]
        dx, dy, ux, uy = W.direction[p, 0], W.direction[p, 1], W.direction_rate[p, 0], W.direction_rate[p, 1]
        hx, hy = part_curvature(kind, dx, dy, ex, ey)
        for i in range(M.part_start[p], M.part_start[p + 1]):
            column = M.constraint_column[i]
            if column < n:
                dt[n + column] -= W.multiplier[k] * weight * (M.constraint_row[0, i] * hx + M.constraint_row[1, i] * hy)
        sx, sy = part_slope(kind, dx, dy)
        hx, hy = part_curvature(kind, dx, dy, ux, uy)
        bx, by = part_bend(kind, dx, dy, ux, uy, W.direction_acceleration[p, 0], W.direction_acceleration[p, 1])
        W.work[k] += weight * (ex * bx + ey * by + 2.0 * (hx * fx + hy * fy) + sx * gx + sy * gy)
    # as in (R6), with dt instead of f
    for k in range(m):
        for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
            column = M.constraint_column[i]
            if column < n:
                W.work[k] += W.gradient[i] * dt[n + column]
    solve_constraints(S, W.work[:m])
    subtract_gradients(S, W.work, dt, n)


@kernel
def record_signals(t, y, S, signals):
    """Write the signals that controllers need later with a delay."""
    expand(t, y, S)
    M = S.model
    for i in range(M.recorder.size):
        if M.recorder[i] >= 0:
            signals[M.recorder[i]] = recorded_signal(t, i, S)
