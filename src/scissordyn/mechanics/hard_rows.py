"""Hard contacts of a mechanism and the equations for their impulses: rows, products, effective masses, modes."""

from __future__ import annotations

import math
from typing import NamedTuple

from scissordyn.kernel import F1, F2, I1, I2, kernel, opener
from scissordyn.mechanics.band import product
from scissordyn.mechanics.constraint_solver import solve_constraints
from scissordyn.mechanics.force_element import map_values
from scissordyn.mechanics.hard_contour import worn_convective, worn_turning
from scissordyn.tolerance import ROUND_OFF_TOL

IN_ANY_CASE, AS_DEEP, STEP, TOO_LONG = range(-2, 2)
"""Step request (force the step, allow any indentation at its end, or reject it if too long), and the status it returns."""

OPEN, STICK, SLIP = range(3)  # Modes of a contact; `SLIP` with P_T = mu P_N, `SLIP` + 1 with P_T = -mu P_N


# [-] compliance of contact surfaces relative to that of a free journal; it makes dependent rows solvable
SURFACE_COMPLIANCE = 1e-11


class HardModel(NamedTuple):
    """Indices of the contacts that are solved for, and the structure of the equations for their impulses."""

    which: I1  # (k,) index among the contacts; hard ones, then compliant ones
    compliant: I1  # (k,) whether it is compliant (`compliant_contact`)
    damped: I1  # (c,) components whose forces depend on their speeds, one entry per possible row
    damped_axis: I1  # (c,) row index of each entry within its component
    place: I1  # (rows,) permutation, rows = m+2k+c
    pairs: I2  # (pairs, 2): rows a >= b that share columns, in the order of a
    reach: I1  # (1,) half bandwidth
    products: I2  # (products, 2): entries of rows in the same column, pair by pair
    product_start: I1  # (pairs + 1,)


class HardParameters(NamedTuple):
    """Parameters of hard contacts and of the stiffness laws of elastic ones."""

    restitution: F1  # (k,)
    kinetic: F1  # (k,)
    static: F1  # (k,)
    law: I1  # (k,) address of the kernel of its stiffness law's force
    energy: I1  # (k,) address of the kernel of its energy, or 0
    elastic: F2  # (k, PARAMETERS) parameters of its stiffness law
    floor: F1  # (k,) indentation below which the law is linear [m]
    locate: I1  # (1,) whether impacts are located, and no contact begins within a step


class HardState(NamedTuple):
    """State of hard contacts between steps, and counts since the start."""

    longest: F1  # (1,) longest step for compliant contacts [s]
    pressed: F1  # (k,) indentation at the evaluation of the law in the last step [m]
    struck: F1  # (k,) energy of the largest impact since it closed [J]
    mode: I1  # (k,) OPEN, STICK, SLIP, SLIP + 1 (towards -T)
    stuck: I1  # (k,) whether it stuck in the last step
    overlap: F1  # (k,) largest indentation so far minus that of the law [m]
    slope: F1  # (ny,) y' of the last step, without its jumps
    stick: F1  # (k,) total time of sticking [s]
    # (3,) largest indentation of open contacts at the end [m], time until a rebounding contact closes again [s],
    # and the largest indentation relative to the clearance [-]
    ahead: F1
    counts: I1  # (COUNTS,) counters of `impulse_solver`


