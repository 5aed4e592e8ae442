"""A step of time stepping with hard contacts: impulses that keep surfaces apart, with restitution and Coulomb friction.

Moreau's midpoint rule with Jean's theta = 1/2 (Moreau 1988; Jean 1999, doi:10.1016/S0045-7825(98)00383-1): contacts whose gap
at the middle of the step has closed get impulses P_N, P_T, with U the relative velocity of the surfaces, positive as they
separate,

    0 <= U_N+ + e U_N- _|_ P_N >= 0,    |P_T| <= mu P_N,  P_T opposite to U_T+ where it slips.

Rows of the equations for the impulses: the constraints, then N and T of each hard contact, then components whose force depends
on their speed, permuted so that their band is narrow. Such a force F is taken at the mean of the speeds before and after the
step, so that strong damping does not limit the step: with s s^T = -dF/dv and U = s.v

    U+ + 2/h lambda = 2 U_m - U-,    U_m where F was evaluated.

Where contacts are few, impacts are located: a step ends where an open gap closes, and an impact there changes velocities alone.
Zeno's rule: a contact that forces would close again within the step stays closed, and a closed contact has no restitution.
Positions of contacts that stay closed are moved back to the surface by the least change in the metric of the masses.
"""

from __future__ import annotations

import math

from scissordyn.jit import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.component import linearise_component
from scissordyn.mechanics.contact import gap, kinematics
from scissordyn.mechanics.equations import accelerate
from scissordyn.mechanics.hard_rows import (
    acting_row,
    add_row,
    along,
    assemble,
    contact_rows,
    convective,
    effective_mass,
    element_of,
    speed_along,
)
from scissordyn.mechanics.impulse_solver import OPEN, STICK, solve_impulses

__all__ = [
    "ANGLE",
    "APPROACH",
    "CLOSED",
    "FRICTION_LOSS",
    "IMPULSE",
    "MASS",
    "REBOUND",
    "RESTITUTION_LOSS",
    "RESULTS",
    "hard_impact",
    "hard_step",
    "restore",
]

ANGLE, APPROACH, MASS, IMPULSE, RESTITUTION_LOSS, FRICTION_LOSS, REBOUND, CLOSED = range(8)
"""Columns of `HardContacts.result`: angle of n [rad], approach speed [m/s], effective mass [kg], impulse [N s], energy lost by
restitution and by friction [J], delta' after the step [m/s], whether the contact goes on."""

RESULTS = 8

factorize, solve = band.factorize, band.solve

DEEP = 1e-6
"""Gap or indentation of a contact that stays closed, as a fraction of the clearance, beyond which positions are moved back."""

LEAST_SQUARES = 1e-2
"""Weight of the moves against the gaps that they leave, relative to a free journal: where gaps contradict each other, as in a
closed loop with all joints in contact, no move is larger than five times the gaps."""

TOO_DEEP = 0.1
"""Indentation, as a fraction of the clearance, of a contact at the end of a step that is too long."""

STRIKES = 1e-9
"""Gap, as a fraction of the clearance, up to which a contact takes part in a located impact."""

ZENO = 1e-3
"""Part of a step: a located impact after which the surfaces would meet again sooner ends with them closed."""

STAYS = 1e-3
"""Gap, as a fraction of the clearance, up to which a contact that was closed is kept in the equations, which may open it."""

NEAR = 0.5
"""Gap, as a fraction of the clearance, up to which a contact may be closed by the forces of a step alone."""

RESTING = 1e-9
"""Approach speeds below this fraction of the step's change of velocity are round-off."""


