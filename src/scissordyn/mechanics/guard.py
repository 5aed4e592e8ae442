"""Guards, whose zero crossings start or end the action of contacts and components, and the resulting state changes."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.component import begin_laws, component_gap, switch_loss
from scissordyn.mechanics.constraint_part import part_slope
from scissordyn.mechanics.constraint_solver import (
    engage,
    expand,
    expand_element,
    factorize_constraints,
    map_directions,
    project,
    solve_constraints,
    velocity_residual,
)
from scissordyn.mechanics.contact import begin_contact, end_contact, gap, renew_contacts
from scissordyn.mechanics.contact_mass import component_mass
from scissordyn.mechanics.system import APPROACH_FLOOR
from scissordyn.tolerance import EVENT_TOL


@kernel
def guards(t, y, S, value, rate):
    """Write value and rate of all guards; a value rises through zero when its element begins to act (a journal: |e| - c)."""
    M = S.model
    expand(t, y, S)
    contacts = S.parameters.contact.size
    for j in range(contacts):
        value[j], rate[j] = gap(j, S)
    for guard in range(contacts, S.state.mode.size):
        i = M.guard_component[guard]
        start, stop = state_range(i, S)
        value[guard], rate[guard] = component_gap(t, i, y[start:stop], S)


@kernel
def guard(t, y, k, S, value, rate):
    """Write value and rate of guard k only."""
    if k < S.parameters.contact.size:
        expand_element(t, y, k, S)
        value[k], rate[k] = gap(k, S)
        return
    expand(t, y, S)
    i = S.model.guard_component[k]
    start, stop = state_range(i, S)
    value[k], rate[k] = component_gap(t, i, y[start:stop], S)


@kernel
def state_range(i, S):
    """Return the index range of the internal states of component i in y."""
    M = S.model
    element = S.parameters.contact.size + i
    return 2 * M.n + M.state_start[element], 2 * M.n + M.state_start[element + 1]


@kernel
def reset(t, y, guard, S, data):
    """Change the mode of a guard whose value has crossed zero; return whether it changed.

    Writes the rate, the angle of the normal or the energy lost, and the work of the drives to `data`.
    """
    M, C = S.model, S.state
    data[2] = 0.0
    expand(t, y, S)
    if guard < S.parameters.contact.size:
        return end_contact(guard, S, data) if C.mode[guard] == 1 else begin_contact(y, guard, S, data, False)
    i = M.guard_component[guard]
    start, stop = state_range(i, S)
    _, data[0] = component_gap(t, i, y[start:stop], S)
    data[1] = 0.0
    for latch in range(M.latch.shape[0]):
        if M.latch[latch, 2] == i:
            lock(t, y, guard, S, data)
            return True
    if C.mode[guard] == 0 and not data[0] > 0.0:
        return False
    data[1] = switch_loss(t, i, y[start:stop], S)
    if C.mode[guard] == 0:
        begin_laws(i, y[start:stop], S, False)
        C.mass[guard] = component_mass(t, i, y[start:stop], S)
    C.memory[guard] = max(data[0], APPROACH_FLOOR)
    C.mode[guard] = 1 - C.mode[guard]
    return True


@kernel
def touch(t, y, guard, S, data):
    """Activate a guard whose value is positive at the start of a run, for any rate."""
    M, C = S.model, S.state
    expand(t, y, S)
    if guard < S.parameters.contact.size:
        begin_contact(y, guard, S, data, True)
        return
    i = M.guard_component[guard]
    start, stop = state_range(i, S)
    _, data[0] = component_gap(t, i, y[start:stop], S)
    begin_laws(i, y[start:stop], S, True)
    data[0], data[1] = max(data[0], APPROACH_FLOOR), 0.0
    C.memory[guard], C.mode[guard] = data[0], 1
    C.mass[guard] = component_mass(t, i, y[start:stop], S)


@kernel
def lock(t, y, guard, S, data):
    """Lock a latch by a plastic impact; write the energy lost and the work of the drives in the impact to `data`.

    Both are computed independently, so that the energy balance tests them. If other constraints prevent the impact, the state
    is kept, the latch's memory becomes NaN, and the integration stops.
    """
    M, W, C = S.model, S.work, S.state
    n, lost = M.n, 0.0
    for i in range(2 * n):
        W.scratch[i] = y[i]
    map_directions(S, W.V, W.direction_rate)
    fastest = 0.0
    for p in range(M.part_constraint.size):
        fastest = max(fastest, abs(W.direction_rate[p, 0]) + abs(W.direction_rate[p, 1]))
    C.mode[guard] = 1
    # the rate part of (R7) is the plastic impact
    engage(S)
    project(t, y, S)
    if not velocity_residual(t, y, S) <= EVENT_TOL * fastest:
        for i in range(2 * n):
            y[i] = W.scratch[i]
        C.memory[guard] = math.nan
        return
    for i in range(n):  # velocity jumps, stored as accelerations
        W.A[i] = y[n + i] - W.scratch[n + i]
        lost += 0.5 * W.A[i] * W.A[i]
    data[1], data[2] = lost, impulsive_work(S)
    renew_contacts(S)


@kernel
def impulsive_work(S):
    """Return the work [J] of drives and prescribed distances in the velocity jump `Work.A[:n]` at the position `Work.X`.

    The impulses P of the constraints follow from the jump, which equals -Phi_x^T P. The impulse of a drive on its entries of b
    is M_bx jump + Phi_b^T P; the drive's speed is unchanged.
    """
    M, W = S.model, S.work
    n = M.n
    for i in range(M.nb):
        W.A[n + i] = 0.0
    map_directions(S, W.A, W.direction_acceleration)
    for k in range(W.multiplier.size):
        W.work[k] = 0.0
    # Phi Phi^T P = -Phi jump
    for p in range(M.part_constraint.size):
        sx, sy = part_slope(M.part_reference[p], W.direction[p, 0], W.direction[p, 1])
        along = sx * W.direction_acceleration[p, 0] + sy * W.direction_acceleration[p, 1]
        W.work[M.part_constraint[p]] -= W.part_weight[p] * along
    factorize_constraints(S)
    solve_constraints(S, W.work[: W.multiplier.size])
    total = 0.0
    for k in range(1, M.nb):
        for i in range(n):
            total += W.A[i] * M.inertia[i, k] * W.basis[1, k]
    for k in range(W.multiplier.size):
        for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
            column = M.constraint_column[i] - n
            if column > 0:
                total += W.gradient[i] * W.work[k] * W.basis[1, column]
    for i in range(M.timed.size):
        total -= W.work[M.timed[i]] * W.value[1, M.timed[i]]
    return total