class HardWork(NamedTuple):
    """Scratch arrays of a time step with k hard or compliant contacts; U- and U+ are velocities before and after the step."""

    later: F1  # (k,) theta of a compliant contact along N
    later_slip: F1  # (k,) theta of a compliant contact along T
    rubbed: F1  # (k,) slip speed at the linearisation of its friction [m/s]
    bristle: F1  # (states of a contact,) internal states of its friction law at the end of the step
    rebound: F1  # (k,) restitution coefficient in the current step
    bias: F1  # (k,) speed at which an open gap closes by the end of the step
    turn: F1  # (k,) speed along N that the curvature of the surface requires at the end of the step
    load: F1  # (k,) normal force of the last step [N]
    turning_mass: F1  # (k,) impulse along T per U_T+, because the normal rotates [kg]
    lag: F1  # (k,) known part of that impulse [N s]
    offset: F1  # (k,) e U- + bias
    yields: I1  # (k,) whether the contact is elastic in the current step
    reached: F1  # (k,) indentation of the law without U+ [m]
    weight: F1  # (k,) decrease of that indentation per U+ [s]
    faster: F1  # (k,) f: 0 if its vibration is resolved, 1 if it is much faster than the step
    compliance: F1  # (k,) speed per P_N [1/kg]
    size: F1  # (1,) size of the current step [s]
    damping: I1  # (c,) whether the row is active now
    value: F1  # entries of rows: those of `normal`, which is a view of it, and of the constraints
    normal: F2  # (3, entries of force elements): generalized forces of unit impulses along N and T, and rows s
    acts: I1  # (rows,) whether the row belongs to an active constraint or a contact whose gap closes
    closed: I1  # (k,) whether the gap closes in the step
    was: I1  # (k,) whether it was in contact before
    impact: I1  # (3,) whether the step has an impact; request or status of the step (`STEP`); whether it ends on an impact
    required: I1  # (k,) the mode that its impulses and velocities require
    restless: I1  # (k,) index of the last Newton step that changed its mode
    gram: F2  # (rows, 2 reach + 1) symmetric products of the rows
    band: F2  # (rows, more than 3 reach) factorized equations
    right: F1  # (rows,) right-hand side after elimination
    since: I1  # (1,) first row that differs from the factorized equations
    pivots: I1
    free: F1  # (rows,) velocities of the rows without impulses
    before: F1  # (rows,) U- of contacts
    impulse: F1  # (rows,)
    velocity: F1  # (rows,) U+
    shift: F1  # (rows,) displacements of positions along the rows
    friction: F1  # (k,) friction coefficient in the current step
    depth: F1  # (k,) indentation at the middle of the step [m]
    ending: F1  # (k,) indentation at the end of the step [m]
    kept_mode: I1  # (k,) mode, stuck and slope at the start of the step
    kept_stuck: I1
    kept_slope: F1
    middle: F1  # (ny,) the state at the middle of the step
    scratch: F1  # (ny,)
    mass_row: F1  # (m,) scratch
    result: F2  # (k, RESULTS)
    drive_work: F1  # (1,) of the drives in an impact [J]
    active: I1  # (k,) closed contacts, for pivoting
    units: F2  # (2k+1, rows) impulses of all rows for unit impulses of contacts, and without contacts
    table: F2  # (3k, 3k+2) dictionary of the pivoting
    basic: I1  # (3k,) basic variables, of the rows
    beside: I1  # (3k+1,) nonbasic variables, of the columns


class HardContacts(NamedTuple):
    """Hard contacts of a mechanism, and the compliant contacts that are solved for with them."""

    model: HardModel
    parameters: HardParameters
    state: HardState
    work: HardWork


open_hard = opener(HardContacts)  # Returns the `HardContacts` of a handle's address, inside kernels


@kernel
def contact_rows(i, S, H):
    """Write generalised forces of unit forces along N and T of hard contact i; Work.contact contains its normal."""
    M, j = S.model, H.model.which[i]
    ux, uy, ax, ay, bx, by, _, _, _, _, _, _ = map_values(j, S)
    p, contact, lever = S.parameters.contact[j], S.work.contact[j], 0.0
    nx, ny, radius = contact.nx, contact.ny, p.radius
    # forces on the journal or corner for F_n = 1, then for F_t = 1, as in `contact` and `plane_contact`
    if p.plane == 1 or p.cells > 0:
        moment_n, moment_t = -(uy * nx - ux * ny), ux * nx + uy * ny + radius
        if p.cells > 0:
            lever = contact.lever
    else:
        moment_n, moment_t = 0.0, radius + contact.distance
    for k in range(M.element_start[j], M.element_start[j + 1]):
        r0, r1, r2, r3, r4, r5 = (
            M.element_row[0, k],
            M.element_row[1, k],
            M.element_row[2, k],
            M.element_row[3, k],
            M.element_row[4, k],
            M.element_row[5, k],
        )
        first, other = ax * r3 - ay * r2, bx * r5 - by * r4
        H.work.normal[0, k] = -nx * r0 - ny * r1 + moment_n * other
        if lever != 0.0:
            H.work.normal[0, k] += lever * (other - first)
        H.work.normal[1, k] = ny * r0 - nx * r1 - radius * first + moment_t * other


@kernel
def convective(j, S):
    """Return the second derivative of the indentation at zero acceleration [m/s^2]; Work.contact contains the normal."""
    ex, ey, _, _, bx, by, ux, uy, _, _, qx, qy = map_values(j, S)
    contact = S.work.contact[j]
    if S.parameters.contact[j].cells > 0:
        return worn_convective(j, S)
    nx, ny = contact.nx, contact.ny
    along_t = uy * nx - ux * ny
    if S.parameters.contact[j].plane == 1:
        spin = bx * qy - by * qx
        return 2.0 * along_t * spin - (ex * nx + ey * ny) * spin * spin
    return along_t * along_t / contact.distance if contact.distance > 0.0 else 0.0


