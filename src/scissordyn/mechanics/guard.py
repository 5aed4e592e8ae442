"""Guards: contacts and components that begin or cease to act, and what happens then."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.component import component_gap, switch_loss
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

LOCKED = 1e-9  # A latch has locked when the rates of all constraints vanish within this fraction of the fastest rate


@kernel
def guards(t, y, S, value, rate):
    """Write what rises through zero as a guard begins to act, and its rate; |e| - c for the contact of a journal."""
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
    """The same for one guard."""
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
    """Where the internal states of component i stand in y."""
    M = S.model
    element = S.parameters.contact.size + i
    return 2 * M.n + M.state_start[element], 2 * M.n + M.state_start[element + 1]


@kernel
def reset(t, y, guard, S, data):
    """A guard has been crossed; writes its rate, the angle of the normal or a loss of energy, and the work of the drives.

    Returns whether its mode changed.
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
        C.mass[guard] = component_mass(t, i, y[start:stop], S)
    C.memory[guard] = max(data[0], APPROACH_FLOOR)
    C.mode[guard] = 1 - C.mode[guard]
    return True


@kernel
def touch(t, y, guard, S, data):
    """Let a guard act that is past zero at the start, whatever its rate."""
    M, C = S.model, S.state
    expand(t, y, S)
    if guard < S.parameters.contact.size:
        begin_contact(y, guard, S, data, True)
        return
    i = M.guard_component[guard]
    start, stop = state_range(i, S)
    _, data[0] = component_gap(t, i, y[start:stop], S)
    data[0], data[1] = max(data[0], APPROACH_FLOOR), 0.0
    C.memory[guard], C.mode[guard] = data[0], 1
    C.mass[guard] = component_mass(t, i, y[start:stop], S)


@kernel
def lock(t, y, guard, S, data):
    """A plastic impact onto a latch's constraint; `data` gets the energy lost and the work that the drives do meanwhile.

    Both are computed by themselves, so that the energy balance tests them. Where the other constraints forbid the impact, the
    state stays and the latch's memory is NaN: no step goes on from there.
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
    if not velocity_residual(t, y, S) <= LOCKED * fastest:
        for i in range(2 * n):
            y[i] = W.scratch[i]
        C.memory[guard] = math.nan
        return
    for i in range(n):  # the jump of the velocities, in the place of accelerations
        W.A[i] = y[n + i] - W.scratch[n + i]
        lost += 0.5 * W.A[i] * W.A[i]
    data[1], data[2] = lost, impulsive_work(S)
    renew_contacts(S)


@kernel
def impulsive_work(S):
    """Work [J] of the drives and of prescribed distances in a jump W.A[:n] of the velocities; the position stands in W.X.

    The impulses P of the constraints follow from the jump, -Phi_x^T P. A drive has the impulse M_bx jump + Phi_b^T P on its
    entries of b, and keeps its speed while it acts.
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
