"""Impacts of hard contacts at an instant: velocities change, positions do not."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.contact import gap, kinematics
from scissordyn.mechanics.equations import accelerate
from scissordyn.mechanics.hard_elastic import TOUCHING_DEPTH_MAX
from scissordyn.mechanics.hard_powers import add_hard_loads
from scissordyn.mechanics.hard_result import (
    ANGLE,
    APPROACH,
    CLOSED,
    FRICTION_LOSS,
    IMPULSE,
    MASS,
    REBOUND,
    RESTITUTION_LOSS,
    STRUCK,
    impact_energy,
)
from scissordyn.mechanics.hard_rows import add_row, along, assemble, contact_rows, effective_mass, element_of
from scissordyn.mechanics.impulse_solver import solve_impulses
from scissordyn.mechanics.monitored import BALANCED
from scissordyn.tolerance import EVENT_TOL, SHORT_STEP_FRACTION


@kernel
def hard_impact(t, h, y, S, H, gain):
    """Compute the impacts at an instant, change the velocities of y, and write the loads of wear [J] to `gain`.

    h is the step size for Zeno's rule and for the mean force of an impulse.
    """
    M, W, C = S.model, S.work, S.state
    n, m = M.n, W.multiplier.size
    for i in range(H.model.which.size):
        H.work.was[i] = C.mode[H.model.which[i]]
        if H.model.compliant[i] == 0:
            C.mode[H.model.which[i]] = 0
    for i in range(y.size):
        H.work.scratch[i] = y[i]
    accelerate(t, y, S, H.work.middle)
    for i in range(H.model.which.size):
        j = H.model.which[i]
        depth, rate = gap(j, S)
        H.work.result[i, :] = 0.0
        H.work.result[i, REBOUND] = rate
        if H.model.compliant[i] == 1:  # its force is finite
            H.work.closed[i] = H.work.yields[i] = 0
            continue
        reach = TOUCHING_DEPTH_MAX if H.work.was[i] == 1 else EVENT_TOL
        H.work.closed[i] = 1 if depth >= -reach * S.parameters.contact[j].clearance else 0
        if H.work.closed[i] == 1:
            kinematics(j, S)
            contact_rows(i, S, H)
            H.work.yields[i] = 0
            H.work.rebound[i] = 0.0 if H.work.was[i] == 1 else H.parameters.restitution[i]
            H.work.bias[i] = H.work.turn[i] = H.work.turning_mass[i] = H.work.lag[i] = 0.0
    for c in range(H.model.damped.size):
        H.work.damping[c] = 0
    for a in range(H.model.place.size):
        H.work.free[H.model.place[a]] = 0.0
    for a in range(m, m + 2 * H.model.which.size):
        if H.work.closed[(a - m) // 2] == 1:
            H.work.free[H.model.place[a]] = along(a, W.V, S, H)
    for a in range(H.model.place.size):
        H.work.before[a] = H.work.free[a]
    assemble(0.0, S, H)
    solve_impulses(m, y, S, H)
    for a in range(m + 2 * H.model.which.size):
        if H.work.impulse[H.model.place[a]] != 0.0:
            add_row(a, m, H.work.impulse[H.model.place[a]], y, n, S, H)
    take_impacts(h, y, S, H)
    gain[:] = 0.0
    if gain.size > BALANCED:
        add_hard_loads(h, 1.0, S, H, gain)
    H.work.drive_work[0] = drive_work(y, S, H)
    for i in range(H.model.which.size):
        if H.model.compliant[i] == 1:
            continue
        C.mode[H.model.which[i]] = 1 if H.work.closed[i] == 1 and H.work.result[i, CLOSED] == 1.0 else 0
        C.memory[H.model.which[i]] = 0.0


@kernel
def take_impacts(h, y, S, H):
    """Write the impact results of each contact; `HardWork.middle` contains accelerations without contacts."""
    m, n = S.work.multiplier.size, S.model.n
    H.state.ahead[1] = math.inf
    for k in range(n):
        S.work.A[k] = H.work.middle[n + k]
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0:
            continue
        contact, out = S.work.contact[H.model.which[i]], H.work.result[i]
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        p_n, before, after = H.work.impulse[a], H.work.before[a], H.work.velocity[a]
        out[REBOUND] = -after
        if not p_n > 0.0:
            H.work.closed[i] = H.work.was[i]  # a closed contact that is not struck stays closed: the next step may open it
            out[CLOSED] = float(H.work.was[i])
            continue
        out[ANGLE], out[APPROACH], out[IMPULSE] = math.atan2(contact.ny, contact.nx), max(-before, 0.0), p_n
        out[RESTITUTION_LOSS] = -0.5 * p_n * (after + before)
        out[FRICTION_LOSS] = -0.5 * H.work.impulse[b] * (H.work.velocity[b] + H.work.before[b])
        together = -along(m + 2 * i, S.work.A, S, H)  # acceleration of the surfaces towards each other
        back = 2.0 * max(after, 0.0) / together if together > 0.0 else math.inf
        out[CLOSED] = 1.0 if back < SHORT_STEP_FRACTION * h else 0.0
        if out[CLOSED] == 0.0:
            stored = S.model.elastic_state[H.model.which[i]]
            out[RESTITUTION_LOSS] += y[stored]
            y[stored] = 0.0
            H.state.ahead[1] = min(H.state.ahead[1], back)
        if H.work.was[i] == 0:
            out[MASS] = effective_mass(i, S, H)
        out[STRUCK] = impact_energy(i, p_n, S, H)


@kernel
def drive_work(y, S, H):
    """Return the work of the drives in an impact [J]; `HardWork.scratch` contains the state before it."""
    M, W = S.model, S.work
    n, m, total = M.n, W.multiplier.size, 0.0
    for k in range(1, M.nb):
        for i in range(n):
            total += (y[n + i] - H.work.scratch[n + i]) * M.inertia[i, k] * W.basis[1, k]
    for a in range(m):
        for e in range(M.constraint_start[a], M.constraint_start[a + 1]):
            if M.constraint_column[e] > n:
                total -= W.gradient[e] * H.work.impulse[H.model.place[a]] * W.basis[1, M.constraint_column[e] - n]
    for i in range(M.timed.size):
        total += H.work.impulse[H.model.place[M.timed[i]]] * W.value[1, M.timed[i]]
    for a in range(m, m + 2 * H.model.which.size):
        if H.work.impulse[H.model.place[a]] == 0.0:
            continue
        j, axis = element_of(a, m, S, H)
        for e in range(M.element_start[j], M.element_start[j + 1]):
            if M.element_column[e] > n:
                total -= H.work.normal[axis, e] * H.work.impulse[H.model.place[a]] * W.basis[1, M.element_column[e] - n]
    return total
