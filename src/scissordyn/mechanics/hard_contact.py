"""Time step with hard contacts: impulses with restitution and Coulomb friction keep surfaces apart.

Moreau's midpoint rule with Jean's theta = 1/2 (Moreau 1988; Jean 1999, doi:10.1016/S0045-7825(98)00383-1). Contacts whose gap
is closed at the middle of the step receive impulses P_N, P_T. U is the relative velocity of the surfaces, positive for
separation:

    0 <= U_N+ + e U_N- _|_ P_N >= 0,    |P_T| <= mu P_N,  P_T opposite to U_T+ where it slips.

The rows of the equations for the impulses are the constraints, N and T of each hard contact, and components whose forces depend
on their speeds, permuted to a narrow band. Such forces F, including those of oil films, are evaluated at the mean of the speeds
before and after the step, so that strong damping does not limit the step. With -dF/dv = sum s s^T and U = s.v

    U+ + 2/h lambda = 2 U_m - U-,    U_m where F was evaluated.

If there are few contacts, impacts are located: a step ends where an open gap closes, and an impact there changes only the
velocities. Zeno's rule: a contact that forces would close again within the step stays closed, and a closed contact has no
restitution. Positions of contacts that stay closed are moved back to the surface by the least change in the mass metric.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.compliant_contact import take_compliant, too_long_for_laws
from scissordyn.mechanics.component import linearise_component
from scissordyn.mechanics.constraint_solver import expand
from scissordyn.mechanics.contact import gap, kinematics
from scissordyn.mechanics.equations import accelerate
from scissordyn.mechanics.guard import guards
from scissordyn.mechanics.hard_elastic import TOUCHING_DEPTH_MAX, law_depth, stored_energy
from scissordyn.mechanics.hard_result import CLOSED, REBOUND, RESTITUTION_LOSS, share_of_force, take_results
from scissordyn.mechanics.hard_rows import (
    IN_ANY_CASE,
    OPEN,
    STEP,
    TOO_LONG,
    acting_row,
    add_row,
    along,
    assemble,
    contact_rows,
    curving_speed,
    element_of,
    speed_along,
)
from scissordyn.mechanics.impulse_solver import solve_impulses
from scissordyn.tolerance import ROUND_OFF_TOL

GAP_TOL = 1e-6  # Largest gap or indentation of a closed contact, relative to the clearance, that is not corrected

LEAST_SQUARES_WEIGHT = 1e-2
"""Weight of the size of a position correction relative to the remaining gaps, for a free journal.

