"""Compliant contacts in a mechanism with hard contacts: a time step solves their force laws implicitly.

The rows N and T of an active compliant contact are those of an elastic hard contact, with its damping and friction laws added,

    P_N = h F_n(delta_mean, delta'_mean),    P_T = h F_t(v_mean, F_n, z),

delta_mean as in `hard_elastic`, rates at theta U+ + (1 - theta) U-, theta = 1/2, or near 1 if the damping is much stiffer than
the step. The internal states z of friction follow implicit Euler. The laws are linearised repeatedly until the impulses agree
with them. A step resolves the vibration of the contact: step size times angular frequency is at most `PHASE_MAX`.
"""

from __future__ import annotations

import math

from scissordyn.kernel import call_at, kernel
from scissordyn.laws.evaluate import elastic_force, friction_force, rate_in_range, reference_speed
from scissordyn.mechanics.hard_elastic import law_at, law_depth, prepare_law
from scissordyn.mechanics.hard_result import CLOSED
from scissordyn.mechanics.hard_rows import SLIP, effective_mass, largest_impulse, mark_changed

PHASE_MAX = 0.2  # [rad] Largest product of step size and natural angular frequency of a compliant contact
STEP_RATIO_MAX = 1.5  # Largest ratio of a step size to the allowed one in a compliant contact; above, the step is repeated

MISFIT_TOL, NEGLIGIBLE_FRACTION = 1e-4, 1e-7
"""Accepted errors of a linearised law: relative to its force, and relative to the largest force of the step."""

DIFFERENCE, SLIP_DIFFERENCE = 1e-5, 1e-9
"""Relative step of the numerical derivatives of laws, and the smallest step of slip speeds [m/s]."""


@kernel
def normal_at(i, delta, rate, S, H):
    """Return the normal force [N] of compliant contact i; negative if fast separation makes the law pull."""
    j = H.model.which[i]
    # below the floor the law is linear and undamped
    if delta <= H.parameters.floor[i]:
        force, _ = law_at(i, delta, H)
        return force
    elastic = elastic_force(H.parameters.law[i], delta, H.parameters.elastic[i])
    reference = reference_speed(elastic, delta, rate, S.state.memory[j], S.state.mass[j])
    arguments = elastic, delta, rate_in_range(rate, reference), abs(reference)
    return call_at(S.parameters.law[j].damping, arguments, (), (), (), S.parameters.damping[j], ())


@kernel
def friction_at(i, slip, normal, y, S, H):
    """Return the friction force [N] of compliant contact i at the end of a step; write its states to `HardWork.bristle`."""
    M, P, j = S.model, S.parameters, H.model.which[i]
    states = M.state_start[j + 1] - M.state_start[j]
    z, dz, first, h = H.work.bristle[:states], S.work.state_work[0, :states], 2 * M.n + M.state_start[j], H.work.size[0]
    for k in range(states):
        z[k] = y[first + k]
    for _ in range(3 if states > 0 else 0):  # Newton steps for an internal state of friction
        # implicit Euler, z = z_0 + h z'(z), by Newton's method with a numerical slope
        for k in range(states):
            friction_force(P.law[j].friction, slip, normal, z, dz, P.friction[j])
            here, rate = z[k], dz[k]
            apart = DIFFERENCE * abs(here) + 1e-12 * max(1.0, P.state_scale[M.state_start[j] + k])
            z[k] = here + apart
            friction_force(P.law[j].friction, slip, normal, z, dz, P.friction[j])
            slope = min((dz[k] - rate) / apart, 0.0)
            z[k] = here - (here - y[first + k] - h * rate) / (1.0 - h * slope)
    return friction_force(P.law[j].friction, slip, normal, z, dz, P.friction[j])


@kernel
def rate_of(i, at, u, H):
    """Return the indentation rate [m/s] for the laws: a weighted mean over the step, which ends with the normal rate u."""
    later = H.work.later[i]
    return -later * (u - H.work.turn[i]) - (1.0 - later) * (H.work.before[at] + H.work.turn[i])


@kernel
def slip_of(i, at, u, H):
    """Return the slip speed [m/s] for the laws: a weighted mean over the step, which ends with the tangential rate u."""
    return -H.work.later_slip[i] * u - (1.0 - H.work.later_slip[i]) * H.work.before[at]


@kernel
def later_part(stiff):
    """Return theta, the weight of the end of a step in the theta method, for a contact's normal force or friction: 0.5 to 1.

    `stiff` is the damping, or the slope of friction, times the step size over the effective mass.
    """
    return 0.5 + 0.5 * stiff * stiff / (1.0 + stiff * stiff)


@kernel
def normal_slopes(i, delta, rate, S, H):
    """Return the derivatives of the normal force by indentation [N/m] and rate [N s/m]."""
    j, small = H.model.which[i], DIFFERENCE * max(delta, H.parameters.floor[i])
    elastic = elastic_force(H.parameters.law[i], delta, H.parameters.elastic[i]) if delta > H.parameters.floor[i] else 0.0
    slow = DIFFERENCE * (abs(rate) + abs(reference_speed(elastic, delta, rate, S.state.memory[j], S.state.mass[j])))
    by_depth = (normal_at(i, delta + small, rate, S, H) - normal_at(i, delta - small, rate, S, H)) / (2.0 * small)
    by_rate = (normal_at(i, delta, rate + slow, S, H) - normal_at(i, delta, rate - slow, S, H)) / (2.0 * slow)
    return by_depth, max(by_rate, 0.0)


