"""The balances of force and moment of all bodies, with the reactions of ideal joints, guides and drives as unknowns."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.mechanics.reactions import Balance
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.graph import coupled, reach, reverse_cuthill_mckee
from scissordyn.plan.linear_constraints import body_inertia

FEW = 6  # Up to so many unknowns their order does not matter

Entry = tuple[int, tuple[float, float, float], Point, int, int]
"""Unknown, force and torque per unit of it, arm, anchor and frame: see `Balance`."""


def balance(mechanism: Mechanism) -> Balance:
    unknowns = _Unknowns(mechanism)
    joints = unknowns.of(unknowns.joints)
    unknowns.of(unknowns.welds)
    guides = unknowns.of(unknowns.guides)
    unknowns.of(unknowns.alignments)
    drives = unknowns.of(unknowns.drives)
    order, reach = _order([[unknown for unknown, *_ in rows] for rows in unknowns.entries.values()], unknowns.count)
    listed = [entry for rows in unknowns.entries.values() for entry in rows]
    return Balance(
        start=np.cumsum([0, *map(len, unknowns.entries.values())], dtype=np.int64),
        unknown=np.array([order[unknown] for unknown, *_ in listed], np.int64),
        direction=np.array([direction for _, direction, *_ in listed]).reshape(-1, 3),
        arm=np.array([arm for _, _, arm, *_ in listed]).reshape(-1, 2),
        anchor=np.array([anchor for *_, anchor, _ in listed], np.int64),
        frame=np.array([frame for *_, frame in listed], np.int64),
        mass=np.array([body.mass for body in mechanism.bodies], float),
        inertia=np.array([body_inertia(mechanism, body) if body.rotates else 0.0 for body in mechanism.bodies], float),
        length=unknowns.length,
        order=order,
        band=reach,
        joints=joints,
        guides=guides,
        drives=drives,
    )


class _Unknowns:
    """Collects the reactions as unknowns, and where each of them acts."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.index = {body.name: k for k, body in enumerate(mechanism.bodies)}
        self.entries: dict[str, list[Entry]] = {name: [] for name in self.index}
        sizes = [math.hypot(*point) for body in mechanism.bodies for point in body.points.values()]
        self.length = max([size for size in sizes if size > 0.0], default=1.0)
        self.count = 0

    def of(self, kind: Callable[[], None]) -> tuple[int, int]:
        """Enter the unknowns of one kind of parts; the first of them and the one behind the last."""
        first = self.count
        kind()
        return first, self.count

    def joints(self) -> None:
        for joint in self.mechanism.ideal_joints:
            self._forces(joint.journal, joint.bearing)

    def welds(self) -> None:
        for weld in self.mechanism.welds:
            self._forces(weld.start, weld.end)
            for anchor, sign in ((weld.start, 1.0), (weld.end, -1.0)):
                self._enter(anchor[0], (0.0, 0.0, sign * self.length), anchor)
            self.count += 1

    def guides(self) -> None:
        for guide in self.mechanism.ideal_guides:
            across = -math.sin(guide.direction), math.cos(guide.direction)
            self._enter(guide.follower[0], (*across, 0.0), guide.follower, guide.body)
            self._enter(guide.body, (-across[0], -across[1], 0.0), guide.follower, guide.body)
            self.count += 1

    def alignments(self) -> None:
        for guide in self.mechanism.ideal_guides:
            if guide.aligned:
                self._enter(guide.follower[0], (0.0, 0.0, self.length), guide.follower)
                self._enter(guide.body, (0.0, 0.0, -self.length), guide.follower)
                self.count += 1

    def drives(self) -> None:
        for drive in self.mechanism.drives:
            anchor = drive.body, next(iter(self.mechanism.body(drive.body).points))
            self._enter(drive.body, (0.0, 0.0, self.length), anchor)
            self.count += 1

    def _forces(self, start: BodyPoint, end: BodyPoint) -> None:
        """Two components of a force between two points that coincide."""
        for direction in ((1.0, 0.0), (0.0, 1.0)):
            for anchor, sign in ((start, 1.0), (end, -1.0)):
                self._enter(anchor[0], (sign * direction[0], sign * direction[1], 0.0), anchor)
            self.count += 1

    def _enter(self, body: str, direction: tuple[float, float, float], anchor: BodyPoint, frame: str = GROUND) -> None:
        """The present unknown acts on a body, unless that is the ground."""
        if body != GROUND:
            arm = _arm(self.mechanism, *anchor)
            self.entries[body].append((self.count, direction, arm, self.index[anchor[0]], self.index.get(frame, -1)))


def _order(groups: list[list[int]], count: int) -> tuple[np.ndarray, int]:
    """Where each unknown stands so that those of a body are near each other, and the largest distance of two of a body."""
    near, order = coupled([*map(np.array, groups), *np.arange(count)[:, None]], count), np.arange(count)
    if count > FEW:
        order[reverse_cuthill_mckee(near)] = np.arange(count)
    return order, reach(near, order)


def _arm(mechanism: Mechanism, body: str, point: str) -> tuple[float, float]:
    """A point from the mass centre, in the body's frame [m]."""
    described = mechanism.body(body)
    x, y = described.points[point]
    return x - described.centre[0], y - described.centre[1]
