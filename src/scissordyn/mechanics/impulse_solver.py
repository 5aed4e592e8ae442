"""The impulses of a step: a semi-smooth Newton method on banded equations, and projected Gauss-Seidel sweeps if it fails.

Letters: G products of the rows, lambda their impulses, U = U_free + G lambda. Of each contact the modes are open, stick and
slip either way (Alart and Curnier 1991, doi:10.1016/0045-7825(91)90022-X); for given modes the equations are linear, and of a
chain of joints banded: a step of Newton's method costs as many operations as there are joints.

Rows that depend on each other, as where all joints of a closed loop are in contact, have more impulses than one that solve
the equations. G_aa (1 + `COMPLIANCE`) in the place of G_aa of a contact chooses among them: surfaces that yield by this part
of what a free journal would.
"""

from __future__ import annotations

from scissordyn.jit import kernel
from scissordyn.mechanics import band

__all__ = [
    "COUNTS",
    "DEPENDENT",
    "FACTORIZATIONS",
    "IMPULSIVE",
    "MOST_IN_A_STEP",
    "OPEN",
    "SLIP",
    "STICK",
    "SWEPT",
    "SWEPT_STEPS",
    "UNSOLVED",
    "solve_impulses",
]

OPEN, STICK, SLIP = range(3)
"""Modes of a contact; `SLIP` with P_T = mu P_N, `SLIP` + 1 with P_T = -mu P_N."""

COMPLIANCE = 1e-11

MOST = 60
"""Steps of Newton's method before sweeps are tried."""

TOGETHER = 12
"""Steps of Newton's method that change all modes at once; from then on the first contact that asks for it changes its mode, as
in Murty's principal pivoting, which does not cycle without friction."""

SWEEPS = 2000

CONVERGED = 1e-10
"""Change of an impulse in a sweep, as a fraction of the largest, at which sweeps end."""

STILL = 1e-6
"""Slip speed, as a part of what forces change it by in a step, below which surfaces have not slipped."""

FACTORIZATIONS, MOST_IN_A_STEP, SWEPT, SWEPT_STEPS, UNSOLVED, IMPULSIVE, DEPENDENT = range(7)
"""Columns of `HardContacts.counts`: factorizations, most of them in a step, sweeps, steps with sweeps, steps that are not
solved, steps with closed contacts, steps with rows that depend on each other."""

COUNTS = 7

DEPENDS = 1e-6
"""Pivot over diagonal below which a row depends on others."""

_factorize, _solve = band.factorize, band.solve


@kernel()
def solve_impulses(m, H):
    """Write impulses and velocities of the rows; modes of the last step are where it begins."""
    count = H.which.size
    for i in range(count):
        if H.before[H.place[m + 2 * i]] > 0.0:  # surfaces that part already
            H.rebound[i] = 0.0
        at = H.place[m + 2 * i + 1]
        still = H.closed[i] == 1 and abs(H.before[at]) <= STILL * abs(H.free[at] - H.before[at])
        H.friction[i] = H.static[i] if still or H.stuck[i] == 1 else H.kinetic[i]
        if H.closed[i] == 1 and H.mode[i] == OPEN:
            H.mode[i] = STICK if H.kinetic[i] > 0.0 else SLIP
    H.counts[IMPULSIVE] += 1
    solved = False
    for tried in range(MOST):
        if not solve_modes(m, H):
            break
        H.counts[FACTORIZATIONS] += 1
        H.counts[MOST_IN_A_STEP] = max(H.counts[MOST_IN_A_STEP], tried + 1)
        if not change_modes(m, tried >= TOGETHER, H):
            solved = True
            break
    if solved and depends(H):
        H.counts[DEPENDENT] += 1
    if not solved:
        H.counts[SWEPT_STEPS] += 1
        if not sweep(m, H):
            H.counts[UNSOLVED] += 1


@kernel(inline=True)
def solve_modes(m, H):
    """Impulses for the present modes, and the velocities that follow; returns whether there are any."""
    size, reach = H.place.size, H.reach[0]
    H.band[:, :] = 0.0
    for a in range(size):
        for k in range(2 * reach + 1):
            H.band[a, k] = H.gram[a, k]
        H.impulse[a] = -H.free[a]
    for a in range(H.place.size):
        if H.gram[a, reach] == 0.0:  # an open latch or contact, a component that does not damp
            H.band[a, reach] = 1.0
            H.impulse[a] = 0.0
    for i in range(H.which.size):
        a, b = H.place[m + 2 * i], H.place[m + 2 * i + 1]
        if H.closed[i] == 0:
            continue
        if H.mode[i] == OPEN:
            only(a, 1.0, reach, H)
            only(b, 1.0, reach, H)
            continue
        H.band[a, reach] *= 1.0 + COMPLIANCE
        H.impulse[a] = -H.free[a] - H.rebound[i] * H.before[a]
        if H.mode[i] == STICK:
            H.band[b, reach] *= 1.0 + COMPLIANCE
            continue
        sign = 1.0 if H.mode[i] == SLIP else -1.0
        only(b, H.gram[b, reach], reach, H)
        H.band[b, a - b + reach] = -sign * H.friction[i] * H.gram[b, reach]
    if _factorize(H.band, reach, reach, H.pivots) >= 0:
        return False
    _solve(H.band, reach, reach, H.pivots, H.impulse)
    for a in range(size):
        H.velocity[a] = H.free[a] + product(a, H)
    return True


