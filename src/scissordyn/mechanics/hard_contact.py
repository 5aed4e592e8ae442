"""A step of time stepping with hard contacts: impulses that keep surfaces apart, with restitution and Coulomb friction.

Moreau's midpoint rule with Jean's theta = 1/2 (Moreau 1988; Jean 1999, doi:10.1016/S0045-7825(98)00383-1): contacts whose gap
at the middle of the step has closed get impulses P_N, P_T, with U the relative velocity of the surfaces, positive as they
separate,

    0 <= U_N+ + e U_N- _|_ P_N >= 0,    |P_T| <= mu P_N,  P_T opposite to U_T+ where it slips.

Rows of the equations for the impulses: the constraints, then N and T of each hard contact, then components whose force depends
on their speed, permuted so that their band is narrow. Such a force F is taken at the mean of the speeds before and after the
step, so that strong damping does not limit the step: with s s^T = -dF/dv and U = s.v

    U+ + 2/h lambda = 2 U_m - U-,    U_m where F was evaluated.

Zeno's rule: a contact that forces would close again within the step stays closed, and a closed contact has no restitution.
Positions of contacts that stay closed are moved back to the surface by the least change in the metric of the masses.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from scissordyn.jit import F1, F2, I1, I2, kernel, opener
from scissordyn.mechanics import band
from scissordyn.mechanics.component import linearise_component
from scissordyn.mechanics.constraint_solver import solve_constraints
from scissordyn.mechanics.contact import gap, kinematics
from scissordyn.mechanics.equations import accelerate
from scissordyn.mechanics.force_element import map_values
from scissordyn.mechanics.impulse_solver import COMPLIANCE, OPEN, STICK, solve_impulses
from scissordyn.mechanics.monitored import DAMPERS, DAMPING, DRIVE_TORQUE, FRICTION, LOADS, MOTORS, monitor

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
    "HardContacts",
    "hard_monitor",
    "hard_step",
    "open_hard",
]

ANGLE, APPROACH, MASS, IMPULSE, RESTITUTION_LOSS, FRICTION_LOSS, REBOUND, CLOSED = range(8)
"""Columns of `HardContacts.result`: angle of n [rad], approach speed [m/s], effective mass [kg], impulse [N s], energy lost by
restitution and by friction [J], delta' after the step [m/s], whether the contact goes on."""

RESULTS = 8

factorize, solve = band.factorize, band.solve

DEEP = 1e-6
"""Gap or indentation of a contact that stays closed, as a fraction of the clearance, beyond which positions are moved back."""

TOO_DEEP = 0.2
"""Indentation, as a fraction of the clearance, of a contact at the end of a step that is too long."""

STAYS = 1e-3
"""Gap, as a fraction of the clearance, up to which a contact that was closed is kept in the equations, which may open it."""

RESTING = 1e-9
"""Approach speeds below this fraction of the step's change of velocity are round-off."""


class HardContacts(NamedTuple):
    """Hard contacts of a mechanism, their numbers, and scratch of a thread."""

    which: I1  # (k,) number among the contacts
    restitution: F1  # (k,)
    kinetic: F1  # (k,)
    static: F1  # (k,)
    rebound: F1  # (k,) restitution in the present step
    damped: I1  # (c,) components whose force depends on their speed
    damping: I1  # (c,) whether it does now
    place: I1  # (rows,) permutation, rows = m+2k+c
    pairs: I2  # (pairs, 2): rows a >= b that share columns, in the order of a
    reach: I1  # (1,) of the band
    normal: F2  # (2, entries of force elements): generalized forces of unit impulses along N and T, and s
    closed: I1  # (k,) whether the gap closes in the step
    was: I1  # (k,) whether it was in contact before
    impact: I1  # (2,) whether the step has an impact, and whether it is too long
    mode: I1  # (k,) OPEN, STICK, SLIP, SLIP + 1 (towards -T)
    stuck: I1  # (k,) whether it stuck in the last step
    gram: F2  # (rows, 2 reach + 1) symmetric, products of the rows
    band: F2  # (rows, 3 reach + 1) the equations, factorized
    pivots: I1
    free: F1  # (rows,) velocities of the rows without impulses
    before: F1  # (rows,) U- of contacts
    impulse: F1  # (rows,)
    velocity: F1  # (rows,) U+
    shift: F1  # (rows,) moves of positions along the rows
    friction: F1  # (k,) coefficient in the present step
    row: F1  # (n,) zeros: one row while it is multiplied
    depth: F1  # (k,) at the middle of the step
    kept_mode: I1  # (k,) mode, stuck and slope at the start of the step
    kept_stuck: I1
    kept_slope: F1
    slope: F1  # (ny,) y' of the last step, its jumps left out
    middle: F1  # (ny,) the state at the middle of the step
    scratch: F1  # (ny,)
    mass_row: F1  # (m,) scratch
    result: F2  # (k, RESULTS)
    stick: F1  # (k,) time for which it has stuck [s]
    counts: I1  # (COUNTS,) see `impulse_solver`


