"""The balances of force and moment of all bodies, with the reactions of ideal joints, guides and drives as unknowns."""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from scissordyn.component.place import GROUND, Point
from scissordyn.mechanics.reactions import Balance
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.linear_constraints import body_inertia

__all__ = ["balance"]

FEW = 6
"""Up to so many unknowns their order does not matter."""

Entry = tuple[int, tuple[float, float, float], Point, int, int]
"""Unknown, force and torque per unit of it, arm, anchor and frame: see `Balance`."""


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
    joints = 0, count
    for weld in mechanism.welds:
        for (body, point), sign in ((weld.start, 1.0), (weld.end, -1.0)):
            if body != GROUND:
                enter(body, count, (sign, 0.0, 0.0), (body, point))
                enter(body, count + 1, (0.0, sign, 0.0), (body, point))
                enter(body, count + 2, (0.0, 0.0, sign * length), (body, point))
        count += 3
    first_guide = count
    for guide in mechanism.ideal_guides:
        across = -math.sin(guide.direction), math.cos(guide.direction)
        enter(guide.follower[0], count, (*across, 0.0), guide.follower, guide.body)
        if guide.body != GROUND:
            enter(guide.body, count, (-across[0], -across[1], 0.0), guide.follower, guide.body)
        count += 1
    guides = first_guide, count
    for guide in mechanism.ideal_guides:
        if not guide.aligned:
            continue
        enter(guide.follower[0], count, (0.0, 0.0, length), guide.follower)
        if guide.body != GROUND:
            enter(guide.body, count, (0.0, 0.0, -length), guide.follower)
        count += 1
    first_drive = count
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
        joints=joints,
        guides=guides,
        drives=(first_drive, count),
    )


def _arm(mechanism: Mechanism, body: str, point: str) -> tuple[float, float]:
    """A point from the mass centre, in the body's frame [m]."""
    described = mechanism.body(body)
    x, y = described.points[point]
    return x - described.centre[0], y - described.centre[1]