@kernel()
def hard_step(t, h, y, new, S, H):
    """Make one step of size h from t and the state y to `new`; what hard contacts have done stands in `HardContacts.result`.

    Right after it, `System.work` has the forces of the middle of the step, with the mean of all impulses among them.
    """
    M, C = S.model, S.state
    n, count = M.n, H.which.size
    for i in range(y.size):
        H.kept_slope[i] = H.slope[i]
    for i in range(count):
        H.was[i], H.kept_mode[i], H.kept_stuck[i] = C.mode[H.which[i]], H.mode[i], H.stuck[i]
        C.mode[H.which[i]] = 0  # contact forces of the last step do not act
        H.load[i] = C.memory[H.which[i]]
    predict(h, y, S, H)
    accelerate(t + 0.5 * h, H.middle, S, new)
    for i in range(y.size):
        H.slope[i] = new[i]
    acts_now = close_gaps(h, S, H)
    if linearise_damping(t + 0.5 * h, S, H):
        acts_now = True
    if acts_now:
        solve_step(t, h, y, S, H)
    for i in range(n):
        new[n + i] = y[n + i] + h * H.slope[n + i]
    for i in range(2 * n, y.size):
        new[i] = y[i] + h * H.slope[i]
    H.impact[0] = 0
    H.impact[1] = min(H.impact[1], 0)
    if acts_now:
        add_impulses(h, y, new, S, H)
        take_results(h, S, H)
    for i in range(n):
        new[i] = y[i] + 0.5 * h * (y[n + i] + new[n + i])
        # what the next step begins with: forces, not impacts
        H.slope[n + i] = H.slope[n + i] if H.impact[0] == 1 else (new[n + i] - y[n + i]) / h
    for i in range(count):
        j = H.which[i]
        C.mode[j] = H.closed[i]
        if H.closed[i] == 0:
            C.memory[j] = 0.0
            new[2 * n + M.state_start[j]] = 0.0
        else:
            share_of_force(i, j, h, new, S, H)
        y[2 * n + M.state_start[j]] = new[2 * n + M.state_start[j]]  # it is a mean over the step
    look_ahead(h, new, S, H)
    if H.impact[1] == 1:
        take_back(S, H)
    elif acts_now:
        return_to_surfaces(h, new, S, H)


@kernel(inline=True)
def take_back(S, H):
    """Put back what the step has changed: it is to be made again, shorter."""
    for i in range(H.which.size):
        S.state.mode[H.which[i]] = H.was[i]
    restore(H)


@kernel(inline=True)
def restore(H):
    """Put back what the next step begins with."""
    for i in range(H.which.size):
        H.mode[i], H.stuck[i] = H.kept_mode[i], H.kept_stuck[i]
    for i in range(H.slope.size):
        H.slope[i] = H.kept_slope[i]


@kernel(inline=True)
def predict(h, y, S, H):
    """The state at the middle of the step: positions by the velocities, all else by the slope of the last step."""
    n = S.model.n
    for i in range(n):
        H.middle[i] = y[i] + 0.5 * h * y[n + i]
    for i in range(n, y.size):
        H.middle[i] = y[i] + 0.5 * h * H.slope[i]


@kernel(inline=True)
def close_gaps(h, S, H):
    """Mark the contacts whose gap at the middle of the step has closed, with their rows; returns whether there are any."""
    found = False
    for i in range(H.which.size):
        j = H.which[i]
        depth, rate = gap(j, S)
        H.closed[i], H.depth[i] = 0, depth
        H.result[i, :] = 0.0
        H.result[i, REBOUND] = rate
        least = -(STAYS if H.locate[0] == 1 else NEAR) * S.parameters.contact[j].clearance
        if depth >= least if H.was[i] == 1 or H.locate[0] == 0 else False:
            kinematics(j, S)
            contact_rows(i, S, H)
            H.closed[i] = 1
            H.rebound[i] = 0.0 if H.was[i] == 1 or depth < 0.0 else H.restitution[i]
            H.turn[i] = 0.5 * h * convective(j, S) if H.was[i] == 1 or depth < 0.0 else 0.0
            H.bias[i] = -2.0 * depth / h if depth < 0.0 and H.locate[0] == 0 else 0.0
            found = True
        else:
            H.mode[i], H.stuck[i] = OPEN, 0
    return found