open_hard = opener(HardContacts)
"""From the address of a handle of `HardContacts` to it, inside kernels."""


@kernel(inline=True)
def contact_rows(i, S, H):
    """Write generalized forces of unit forces along N and T of hard contact i; Work.contact has its normal."""
    M, j = S.model, H.which[i]
    ux, uy, ax, ay, bx, by, _, _, _, _, _, _ = map_values(j, S)
    p, found = S.parameters.contact[j], S.work.contact[j]
    nx, ny, radius = found.nx, found.ny, p.radius
    # forces on the journal or corner for F_n = 1, then for F_t = 1, as in `contact` and `plane_contact`
    if p.plane == 1:
        moment_n, moment_t = -(uy * nx - ux * ny), ux * nx + uy * ny + radius
    else:
        moment_n, moment_t = 0.0, radius + found.distance
    for k in range(M.element_start[j], M.element_start[j + 1]):
        r0, r1, r2, r3, r4, r5 = (
            M.element_row[0, k],
            M.element_row[1, k],
            M.element_row[2, k],
            M.element_row[3, k],
            M.element_row[4, k],
            M.element_row[5, k],
        )
        own, other = ax * r3 - ay * r2, bx * r5 - by * r4
        H.normal[0, k] = -nx * r0 - ny * r1 + moment_n * other
        H.normal[1, k] = ny * r0 - nx * r1 - radius * own + moment_t * other


