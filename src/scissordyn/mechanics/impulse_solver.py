"""Impulses of a step: semi-smooth Newton method on banded equations, and Lemke's pivoting if it fails.

G are the products of the rows, lambda their impulses, U = U_free + G lambda. Each contact is open, sticks, or slips either way
(Alart and Curnier 1991, doi:10.1016/0045-7825(91)90022-X). For given modes the equations are linear, and banded for a chain of
joints: the cost of a Newton step is linear in the number of joints.

Dependent rows, for example if all joints of a closed loop are in contact, have several solutions. To select one, G_aa is
multiplied by 1 + `SURFACE_COMPLIANCE`, as if surfaces had this fraction of the compliance of a free journal.
"""

from __future__ import annotations

from scissordyn.kernel import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.compliant_contact import begin_laws, laws_fit
from scissordyn.mechanics.hard_elastic import law_fits, prepare_law
from scissordyn.mechanics.hard_rows import OPEN, SLIP, STICK, mark_changed, row_product, write_equations
from scissordyn.mechanics.pivoting import pivot
from scissordyn.tolerance import DATA_TOL, EVENT_TOL, SINGULAR_VALUE_MIN

MODE_STEPS_MAX = 40  # Largest number of Newton steps to consistent contact modes (open, stick, slip) before Lemke's pivoting

STALLED_STEPS_MAX = 10
"""Largest number of Newton steps that change all modes without a new minimum of the contacts that request another mode.

After them only the last of these contacts changes its mode, until there are fewer, as in block principal pivoting.
"""

LINEARISATIONS_MAX = 4  # Largest number of linearisations of elastic contact laws in a time step

# Largest number of linearisations in a step with compliant contact laws, less smooth than elastic ones
COMPLIANT_LINEARISATIONS_MAX = 12

RECENT_STEPS = 15
"""Number of last Newton steps before a failure; pivoting begins with the contacts that changed their modes in them."""


FOUND, MISFIT, FAILED = range(3)
"""Results of `newton`: consistent modes; consistent modes, but compliant laws that are not met; no consistent modes."""


FACTORIZATIONS, MOST_IN_A_STEP, PIVOTS, PIVOTED, UNSOLVED, IMPULSIVE, DEPENDENT = range(7)
"""Columns of `HardState.counts`: factorizations, most of them in a step, pivots, steps with pivots, steps that are not
solved, steps with closed contacts, steps with rows that depend on each other."""


@kernel
def solve_impulses(m, y, S, H):
    """Compute the impulses of all rows and the velocities after the step; begin with the contact modes of the last step.

    Return whether they agree with the laws of compliant contacts.
    """
    most_laws = LINEARISATIONS_MAX
    for i in range(H.model.which.size):
        if H.work.before[H.model.place[m + 2 * i]] > 0.0:  # the surfaces already separate
            H.work.rebound[i] = 0.0
        H.work.compliance[i] = 0.0
        if H.model.compliant[i] == 1 and H.work.closed[i] == 1:
            begin_laws(i, m, y, S, H)
            most_laws = COMPLIANT_LINEARISATIONS_MAX
            continue
        if H.work.yields[i] == 1:
            prepare_law(i, H.model.place[m + 2 * i], H)
        else:
            H.work.offset[i] = H.work.rebound[i] * H.work.before[H.model.place[m + 2 * i]] + H.work.bias[i]
        at = H.model.place[m + 2 * i + 1]
        # mu_s for a contact that stuck in the last step or only now starts to move
        still = H.work.closed[i] == 1 and abs(H.work.before[at]) <= DATA_TOL * abs(H.work.free[at] - H.work.before[at])
        H.work.friction[i] = H.parameters.static[i] if still or H.state.stuck[i] == 1 else H.parameters.kinetic[i]
        if H.work.closed[i] == 1 and H.state.mode[i] == OPEN:
            H.state.mode[i] = STICK if H.parameters.kinetic[i] > 0.0 else SLIP
    H.state.counts[IMPULSIVE] += 1
    # modes by Newton's method, else pivoting of restless contacts, else of all contacts, else without friction
    agree = newton(most_laws, m, y, S, H)
    if agree != FAILED:
        if depends(H):
            H.state.counts[DEPENDENT] += 1
        return agree == FOUND
    H.state.counts[PIVOTED] += 1
    if not pivot_restless(m, H):
        pivots = pivot(0, m, H)
        if pivots < 0:  # without friction a solution exists
            H.state.counts[UNSOLVED] += 1
            H.work.friction[:] = 0.0
            H.state.counts[PIVOTS] += max(pivot(0, m, H), 0)
        H.state.counts[PIVOTS] += max(pivots, 0)
    return most_laws != COMPLIANT_LINEARISATIONS_MAX or laws_fit(m, y, S, H)


