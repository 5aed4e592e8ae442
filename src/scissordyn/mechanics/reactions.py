"""Reactions of ideal joints, guides and drives from the Newton-Euler equations of each body.

The motion is known, so the reactions are the unknowns of linear equations, three per body. They are solved in the
least-squares sense by banded normal equations: exact where the reactions are determined, and linear in the number of bodies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from scissordyn.component.place import GROUND, Point
from scissordyn.jit import kernel
from scissordyn.kept import kept
from scissordyn.mechanics import band
from scissordyn.mechanics.band import width
from scissordyn.mechanics.reduce import body_inertia
from scissordyn.model.mechanism import Mechanism

__all__ = ["Balance", "balance", "solve_reactions"]

_factorize, _solve = band.factorize, band.solve

REDUNDANT = 1e-8
"""Below this ratio of pivots a closer look tells which reactions are determined.

With d the share of the last unknown in the null space, round-off 1e-16 shows as a pivot of 1e-16/d^2 beside another of d^2: the
smaller of the two never exceeds 1e-8.
"""

SHIFT = 1e-13
"""What is added to singular normal equations, as a share of their diagonal: beyond round-off, far below what is determined."""

REFINEMENTS = 3
"""Repetitions after which what is determined is exact to round-off."""

FEW = 6
"""Up to so many unknowns their order does not matter."""

LANES = 32
"""Instants that are solved side by side, so that the processor's vector units are used."""

PROBES = 3
"""Vectors that are tried."""

TOUCHED = 1e-4
"""An unknown is not determined if the null space has a larger share in it."""


Entry = tuple[int, tuple[float, float, float], Point, int, int]
"""Unknown, force and torque per unit of it, arm, anchor and frame: see `Balance`."""


class Balance(NamedTuple):
    """The unknown reactions and how they enter the balance of each body.

    Parameters
    ----------
    start : ndarray of int, shape (bodies + 1,)
        Entries of each body.
    unknown : ndarray of int
        Row of the ordered unknowns for each entry.
    direction : ndarray, shape (entries, 3)
        Force (x, y) and torque per unit of the unknown, in the frame of a body or of the ground; unknown torques are in units
        of `length`, so that they weigh as much as forces in a mechanism of any size.
    arm : ndarray, shape (entries, 2)
        Point of application from the mass centre of its anchor, in that body's frame [m].
    anchor, frame : ndarray of int, shape (entries,)
        Bodies that carry the point of application and the direction of the force; -1 for the ground.
    mass, inertia : ndarray, shape (bodies,)
        Inertia is zero for a body that does not rotate, whose balance of moments its guide keeps.
    length : float
        Scale of the moment equations [m].
    order : ndarray of int
        Place of each unknown (joints x, y; welds x, y, torque; guides; aligned guides' torques; drives) among the ordered ones.
    band : int
        Half bandwidth of the normal equations.
    """

    start: np.ndarray
    unknown: np.ndarray
    direction: np.ndarray
    arm: np.ndarray
    anchor: np.ndarray
    frame: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    length: float
    order: np.ndarray
    band: int


