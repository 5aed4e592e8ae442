"""Effective masses: the inertia that a force along the normal of a contact, or along the gap of a component, accelerates.

A unit force with the generalized force g on the free coordinates, whose mass matrix is one, accelerates them by

    a = g - Phi^T (Phi Phi^T)^-1 Phi g,    1/m = a . a

The constraints are kept, prescribed coordinates keep their motion, and all other contacts are open.

A point of a bar that bends has little inertia of its own, less with each element or mode more; an impact moves more of the bar.
The effective mass is therefore at least the reduced mass of both bodies, where a bar counts as a whole.
"""

from __future__ import annotations

from scissordyn.components.port import RAIL
from scissordyn.kernel import kernel
from scissordyn.mechanics.component import evaluate, sense, write_context
from scissordyn.mechanics.constraint_solver import factorize_constraints, map_directions, solve_constraints, subtract_gradients
from scissordyn.mechanics.force_element import add_forces, add_torques, map_values
from scissordyn.mechanics.port import port_forces
from scissordyn.mechanics.rail import ACROSS, write_rows
from scissordyn.tolerance import ROUND_OFF_TOL

# [kg] effective mass of a contact if drives prescribe the motion along its normal: small, so that damping vanishes
MASS_MIN = 1e-300


@kernel
def contact_mass(j, S):
    """Return the effective mass of contact j along its normal [kg]; call `kinematics` first."""
    W = S.work
    nx, ny = W.contact[j].nx, W.contact[j].ny
    ux, uy, ax, ay, bx, by, _, _, _, _, _, _ = map_values(j, S)
    # a guide surface is pushed at the corner, not at the point that its map starts from, and a worn bearing likewise
    p = S.parameters.contact[j]
    moment = ux * ny - uy * nx if p.plane == 1 or p.cells > 0 else 0.0
    lever = W.contact[j].lever if p.journal == 1 else 0.0
    W.load[:] = 0.0
    add_torques(j, S, -nx, -ny, -lever, moment + lever, ax, ay, bx, by, W.load, 0, S.model.n)
    return at_least(S.parameters.whole_mass[j], effective_mass(S))


@kernel
def component_mass(t, i, z, S):
    """Return the effective mass of component i along its gap [kg], or its inertia [kg m^2] if the gap is an angle.

    The result is 0 if the gap is an angle at a bar that bends; damping then refers to the approach speed, as in the published
    law. The inertia of a cross-section that a bar turns would be far smaller than the inertia that an impact meets.
    """
    M, W = S.model, S.work
    element, port, force = S.parameters.contact.size + i, M.component_port[i], W.other_answer
    whole = S.parameters.whole_mass[element]
    if M.reference_of[i] >= 0 and whole > 0.0:
        return 0.0
    maps = map_values(element, S)
    sense(i, S, maps)
    write_context(t, i, S)
    # the gap's rate is linear in the port's rates: its gradient from unit rates
    rates = W.coordinate_rates[i]
    rates[:] = 0.0
    evaluate(i, S, z, M.gap_kernel[i], W.answer)
    still = W.answer[1]
    for k in range(M.component_forces[i]):
        rates[k] = 1.0
        evaluate(i, S, z, M.gap_kernel[i], W.answer)
        force[k] = W.answer[1] - still
        rates[k] = 0.0
    W.load[:] = 0.0
    if port == RAIL.code:
        write_rows(element, i, S)
        for e in range(M.element_start[element], M.element_start[element + 1]):
            if M.element_column[e] < M.n:
                W.load[M.element_column[e]] += force[0] * W.rail[ACROSS, e - M.element_start[element]]
    else:
        fx, fy, gx, gy, hx, hy = port_forces(port, maps, W.coordinates[i], force)
        add_forces(element, S, fx, fy, gx, gy, hx, hy, W.load, 0, M.n)
    return at_least(whole, effective_mass(S))


@kernel
def at_least(whole, mass):
    """Return an effective mass, or a greater one of whole bodies; a direction that the drives prescribe keeps its tiny mass."""
    return mass if mass == MASS_MIN else max(mass, whole)


@kernel
def effective_mass(S):
    """Return the effective mass for a unit force whose generalized force is in Work.load; Work.load is overwritten.

    If the constraints lock the direction, or at a singular position, the constraints are left out, which gives a smaller mass.
    """
    M, W = S.model, S.work
    free = squared_load(S)
    if not free > 0.0:
        return MASS_MIN
    if W.multiplier.size == 0:
        return 1.0 / free
    map_directions(S, W.X, W.direction)
    if factorize_constraints(S) >= 0:
        return 1.0 / free
    for k in range(W.multiplier.size):
        W.work[k] = 0.0
        for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
            if M.constraint_column[i] < M.n:
                W.work[k] += W.gradient[i] * W.load[M.constraint_column[i]]
    solve_constraints(S, W.work[: W.multiplier.size])
    subtract_gradients(S, W.work, W.load, 0)
    left = squared_load(S)
    return 1.0 / left if left > ROUND_OFF_TOL**2 * free else 1.0 / free


@kernel
def squared_load(S):
    """Return the square of the norm of Work.load."""
    total = 0.0
    for i in range(S.model.n):
        total += S.work.load[i] * S.work.load[i]
    return total