@kernel
def newton(most_laws, m, y, S, H):
    """Find consistent modes; return `FOUND`, `MISFIT` if compliant laws are not met, or `FAILED`."""
    none = 3 * H.model.which.size + 1
    H.work.since[0] = 0
    H.work.restless[:] = 0
    fewest, tries, laws = none, STALLED_STEPS_MAX, 0
    for tried in range(MODE_STEPS_MAX):
        if not solve_modes(m, H):
            break
        H.state.counts[FACTORIZATIONS] += 1
        H.state.counts[MOST_IN_A_STEP] = max(H.state.counts[MOST_IN_A_STEP], tried + 1)
        asking = ask_for_modes(m, H)
        elastic = laws == most_laws or law_fits(m, H)
        # all modes are consistent: check the laws of elastic and compliant contacts
        if asking == 0:
            compliant = laws_fit(m, y, S, H)
            if (elastic and compliant) or laws == most_laws:
                return FOUND if compliant else MISFIT
            laws, fewest, tries = laws + 1, none, STALLED_STEPS_MAX
            continue
        # block principal pivoting: all at once while this makes progress, then one at a time
        if asking < fewest:
            fewest, tries = asking, STALLED_STEPS_MAX
        else:
            tries = max(tries - 1, 0)
        change_modes(tries == 0, tried, m, H)
    return FAILED


@kernel
def pivot_restless(m, H):
    """Pivot only the contacts that kept changing modes and those that then request another mode.

    Return whether no contact requests another mode at the end.
    """
    for _ in range(6):  # each time further contacts join the pivoted ones
        pivots = pivot(MODE_STEPS_MAX - RECENT_STEPS, m, H)
        H.state.counts[PIVOTS] += max(pivots, 0)
        if pivots < 0:
            return False
        if ask_for_modes(m, H) == 0:
            return True
        change_modes(False, MODE_STEPS_MAX, m, H)
    return False


@kernel
def solve_modes(m, H):
    """Compute the impulses for the current modes and the resulting velocities; return whether a solution exists."""
    size, reach, first = H.model.place.size, H.model.reach[0], H.work.since[0]
    write_equations(m, first, H)
    H.work.since[0] = size
    # rows before the first changed one keep their factors
    if band.eliminate(H.work.band, reach, first, H.work.right) < 0:
        band.substitute(H.work.band, reach, H.work.right, H.work.impulse)
        update_velocities(H)
        if accurate(m, H):
            return True
    write_equations(m, 0, H)
    H.work.since[0] = 0
    for a in range(size):
        H.work.impulse[a] = H.work.right[a]
    if band.factorize(H.work.band, reach, reach, H.work.pivots) >= 0:
        return False
    band.solve(H.work.band, reach, H.work.pivots, H.work.impulse)
    update_velocities(H)
    return True


@kernel
def update_velocities(H):
    """Write the velocities that result from the impulses."""
    for a in range(H.model.place.size):
        H.work.velocity[a] = H.work.free[a] + row_product(a, H.work.impulse, H)