@kernel(inline=True)
def linearise_damping(t, S, H):
    """Write the row s of each component whose force depends on its speed; returns whether there is one."""
    M, W, found = S.model, S.work, False
    for c in range(H.damped.size):
        i = H.damped[c]
        e = S.parameters.contact.size + i
        H.damping[c] = 0
        if M.component_guard[i] >= 0 and S.state.mode[M.component_guard[i]] == 0:
            continue
        first = 2 * M.n + M.state_start[e]
        linearise_component(t, i, S, H.middle[first : 2 * M.n + M.state_start[e + 1]], H.scratch, first)
        start, count, block = M.element_start[e], M.element_start[e + 1] - M.element_start[e], M.block_start[e]
        best, most = 0, 0.0
        for k in range(count):
            if -W.block_v[block + k * count + k] > most:
                best, most = k, -W.block_v[block + k * count + k]
        if not most > 0.0:
            continue
        root = math.sqrt(most)
        for k in range(count):
            H.normal[0, start + k] = -W.block_v[block + k * count + best] / root
        H.damping[c] = 1
        found = True
    return found


@kernel(inline=True)
def solve_step(t, h, y, S, H):
    """Solve for the impulses of the step; `HardContacts.slope` has the accelerations without them."""
    M, W = S.model, S.work
    n, nb, m = M.n, M.nb, W.multiplier.size
    first = m + 2 * H.which.size
    for a in range(H.place.size):
        H.free[H.place[a]] = H.before[H.place[a]] = 0.0
    # velocities without impulses at the end, and at the start, both with the drives' own
    for k in range(n):
        W.A[k] = y[n + k] + h * H.slope[n + k]
    for k in range(nb):
        W.A[n + k] = W.basis[1, k] + 0.5 * h * W.basis[2, k]
    for a in range(m, H.place.size):
        if acting_row(a, m, S, H):
            H.free[H.place[a]] = along(a, W.A, S, H)
    for k in range(n):
        W.A[k] = y[n + k]
    for k in range(nb):
        W.A[n + k] = W.basis[1, k] - 0.5 * h * W.basis[2, k]
    for a in range(m, H.place.size):
        if acting_row(a, m, S, H):
            H.before[H.place[a]] = along(a, W.A, S, H)
    for a in range(first, H.place.size):
        if H.damping[a - first] == 1:
            H.free[H.place[a]] += H.before[H.place[a]] - 2.0 * along(a, W.V, S, H)
    leave_out_open(m, S, H)
    assemble(h, S, H)
    turn_normals(h, m, S, H)
    solve_impulses(m, H)


@kernel(inline=True)
def leave_out_open(m, S, H):
    """Of the contacts with a gap that were open: leave out those that are not closed by the forces of this step alone."""
    for i in range(H.which.size):
        if H.closed[i] == 0 or H.was[i] == 1 or H.depth[i] >= 0.0:
            continue
        at = H.place[m + 2 * i]
        by_force = H.before[at] - H.free[at]
        if H.free[at] > -H.bias[i] or 2.0 * H.restitution[i] * max(-H.before[at], 0.0) > by_force:
            H.closed[i], H.mode[i], H.stuck[i] = 0, OPEN, 0


@kernel(inline=True)
def turn_normals(h, m, S, H):
    """What the turning of a closed contact's normal within the step adds to its equations.

    A journal under a load N in its bearing is a pendulum of length c, whose frequency (N G_TT/c)^0.5 may be far above 1/h. Its
    normal is therefore taken at the mean of the positions, which are not known yet, and at later ones as the frequency grows:

        P_T = friction - N h^2/c (a (U_T+ - U_T-) + f u_t),    a = 1/4 + 3/4 f,    f = z^2/(1 + z^2),    z = N G_TT h^2/c.
    """
    for i in range(H.which.size):
        H.swing[i] = H.lag[i] = 0.0
        if H.closed[i] == 0:
            continue
        j = H.which[i]
        at, other = H.place[m + 2 * i], H.place[m + 2 * i + 1]
        H.turn[i] = min(H.turn[i], max(-H.before[at], 0.0))
        H.bias[i] = max(H.bias[i] - 0.5 * H.turn[i], 0.0) - H.turn[i]
        found = S.work.contact[j]
        if S.parameters.contact[j].plane == 1 or H.was[i] == 0 or not found.distance > 0.0:
            continue
        load = H.load[i] * h * h / found.distance
        z = load * H.gram[other, H.reach[0]]
        f = z * z / (1.0 + z * z)
        H.swing[i] = load * (0.25 + 0.75 * f)
        rolls = along(m + 2 * i + 1, S.work.V, S, H) - speed_along(j, S)
        H.lag[i] = H.swing[i] * H.before[other] - load * f * (H.before[other] - rolls)


