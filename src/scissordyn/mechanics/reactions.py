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

from scissordyn.jit import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.band import width
from scissordyn.mechanics.layout import Layout, turning_inertia
from scissordyn.mechanics.outputs import Record
from scissordyn.model.body import GROUND, Point
from scissordyn.model.element import Force, Spring, TravelStop
from scissordyn.model.mechanism import Mechanism

__all__ = ["Balance", "balance", "connection_forces", "journal_forces", "known_loads", "solve_reactions"]

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
        Force (x, y) and torque per unit of the unknown, in the frame of a body or of the ground.
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
                enter(body, count + 2, (0.0, 0.0, sign), (body, point))
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
        enter(guide.follower[0], count, (0.0, 0.0, 1.0), guide.follower)
        if guide.body != GROUND:
            enter(guide.body, count, (0.0, 0.0, -1.0), guide.follower)
        count += 1
    for drive in mechanism.drives:
        enter(drive.body, count, (0.0, 0.0, 1.0), (drive.body, next(iter(mechanism.body(drive.body).points))))
        count += 1

    groups = [np.array([unknown for unknown, *_ in entries[name]], np.int64) for name in names]
    rows = np.concatenate([np.arange(count), *(np.repeat(group, group.size) for group in groups)])
    beside = np.concatenate([np.arange(count), *(np.tile(group, group.size) for group in groups)])
    order = np.empty(count, np.int64)
    if count:
        graph = sp.csr_array((np.ones(rows.size), (rows, beside)), shape=(count, count))
        order[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(count)
    reach = int(np.max(np.abs(order[rows] - order[beside]), initial=0))

    listed = [entry for name in names for entry in entries[name]]
    sizes = [math.hypot(*point) for body in mechanism.bodies for point in body.points.values()]
    return Balance(
        start=np.cumsum([0, *(len(entries[name]) for name in names)], dtype=np.int64),
        unknown=np.array([order[unknown] for unknown, *_ in listed], np.int64),
        direction=np.array([direction for _, direction, *_ in listed]).reshape(-1, 3),
        arm=np.array([arm for _, _, arm, *_ in listed]).reshape(-1, 2),
        anchor=np.array([anchor for *_, anchor, _ in listed], np.int64),
        frame=np.array([frame for *_, frame in listed], np.int64),
        mass=np.array([body.mass for body in mechanism.bodies]),
        inertia=np.array([turning_inertia(mechanism, body) if body.rotates else 0.0 for body in mechanism.bodies]),
        length=max([size for size in sizes if size > 0.0], default=1.0),
        order=order,
        band=reach,
    )


def journal_forces(found: Record) -> np.ndarray:
    """Contact forces -F_n n - F_t t on the journals of the loose joints, shape (nt, nj, 2) [N]."""
    normal, tangential, nx, ny = np.moveaxis(found.joint[..., 4:8], -1, 0)
    return np.stack([-normal * nx + tangential * ny, -normal * ny - tangential * nx], axis=-1)


def known_loads(layout: Layout, direction: np.ndarray, position: np.ndarray, found: Record, radius: np.ndarray) -> np.ndarray:
    """Forces of loose joints, springs, loads, motors, massless links and latches on the bodies.

    Parameters
    ----------
    layout : Layout
    direction, position : ndarray, shape (nt, bodies, 2)
        Cosine and sine of each body's angle, and where its mass centre is [m].
    found : Record
    radius : ndarray, shape (nj, 2)
        Clearance and journal radius of the loose joints [m].

    Returns
    -------
    ndarray, shape (nt, bodies, 3)
        Force [N] and moment about the mass centre [N m].
    """
    mechanism = layout.mechanism
    index = {body.name: k for k, body in enumerate(mechanism.bodies)}
    known = np.zeros((*direction.shape[:2], 3))
    on_journals = journal_forces(found)

    def push(body: str, point: str, force: np.ndarray) -> None:
        if body == GROUND:
            return
        k, (x, y) = index[body], _arm(mechanism, body, point)
        cos, sin = direction[:, k, 0], direction[:, k, 1]
        known[:, k, :2] += force
        known[:, k, 2] += (cos * x - sin * y) * force[:, 1] - (sin * x + cos * y) * force[:, 0]

    def turn(body: str, torque: np.ndarray) -> None:
        if body != GROUND:
            known[:, index[body], 2] += torque

    for j, joint in enumerate(mechanism.clearance_joints):
        force, tangential = on_journals[:, j], found.joint[:, j, 5]
        push(*joint.journal, force)
        push(*joint.bearing, -force)
        turn(joint.journal[0], -radius[j, 1] * tangential)
        turn(joint.bearing[0], (radius[j, 1] + found.joint[:, j, 8]) * tangential)
    for j, corner in enumerate(mechanism.contact_points, start=len(mechanism.clearance_joints)):
        force, contact = on_journals[:, j], found.joint[:, j]
        k, (x, y) = index[corner.follower], mechanism.body(corner.follower).centre
        cos, sin = direction[:, k, 0], direction[:, k, 1]
        x, y = corner.centre[0] - x, corner.centre[1] - y
        tip = position[:, k] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=1) + radius[j, 1] * contact[:, 6:8]
        for body, sign in ((corner.follower, 1.0), (corner.body, -1.0)):
            if body != GROUND:
                arm = tip - position[:, index[body]]
                known[:, index[body], :2] += sign * force
                turn(body, sign * (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]))
    for i, element in enumerate(mechanism.elements):
        force, torque = found.element[:, i, :2], found.element[:, i, 2]
        if isinstance(element, Spring):
            push(*element.end, force)
            push(*element.start, -force)
        elif isinstance(element, Force | TravelStop):
            push(*element.point, force)
        else:
            turn(element.body, torque)
            turn(element.base, -torque)
    thrust, held = connection_forces(layout, found)
    for i, link in enumerate(mechanism.rods):
        push(*link.end, thrust[:, i])
        push(*link.start, -thrust[:, i])
    for i, latch in enumerate(mechanism.latches):
        turn(latch.body, held[:, i])
        turn(latch.base, -held[:, i])
    return known


