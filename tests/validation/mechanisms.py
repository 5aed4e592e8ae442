"""Random mechanisms that lose no energy, or have friction at every joint, drafted as in `benchmarks.random_cases`."""

from dataclasses import dataclass, replace

import numpy as np
from benchmarks.random_cases import Draft

import scissordyn as sd
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.friction.coulomb import Coulomb

CLEARANCE = 1e-3  # [m] radial clearance

BOUNCING = tuple(sd.Clearance(CLEARANCE, stiffness=law, damping=NoDamping()) for law in (sd.Hertz(), sd.Liu()))
"""Clearances whose contacts lose no energy."""
FRICTIONAL = sd.Clearance(CLEARANCE, friction=sd.LuGre(0.1)), sd.Clearance(CLEARANCE, friction=Coulomb(0.1))
"""Clearances whose contacts lose energy by impacts and friction."""


@dataclass
class Plain(Draft):
    """Draft of a mechanism of bodies of about 1 m and 1 kg, with given clearances and springs without loss."""

    clearances: tuple[sd.Clearance, ...] = BOUNCING

    def clearance(self, *, plane: bool = False) -> sd.Clearance:
        return self.choice(self.clearances)

    def share_pin(self, number: int, *, loose: bool) -> int:
        """Pin a body at an existing joint to the body of its bearing, and return the number of that body (-1: ground)."""
        bearing = self.choice(self.joints).bearing
        place, other = self.place(bearing), next((k for k, body in enumerate(self.bodies) if body.name == bearing[0]), -1)
        play = self.clearance() if loose or self.happens(0.25) else None
        self.joints.append(sd.Revolute(self.new_name("common pin"), self.mark(number, place), self.mark(other, place), play))
        self.freedom -= 2
        return other

    def add(self, kind: str, one: int, other: int) -> None:
        label = self.new_name(kind)
        if kind == "torsion spring":
            stiffness, angle = self.between(0.5, 3.0), self.between(-1.0, 1.0)
            self.components.append(sd.TorsionSpring(label, self.name(one), self.name(other), stiffness, angle))
        else:
            ends = self.own(one), self.own(other)
            self.components.append(sd.Spring(label, *ends, self.between(20.0, 100.0), self.between(0.1, 0.6)))


def random_mechanism(seed, *, floating=False, clearances=BOUNCING, everywhere=False):
    """Return two to five bodies with every kind of joint and at least one degree of freedom.

    `floating`: nothing is connected to the ground, and there is no gravity. `everywhere`: every joint has clearance, and all
    bodies rotate, as a body that does not would lose the moment of friction.
    """
    draft = Plain(np.random.default_rng([21, seed]), 1.0, 1.0, clearances=clearances)
    draft.add_body((0.0, 0.0))
    if not floating:
        draft.connect(0, -1, draft.choice(["pin", "guide", "spring", "clearance joint"]))
    kinds = ["clearance joint"] * 3 + ([] if everywhere else ["pin"] * 5 + ["guide", "weld"] * 2) + ["spring"]
    neighbours = set[frozenset[int]]()
    for _ in range(int(draft.random.integers(1, 5))):
        parent = int(draft.random.integers(len(draft.bodies)))
        number = draft.add_body(draft.bodies[parent].position, turning=everywhere)
        if draft.joints and draft.rotates(number) and draft.happens(0.3):
            parent = draft.share_pin(number, loose=everywhere)
        else:
            draft.connect(number, parent, draft.choice(kinds))
        neighbours.add(frozenset((number, parent)))
    turning = [number for number in range(len(draft.bodies)) if draft.rotates(number)]
    for _ in range(int(draft.random.integers(0, 3)) if len(turning) > 1 else 0):
        one, other = draft.random.permutation(turning)[:2].tolist()
        # the start is that of the tight mechanism, which has to be able to move
        if draft.freedom < (6 if floating else 3) or draft.welded(one, other):
            continue
        loose = everywhere or bool(draft.welds) or frozenset((one, other)) in neighbours or draft.happens(0.25)
        draft.connect(one, other, "clearance joint" if loose else "pin")
        neighbours.add(frozenset((one, other)))
    for _ in range(int(draft.random.integers(0, 3))):
        one, other = draft.choice(turning), draft.choice(turning if floating else [-1, *turning])
        if one != other:
            draft.add(draft.choice(["torsion spring", "spring"]), one, other)
    return sd.Mechanism(
        bodies=tuple(replace(body, points=points) for body, points in zip(draft.bodies, draft.points, strict=True)),
        joints=tuple(draft.joints),
        guides=tuple(draft.guides),
        welds=tuple(draft.welds),
        components=tuple(draft.components),
        ground=tuple(draft.ground.items()),
        gravity=0.0 if floating or draft.happens(0.5) else 9.81,
    )