@kernel(inline=True)
def add_impulses(h, y, new, S, H):
    """Add the impulses to the velocities, and their mean forces to what stands in `System.work`."""
    M, W = S.model, S.work
    n, m = M.n, W.multiplier.size
    for a in range(H.place.size):
        value = H.impulse[H.place[a]]
        if value == 0.0:
            continue
        add_row(a, m, value, new, n, S, H)
        if a < m:
            W.multiplier[a] -= value / h
            continue
        j, axis = element_of(a, m, S, H)
        for k in range(M.element_start[j], M.element_start[j + 1]):
            W.force[M.element_column[k]] += value * H.normal[axis, k] / h
    for i in range(n):
        W.A[i] = (new[n + i] - y[n + i]) / h
    for k in range(M.nb):
        W.A[n + k] = W.basis[2, k]


@kernel(inline=True)
def place_at_end(h, new, S):
    """Write the positions of the end of the step into Work.X."""
    M, W = S.model, S.work
    for k in range(M.n):
        W.X[k] = new[k]
    for k in range(M.nb):
        W.X[M.n + k] = W.basis[0, k] + h * (0.5 * W.basis[1, k] + 0.125 * h * W.basis[2, k])


@kernel(inline=True)
def place_at_middle(S, H):
    """Write those of the middle back."""
    M, W = S.model, S.work
    for k in range(M.n):
        W.X[k] = H.middle[k]
    for k in range(M.nb):
        W.X[M.n + k] = W.basis[0, k]


@kernel(inline=True)
def look_ahead(h, new, S, H):
    """Note the largest indentation of contacts that are open at the end of the step, and whether one has become too deep."""
    place_at_end(h, new, S)
    H.ahead[0] = -math.inf
    for i in range(H.which.size):
        depth, _ = gap(H.which[i], S)
        if H.closed[i] == 0:
            H.ahead[0] = max(H.ahead[0], depth)
        most = TOO_DEEP * S.parameters.contact[H.which[i]].clearance
        if H.locate[0] == 0 and H.impact[1] == 0 and depth > most and depth - H.depth[i] > 0.5 * most:
            H.impact[1] = 1
    place_at_middle(S, H)