def connection_forces(layout: Layout, found: Record) -> tuple[np.ndarray, np.ndarray]:
    """Forces of massless links on their ends, shape (nt, links, 2) [N], and torques of latches on their bodies [N m]."""
    mechanism, instants = layout.mechanism, found.X.shape[0]
    owner = {condition.name: k for k, condition in enumerate(layout.conditions) if condition.name}
    thrust = np.zeros((instants, len(mechanism.rods), 2))
    for i, link in enumerate(mechanism.rods):
        ((_, form),) = layout.conditions[owner[link.name]].parts
        thrust[:, i] = -found.multiplier[:, owner[link.name], None] * (found.X[:, form.columns] @ form.rows.T)
    held = -found.multiplier[:, [owner[latch.name] for latch in mechanism.latches]]
    return thrust, held


def _arm(mechanism: Mechanism, body: str, point: str) -> tuple[float, float]:
    """A point from the mass centre, in the body's frame [m]."""
    described = mechanism.body(body)
    x, y = described.points[point]
    return x - described.centre[0], y - described.centre[1]


@kernel(inline=True)
def normal_equations(B, instant, gravity, direction, position, acceleration, spin_rate, known, matrix, rows, right, x):
    """Write the normal equations of the balances at an instant into `matrix` and `x`."""
    lower = B.band
    matrix[:, :] = 0.0
    x[:] = 0.0
    for body in range(B.mass.size):
        right[0] = B.mass[body] * (acceleration[instant, body, 0] - gravity[0]) - known[instant, body, 0]
        right[1] = B.mass[body] * (acceleration[instant, body, 1] - gravity[1]) - known[instant, body, 1]
        right[2] = B.inertia[body] * spin_rate[instant, body] - known[instant, body, 2]
        rotates = B.inertia[body] > 0.0
        right[2] = right[2] / B.length if rotates else 0.0
        first, last = B.start[body], B.start[body + 1]
        for i in range(first, last):
            fx, fy = B.direction[i, 0], B.direction[i, 1]
            if B.frame[i] >= 0:
                cos, sin = direction[instant, B.frame[i], 0], direction[instant, B.frame[i], 1]
                fx, fy = cos * fx - sin * fy, sin * fx + cos * fy
            anchor = B.anchor[i]
            cos, sin = direction[instant, anchor, 0], direction[instant, anchor, 1]
            ax = cos * B.arm[i, 0] - sin * B.arm[i, 1] + position[instant, anchor, 0] - position[instant, body, 0]
            ay = sin * B.arm[i, 0] + cos * B.arm[i, 1] + position[instant, anchor, 1] - position[instant, body, 1]
            rows[0, i - first], rows[1, i - first] = fx, fy
            rows[2, i - first] = (ax * fy - ay * fx + B.direction[i, 2]) / B.length if rotates else 0.0
        for i in range(first, last):
            row = B.unknown[i]
            for r in range(3):
                x[row] += rows[r, i - first] * right[r]
                for k in range(first, last):
                    matrix[row, B.unknown[k] - row + lower] += rows[r, i - first] * rows[r, k - first]