@kernel
def accurate(m, H):
    """Return whether the impulses satisfy the equations of closed contacts up to round-off of the velocity changes."""
    reach, largest, worst = H.model.reach[0], 0.0, 0.0
    for a in range(H.model.place.size):
        largest = max(largest, abs(H.work.free[a]), H.work.gram[a, reach] * abs(H.work.impulse[a]))
    for a in range(m):
        if H.work.gram[H.model.place[a], reach] > 0.0:
            worst = max(worst, abs(H.work.velocity[H.model.place[a]]))
    for i in range(H.model.which.size):
        if H.work.closed[i] == 0 or H.state.mode[i] == OPEN:
            continue
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        worst = max(worst, abs(H.work.velocity[a] + H.work.compliance[i] * H.work.impulse[a] + H.work.offset[i]))
        if H.state.mode[i] == STICK:
            worst = max(worst, abs(H.work.velocity[b]))
    return worst <= EVENT_TOL * largest


@kernel
def depends(H):
    """Return whether a row of the factorized equations depends on others, apart from its compliance."""
    reach = H.model.reach[0]
    least = 1.0
    for a in range(H.model.place.size):
        if H.work.gram[a, reach] > 0.0:
            least = min(least, abs(H.work.band[a, reach]) / H.work.gram[a, reach])
    return least < SINGULAR_VALUE_MIN**2  # the pivot of a Gram matrix is the square of a distance


@kernel
def ask_for_modes(m, H):
    """Write the mode that impulses and velocities of each contact require; return how many differ from the current one.

    A contact on the border between two modes, up to round-off of the largest impulse, keeps its mode.
    """
    asking, reach, largest = 0, H.model.reach[0], 0.0
    for a in range(H.model.place.size):
        largest = max(largest, abs(H.work.impulse[a]))
    near = EVENT_TOL * largest
    for i in range(H.model.which.size):
        old = H.work.required[i] = H.state.mode[i]
        if H.work.closed[i] == 0:
            continue
        a, b = H.model.place[m + 2 * i], H.model.place[m + 2 * i + 1]
        p_n, p_t, new = H.work.impulse[a], H.work.impulse[b], OPEN
        # the augmented Lagrangian of Alart and Curnier decides whether it is closed; on the border the mode is kept
        if p_n - (H.work.velocity[a] + H.work.compliance[i] * p_n + H.work.offset[i]) / H.work.gram[a, reach] > (
            near if old == OPEN else -near
        ):
            limit = H.work.friction[i] * max(p_n, 0.0)
            # the friction impulse that would stop the slip
            wanted = p_t - H.work.lag[i] + (H.work.turning_mass[i] - 1.0 / H.work.gram[b, reach]) * H.work.velocity[b]
            new = SLIP if wanted > (near if old == SLIP + 1 else -near) else SLIP + 1
            if H.model.compliant[i] == 1:
                new = SLIP
            if H.work.friction[i] > 0.0 and abs(wanted) <= limit + (near if old == STICK else -near):
                new = STICK
        H.work.required[i] = new
        if new != old or (new >= SLIP and H.work.friction[i] > H.parameters.kinetic[i]):
            asking += 1
    return asking


@kernel
def change_modes(single, tried, m, H):
    """Set the mode of each contact (open, stick or slip) to the one that its impulses and velocities require.

    If `single`, change only the last contact whose mode differs. `tried` is the index of the Newton step; it is stored for each
    changed contact.
    """
    for i in range(H.model.which.size - 1, -1, -1):
        breaks_away = H.work.closed[i] == 1 and H.work.required[i] >= SLIP and H.work.friction[i] > H.parameters.kinetic[i]
        if H.work.required[i] != H.state.mode[i] or breaks_away:
            H.state.mode[i], H.work.restless[i] = H.work.required[i], tried
            mark_changed(i, m, H)
            if breaks_away:
                H.work.friction[i] = H.parameters.kinetic[i]
            if single:
                return