@kernel(inline=True)
def depends(H):
    """Whether a row of the factorized equations depends on others, but for its compliance."""
    reach = H.reach[0]
    least = 1.0
    for a in range(H.place.size):
        if H.gram[a, reach] > 0.0:
            least = min(least, abs(H.band[a, reach]) / H.gram[a, reach])
    return least < DEPENDS


@kernel(inline=True)
def only(a, value, reach, H):
    """Make row a of the equations a diagonal one without a right-hand side."""
    for k in range(2 * reach + 1):
        H.band[a, k] = 0.0
    H.band[a, reach] = value
    H.impulse[a] = 0.0


@kernel(inline=True)
def product(a, H):
    """Row a of G times the impulses."""
    reach, total = H.reach[0], 0.0
    for b in range(max(0, a - reach), min(H.place.size, a + reach + 1)):
        total += H.gram[a, b - a + reach] * H.impulse[b]
    return total


@kernel(inline=True)
def change_modes(m, single, H):
    """The modes that impulses and velocities ask for; returns whether one has changed."""
    changed, reach = False, H.reach[0]
    for i in range(H.which.size):
        if H.closed[i] == 0:
            continue
        a, b = H.place[m + 2 * i], H.place[m + 2 * i + 1]
        p_n, p_t, old = H.impulse[a], H.impulse[b], H.mode[i]
        new = OPEN
        if p_n - (H.velocity[a] + H.rebound[i] * H.before[a]) / H.gram[a, reach] > 0.0:
            limit, wanted = H.friction[i] * max(p_n, 0.0), p_t - H.velocity[b] / H.gram[b, reach]
            new = SLIP if wanted > limit else SLIP + 1
            # equality, as where there is no impulse yet, slips
            if abs(wanted) <= limit and limit > 0.0:
                new = STICK
            if new != STICK and H.friction[i] > H.kinetic[i]:  # it breaks away
                H.friction[i] = H.kinetic[i]
                changed = True
        if new != old:
            H.mode[i] = new
            changed = True
        if single and changed:
            break
    return changed


@kernel()
def sweep(m, H):
    """Projected Gauss-Seidel; returns whether it has converged."""
    size, reach = H.place.size, H.reach[0]
    for i in range(H.which.size):
        if H.closed[i] == 0:
            H.impulse[H.place[m + 2 * i]] = H.impulse[H.place[m + 2 * i + 1]] = 0.0
    for a in range(size):
        if not abs(H.impulse[a]) < 1e300:
            H.impulse[a] = 0.0
    done = False
    for _ in range(SWEEPS):
        H.counts[SWEPT] += 1
        moved = largest = 0.0
        for a in range(H.place.size):
            at = H.place[a]
            if not a < m and a < m + 2 * H.which.size:
                continue
            if H.gram[at, reach] > 0.0:
                old = H.impulse[at]
                H.impulse[at] -= (H.free[at] + product(at, H)) / H.gram[at, reach]
                moved, largest = max(moved, abs(H.impulse[at] - old)), max(largest, abs(H.impulse[at]))
        for i in range(H.which.size):
            if H.closed[i] == 0:
                continue
            a, b = H.place[m + 2 * i], H.place[m + 2 * i + 1]
            old, other = H.impulse[a], H.impulse[b]
            u = H.free[a] + product(a, H) + H.rebound[i] * H.before[a]
            H.impulse[a] = max(0.0, old - u / H.gram[a, reach])
            wanted = other - (H.free[b] + product(b, H)) / H.gram[b, reach]
            limit = H.friction[i] * H.impulse[a]
            H.impulse[b] = max(-limit, min(limit, wanted))
            moved = max(moved, abs(H.impulse[a] - old), abs(H.impulse[b] - other))
            largest = max(largest, H.impulse[a])
            H.mode[i] = OPEN if H.impulse[a] == 0.0 else STICK if abs(wanted) < limit else SLIP if wanted > 0.0 else SLIP + 1
        if moved <= CONVERGED * largest:
            done = True
            break
    for a in range(size):
        H.velocity[a] = H.free[a] + product(a, H)
    return done
