"""Results of hard contacts in a step."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.hard_rows import OPEN, STICK, effective_mass
from scissordyn.tolerance import EVENT_TOL

ANGLE, APPROACH, MASS, IMPULSE, RESTITUTION_LOSS, FRICTION_LOSS, REBOUND, CLOSED, SUDDEN, STRUCK = range(10)
"""Columns of `HardWork.result`: angle of n [rad], approach speed [m/s], effective mass [kg], impulse [N s], energy lost by
restitution and by friction [J], delta' after the step [m/s], whether the contact stays closed, the impact's
part of the impulse [N s], and the energy of the impact (`impact_energy`) [J].
"""


@kernel
def take_results(h, S, H):
    """Write the results of each closed contact, and whether one of them was an impact."""
    m = S.work.multiplier.size
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0 or H.model.compliant[i] == 1:
            continue
        contact, out = S.work.contact[H.model.which[i]], H.work.result[i]
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        p_n, p_t = H.work.impulse[a], H.work.impulse[b]
        before, after = H.work.before[a], H.work.velocity[a]
        out[REBOUND] = -after
        if not p_n > 0.0:
            H.work.closed[i], H.state.stuck[i], H.state.mode[i] = 0, 0, OPEN
            continue
        out[ANGLE], out[APPROACH], out[IMPULSE] = math.atan2(contact.ny, contact.nx), max(-before, 0.0), p_n
        turned = H.work.lag[i] - H.work.turning_mass[i] * H.work.velocity[b]  # part of P_T caused by the rotation of the normal
        out[RESTITUTION_LOSS] = -0.5 * p_n * (after + before) - 0.5 * turned * (H.work.velocity[b] + H.work.before[b])
        out[FRICTION_LOSS] = -0.5 * (p_t - turned) * (H.work.velocity[b] + H.work.before[b])
        H.state.stuck[i] = 1 if H.state.mode[i] == STICK else 0
        if H.work.yields[i] == 1:
            out[CLOSED] = 1.0
            continue
        by_force = before - H.work.free[a]
        if (-before - H.work.turn[i]) * (1.0 + H.work.rebound[i]) > EVENT_TOL + abs(by_force):
            H.work.impact[0] = 1
        near = EVENT_TOL * (abs(before) + H.work.turn[i])
        out[CLOSED] = 1.0 if after - H.work.turn[i] <= max(by_force, near) else 0.0
        out[SUDDEN] = p_n - lasting_part(i, a, H) * p_n
        if H.work.was[i] == 0:
            out[MASS] = effective_mass(i, S, H)
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0 or H.model.compliant[i] == 1:
            continue
        sudden = H.work.result[i, SUDDEN]
        if H.work.yields[i] == 1 and H.work.impact[0] == 1:  # an impact elsewhere passes through this contact
            sudden = H.work.result[i, IMPULSE] - h * H.work.load[i]
        H.work.result[i, STRUCK] = impact_energy(i, sudden, S, H)


@kernel
def impact_energy(i, impulse, S, H):
    """Return m v^2 [J] of a single impact of effective mass m with impulse m v (1 + e); 0 if it is not a new maximum."""
    if H.work.was[i] == 0:
        H.state.struck[i] = 0.0
    a = H.model.place[S.work.multiplier.size + 2 * i]
    square = impulse / (1.0 + H.work.rebound[i])
    square *= square
    # 1/m is at most the known G_NN
    if not (impulse > 0.0 and square * H.work.gram[a, H.model.reach[0]] > H.state.struck[i]):
        return 0.0
    energy = square / effective_mass(i, S, H)
    H.state.struck[i] = max(H.state.struck[i], energy)
    return energy


@kernel
def lasting_part(i, a, H):
    """Return the fraction of a contact's normal impulse that forces cause, not an impact."""
    impulsive = max(-H.work.before[a] - H.work.turn[i], 0.0) * (1.0 + H.work.rebound[i])
    by_force = max(H.work.before[a] - H.work.free[a] + 2.0 * H.work.turn[i], 0.0)
    return by_force / (by_force + impulsive) if by_force > 0.0 else 0.0


@kernel
def share_of_force(i, j, h, new, S, H):
    """Write the mean contact force over the step, without impacts, to the contact's memory and state."""
    m, contact = S.work.multiplier.size, S.work.contact[j]
    a = H.model.place[m + 2 * i]
    share = 1.0 if H.work.yields[i] == 1 else lasting_part(i, a, H)
    contact.elastic = 0.0
    contact.normal = share * H.work.impulse[a] / h
    contact.tangential = share * H.work.impulse[H.model.place[m + 2 * i + 1]] / h
    S.state.memory[j] = contact.normal
    new[2 * S.model.n + S.model.state_start[j]] = contact.tangential