@kernel(inline=True)
def element_of(a, m, S, H):
    """Force element and row of `HardContacts.normal` of a row that is no constraint's."""
    i = a - m
    if i < 2 * H.which.size:
        return H.which[i // 2], i % 2
    return S.parameters.contact.size + H.damped[i - 2 * H.which.size], 0


@kernel(inline=True)
def along(a, source, S, H):
    """Product of a row that is no constraint's with a vector of all columns."""
    M, total = S.model, 0.0
    j, axis = element_of(a, S.work.multiplier.size, S, H)
    for k in range(M.element_start[j], M.element_start[j + 1]):
        total += H.normal[axis, k] * source[M.element_column[k]]
    return total


@kernel(inline=True)
def scatter(a, m, S, H):
    """Add row a to `HardContacts.row`."""
    M = S.model
    if a < m:
        for k in range(M.constraint_start[a], M.constraint_start[a + 1]):
            if M.constraint_column[k] < M.n:
                H.row[M.constraint_column[k]] += S.work.gradient[k]
        return
    j, axis = element_of(a, m, S, H)
    for k in range(M.element_start[j], M.element_start[j + 1]):
        if M.element_column[k] < M.n:
            H.row[M.element_column[k]] += H.normal[axis, k]


@kernel(inline=True)
def clear(a, m, S, H):
    """Set `HardContacts.row` back to zero where row a has columns."""
    M = S.model
    if a < m:
        for k in range(M.constraint_start[a], M.constraint_start[a + 1]):
            if M.constraint_column[k] < M.n:
                H.row[M.constraint_column[k]] = 0.0
        return
    j, _ = element_of(a, m, S, H)
    for k in range(M.element_start[j], M.element_start[j + 1]):
        if M.element_column[k] < M.n:
            H.row[M.element_column[k]] = 0.0


@kernel(inline=True)
def times_row(b, m, S, H):
    """Product of row b with `HardContacts.row`."""
    M, total = S.model, 0.0
    if b < m:
        for k in range(M.constraint_start[b], M.constraint_start[b + 1]):
            if M.constraint_column[k] < M.n:
                total += S.work.gradient[k] * H.row[M.constraint_column[k]]
        return total
    j, axis = element_of(b, m, S, H)
    for k in range(M.element_start[j], M.element_start[j + 1]):
        if M.element_column[k] < M.n:
            total += H.normal[axis, k] * H.row[M.element_column[k]]
    return total


@kernel(inline=True)
def add_row(a, m, value, target, first, S, H):
    """Add a multiple of row a to target[first:], its free columns alone."""
    M = S.model
    if a < m:
        for k in range(M.constraint_start[a], M.constraint_start[a + 1]):
            if M.constraint_column[k] < M.n:
                target[first + M.constraint_column[k]] += value * S.work.gradient[k]
        return
    j, axis = element_of(a, m, S, H)
    for k in range(M.element_start[j], M.element_start[j + 1]):
        if M.element_column[k] < M.n:
            target[first + M.element_column[k]] += value * H.normal[axis, k]


@kernel(inline=True)
def acting_row(a, m, S, H):
    """Whether a row is of an active constraint or of a contact whose gap closes."""
    if a < m:
        return S.work.inactive[a] == 0.0
    i = a - m
    if i < 2 * H.which.size:
        return H.closed[i // 2] == 1
    return H.damping[i - 2 * H.which.size] == 1


@kernel()
def assemble(h, S, H):
    """Write the products of all acting rows, and what the rows of components add to theirs."""
    m, reach = S.work.multiplier.size, H.reach[0]
    H.gram[:, :] = 0.0
    row = -1
    for p in range(H.pairs.shape[0]):
        a, b = H.pairs[p, 0], H.pairs[p, 1]
        if not (acting_row(a, m, S, H) and acting_row(b, m, S, H)):
            continue
        if a != row:
            if row >= 0:
                clear(row, m, S, H)
            scatter(a, m, S, H)
            row = a
        total, i, k = times_row(b, m, S, H), H.place[a], H.place[b]
        H.gram[i, k - i + reach] = total
        H.gram[k, i - k + reach] = total
    if row >= 0:
        clear(row, m, S, H)
    first = m + 2 * H.which.size
    for c in range(H.damped.size):
        if H.damping[c] == 1:
            H.gram[H.place[first + c], reach] += 2.0 / h


@kernel(inline=True)
def effective_mass(i, S, H):
    """Mass [kg] that an impulse along the normal of hard contact i moves, all constraints kept, other contacts open."""
    m = S.work.multiplier.size
    a, reach = m + 2 * i, H.reach[0]
    at = H.place[a]
    total = H.gram[at, reach]
    if m > 0:
        for k in range(m):
            offset = H.place[k] - at
            H.mass_row[k] = H.gram[at, offset + reach] if abs(offset) <= reach else 0.0
        for k in range(m):
            S.work.work[k] = H.mass_row[k]
        solve_constraints(S, S.work.work[:m])
        for k in range(m):
            total -= H.mass_row[k] * S.work.work[k]
    return 1.0 / total if total > 0.0 else math.inf


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
    predict(h, y, S, H)
    accelerate(t + 0.5 * h, H.middle, S, new)
    for i in range(y.size):
        H.slope[i] = new[i]
    acts_now = close_gaps(S, H)
    if linearise_damping(t + 0.5 * h, S, H):
        acts_now = True
    if acts_now:
        solve_step(t, h, y, S, H)
    for i in range(n):
        new[n + i] = y[n + i] + h * H.slope[n + i]
    for i in range(2 * n, y.size):
        new[i] = y[i] + h * H.slope[i]
    H.impact[0] = H.impact[1] = 0
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
    if acts_now:
        return_to_surfaces(h, new, S, H)
    if H.impact[1] == 1:
        take_back(S, H)


@kernel(inline=True)
def take_back(S, H):
    """Put back what the step has changed: it is to be made again, shorter."""
    for i in range(H.which.size):
        S.state.mode[H.which[i]], H.mode[i], H.stuck[i] = H.was[i], H.kept_mode[i], H.kept_stuck[i]
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
def close_gaps(S, H):
    """Mark the contacts whose gap at the middle of the step has closed, with their rows; returns whether there are any."""
    found = False
    for i in range(H.which.size):
        j = H.which[i]
        depth, rate = gap(j, S)
        H.closed[i], H.depth[i] = 0, depth
        H.result[i, :] = 0.0
        H.result[i, REBOUND] = rate
        if depth >= (-STAYS * S.parameters.contact[j].clearance if H.was[i] == 1 else 0.0):
            kinematics(j, S)
            contact_rows(i, S, H)
            H.closed[i] = 1
            H.rebound[i] = 0.0 if H.was[i] == 1 else H.restitution[i]
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
    assemble(h, S, H)
    solve_impulses(m, H)


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
def return_to_surfaces(h, new, S, H):
    """Move the positions of contacts that stay closed back to their surfaces."""
    M, W = S.model, S.work
    n, m, reach, deep = M.n, W.multiplier.size, H.reach[0], False
    for k in range(n):
        W.X[k] = new[k]
    for k in range(M.nb):
        W.X[n + k] = W.basis[0, k] + h * (0.5 * W.basis[1, k] + 0.125 * h * W.basis[2, k])
    H.band[:, :] = 0.0
    for a in range(H.place.size):
        at = H.place[a]
        H.shift[at], H.band[at, reach] = 0.0, 1.0
        if a < m and H.gram[at, reach] > 0.0:
            for k in range(2 * reach + 1):
                H.band[at, k] = H.gram[at, k]
    for i in range(H.which.size):
        depth, _ = gap(H.which[i], S)
        most = TOO_DEEP * S.parameters.contact[H.which[i]].clearance
        if depth > most and depth - H.depth[i] > 0.5 * most:
            H.impact[1] = 1
        if H.closed[i] == 0 or H.result[i, CLOSED] == 0.0:
            continue
        at = H.place[m + 2 * i]
        for k in range(2 * reach + 1):
            H.band[at, k] = H.gram[at, k]
        H.band[at, reach] *= 1.0 + COMPLIANCE
        H.shift[at] = depth
        deep = deep or abs(depth) > DEEP * S.parameters.contact[H.which[i]].clearance
    if deep and factorize(H.band, reach, reach, H.pivots) < 0:
        solve(H.band, reach, reach, H.pivots, H.shift)
        for a in range(m + 2 * H.which.size):
            if H.shift[H.place[a]] != 0.0:
                add_row(a, m, H.shift[H.place[a]], new, 0, S, H)
    for k in range(n):
        W.X[k] = H.middle[k]
    for k in range(M.nb):
        W.X[n + k] = W.basis[0, k]


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
        out[RESTITUTION_LOSS] = -0.5 * p_n * (after + before)
        out[FRICTION_LOSS] = -0.5 * p_t * (H.velocity[b] + H.before[b])
        by_force = before - H.free[a]
        if -before * (1.0 + H.rebound[i]) > RESTING + abs(by_force):
            H.impact[0] = 1
        out[CLOSED] = 1.0 if after <= max(by_force, 0.0) else 0.0
        H.stuck[i] = 1 if H.mode[i] == STICK else 0
        if H.was[i] == 0:
            out[MASS] = effective_mass(i, S, H)


@kernel(inline=True)
def share_of_force(i, j, h, new, S, H):
    """Mean contact force over the step, without impacts, in the place of the contact's memory and of its state."""
    m, found = S.work.multiplier.size, S.work.contact[j]
    a = H.place[m + 2 * i]
    impulsive = max(-H.before[a], 0.0) * (1.0 + H.rebound[i])
    by_force = max(H.before[a] - H.free[a], 0.0)
    share = by_force / (by_force + impulsive) if by_force > 0.0 else 0.0
    found.elastic = 0.0
    found.normal = share * H.impulse[a] / h
    found.tangential = share * H.impulse[H.place[m + 2 * i + 1]] / h
    S.state.memory[j] = found.normal
    new[2 * S.model.n + S.model.state_start[j]] = found.tangential


@kernel(inline=True)
def hard_monitor(t, h, y, S, H, power, rows):
    """Powers and monitored numbers of the step just made, means over it; NaN for what an impact makes infinite."""
    M, guards = S.model, S.state.mode.size
    monitor(t, y, S, power, rows)
    for i in range(H.which.size):
        j, out = H.which[i], H.result[i]
        if H.stuck[i] == 1:
            H.stick[i] += h
        power[DAMPING] += out[RESTITUTION_LOSS] / h - rows[j, 1]
        power[FRICTION] += out[FRICTION_LOSS] / h - rows[j, 2]
        rows[j, 0], rows[j, 1], rows[j, 2] = out[IMPULSE] / h, out[RESTITUTION_LOSS] / h, out[FRICTION_LOSS] / h
    correct_powers(h, y, S, H, power)
    if H.impact[0] == 1:
        for row in range(M.monitor.shape[0]):
            if M.monitor[row, 0] == DRIVE_TORQUE:
                rows[guards + row, 0] = math.nan


@kernel(inline=True)
def correct_powers(h, y, S, H, power):
    """Powers of components by the mean of the velocities before and after the step, in the place of that at the middle."""
    M, W = S.model, S.work
    n, contacts = M.n, S.parameters.contact.size
    for i in range(M.component_port.size):
        if M.component_passive[i] == 1:
            continue
        e = contacts + i
        _, _, ax, ay, bx, by, _, _, _, _, _, _ = map_values(e, S)
        more = 0.0
        for k in range(M.element_start[e], M.element_start[e + 1]):
            column = M.element_column[k]
            if column < n:
                force = W.wrench[e, 0] * M.element_row[0, k] + W.wrench[e, 1] * M.element_row[1, k]
                force += W.wrench[e, 2] * (ax * M.element_row[3, k] - ay * M.element_row[2, k])
                force += W.wrench[e, 3] * (bx * M.element_row[5, k] - by * M.element_row[4, k])
                more += force * (y[n + column] + 0.5 * h * W.A[column] - W.V[column])
        power[MOTORS if M.component_motor[i] == 1 else LOADS] += more
    first = W.multiplier.size + 2 * H.which.size
    for c in range(H.damped.size):
        if H.damping[c] == 0:
            continue
        at, middle = H.place[first + c], along(first + c, W.V, S, H)
        mean = middle - H.impulse[at] / h  # of U before and after
        if M.component_motor[H.damped[c]] == 1:
            power[MOTORS] += H.impulse[at] * mean / h
        elif M.component_passive[H.damped[c]] == 1:
            power[DAMPERS] += mean * mean - middle * middle
        else:
            power[LOADS] += H.impulse[at] * mean / h