@kernel
def linearise_laws(i, a, b, u_n, slip, normal, y, S, H):
    """Write the equations of compliant contact i, linearised at U_N+ = u_n, a slip speed and a normal force."""
    h = H.work.size[0]
    delta, rate = H.work.reached[i] - H.work.weight[i] * u_n, rate_of(i, a, u_n, H)
    force = normal_at(i, delta, rate, S, H)
    by_depth, by_rate = normal_slopes(i, delta, rate, S, H)
    _, least = law_at(i, H.parameters.floor[i], H)
    # P_N = h (F + slope (u_n - U_N+)): compliance and offset in the row N
    slope = max(by_depth, least) * H.work.weight[i] + by_rate * H.work.later[i]
    H.work.compliance[i], H.work.offset[i] = 1.0 / (h * slope), -u_n - force / slope
    small = DIFFERENCE * abs(slip) + SLIP_DIFFERENCE
    up, down = friction_at(i, slip + small, normal, y, S, H), friction_at(i, slip - small, normal, y, S, H)
    by_slip = max((up - down) / (2.0 * small), 0.0)
    later = later_part(h * by_slip * H.work.gram[b, H.model.reach[0]]) if H.work.later_slip[i] == 0.0 else H.work.later_slip[i]
    H.work.later_slip[i] = later
    u_t = -(slip + (1.0 - later) * H.work.before[b]) / later
    # the same for the row T
    H.work.turning_mass[i] = h * by_slip * later
    H.work.lag[i] = h * friction_at(i, slip, normal, y, S, H) + H.work.turning_mass[i] * u_t
    H.work.rubbed[i] = slip


@kernel
def begin_laws(i, m, y, S, H):
    """Write the equations of compliant contact i, linearised at the velocities before the step."""
    a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
    H.state.pressed[i] = max(H.state.pressed[i], H.work.depth[i], 0.0)
    prepare_law(i, a, H)
    rate = -H.work.before[a] - H.work.turn[i]
    _, by_rate = normal_slopes(i, max(H.state.pressed[i], H.parameters.floor[i]), rate, S, H)
    H.work.later[i], H.work.later_slip[i] = later_part(H.work.size[0] * by_rate * H.work.gram[a, H.model.reach[0]]), 0.0
    normal = max(normal_at(i, H.state.pressed[i], rate, S, H), 0.0)
    linearise_laws(i, a, b, H.work.before[a], -H.work.before[b], normal, y, S, H)
    H.work.friction[i], H.state.mode[i] = 0.0, SLIP


@kernel
def laws_fit(m, y, S, H):
    """Return whether the impulses agree with the laws of all compliant contacts; linearise again those that do not."""
    fits, h, largest = True, H.work.size[0], largest_impulse(m, H)
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0 or H.model.compliant[i] == 0:
            continue
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        u, p_n, slip = H.work.velocity[a], H.work.impulse[a], slip_of(i, b, H.work.velocity[b], H)
        delta = H.work.reached[i] - H.work.weight[i] * u
        elastic, _ = law_at(i, max(delta, H.parameters.floor[i]), H)
        force = max(normal_at(i, delta, rate_of(i, a, u, H), S, H), 0.0)
        friction = friction_at(i, slip, p_n / h, y, S, H) if p_n > 0.0 else 0.0
        near = MISFIT_TOL * max(h * force, p_n) + NEGLIGIBLE_FRACTION * max(largest, h * elastic)
        if max(abs(h * force - p_n), abs(h * friction - H.work.impulse[b])) > near:
            # friction is steepest at rest: use zero slip if the slip has reversed since the last linearisation
            across = slip * H.work.rubbed[i] < 0.0
            linearise_laws(i, a, b, u, 0.0 if across else slip, 0.5 * (force + p_n / h), y, S, H)
            mark_changed(i, m, H)
            fits = False
    return fits


@kernel
def take_compliant(y, new, S, H):
    """Write depth, rates and forces of closed compliant contacts at the end of the step to `S.work.contact`.

    States of their friction go to the state vector `new`.
    """
    M, h, m = S.model, H.work.size[0], S.work.multiplier.size
    for i in range(H.model.which.size):
        if H.model.compliant[i] == 0 or H.work.closed[i] == 0:
            continue
        j = H.model.which[i]
        a, b, contact = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1], S.work.contact[j]
        delta = law_depth(i, a, H)
        H.state.pressed[i] = max(delta, 0.0)
        contact.depth = delta
        contact.rate, contact.slip = (
            -0.5 * (H.work.before[a] + H.work.velocity[a]),
            -0.5 * (H.work.before[b] + H.work.velocity[b]),
        )
        contact.elastic = elastic_force(H.parameters.law[i], delta, H.parameters.elastic[i]) if delta > 0.0 else 0.0
        contact.normal, contact.tangential = H.work.impulse[a] / h, H.work.impulse[b] / h
        friction_at(i, slip_of(i, b, H.work.velocity[b], H), contact.normal, y, S, H)
        first = M.state_start[j]
        for k in range(M.state_start[j + 1] - first):
            new[2 * M.n + first + k] = H.work.bristle[k]
        H.work.result[i, CLOSED] = 1.0


@kernel
def too_long_for_laws(S, H):
    """Write the longest step for the active compliant contacts; return whether the present step is too long."""
    H.state.longest[0] = math.inf
    for i in range(H.model.which.size):
        if H.model.compliant[i] == 1 and H.work.closed[i] == 1:
            _, slope = law_at(i, H.state.pressed[i], H)
            H.state.longest[0] = min(H.state.longest[0], PHASE_MAX * math.sqrt(effective_mass(i, S, H) / slope))
    return H.work.size[0] > STEP_RATIO_MAX * H.state.longest[0]