@kernel()
def hard_impact(t, h, y, S, H):
    """Impacts at an instant and a state y, whose velocities they change; h is the size of a step, for Zeno's rule."""
    M, W, C = S.model, S.work, S.state
    n, m = M.n, W.multiplier.size
    for i in range(H.which.size):
        H.was[i] = C.mode[H.which[i]]
        C.mode[H.which[i]] = 0
    for i in range(y.size):
        H.scratch[i] = y[i]
    accelerate(t, y, S, H.middle)
    for k in range(n):
        H.row[k] = 0.0
    for i in range(H.which.size):
        j = H.which[i]
        depth, rate = gap(j, S)
        H.result[i, :] = 0.0
        H.result[i, REBOUND] = rate
        reach = STAYS if H.was[i] == 1 else STRIKES
        H.closed[i] = 1 if depth >= -reach * S.parameters.contact[j].clearance else 0
        if H.closed[i] == 1:
            kinematics(j, S)
            contact_rows(i, S, H)
            H.rebound[i] = 0.0 if H.was[i] == 1 else H.restitution[i]
            H.bias[i] = H.turn[i] = H.swing[i] = H.lag[i] = 0.0
    for c in range(H.damped.size):
        H.damping[c] = 0
    for a in range(H.place.size):
        H.free[H.place[a]] = 0.0
    for a in range(m, m + 2 * H.which.size):
        if H.closed[(a - m) // 2] == 1:
            H.free[H.place[a]] = along(a, W.V, S, H)
    for a in range(H.place.size):
        H.before[a] = H.free[a]
    assemble(0.0, S, H)
    solve_impulses(m, H)
    for a in range(m + 2 * H.which.size):
        if H.impulse[H.place[a]] != 0.0:
            add_row(a, m, H.impulse[H.place[a]], y, n, S, H)
    take_impacts(h, S, H)
    H.work[0] = drive_work(y, S, H)
    for i in range(H.which.size):
        C.mode[H.which[i]] = 1 if H.closed[i] == 1 and H.result[i, CLOSED] == 1.0 else 0
        C.memory[H.which[i]] = 0.0


@kernel(inline=True)
def take_impacts(h, S, H):
    """Write what each contact has done in an impact; `HardContacts.middle` has accelerations without contacts."""
    m, n = S.work.multiplier.size, S.model.n
    H.ahead[1] = math.inf
    for k in range(n):
        S.work.A[k] = H.middle[n + k]
    for i in range(H.which.size):
        if H.closed[i] == 0:
            continue
        found, out = S.work.contact[H.which[i]], H.result[i]
        a, b = H.place[m + 2 * i], H.place[m + 2 * i + 1]
        p_n, before, after = H.impulse[a], H.before[a], H.velocity[a]
        out[REBOUND] = -after
        if not p_n > 0.0:
            H.closed[i] = H.was[i]  # a closed contact that is not struck stays closed: the next step may open it
            out[CLOSED] = float(H.was[i])
            continue
        out[ANGLE], out[APPROACH], out[IMPULSE] = math.atan2(found.ny, found.nx), max(-before, 0.0), p_n
        out[RESTITUTION_LOSS] = -0.5 * p_n * (after + before)
        out[FRICTION_LOSS] = -0.5 * H.impulse[b] * (H.velocity[b] + H.before[b])
        together = -along(m + 2 * i, S.work.A, S, H)  # acceleration of the surfaces towards each other
        back = 2.0 * max(after, 0.0) / together if together > 0.0 else math.inf
        out[CLOSED] = 1.0 if back < ZENO * h else 0.0
        if out[CLOSED] == 0.0:
            H.ahead[1] = min(H.ahead[1], back)
        if H.was[i] == 0:
            out[MASS] = effective_mass(i, S, H)


@kernel(inline=True)
def drive_work(y, S, H):
    """Work of the drives in an impact [J]: `HardContacts.scratch` has the state before it."""
    M, W = S.model, S.work
    n, m, total = M.n, W.multiplier.size, 0.0
    for k in range(1, M.nb):
        for i in range(n):
            total += (y[n + i] - H.scratch[n + i]) * M.inertia[i, k] * W.basis[1, k]
    for a in range(m):
        for e in range(M.constraint_start[a], M.constraint_start[a + 1]):
            if M.constraint_column[e] > n:
                total -= W.gradient[e] * H.impulse[H.place[a]] * W.basis[1, M.constraint_column[e] - n]
    for i in range(M.timed.size):
        total += H.impulse[H.place[M.timed[i]]] * W.value[1, M.timed[i]]
    for a in range(m, m + 2 * H.which.size):
        if H.impulse[H.place[a]] == 0.0:
            continue
        j, axis = element_of(a, m, S, H)
        for e in range(M.element_start[j], M.element_start[j + 1]):
            if M.element_column[e] > n:
                total -= H.normal[axis, e] * H.impulse[H.place[a]] * W.basis[1, M.element_column[e] - n]
    return total


@kernel(inline=True)
def return_to_surfaces(h, new, S, H):
    """Move the positions of contacts that stay closed back to their surfaces."""
    W = S.work
    m, reach, deep = W.multiplier.size, H.reach[0], False
    place_at_end(h, new, S)
    H.band[:, :] = 0.0
    for a in range(H.place.size):
        at = H.place[a]
        H.shift[at], H.band[at, reach] = 0.0, 1.0
        if a < m and H.gram[at, reach] > 0.0:
            for k in range(2 * reach + 1):
                H.band[at, k] = H.gram[at, k]
    for i in range(H.which.size):
        depth, _ = gap(H.which[i], S)
        if H.closed[i] == 0 or H.result[i, CLOSED] == 0.0 or (H.locate[0] == 0 and depth <= 0.0):
            continue
        at = H.place[m + 2 * i]
        for k in range(2 * reach + 1):
            H.band[at, k] = H.gram[at, k]
        H.band[at, reach] *= 1.0 + LEAST_SQUARES
        H.shift[at] = depth
        deep = deep or abs(depth) > DEEP * S.parameters.contact[H.which[i]].clearance
    if deep and factorize(H.band, reach, reach, H.pivots) < 0:
        solve(H.band, reach, reach, H.pivots, H.shift)
        for a in range(m + 2 * H.which.size):
            if H.shift[H.place[a]] != 0.0:
                add_row(a, m, H.shift[H.place[a]], new, 0, S, H)
    place_at_middle(S, H)


@kernel(inline=True)
def take_results(h, S, H):
    """Write what each closed contact has done, and whether one of them was an impact."""
    m = S.work.multiplier.size
    for i in range(H.which.size):
        if H.closed[i] == 0:
            continue
        found, out = S.work.contact[H.which[i]], H.result[i]
        a, b = H.place[m + 2 * i], H.place[m + 2 * i + 1]
        p_n, p_t = H.impulse[a], H.impulse[b]
        before, after = H.before[a], H.velocity[a]
        out[REBOUND] = -after
        if not p_n > 0.0:
            H.closed[i], H.stuck[i], H.mode[i] = 0, 0, OPEN
            continue
        out[ANGLE], out[APPROACH], out[IMPULSE] = math.atan2(found.ny, found.nx), max(-before, 0.0), p_n
        turned = H.lag[i] - H.swing[i] * H.velocity[b]  # part of P_T that is the normal's
        out[RESTITUTION_LOSS] = -0.5 * p_n * (after + before) - 0.5 * turned * (H.velocity[b] + H.before[b])
        out[FRICTION_LOSS] = -0.5 * (p_t - turned) * (H.velocity[b] + H.before[b])
        by_force = before - H.free[a]
        if (-before - H.turn[i]) * (1.0 + H.rebound[i]) > RESTING + abs(by_force):
            H.impact[0] = 1
        near = RESTING * (abs(before) + H.turn[i])
        out[CLOSED] = 1.0 if after - H.turn[i] <= max(by_force, near) else 0.0
        H.stuck[i] = 1 if H.mode[i] == STICK else 0
        if H.was[i] == 0:
            out[MASS] = effective_mass(i, S, H)


@kernel(inline=True)
def share_of_force(i, j, h, new, S, H):
    """Mean contact force over the step, without impacts, in the place of the contact's memory and of its state."""
    m, found = S.work.multiplier.size, S.work.contact[j]
    a = H.place[m + 2 * i]
    impulsive = max(-H.before[a] - H.turn[i], 0.0) * (1.0 + H.rebound[i])
    by_force = max(H.before[a] - H.free[a] + 2.0 * H.turn[i], 0.0)
    share = by_force / (by_force + impulsive) if by_force > 0.0 else 0.0
    found.elastic = 0.0
    found.normal = share * H.impulse[a] / h
    found.tangential = share * H.impulse[H.place[m + 2 * i + 1]] / h
    S.state.memory[j] = found.normal
    new[2 * S.model.n + S.model.state_start[j]] = found.tangential