@kernel
def curving_speed(j, h, S):
    """Return the speed along N that the curvature of the surface requires at the end of a step, h kappa/2 of (H3a) [m/s].

    On a worn contour it tends to zero where the normal turns by more than a radian in the step: such an end has no direction.
    """
    speed = 0.5 * h * convective(j, S)
    if S.parameters.contact[j].cells > 0:
        _, turned = worn_turning(j, S)
        angle = h * turned / S.work.contact[j].bend
        speed /= 1.0 + angle * angle * angle * angle
    return speed


@kernel
def speed_along(j, S):
    """Return the part of U_T [m/s] from the motion of the journal's centre; Work.contact contains the normal.

    On a worn contour it is the speed that turns the normal with the curvature there.
    """
    if S.parameters.contact[j].cells > 0:
        _, turned = worn_turning(j, S)
        return -turned
    _, _, _, _, _, _, ux, uy, _, _, _, _ = map_values(j, S)
    contact = S.work.contact[j]
    return ux * contact.ny - uy * contact.nx


@kernel
def element_of(a, m, S, H):
    """Return force element and row of `HardWork.normal` for a row that is not a constraint."""
    i = a - m
    if i < 2 * H.model.which.size:
        return H.model.which[i // 2], i % 2
    c = i - 2 * H.model.which.size
    return S.parameters.contact.size + H.model.damped[c], H.model.damped_axis[c]


@kernel
def along(a, source, S, H):
    """Return the product of a row that is not a constraint and a vector of all columns."""
    M, total = S.model, 0.0
    j, axis = element_of(a, S.work.multiplier.size, S, H)
    for k in range(M.element_start[j], M.element_start[j + 1]):
        total += H.work.normal[axis, k] * source[M.element_column[k]]
    return total


@kernel
def add_row(a, m, value, target, first, S, H):
    """Add a multiple of row a to target[first:], in its free columns only."""
    M = S.model
    if a < m:
        for k in range(M.constraint_start[a], M.constraint_start[a + 1]):
            if M.constraint_column[k] < M.n:
                target[first + M.constraint_column[k]] += value * S.work.gradient[k]
        return
    j, axis = element_of(a, m, S, H)
    for k in range(M.element_start[j], M.element_start[j + 1]):
        if M.element_column[k] < M.n:
            target[first + M.element_column[k]] += value * H.work.normal[axis, k]


@kernel
def acting_row(a, m, S, H):
    """Return whether a row belongs to an active constraint, a closing contact or an active damper."""
    if a < m:
        return S.work.inactive[a] == 0.0
    i = a - m
    if i < 2 * H.model.which.size:
        return H.work.closed[i // 2] == 1
    return H.work.damping[i - 2 * H.model.which.size] == 1


@kernel
def assemble(h, S, H):
    """Write the matrix G, which maps the impulses of the active rows to velocities: the scalar products of the rows.

    Active dampers add 2/h on the diagonal.
    """
    m, reach = S.work.multiplier.size, H.model.reach[0]
    first = H.work.value.size - S.work.gradient.size
    for k in range(S.work.gradient.size):
        H.work.value[first + k] = S.work.gradient[k]
    for a in range(H.model.place.size):
        H.work.acts[a] = 1 if acting_row(a, m, S, H) else 0
    H.work.gram[:, :] = 0.0
    for p in range(H.model.pairs.shape[0]):
        a, b = H.model.pairs[p, 0], H.model.pairs[p, 1]
        if H.work.acts[a] == 0 or H.work.acts[b] == 0:
            continue
        total, i, k = 0.0, H.model.place[a], H.model.place[b]
        for q in range(H.model.product_start[p], H.model.product_start[p + 1]):
            total += H.work.value[H.model.products[q, 0]] * H.work.value[H.model.products[q, 1]]
        H.work.gram[i, k - i + reach] = total
        H.work.gram[k, i - k + reach] = total
    first = m + 2 * H.model.which.size
    for c in range(H.model.damped.size):
        if H.work.damping[c] == 1 and h > 0.0:
            H.work.gram[H.model.place[first + c], reach] += 2.0 / h
    hold_immobile(m, H)


@kernel
def hold_immobile(m, H):
    """Give a contact that cannot slip a tiny compliance along T; open a contact that cannot move along its normal."""
    reach, largest = H.model.reach[0], 0.0
    for i in range(H.model.which.size):
        if H.work.closed[i] == 1:
            a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
            largest = max(largest, H.work.gram[a, reach], H.work.gram[b, reach])
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0:
            continue
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        if H.model.compliant[i] == 1:  # its force follows from its law
            H.work.gram[a, reach] = max(H.work.gram[a, reach], ROUND_OFF_TOL * largest)
        if H.work.gram[a, reach] <= ROUND_OFF_TOL**2 * largest:
            H.work.closed[i], H.state.mode[i], H.state.stuck[i] = 0, OPEN, 0
            for k in range(2 * reach + 1):
                H.work.gram[a, k] = H.work.gram[b, k] = 0.0
            for k in range(H.model.place.size):
                if abs(a - k) <= reach:
                    H.work.gram[k, a - k + reach] = 0.0
                if abs(b - k) <= reach:
                    H.work.gram[k, b - k + reach] = 0.0
        else:
            H.work.gram[b, reach] = max(H.work.gram[b, reach], ROUND_OFF_TOL * H.work.gram[a, reach])


@kernel
def effective_mass(i, S, H):
    """Return the effective mass [kg] of hard contact i along its normal, with all constraints and other contacts open."""
    m = S.work.multiplier.size
    a, reach = m + 2 * i, H.model.reach[0]
    at = H.model.place[a]
    total = H.work.gram[at, reach]
    if m > 0:
        for k in range(m):
            offset = H.model.place[k] - at
            H.work.mass_row[k] = H.work.gram[at, offset + reach] if abs(offset) <= reach else 0.0
        for k in range(m):
            S.work.work[k] = H.work.mass_row[k]
        solve_constraints(S, S.work.work[:m])
        for k in range(m):
            total -= H.work.mass_row[k] * S.work.work[k]
    return 1.0 / total if total > 0.0 else math.inf


@kernel
def row_product(a, vector, H):
    """Return the product of row a of the banded matrix G and a vector of all rows."""
    return product(H.work.gram, H.model.reach[0], a, vector)


@kernel
def largest_impulse(m, H):
    """Return the largest normal impulse of a closed contact."""
    largest = 0.0
    for i in range(H.model.which.size):
        if H.work.closed[i] == 1:
            largest = max(largest, H.work.impulse[H.model.place[m + 2 * i]])
    return largest


@kernel
def mark_changed(i, m, H):
    """Record that the equations of contact i differ from the factorized ones."""
    H.work.since[0] = min(H.work.since[0], H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1])


@kernel
def write_equations(m, first, H):
    """Write the equations for the current modes from row `first` on."""
    size, reach = H.model.place.size, H.model.reach[0]
    for a in range(first, size):
        for k in range(2 * reach + 1):
            H.work.band[a, k] = H.work.gram[a, k]
        for k in range(2 * reach + 1, H.work.band.shape[1]):
            H.work.band[a, k] = 0.0
        H.work.right[a] = -H.work.free[a]
        if H.work.gram[a, reach] == 0.0:  # an open latch or contact, or a component without damping
            H.work.band[a, reach] = 1.0
            H.work.right[a] = 0.0
    for i in range(H.model.which.size):
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        if H.work.closed[i] == 1 and a >= first:
            write_normal(i, a, H)
        if H.work.closed[i] == 1 and b >= first:
            write_tangential(i, a, b, H)


@kernel
def write_normal(i, a, H):
    """Write the row N of a closed contact."""
    if H.state.mode[i] == OPEN:
        write_unit_row(a, H)
        return
    H.work.band[a, H.model.reach[0]] = H.work.band[a, H.model.reach[0]] * (1.0 + SURFACE_COMPLIANCE) + H.work.compliance[i]
    H.work.right[a] = -H.work.free[a] - H.work.offset[i]


@kernel
def write_tangential(i, a, b, H):
    """Write the row T of a closed contact with row N at a."""
    reach = H.model.reach[0]
    if H.state.mode[i] == OPEN:
        write_unit_row(b, H)
        return
    if H.state.mode[i] == STICK:
        H.work.band[b, reach] *= 1.0 + SURFACE_COMPLIANCE
        return
    sign = 1.0 if H.state.mode[i] == SLIP else -1.0
    # P_T + turning_mass U_T = lag + friction, times G_TT
    mass, turned = H.work.gram[b, reach], H.work.turning_mass[i] * H.work.gram[b, reach]
    for k in range(2 * reach + 1):
        H.work.band[b, k] = turned * H.work.gram[b, k]
    H.work.band[b, reach] += mass
    H.work.band[b, a - b + reach] -= sign * H.work.friction[i] * mass
    H.work.right[b] = mass * H.work.lag[i] - turned * H.work.free[b]


@kernel
def write_unit_row(a, H):
    """Replace row a of the equations by a unit row with zero right-hand side."""
    for k in range(2 * H.model.reach[0] + 1):
        H.work.band[a, k] = 0.0
    H.work.band[a, H.model.reach[0]] = 1.0
    H.work.right[a] = 0.0
