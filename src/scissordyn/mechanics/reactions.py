"""Forces and moments of ideal joints, welds, guides and drives from the Newton-Euler equations of each body.

The motion is known, so the reactions are the unknowns of linear equations, three per body. They are solved as least squares by
banded normal equations: exact for determined reactions, with a cost linear in the number of bodies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scissordyn.kernel import F1, F2, F3, I1, entry, kernel, vectorized_loops
from scissordyn.mechanics import band
from scissordyn.mechanics.balance import Balance
from scissordyn.mechanics.band import width
from scissordyn.mechanics.sample import Record

DETERMINED_RATIO_MIN = 1e-8
"""Smallest pivot ratio of the equations of reactions without a check by `careful` which reactions are determined.

With d the share of the last unknown in the null space, the round-off 1e-16 gives a pivot of 1e-16/d^2 next to another of d^2.
The smaller of the two never exceeds 1e-8.
"""

DIAGONAL_SHIFT = 1e-13
"""Shift of the diagonal of singular normal equations, relative to it: above round-off, far below determined values."""

INSTANT_LANES = 32  # Number of instants whose reactions are solved at once, to use the processor's vector units
NULL_SHARE_MAX = 1e-4  # Largest share of a reaction in the null space with which the reaction counts as determined


@kernel
def body_right(B, body, first, lanes, gravity, acceleration, angular_acceleration, applied_load, right):
    """Write the right-hand side of the balance of a body at some instants, (3, lanes)."""
    turns = B.moments[body] == 1
    for lane in range(lanes):
        at = first + lane
        right[0, lane] = B.mass[body] * (acceleration[at, body, 0] - gravity[0]) - applied_load[at, body, 0]
        right[1, lane] = B.mass[body] * (acceleration[at, body, 1] - gravity[1]) - applied_load[at, body, 1]
        moment = B.inertia[body] * angular_acceleration[at, body] - applied_load[at, body, 2]
        right[2, lane] = moment / B.length if turns else 0.0


@kernel
def body_rows(B, body, first, lanes, direction, position, rows):
    """Write the coefficients of the unknowns in the balance of a body at some instants, (3, entries, lanes)."""
    turns, start = B.moments[body] == 1, B.start[body]
    for i in range(start, B.start[body + 1]):
        anchor, frame = B.anchor[i], B.frame[i]
        for lane in range(lanes):
            at = first + lane
            fx, fy = B.direction[i, 0], B.direction[i, 1]
            if frame >= 0:
                cos, sin = direction[at, frame, 0], direction[at, frame, 1]
                fx, fy = cos * fx - sin * fy, sin * fx + cos * fy
            cos, sin = direction[at, anchor, 0], direction[at, anchor, 1]
            ax = cos * B.arm[i, 0] - sin * B.arm[i, 1] + position[at, anchor, 0] - position[at, body, 0]
            ay = sin * B.arm[i, 0] + cos * B.arm[i, 1] + position[at, anchor, 1] - position[at, body, 1]
            rows[0, i - start, lane], rows[1, i - start, lane] = fx, fy
            rows[2, i - start, lane] = (ax * fy - ay * fx + B.direction[i, 2]) / B.length if turns else 0.0


@vectorized_loops
def normal_equations(B, first, lanes, gravity, direction, position, acceleration, angular_acceleration, applied_load, W):
    """Write the normal equations at some instants: `matrix` (unknowns, band + 1, lanes) from the diagonal down, and `load`."""
    matrix, rows, right, load = W.matrix, W.rows, W.right, W.load
    matrix[:, :, :] = 0.0
    load[:, :] = 0.0
    for body in range(B.mass.size):
        body_right(B, body, first, lanes, gravity, acceleration, angular_acceleration, applied_load, right)
        body_rows(B, body, first, lanes, direction, position, rows)
        start, stop = B.start[body], B.start[body + 1]
        for i in range(start, stop):
            row = B.unknown[i]
            for r in range(3):
                for lane in range(lanes):
                    load[row, lane] += rows[r, i - start, lane] * right[r, lane]
            for k in range(start, stop):
                below = row - B.unknown[k]
                if below >= 0:
                    for r in range(3):
                        for lane in range(lanes):
                            matrix[row, below, lane] += rows[r, i - start, lane] * rows[r, k - start, lane]


@vectorized_loops
def solve_lanes(reach, matrix, load):
    """Solve symmetric positive definite banded equations for all lanes, in place: L D L^T without row exchanges."""
    size, lanes = matrix.shape[0], matrix.shape[2]
    for j in range(size):
        for below in range(1, min(reach, size - 1 - j) + 1):
            i = j + below
            for lane in range(lanes):
                factor = matrix[i, below, lane] / matrix[j, 0, lane]
                load[i, lane] -= factor * load[j, lane]
                matrix[j, reach + below, lane] = factor
            for other in range(1, below + 1):
                for lane in range(lanes):
                    matrix[i, below - other, lane] -= matrix[j, reach + below, lane] * matrix[j + other, other, lane]
    for i in range(size - 1, -1, -1):
        for lane in range(lanes):
            load[i, lane] /= matrix[i, 0, lane]
        for below in range(1, min(reach, size - 1 - i) + 1):
            for lane in range(lanes):
                load[i, lane] -= matrix[i, reach + below, lane] * load[i + below, lane]


@kernel
def sides_of_one(B, gravity, direction, position, acceleration, angular_acceleration, applied_load, matrix, rows, right, load):
    """Write normal equations with several right-hand sides: `matrix` (unknowns, 2 band + 1, 1), `load` (unknowns, sides)."""
    matrix[:, :, :] = 0.0
    load[:, :] = 0.0
    sides = load.shape[1]
    for body in range(B.mass.size):
        body_right(B, body, 0, sides, gravity, acceleration, angular_acceleration, applied_load, right)
        body_rows(B, body, 0, 1, direction, position, rows)
        start, stop = B.start[body], B.start[body + 1]
        for i in range(start, stop):
            row = B.unknown[i]
            for r in range(3):
                for side in range(sides):
                    load[row, side] += rows[r, i - start, 0] * right[r, side]
            for k in range(start, stop):
                below = row - B.unknown[k]
                if below >= 0:
                    for r in range(3):
                        matrix[row, below, 0] += rows[r, i - start, 0] * rows[r, k - start, 0]


@kernel
def solve_sides(reach, matrix, load):
    """Solve banded equations with several right-hand sides in place; the order of operations is that of `solve_lanes`."""
    size, sides = load.shape[0], load.shape[1]
    for j in range(size):
        for below in range(1, min(reach, size - 1 - j) + 1):
            i = j + below
            factor = matrix[i, below, 0] / matrix[j, 0, 0]
            matrix[j, reach + below, 0] = factor
            for side in range(sides):
                load[i, side] -= factor * load[j, side]
            for other in range(1, below + 1):
                matrix[i, below - other, 0] -= factor * matrix[j + other, other, 0]
    for i in range(size - 1, -1, -1):
        for side in range(sides):
            load[i, side] /= matrix[i, 0, 0]
        for below in range(1, min(reach, size - 1 - i) + 1):
            factor = matrix[i, reach + below, 0]
            for side in range(sides):
                load[i, side] -= factor * load[i + below, side]


@kernel
def careful(reach, lanes, lane, matrix, load, full, pivots, work, probe, x):
    """Solve the equations of one lane; an undetermined unknown becomes NaN.

    For singular normal equations N x = l, the shift N + s changes determined unknowns by s over the square of a singular value.
    Each repetition with l + s x multiplies this error by the same factor (iterated Tikhonov regularisation). The same solution
    applied to s times a test vector yields its part in the null space: an unknown without such a part is determined. One vector
    may be orthogonal to the null space by chance at some position, several are not.
    """
    size, scale = x.size, 0.0
    full[:, :] = 0.0
    for row in range(size):
        for below in range(min(reach, row) + 1):
            full[row, reach - below] = matrix[row, below, lane]
            full[row - below, reach + below] = matrix[row, below, lane]
        scale = max(scale, full[row, reach])
        x[row] = work[row] = load[row, lane]
    shift = DIAGONAL_SHIFT * scale
    for row in range(size):
        full[row, reach] += shift
    band.factorize(full, reach, reach, pivots)
    band.solve(full, reach, pivots, x)
    for _ in range(3):  # determined values are then exact up to round-off
        for row in range(size):
            x[row] = work[row] + shift * x[row]
        band.solve(full, reach, pivots, x)
    for vector in range(3):  # test vectors of the null space
        for row in range(size):
            probe[row] = math.cos((vector + 1.0) * row * row + vector + 1.0)  # pseudo-random
        for _ in range(2):
            for row in range(size):
                probe[row] *= shift
            band.solve(full, reach, pivots, probe)
        for row in range(size):
            if not abs(probe[row]) < NULL_SHARE_MAX:
                x[row] = math.nan


class Scratch(NamedTuple):
    """Scratch arrays of `fill`, which solves the balances of the bodies for the reactions."""

    matrix: F3
    rows: F3
    right: F2
    load: F2
    full: F2
    pivots: I1
    work: F1
    probe: F1
    determined: I1  # (lanes,) 1 if every reaction is


@entry
def fill(
    B: Balance,
    gravity: F1,
    direction: F3,
    position: F3,
    acceleration: F3,
    angular_acceleration: F2,
    applied_load: F3,
    W: Scratch,
    out: F2,
) -> None:
    """Solve the balances at each instant; direction, position, acceleration (nt, bodies, 2), applied_load (nt, bodies, 3)."""
    reach, size = B.band, out.shape[1]
    first = 0
    while first < out.shape[0]:
        lanes = min(INSTANT_LANES, out.shape[0] - first)
        normal_equations(B, first, lanes, gravity, direction, position, acceleration, angular_acceleration, applied_load, W)
        for lane in range(lanes, INSTANT_LANES):  # empty lanes must have a nonzero divisor
            for row in range(size):
                W.matrix[row, 0, lane] = 1.0
        solve_lanes(reach, W.matrix, W.load)
        undetermined = False
        for lane in range(lanes):
            smallest = largest = W.matrix[0, 0, lane]
            for row in range(size):
                out[first + lane, row] = W.load[row, lane]
                smallest, largest = min(smallest, W.matrix[row, 0, lane]), max(largest, W.matrix[row, 0, lane])
            W.determined[lane] = 1 if smallest > DETERMINED_RATIO_MIN * largest else 0
            undetermined = undetermined or W.determined[lane] == 0
        if undetermined:  # the solution has overwritten the equations
            normal_equations(B, first, lanes, gravity, direction, position, acceleration, angular_acceleration, applied_load, W)
        for lane in range(lanes):
            if W.determined[lane] == 0:
                careful(reach, lanes, lane, W.matrix, W.load, W.full, W.pivots, W.work, W.probe, out[first + lane])
        first += lanes


class Reactions(NamedTuple):
    """Forces and moments of ideal joints at some instants; NaN if they are not determined."""

    joints: np.ndarray  # (nt, ideal joints, 2) Forces on the journals [N]
    weld_forces: np.ndarray  # (nt, welds, 2) Forces on the start's bodies [N]
    weld_moments: np.ndarray  # (nt, welds) Moments on the start's bodies, about the weld [N m]
    guides: np.ndarray  # (nt, ideal guides) Forces on the followers, across the guide [N]
    guide_moments: np.ndarray  # (nt, guides with a moment) Moments on the followers, about the guided points [N m]


def solve_reactions(parts: Balance, gravity: np.ndarray, outputs: Record) -> Reactions:
    """Compute forces and moments of ideal joints, welds and guides at many instants; `gravity` (2,) [m/s^2]."""
    instants, unknowns = outputs.direction.shape[0], parts.order.size
    values = np.zeros((instants, unknowns))
    if unknowns:
        widest, reach = int(np.max(np.diff(parts.start))), parts.band
        work = Scratch(
            matrix=np.zeros((unknowns, 2 * reach + 1, INSTANT_LANES)),
            rows=np.zeros((3, widest, INSTANT_LANES)),
            right=np.zeros((3, INSTANT_LANES)),
            load=np.zeros((unknowns, INSTANT_LANES)),
            full=np.zeros((unknowns, width(reach, reach))),
            pivots=np.zeros(2 * unknowns, np.int64),
            work=np.zeros(unknowns),
            probe=np.zeros(unknowns),
            determined=np.zeros(INSTANT_LANES, np.int64),
        )
        motion = outputs.direction, outputs.position, outputs.acceleration, outputs.angular_acceleration, outputs.load
        fill(parts, gravity, *motion, work, values)
    values = values[:, parts.order]
    joints, welds, guides, moments = (
        values[:, first:last] for first, last in (parts.joints, parts.welds, parts.guides, parts.guide_moments)
    )
    welds = welds.reshape(instants, welds.shape[1] // 3, 3)
    return Reactions(
        joints.reshape(instants, joints.shape[1] // 2, 2),
        welds[:, :, :2],
        parts.length * welds[:, :, 2],
        guides,
        parts.length * moments,
    )