@kernel()
def fill(
    B, gravity, direction, position, acceleration, spin_rate, known, matrix, pivots, rows, right, load, probe, refine, out
):
    """Solve the balances at each instant; an unknown that is not determined there becomes NaN.

    direction, position and acceleration (nt, bodies, 2), spin_rate (nt, bodies), known (nt, bodies, 3); out (nt, unknowns).

    Where the normal equations N x = l are singular, N + s leaves x as it is in what is determined, to s over the square of a
    singular value, and each repetition with l + s x brings that factor once more (iterated Tikhonov regularisation). The
    same solution applied to s times any vector leaves its part in the null space: an unknown with none is determined. One
    vector may by chance be square to the null space while that turns with the bodies, several are not.
    """
    lower = B.band
    for instant in range(out.shape[0]):
        x = out[instant]
        shift = 0.0
        for attempt in range(2):
            normal_equations(B, instant, gravity, direction, position, acceleration, spin_rate, known, matrix, rows, right, x)
            scale = 0.0
            for row in range(x.size):
                scale = max(scale, matrix[row, lower])
                matrix[row, lower] += shift
            singular = _factorize(matrix, lower, lower, pivots) >= 0
            smallest = largest = abs(matrix[0, lower])
            for row in range(1, x.size):
                smallest, largest = min(smallest, abs(matrix[row, lower])), max(largest, abs(matrix[row, lower]))
            if attempt == 0:
                if smallest > REDUNDANT * largest and not singular:
                    _solve(matrix, lower, lower, pivots, x)
                    break
                shift = SHIFT * scale
                continue
            for row in range(x.size):
                load[row] = x[row]
            _solve(matrix, lower, lower, pivots, x)
            for _ in range(REFINEMENTS):
                for row in range(x.size):
                    refine[row] = load[row] + shift * x[row]
                _solve(matrix, lower, lower, pivots, refine)
                for row in range(x.size):
                    x[row] = refine[row]
            for vector in range(PROBES):
                for row in range(x.size):
                    probe[row] = math.cos((vector + 1.0) * row * row + vector + 1.0)  # as good as random
                for _ in range(2):
                    for row in range(x.size):
                        probe[row] *= shift
                    _solve(matrix, lower, lower, pivots, probe)
                for row in range(x.size):
                    if not abs(probe[row]) < TOUCHED:
                        x[row] = math.nan


def solve_reactions(
    mechanism: Mechanism,
    *,
    direction: np.ndarray,
    position: np.ndarray,
    acceleration: np.ndarray,
    spin_rate: np.ndarray,
    known: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reactions of ideal joints, guides and drives at many instants.

    Parameters
    ----------
    mechanism : Mechanism
    direction : ndarray, shape (nt, bodies, 2)
        Cosine and sine of each body's angle.
    position : ndarray, shape (nt, bodies, 2)
        Of the mass centres [m].
    acceleration : ndarray, shape (nt, bodies, 2)
        Of the mass centres [m/s^2].
    spin_rate : ndarray, shape (nt, bodies)
        Angular accelerations [rad/s^2].
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
        widest = int(np.max(np.diff(parts.start)))
        matrix, pivots = np.zeros((unknowns, width(parts.band, parts.band))), np.zeros(unknowns, np.int64)
        work = np.zeros((3, widest)), np.zeros(3), np.zeros(unknowns), np.zeros(unknowns), np.zeros(unknowns)
        fill(parts, gravity, direction, position, acceleration, spin_rate, known, matrix, pivots, *work, values)
    values = values[:, parts.order]
    joints, guides = 2 * len(mechanism.ideal_joints), len(mechanism.ideal_guides)
    welds = joints + 3 * len(mechanism.welds)
    reactions = values[:, :joints].reshape(instants, joints // 2, 2)
    return reactions, values[:, welds : welds + guides], values[:, values.shape[1] - len(mechanism.drives) :]
