"""Elasticity of hard contacts that stay closed, with an implicit stiffness law.

A contact that was closed before the step is compressed by F(delta), with delta at a mean over the step. T is the speed that the
curvature of the surface requires at the end, and K = dF/d delta:

    P_N = h F(delta_mean),    delta_mean = delta_m - h T/4 - h (a (U+ - U- - 2 T) + f (U- + T)),
    a = 1/4 + 3/4 f,    f = z^2/(1 + z^2),    z = K G_NN h^2.

For z -> 0 this is the implicit midpoint rule, which loses no energy. For z -> infinity both eigenvalues of the contact's
vibration tend to zero. With the law linearised, the contact's row of the equations has a compliance of its own,

    0 <= U+ + c P_N + b _|_ P_N >= 0,    c = 1/(h^2 K a).

Steps resolve the vibration of a compliant contact, which has f = 0.
"""

from __future__ import annotations

from scissordyn.kernel import kernel
from scissordyn.laws.evaluate import elastic_energy, elastic_force
from scissordyn.mechanics.hard_result import CLOSED
from scissordyn.mechanics.hard_rows import largest_impulse, mark_changed

# [clearances] Largest indentation with a linear contact law, and largest gap of a closed contact in the equations
TOUCHING_DEPTH_MAX = 1e-3

MISFIT_TOL = 1e-2  # Largest relative error of a linearised contact force; its square is that relative to the largest force


@kernel
def force_at(i, delta, H):
    """Return the force [N] of hard contact i at an indentation."""
    least = H.parameters.floor[i]
    if delta <= least:
        return elastic_force(H.parameters.law[i], least, H.parameters.elastic[i]) / least * delta
    return elastic_force(H.parameters.law[i], delta, H.parameters.elastic[i])


@kernel
def law_at(i, delta, H):
    """Return the force [N] of hard contact i at an indentation, and its derivative [N/m]."""
    force, least = force_at(i, delta, H), H.parameters.floor[i]
    if delta <= least:
        return force, elastic_force(H.parameters.law[i], least, H.parameters.elastic[i]) / least
    small = 1e-5 * delta
    slope = (
        elastic_force(H.parameters.law[i], delta + small, H.parameters.elastic[i])
        - elastic_force(H.parameters.law[i], delta - small, H.parameters.elastic[i])
    ) / (2.0 * small)
    return force, slope


@kernel
def linearise_law(i, delta, H):
    """Write compliance and offset of hard contact i with the law linearised at an indentation."""
    force, slope = law_at(i, delta, H)
    over = 1.0 / H.work.weight[i]
    H.work.compliance[i] = over / (H.work.size[0] * slope)
    H.work.offset[i] = -over * (force / slope + H.work.reached[i] - delta)


@kernel
def law_depth(i, at, H):
    """Return the indentation [m] that corresponds to the force of hard contact i in the step."""
    return H.work.reached[i] - H.work.weight[i] * H.work.velocity[at]


@kernel
def prepare_law(i, at, H):
    """Write the data of a closed elastic contact for its equations; `HardWork.turn` contains T."""
    h, turn, before = H.work.size[0], H.work.turn[i], H.work.before[at]
    _, slope = law_at(i, H.state.pressed[i], H)
    z = slope * H.work.gram[at, H.model.reach[0]] * h * h
    f = z * z / (1.0 + z * z) if H.model.compliant[i] == 0 else 0.0
    a = 0.25 + 0.75 * f
    H.work.weight[i], H.work.faster[i] = h * a, f
    H.work.reached[i] = H.work.depth[i] - 0.25 * h * turn + h * (a * (before + 2.0 * turn) - f * (before + turn))
    linearise_law(i, H.state.pressed[i], H)


@kernel
def law_fits(m, H):
    """Return whether the impulses of elastic contacts agree with their laws; linearise again those that do not."""
    fits, h, largest = True, H.work.size[0], largest_impulse(m, H)
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0 or H.work.yields[i] == 0 or H.model.compliant[i] == 1 or H.work.required[i] != H.state.mode[i]:
            continue
        at = H.model.place[m + 2 * i]
        delta = law_depth(i, at, H)
        force = force_at(i, max(delta, 0.0), H)
        if abs(h * force - H.work.impulse[at]) > MISFIT_TOL * max(h * force, H.work.impulse[at]) + MISFIT_TOL**2 * largest:
            linearise_law(i, max(delta, 0.0), H)
            mark_changed(i, m, H)
            fits = False
    return fits


@kernel
def stored_energy(i, H):
    """Return the elastic energy [J] of hard contact i at the end of a step; 0 if it is open or separates.

    If its vibration is much faster than the step, the energy is that of the indentation corresponding to its force.
    """
    if H.work.result[i, CLOSED] == 0.0:
        return 0.0
    depth = (
        (1.0 - H.work.faster[i]) * H.work.ending[i] + H.work.faster[i] * H.state.pressed[i]
        if H.work.yields[i] == 1
        else H.work.ending[i]
    )
    return elastic_energy(H.parameters.energy[i], H.parameters.law[i], depth, H.parameters.elastic[i])
