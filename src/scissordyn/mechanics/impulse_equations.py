"""The equations of a step for the impulses of rows, where the mode of each closed contact is given; see `impulse_solver`."""

from __future__ import annotations

from scissordyn.kernel import kernel
from scissordyn.mechanics.hard_rows import OPEN, SLIP, STICK

COMPLIANCE = 1e-11  # Of surfaces, as a part of what a free journal would yield, where rows depend on each other


@kernel
def write_equations(m, first, H):
    """Write the equations of the present modes from one row on."""
    size, reach = H.place.size, H.reach[0]
    for a in range(first, size):
        for k in range(2 * reach + 1):
            H.band[a, k] = H.gram[a, k]
        for k in range(2 * reach + 1, H.band.shape[1]):
            H.band[a, k] = 0.0
        H.right[a] = -H.free[a]
        if H.gram[a, reach] == 0.0:  # an open latch or contact, a component that does not damp
            H.band[a, reach] = 1.0
            H.right[a] = 0.0
    for i in range(H.which.size):
        a, b = H.place[m + 2 * i], H.place[m + 2 * i + 1]
        if H.closed[i] == 1 and a >= first:
            write_normal(i, a, H)
        if H.closed[i] == 1 and b >= first:
            write_tangential(i, a, b, H)


@kernel
def write_normal(i, a, H):
    """Write the row N of a closed contact."""
    if H.mode[i] == OPEN:
        only(a, H)
        return
    H.band[a, H.reach[0]] = H.band[a, H.reach[0]] * (1.0 + COMPLIANCE) + H.compliance[i]
    H.right[a] = -H.free[a] - H.offset[i]


@kernel
def write_tangential(i, a, b, H):
    """Write the row T of a closed contact, whose row N is a."""
    reach = H.reach[0]
    if H.mode[i] == OPEN:
        only(b, H)
        return
    if H.mode[i] == STICK:
        H.band[b, reach] *= 1.0 + COMPLIANCE
        return
    sign = 1.0 if H.mode[i] == SLIP else -1.0
    # P_T + turning_mass U_T = lag + friction, times G_TT
    mass, turned = H.gram[b, reach], H.turning_mass[i] * H.gram[b, reach]
    for k in range(2 * reach + 1):
        H.band[b, k] = turned * H.gram[b, k]
    H.band[b, reach] += mass
    H.band[b, a - b + reach] -= sign * H.friction[i] * mass
    H.right[b] = mass * H.lag[i] - turned * H.free[b]


@kernel
def only(a, H):
    """Make row a of the equations a diagonal one without a right-hand side."""
    for k in range(2 * H.reach[0] + 1):
        H.band[a, k] = 0.0
    H.band[a, H.reach[0]] = 1.0
    H.right[a] = 0.0
