"""The balances of force and moment of all bodies, with the reactions of ideal joints, guides and drives as unknowns."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np

from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.mechanics.reactions import Balance
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.bodies import arm_of
from scissordyn.plan.linear_constraints import body_inertia
from scissordyn.plan.ordering import coupled, reach, reverse_cuthill_mckee

FEW = 6  # Up to so many unknowns their order does not matter

Action = tuple[str, tuple[float, float, float], BodyPoint, str]
"""What a unit of an unknown does to a body: force and torque, where it acts, and the body in whose frame the force is."""


def balance(mechanism: Mechanism) -> Balance:
    index = {body.name: k for k, body in enumerate(mechanism.bodies)}
    sizes = [math.hypot(*point) for body in mechanism.bodies for point in body.points.values()]
    length = max([size for size in sizes if size > 0.0], default=1.0)
    kinds = _unknowns(mechanism, length)
    first = list(accumulate(map(len, kinds), initial=0))
    entries: dict[str, list[tuple[int, tuple[float, float, float], Point, int, int]]] = {name: [] for name in index}
    for unknown, actions in enumerate(actions for kind in kinds for actions in kind):
        for body, direction, anchor, frame in actions:
            if body != GROUND:
                arm = arm_of(mechanism, *anchor)
                entries[body].append((unknown, direction, arm, index[anchor[0]], index.get(frame, -1)))
    listed = [entry for rows in entries.values() for entry in rows]
    order, reach = _order([[unknown for unknown, *_ in rows] for rows in entries.values()], first[-1])
    return Balance(
        start=np.cumsum([0, *map(len, entries.values())], dtype=np.int64),
        unknown=np.array([order[unknown] for unknown, *_ in listed], np.int64),
        direction=np.array([direction for _, direction, *_ in listed]).reshape(-1, 3),
        arm=np.array([arm for _, _, arm, *_ in listed]).reshape(-1, 2),
        anchor=np.array([anchor for *_, anchor, _ in listed], np.int64),
        frame=np.array([frame for *_, frame in listed], np.int64),
        mass=np.array([body.mass for body in mechanism.bodies], float),
        inertia=np.array([body_inertia(mechanism, body) if body.rotates else 0.0 for body in mechanism.bodies], float),
        length=length,
        order=order,
        band=reach,
        joints=(first[0], first[1]),
        guides=(first[2], first[3]),
        drives=(first[4], first[5]),
    )


def _unknowns(mechanism: Mechanism, length: float) -> list[list[list[Action]]]:
    """What each unknown does to bodies: of joints, welds, guides, the alignments of guides, and drives.

    Torques are in units of `length`.
    """

    def forces(start: BodyPoint, end: BodyPoint) -> list[list[Action]]:
        """Two components of a force between two points that coincide."""
        sides = (start, 1.0), (end, -1.0)
        return [[(at[0], (sign * x, sign * y, 0.0), at, GROUND) for at, sign in sides] for x, y in ((1.0, 0.0), (0.0, 1.0))]

    joints = [force for joint in mechanism.ideal_joints for force in forces(joint.journal, joint.bearing)]
    welds: list[list[Action]] = []
    for weld in mechanism.welds:
        torque = [(at[0], (0.0, 0.0, sign * length), at, GROUND) for at, sign in ((weld.start, 1.0), (weld.end, -1.0))]
        welds += [*forces(weld.start, weld.end), torque]
    guides, alignments = list[list[Action]](), list[list[Action]]()
    for guide in mechanism.ideal_guides:
        x, y, follower, at = -math.sin(guide.direction), math.cos(guide.direction), guide.follower[0], guide.follower
        guides.append([(follower, (x, y, 0.0), at, guide.body), (guide.body, (-x, -y, 0.0), at, guide.body)])
        if guide.aligned:
            alignments.append([(follower, (0.0, 0.0, length), at, GROUND), (guide.body, (0.0, 0.0, -length), at, GROUND)])
    drives: list[list[Action]] = []
    for drive in mechanism.drives:
        anchor = drive.body, next(iter(mechanism.body(drive.body).points))
        drives.append([(drive.body, (0.0, 0.0, length), anchor, GROUND)])
    return [joints, welds, guides, alignments, drives]


def _order(groups: list[list[int]], count: int) -> tuple[np.ndarray, int]:
    """Where each unknown stands so that those of a body are near each other, and the largest distance of two of a body."""
    near, order = coupled([*map(np.array, groups), *np.arange(count)[:, None]], count), np.arange(count)
    if count > FEW:
        order[reverse_cuthill_mckee(near)] = np.arange(count)
    return order, reach(near, order)