Gaps can contradict each other, as in a closed loop with all joints in contact. No correction exceeds five times the gaps.
"""

INDENTATION_MAX = 0.1  # Largest indentation of a hard contact at the end of a step, relative to the clearance
FORCED_GAP_MAX = 0.5  # Largest gap of an open hard contact, relative to the clearance, that the forces of one step may close


@kernel
def hard_step(t, h, y, new, S, H):
    """Make one step of size h from t and the state y to `new`; write the contact results to `HardWork.result`.

    Afterwards `System.work` contains the forces at the middle of the step, including the mean of all impulses.
    """
    M, C = S.model, S.state
    n, count = M.n, H.model.which.size
    H.work.size[0] = h
    for i in range(y.size):
        H.work.kept_slope[i] = H.state.slope[i]
    for i in range(count):
        H.work.was[i], H.work.kept_mode[i], H.work.kept_stuck[i] = C.mode[H.model.which[i]], H.state.mode[i], H.state.stuck[i]
        C.mode[H.model.which[i]] = 0  # contact forces of the last step do not act
        H.work.load[i] = C.memory[H.model.which[i]] if H.model.compliant[i] == 0 else 0.0
    # all other forces at the middle of the step: a of (H2)
    predict(h, y, S, H)
    accelerate(t + 0.5 * h, H.work.middle, S, new)
    for i in range(y.size):
        H.state.slope[i] = new[i]
    # active contacts, and the rows w_N, w_T of (H2) and s of (H3)
    acts_now = close_gaps(h, S, H)
    if linearise_damping(t + 0.5 * h, S, H):
        acts_now = True
    # the impulses; the step is too long if they do not satisfy the compliant laws
    if acts_now and not solve_step(t, h, y, S, H) and H.work.impact[1] > IN_ANY_CASE:
        H.work.impact[1], H.state.longest[0] = TOO_LONG, math.inf
        take_back(S, H)
        return
    # velocities and internal states without impulses, then with impulses: the first of (H2)
    for i in range(n):
        new[n + i] = y[n + i] + h * H.state.slope[n + i]
    for i in range(2 * n, y.size):
        new[i] = y[i] + h * H.state.slope[i]
    H.work.impact[0] = 0
    if acts_now:
        add_impulses(h, y, new, S, H)
        take_results(h, S, H)
        take_compliant(y, new, S, H)
    # positions by the mean of both velocities: the second of (H2)
    for i in range(n):
        new[i] = y[i] + 0.5 * h * (y[n + i] + new[n + i])
        # the next step begins with forces, not impacts
        H.state.slope[n + i] = H.state.slope[n + i] if H.work.impact[0] == 1 else (new[n + i] - y[n + i]) / h
    # contacts that stay closed carry their mean force into the next step
    for i in range(count):
        j = H.model.which[i]
        C.mode[j] = H.work.closed[i]
        if H.model.compliant[i] == 1:
            continue
        if H.work.closed[i] == 0:
            C.memory[j] = 0.0
            new[2 * n + M.state_start[j]] = 0.0
        else:
            share_of_force(i, j, h, new, S, H)
        y[2 * n + M.state_start[j]] = new[2 * n + M.state_start[j]]  # the state is a mean over the step
    # repeat a step that ends too deep, or in which a compliant contact is not resolved
    look_ahead(h, new, S, H)
    if too_long_for_laws(S, H) and H.work.impact[1] > IN_ANY_CASE:
        H.work.impact[1] = TOO_LONG
    if H.work.impact[1] == TOO_LONG:
        take_back(S, H)
        return
    if acts_now:
        return_to_surfaces(h, new, S, H)
    keep_pressed(h, y, new, S, H)


@kernel
def keep_pressed(h, y, new, S, H):
    """Store the elastic energy of contacts and subtract it from their losses."""
    # impulses do the work (H5) at surfaces; the elastic part of it returns later
    place_at_end(h, new, S)
    m = S.work.multiplier.size
    for i in range(H.model.which.size):
        if H.model.compliant[i] == 1:
            continue
        H.state.overlap[i] = max(H.state.overlap[i], beyond_law(i, S, H))
        acts = H.work.yields[i] == 1 and H.work.closed[i] == 1
        H.state.pressed[i] = max(law_depth(i, H.model.place[m + 2 * i], H), 0.0) if acts else 0.0
        H.work.ending[i], _ = gap(H.model.which[i], S)
        stored = S.model.elastic_state[H.model.which[i]]
        new[stored] = stored_energy(i, H)
        H.work.result[i, RESTITUTION_LOSS] -= new[stored] - y[stored]
    place_at_middle(S, H)


@kernel
def take_back(S, H):
    """Restore modes and other data of all contacts from before the step, which must be repeated with a smaller size."""
    for i in range(H.model.which.size):
        S.state.mode[H.model.which[i]] = H.work.was[i]
    restore(H)


@kernel
def restore(H):
    """Restore the contact state with which the next step begins."""
    for i in range(H.model.which.size):
        H.state.mode[i], H.state.stuck[i] = H.work.kept_mode[i], H.work.kept_stuck[i]
    for i in range(H.state.slope.size):
        H.state.slope[i] = H.work.kept_slope[i]


@kernel
def guards_ahead(t, y, value, rate, S, H):
    """Write the guards at the end of the last step; restore `System.work` to the middle of the step."""
    guards(t, y, S, value, rate)
    expand(t - 0.5 * H.work.size[0], H.work.middle, S)


@kernel
def predict(h, y, S, H):
    """Predict the state at the middle of the step: positions by velocities, the rest by the slope of the last step."""
    n = S.model.n
    for i in range(n):
        H.work.middle[i] = y[i] + 0.5 * h * y[n + i]
    for i in range(n, y.size):
        H.work.middle[i] = y[i] + 0.5 * h * H.state.slope[i]


@kernel
def close_gaps(h, S, H):
    """Mark the contacts closed at the middle of the step and write their rows; return whether there are any."""
    closes = False
    for i in range(H.model.which.size):
        j = H.model.which[i]
        depth, rate = gap(j, S)
        H.work.closed[i], H.work.depth[i] = 0, depth
        H.work.result[i, :] = 0.0
        H.work.result[i, REBOUND] = rate
        # a compliant contact begins and ends at its guard, not at the middle of a step
        if H.model.compliant[i] == 1:
            H.work.closed[i] = H.work.was[i]
            # a contact that was closed, or whose remaining gap closes in a step, has no restitution (Zeno's rule)
            H.work.rebound[i] = H.work.bias[i] = 0.0
            H.work.yields[i] = H.work.was[i]
            if H.work.was[i] == 1:
                kinematics(j, S)
                contact_rows(i, S, H)
                H.work.turn[i] = curving_speed(j, h, S)
                closes = True
            continue
        # beyond its surface, or so close that the forces of this step alone may close it
        least = -(TOUCHING_DEPTH_MAX if H.parameters.locate[0] == 1 else FORCED_GAP_MAX) * S.parameters.contact[j].clearance
        if depth >= least if H.work.was[i] == 1 or H.parameters.locate[0] == 0 else False:
            kinematics(j, S)
            contact_rows(i, S, H)
            H.work.closed[i] = 1
            H.work.rebound[i] = 0.0 if H.work.was[i] == 1 or depth < 0.0 else H.parameters.restitution[i]
            H.work.yields[i] = 1 if H.work.was[i] == 1 and H.parameters.locate[0] == 0 else 0
            H.work.turn[i] = curving_speed(j, h, S) if H.work.was[i] == 1 or depth < 0.0 else 0.0
            # U_N+ >= -2 g/h: the step ends on the surface
            H.work.bias[i] = -2.0 * depth / h if depth < 0.0 and H.parameters.locate[0] == 0 else 0.0
            closes = True
        else:
            H.state.mode[i], H.state.stuck[i] = OPEN, 0
    return closes


@kernel
def linearise_damping(t, S, H):
    """Write the rows s of components whose forces depend on their speeds; return whether there are any."""
    M, damps = S.model, False
    for c in range(H.model.damped.size):
        if H.model.damped_axis[c] > 0:
            continue
        i = H.model.damped[c]
        e, last = S.parameters.contact.size + i, c + 1
        while last < H.model.damped.size and H.model.damped_axis[last] > 0:
            last += 1
        for k in range(c, last):
            H.work.damping[k] = 0
        if M.component_guard[i] >= 0 and S.state.mode[M.component_guard[i]] == 0:
            continue
        first = 2 * M.n + M.state_start[e]
        linearise_component(t, i, S, H.work.middle[first : 2 * M.n + M.state_start[e + 1]], H.work.scratch, first)
        for k in range(write_damping(e, last - c, S, H)):
            H.work.damping[c + k] = 1
            damps = True
    return damps


@kernel
def write_damping(e, most, S, H):
    """Write rows s of force element e with D = sum s s^T, by pivoted Cholesky factorization; return their number.

    D is the symmetric part of -dF/dv. Only directions with negligible damping are omitted.
    """
    M, W = S.model, S.work
    start, count, block = M.element_start[e], M.element_start[e + 1] - M.element_start[e], M.block_start[e]
    largest, rows = 0.0, 0
    for axis in range(most):
        best, left = 0, 0.0
        # pivot: largest diagonal entry of the remaining D
        for k in range(count):
            here = -W.block_v[block + k * count + k]
            for r in range(axis):
                here -= H.work.normal[r, start + k] * H.work.normal[r, start + k]
            if here > left:
                best, left = k, here
        largest = max(largest, left)
        if not left > ROUND_OFF_TOL * largest:
            break
        for k in range(count):
            entry = -0.5 * (W.block_v[block + k * count + best] + W.block_v[block + best * count + k])
            for r in range(axis):
                entry -= H.work.normal[r, start + k] * H.work.normal[r, start + best]
            H.work.normal[axis, start + k] = entry / math.sqrt(left)
        rows += 1
    return rows


@kernel
def solve_step(t, h, y, S, H):
    """Solve for the impulses of the step, given the accelerations without them in `HardState.slope`.

    Return whether the impulses agree with the laws of compliant contacts.
    """
    M, W = S.model, S.work
    n, nb, m = M.n, M.nb, W.multiplier.size
    first = m + 2 * H.model.which.size
    # inactive rows keep U = 0
    for a in range(H.model.place.size):
        H.work.free[H.model.place[a]] = H.work.before[H.model.place[a]] = 0.0
    # velocities without impulses at the end and at the start, both with the velocities of the drives
    for k in range(n):
        W.A[k] = y[n + k] + h * H.state.slope[n + k]
    for k in range(nb):
        W.A[n + k] = W.basis[1, k] + 0.5 * h * W.basis[2, k]
    for a in range(m, H.model.place.size):
        if acting_row(a, m, S, H):
            H.work.free[H.model.place[a]] = along(a, W.A, S, H)
    for k in range(n):
        W.A[k] = y[n + k]
    for k in range(nb):
        W.A[n + k] = W.basis[1, k] - 0.5 * h * W.basis[2, k]
    for a in range(m, H.model.place.size):
        if acting_row(a, m, S, H):
            H.work.before[H.model.place[a]] = along(a, W.A, S, H)
    # (H3): the row needs the mean of the speeds, which enters as 2 U_m - U-
    for a in range(first, H.model.place.size):
        if H.work.damping[a - first] == 1:
            H.work.free[H.model.place[a]] += H.work.before[H.model.place[a]] - 2.0 * along(a, W.V, S, H)
    leave_out_open(m, S, H)
    assemble(h, S, H)
    turn_normals(h, m, S, H)
    return solve_impulses(m, y, S, H)


@kernel
def leave_out_open(m, S, H):
    """Remove contacts with a gap that were open and that the forces of this step alone do not close."""
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0 or H.work.was[i] == 1 or H.work.depth[i] >= 0.0:
            continue
        at = H.model.place[m + 2 * i]
        by_force = H.work.before[at] - H.work.free[at]
        if H.work.free[at] > -H.work.bias[i] or 2.0 * H.parameters.restitution[i] * max(-H.work.before[at], 0.0) > by_force:
            H.work.closed[i], H.state.mode[i], H.state.stuck[i] = 0, OPEN, 0


@kernel
def turn_normals(h, m, S, H):
    """Write the effect of the rotation of closed contacts' normals within the step on their equations.

    A journal under a load N in its bearing is a pendulum of length c; its frequency (N G_TT/c)^0.5 may be far above 1/h. Its
    normal is therefore taken at the mean of the unknown positions, and at later ones as the frequency grows:

        P_T = friction - N h^2/c (a (U_T+ - U_T-) + f u_t),    a = 1/4 + 3/4 f,    f = z^2/(1 + z^2),    z = N G_TT h^2/c.
    """
    for i in range(H.model.which.size):
        H.work.turning_mass[i] = H.work.lag[i] = 0.0
        if H.work.closed[i] == 0 or H.model.compliant[i] == 1:
            continue
        j = H.model.which[i]
        at, other = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        # (H3a), but not more than the approach of the surfaces: this adds no energy
        if H.work.yields[i] == 0:
            H.work.turn[i] = min(H.work.turn[i], max(-H.work.before[at], 0.0))
        H.work.bias[i] = max(H.work.bias[i] - 0.5 * H.work.turn[i], 0.0) - H.work.turn[i]
        contact = S.work.contact[j]
        length = contact.bend if S.parameters.contact[j].cells > 0 else contact.distance
        if S.parameters.contact[j].plane == 1 or H.work.was[i] == 0 or not length > 0.0:
            continue
        # (H3b): N h^2/c, and z from it
        load = H.work.load[i] * h * h / length
        z = load * H.work.gram[other, H.model.reach[0]]
        f = z * z / (1.0 + z * z)
        H.work.turning_mass[i] = load * (0.25 + 0.75 * f)
        # u_t is the motion of the centre only; rotation of the surfaces does not turn the normal
        rolls = along(m + 2 * i + 1, S.work.V, S, H) - speed_along(j, S)
        H.work.lag[i] = H.work.turning_mass[i] * H.work.before[other] - load * f * (H.work.before[other] - rolls)


@kernel
def add_impulses(h, y, new, S, H):
    """Add the impulses to the velocities, and their mean forces to `System.work`."""
    M, W = S.model, S.work
    n, m = M.n, W.multiplier.size
    for a in range(H.model.place.size):
        value = H.work.impulse[H.model.place[a]]
        if value == 0.0:
            continue
        add_row(a, m, value, new, n, S, H)
        # impulses of ideal joints, as mean multipliers over the step
        if a < m:
            W.multiplier[a] -= value / h
            continue
        j, axis = element_of(a, m, S, H)
        for k in range(M.element_start[j], M.element_start[j + 1]):
            W.force[M.element_column[k]] += value * H.work.normal[axis, k] / h
    for i in range(n):
        W.A[i] = (new[n + i] - y[n + i]) / h
    for k in range(M.nb):
        W.A[n + k] = W.basis[2, k]


@kernel
def place_at_end(h, new, S):
    """Write the positions at the end of the step into Work.X."""
    M, W = S.model, S.work
    for k in range(M.n):
        W.X[k] = new[k]
    for k in range(M.nb):
        W.X[M.n + k] = W.basis[0, k] + h * (0.5 * W.basis[1, k] + 0.125 * h * W.basis[2, k])


@kernel
def place_at_middle(S, H):
    """Write the positions at the middle of the step into Work.X."""
    M, W = S.model, S.work
    for k in range(M.n):
        W.X[k] = H.work.middle[k]
    for k in range(M.nb):
        W.X[M.n + k] = W.basis[0, k]


@kernel
def look_ahead(h, new, S, H):
    """Write the largest indentation of contacts open at the end of the step; mark the step if one is too deep."""
    place_at_end(h, new, S)
    H.state.ahead[0] = H.state.ahead[2] = -math.inf
    for i in range(H.model.which.size):
        if H.model.compliant[i] == 1:
            continue
        depth, _ = gap(H.model.which[i], S)
        H.work.ending[i] = depth
        if H.work.closed[i] == 0:
            H.state.ahead[0] = max(H.state.ahead[0], depth)
            H.state.ahead[2] = max(H.state.ahead[2], depth / S.parameters.contact[H.model.which[i]].clearance)
        # by the depth at the end, or by twice its increase since the middle
        most = INDENTATION_MAX * S.parameters.contact[H.model.which[i]].clearance
        if (
            H.work.impact[1] == STEP
            and H.parameters.locate[0] == 0
            and min(beyond_law(i, S, H), 2.0 * (depth - H.work.depth[i])) > most
        ):
            H.work.impact[1] = TOO_LONG
    place_at_middle(S, H)


@kernel
def beyond_law(i, S, H):
    """Return the end-of-step indentation [m] of hard contact i minus that at which its law gives its force (0 if rigid)."""
    if H.work.yields[i] == 1 and H.work.closed[i] == 1:
        return H.work.ending[i] - max(law_depth(i, H.model.place[S.work.multiplier.size + 2 * i], H), 0.0)
    return H.work.ending[i]


@kernel
def return_to_surfaces(h, new, S, H):
    """Correct the positions so that surfaces in lasting contact touch again: remove gaps and indentations of the step."""
    place_at_end(h, new, S)
    if too_far(S, H):
        move_back(new, S, H)
    place_at_middle(S, H)


@kernel
def too_far(S, H):
    """Write how far contacts that stay closed must move back, NaN for others; return whether one is too far away."""
    m, deep = S.work.multiplier.size, False
    for i in range(H.model.which.size):
        depth, _ = gap(H.model.which[i], S)
        # NaN: the row of this contact is not part of the system that moves positions
        if (
            H.work.closed[i] == 0
            or H.work.result[i, CLOSED] == 0.0
            or (H.parameters.locate[0] == 0 and depth <= 0.0 and H.work.yields[i] == 0)
        ):
            depth = math.nan
        # an elastic contact is at the position of its law
        elif H.work.yields[i] == 1:
            depth = 0.0
        H.work.shift[H.model.place[m + 2 * i]] = depth
        deep = deep or abs(depth) > GAP_TOL * S.parameters.contact[H.model.which[i]].clearance
    return deep


@kernel
def move_back(new, S, H):
    """Move positions by the distances of `too_far`, as a weighted least-squares solution."""
    m, reach = S.work.multiplier.size, H.model.reach[0]
    for a in range(H.model.place.size):
        at, normal = H.model.place[a], m <= a < m + 2 * H.model.which.size and (a - m) % 2 == 0
        if not normal:
            H.work.shift[at] = 0.0 if a < m and H.work.gram[at, reach] > 0.0 else math.nan
        moves = not math.isnan(H.work.shift[at])
        for k in range(2 * reach + 1):
            H.work.band[at, k] = H.work.gram[at, k] if moves else 0.0
        for k in range(2 * reach + 1, H.work.band.shape[1]):
            H.work.band[at, k] = 0.0
        # (G + 0.01 diag G) pi = delta: least squares if indentations contradict each other
        if normal:
            H.work.band[at, reach] *= 1.0 + LEAST_SQUARES_WEIGHT
        if not moves:
            H.work.shift[at], H.work.band[at, reach] = 0.0, 1.0
    if band.factorize(H.work.band, reach, reach, H.work.pivots) >= 0:
        return
    band.solve(H.work.band, reach, H.work.pivots, H.work.shift)
    for a in range(m + 2 * H.model.which.size):
        if H.work.shift[H.model.place[a]] != 0.0:
            add_row(a, m, H.work.shift[H.model.place[a]], new, 0, S, H)