@kept
def balance(mechanism: Mechanism) -> Balance:
    """Set up the balances of all bodies.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    Balance
    """
    names = [body.name for body in mechanism.bodies]
    index = {name: k for k, name in enumerate(names)}
    entries: dict[str, list[Entry]] = {name: [] for name in names}

    def enter(
        body: str, unknown: int, direction: tuple[float, float, float], anchor: tuple[str, str], frame: str = GROUND
    ) -> None:
        arm = _arm(mechanism, *anchor)
        entries[body].append((unknown, direction, arm, index[anchor[0]], index.get(frame, -1)))

    sizes = [math.hypot(*point) for body in mechanism.bodies for point in body.points.values()]
    length = max([size for size in sizes if size > 0.0], default=1.0)
    count = 0
    for joint in mechanism.ideal_joints:
        for (body, point), sign in ((joint.journal, 1.0), (joint.bearing, -1.0)):
            if body != GROUND:
                enter(body, count, (sign, 0.0, 0.0), (body, point))
                enter(body, count + 1, (0.0, sign, 0.0), (body, point))
        count += 2
    for weld in mechanism.welds:
        for (body, point), sign in ((weld.start, 1.0), (weld.end, -1.0)):
            if body != GROUND:
                enter(body, count, (sign, 0.0, 0.0), (body, point))
                enter(body, count + 1, (0.0, sign, 0.0), (body, point))
                enter(body, count + 2, (0.0, 0.0, sign * length), (body, point))
        count += 3
    for guide in mechanism.ideal_guides:
        across = -math.sin(guide.direction), math.cos(guide.direction)
        enter(guide.follower[0], count, (*across, 0.0), guide.follower, guide.body)
        if guide.body != GROUND:
            enter(guide.body, count, (-across[0], -across[1], 0.0), guide.follower, guide.body)
        count += 1
    for guide in mechanism.ideal_guides:
        if not guide.aligned:
            continue
        enter(guide.follower[0], count, (0.0, 0.0, length), guide.follower)
        if guide.body != GROUND:
            enter(guide.body, count, (0.0, 0.0, -length), guide.follower)
        count += 1
    for drive in mechanism.drives:
        enter(drive.body, count, (0.0, 0.0, length), (drive.body, next(iter(mechanism.body(drive.body).points))))
        count += 1

    groups = [np.array([unknown for unknown, *_ in entries[name]], np.int64) for name in names]
    rows = np.concatenate([np.arange(count), *(np.repeat(group, group.size) for group in groups)])
    beside = np.concatenate([np.arange(count), *(np.tile(group, group.size) for group in groups)])
    order = np.empty(count, np.int64)
    if count <= FEW:
        order[:] = np.arange(count)
    else:
        graph = sp.csr_array((np.ones(rows.size), (rows, beside)), shape=(count, count))
        order[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(count)
    reach = int(np.max(np.abs(order[rows] - order[beside]), initial=0))

    listed = [entry for name in names for entry in entries[name]]
    return Balance(
        start=np.cumsum([0, *(len(entries[name]) for name in names)], dtype=np.int64),
        unknown=np.array([order[unknown] for unknown, *_ in listed], np.int64),
        direction=np.array([direction for _, direction, *_ in listed]).reshape(-1, 3),
        arm=np.array([arm for _, _, arm, *_ in listed]).reshape(-1, 2),
        anchor=np.array([anchor for *_, anchor, _ in listed], np.int64),
        frame=np.array([frame for *_, frame in listed], np.int64),
        mass=np.array([body.mass for body in mechanism.bodies]),
        inertia=np.array([body_inertia(mechanism, body) if body.rotates else 0.0 for body in mechanism.bodies]),
        length=length,
        order=order,
        band=reach,
    )


def _arm(mechanism: Mechanism, body: str, point: str) -> tuple[float, float]:
    """A point from the mass centre, in the body's frame [m]."""
    described = mechanism.body(body)
    x, y = described.points[point]
    return x - described.centre[0], y - described.centre[1]


@kernel(inline=True)
def body_rows(B, body, first, lanes, gravity, direction, position, acceleration, angular_acceleration, known, rows, right):
    """Write the balance of a body at some instants: `rows` (3, entries, lanes) of the unknowns, `right` (3, lanes)."""
    rotates = B.inertia[body] > 0.0
    for lane in range(lanes):
        at = first + lane
        right[0, lane] = B.mass[body] * (acceleration[at, body, 0] - gravity[0]) - known[at, body, 0]
        right[1, lane] = B.mass[body] * (acceleration[at, body, 1] - gravity[1]) - known[at, body, 1]
        moment = B.inertia[body] * angular_acceleration[at, body] - known[at, body, 2]
        right[2, lane] = moment / B.length if rotates else 0.0
    start = B.start[body]
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
            rows[2, i - start, lane] = (ax * fy - ay * fx + B.direction[i, 2]) / B.length if rotates else 0.0


@kernel()
def normal_equations(
    B, first, lanes, gravity, direction, position, acceleration, angular_acceleration, known, matrix, rows, right, load
):
    """Write the normal equations at some instants: `matrix` (unknowns, band + 1, lanes) from the diagonal down, and `load`."""
    matrix[:, :, :] = 0.0
    load[:, :] = 0.0
    for body in range(B.mass.size):
        body_rows(B, body, first, lanes, gravity, direction, position, acceleration, angular_acceleration, known, rows, right)
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


@kernel()
def solve_lanes(reach, matrix, load):
    """Solve symmetric positive definite banded equations side by side, in place: L D L^T without row exchanges."""
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


@kernel()
def careful(reach, lanes, lane, matrix, load, full, pivots, work, probe, x):
    """Solve the equations of one lane; an unknown that is not determined becomes NaN.

    Where the normal equations N x = l are singular, N + s leaves x as it is in what is determined, to s over the square of a
    singular value, and each repetition with l + s x brings that factor once more (iterated Tikhonov regularisation). The
    same solution applied to s times any vector leaves its part in the null space: an unknown with none is determined. One
    vector may by chance be orthogonal to the null space while that turns with the bodies, several are not.
    """
    size, scale = x.size, 0.0
    full[:, :] = 0.0
    for row in range(size):
        for below in range(min(reach, row) + 1):
            full[row, reach - below] = matrix[row, below, lane]
            full[row - below, reach + below] = matrix[row, below, lane]
        scale = max(scale, full[row, reach])
        x[row] = work[row] = load[row, lane]
    shift = SHIFT * scale
    for row in range(size):
        full[row, reach] += shift
    _factorize(full, reach, reach, pivots)
    _solve(full, reach, reach, pivots, x)
    for _ in range(REFINEMENTS):
        for row in range(size):
            x[row] = work[row] + shift * x[row]
        _solve(full, reach, reach, pivots, x)
    for vector in range(PROBES):
        for row in range(size):
            probe[row] = math.cos((vector + 1.0) * row * row + vector + 1.0)  # as good as random
        for _ in range(2):
            for row in range(size):
                probe[row] *= shift
            _solve(full, reach, reach, pivots, probe)
        for row in range(size):
            if not abs(probe[row]) < TOUCHED:
                x[row] = math.nan


@kernel(inline=True)
def keep(W):
    """Keep the equations, which the solution overwrites."""
    for row in range(W.load.shape[0]):
        for lane in range(W.load.shape[1]):
            W.kept_load[row, lane] = W.load[row, lane]
            for below in range(W.kept.shape[1]):
                W.kept[row, below, lane] = W.matrix[row, below, lane]


@kernel()
def fill(B, gravity, direction, position, acceleration, angular_acceleration, known, W, out):
    """Solve the balances at each instant; direction, position, acceleration (nt, bodies, 2), known (nt, bodies, 3)."""
    reach, size = B.band, out.shape[1]
    first = 0
    while first < out.shape[0]:
        lanes = min(LANES, out.shape[0] - first)
        normal_equations(
            B,
            first,
            lanes,
            gravity,
            direction,
            position,
            acceleration,
            angular_acceleration,
            known,
            W.matrix,
            W.rows,
            W.right,
            W.load,
        )
        for lane in range(lanes, LANES):  # empty lanes must divide by something
            for row in range(size):
                W.matrix[row, 0, lane] = 1.0
        keep(W)
        solve_lanes(reach, W.matrix, W.load)
        for lane in range(lanes):
            smallest = largest = W.matrix[0, 0, lane]
            for row in range(size):
                out[first + lane, row] = W.load[row, lane]
                smallest, largest = min(smallest, W.matrix[row, 0, lane]), max(largest, W.matrix[row, 0, lane])
            if not smallest > REDUNDANT * largest:
                careful(reach, lanes, lane, W.kept, W.kept_load, W.full, W.pivots, W.work, W.probe, out[first + lane])
        first += lanes


class _Work(NamedTuple):
    matrix: np.ndarray
    kept: np.ndarray
    rows: np.ndarray
    right: np.ndarray
    load: np.ndarray
    kept_load: np.ndarray
    full: np.ndarray
    pivots: np.ndarray
    work: np.ndarray
    probe: np.ndarray


def solve_reactions(
    mechanism: Mechanism,
    *,
    direction: np.ndarray,
    position: np.ndarray,
    acceleration: np.ndarray,
    angular_acceleration: np.ndarray,
    known: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reactions of ideal joints, guides and drives at many instants.

    Parameters
    ----------
    mechanism : Mechanism
    direction : ndarray, shape (nt, bodies, 2)
        Cosine and sine of the angle of each body.
    position : ndarray, shape (nt, bodies, 2)
        Of the mass centres [m].
    acceleration : ndarray, shape (nt, bodies, 2)
        Of the mass centres [m/s^2].
    angular_acceleration : ndarray, shape (nt, bodies)
        [rad/s^2]
    known : ndarray, shape (nt, bodies, 3)
        Sum of the known forces on each body [N] and of their moments about its mass centre [N m], gravity apart.

    Returns
    -------
    joints : ndarray, shape (nt, ideal joints, 2)
        Force on the journal [N]; NaN where it is not determined.
    guides : ndarray, shape (nt, ideal guides)
        Force on the follower across the guide, to the left of its direction [N].
    torques : ndarray, shape (nt, drives)
        Torque on the driven body [N m].
    """
    parts = balance(mechanism)
    instants, unknowns = direction.shape[0], parts.order.size
    values = np.zeros((instants, unknowns))
    if unknowns:
        gravity = mechanism.gravity * np.array([math.cos(mechanism.gravity_direction), math.sin(mechanism.gravity_direction)])
        widest, reach = int(np.max(np.diff(parts.start))), parts.band
        work = _Work(
            matrix=np.zeros((unknowns, 2 * reach + 1, LANES)),
            kept=np.zeros((unknowns, reach + 1, LANES)),
            rows=np.zeros((3, widest, LANES)),
            right=np.zeros((3, LANES)),
            load=np.zeros((unknowns, LANES)),
            kept_load=np.zeros((unknowns, LANES)),
            full=np.zeros((unknowns, width(reach, reach))),
            pivots=np.zeros(unknowns, np.int64),
            work=np.zeros(unknowns),
            probe=np.zeros(unknowns),
        )
        fill(parts, gravity, direction, position, acceleration, angular_acceleration, known, work, values)
    values = values[:, parts.order]
    joints, guides = 2 * len(mechanism.ideal_joints), len(mechanism.ideal_guides)
    welds = joints + 3 * len(mechanism.welds)
    reactions = values[:, :joints].reshape(instants, joints // 2, 2)
    return reactions, values[:, welds : welds + guides], parts.length * values[:, values.shape[1] - len(mechanism.drives) :]
