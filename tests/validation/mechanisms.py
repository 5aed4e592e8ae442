"""Random valid mechanisms: chains, trees and loops of bodies, placed so that every joint is closed at the start."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from hypothesis import strategies as st

from scissordyn.component.declaration import Component
from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.component.spring import Spring
from scissordyn.component.torsion_spring import TorsionSpring
from scissordyn.laws.contact import Elastic
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.friction.lugre import LuGre
from scissordyn.model.body import Body
from scissordyn.model.clearance import Clearance
from scissordyn.model.joint import Guide, Revolute, Weld
from scissordyn.model.mechanism import Mechanism

CLEARANCE = 1e-3

ELASTIC: tuple[Elastic, ...] = (Hertz(), Liu())
BOUNCING = tuple(Clearance(CLEARANCE, stiffness=law, damping=NoDamping()) for law in ELASTIC)
"""Clearance joints that lose no energy."""
FRICTIONAL = Clearance(CLEARANCE, friction=LuGre(0.1)), Clearance(CLEARANCE, friction=Coulomb(0.1))
"""Clearance joints with impact losses and friction."""


@dataclass
class Draft:
    """A mechanism in the making; each method adds one part and names it.

    Bodies that do not rotate are held at their mass centres only.
    """

    random: np.random.Generator  # Generic places, masses and speeds: no two conditions depend on each other by accident
    freedom: int = 0  # Degrees of freedom that are left, as drawn
    tight: int = 0  # and with all joints ideal
    bodies: list[Body] = field(default_factory=list)
    points: list[dict[str, Point]] = field(default_factory=list)
    joints: list[Revolute] = field(default_factory=list)
    guides: list[Guide] = field(default_factory=list)
    welds: list[Weld] = field(default_factory=list)
    components: list[Component] = field(default_factory=list)
    ground: dict[str, Point] = field(default_factory=dict)
    pins: list[tuple[int, Point]] = field(default_factory=list)

    def add_body(self, *, rotates: bool) -> int:
        """A body of 1 kg to 3 kg within 1 m of the origin, its mass centre 0.1 m or so off the origin of its frame."""
        draw, number = self.random, len(self.bodies)
        self.bodies.append(
            Body(
                name=f"body {number}",
                mass=float(draw.uniform(1.0, 3.0)),
                inertia=float(draw.uniform(0.05, 0.3)) if rotates else None,
                centre=tuple(draw.uniform(-0.2, 0.2, 2).tolist()) if rotates else (0.0, 0.0),
                position=tuple(draw.uniform(-1.0, 1.0, 2).tolist()),
                angle=float(draw.uniform(-3.0, 3.0)),
                velocity=tuple(draw.uniform(-0.3, 0.3, 2).tolist()),
                angular_velocity=float(draw.uniform(-1.0, 1.0)) if rotates else 0.0,
            )
        )
        self.points.append({})
        self.freedom += 3 if rotates else 2
        self.tight += 3 if rotates else 2
        return number

    def rotates(self, number: int) -> bool:
        """Whether a body rotates; the ground, -1, does not."""
        return number >= 0 and self.bodies[number].rotates

    def local(self, number: int, place: Point) -> Point:
        """A position in a body's frame."""
        body = self.bodies[number]
        x, y = place[0] - body.position[0], place[1] - body.position[1]
        cos, sin = math.cos(body.angle), math.sin(body.angle)
        return cos * x + sin * y, cos * y - sin * x

    def mark(self, number: int, place: Point) -> BodyPoint:
        """A new point of a body, or of the ground, at a position."""
        points = self.ground if number < 0 else self.points[number]
        name = f"p{len(points)}"
        points[name] = place if number < 0 else self.local(number, place)
        return (GROUND if number < 0 else self.bodies[number].name), name

    def between(self, one: int, other: int) -> Point:
        """A position between two bodies."""
        for k in (one, other):
            if k >= 0 and not self.rotates(k):
                return self.bodies[k].position
        middle = [np.zeros(2) if k < 0 else np.array(self.bodies[k].position) for k in (one, other)]
        x, y = (0.5 * (middle[0] + middle[1]) + self.random.uniform(-0.3, 0.3, 2)).tolist()
        return x, y

    def pin(self, one: int, other: int, *, clearance: Clearance | None = None, place: Point | None = None) -> None:
        """A revolute joint, ideal or with clearance."""
        where = self.between(one, other) if place is None else place
        name = f"pin {len(self.joints)}"
        self.joints.append(Revolute(name, self.mark(one, where), self.mark(other, where), clearance))
        self.pins.append((other, where))
        self.freedom -= 0 if clearance else 2
        self.tight -= 2

    def guide(self, one: int, other: int) -> None:
        """A straight guide of body `one` on body `other`."""
        follower = self.mark(one, self.between(one, other))
        body = self.bodies[one]
        place = replace(body, points=self.points[one]).place(follower[1])
        through = place if other < 0 else self.local(other, place)
        carrier = GROUND if other < 0 else self.bodies[other].name
        self.guides.append(
            Guide(f"guide {len(self.guides)}", follower, through, float(self.random.uniform(-3.0, 3.0)), carrier)
        )
        self.freedom -= 1
        self.tight -= 1

    def weld(self, one: int, other: int) -> None:
        """A rigid connection of two bodies, or of a body and the ground."""
        where = self.between(one, other)
        self.welds.append(Weld(f"weld {len(self.welds)}", self.mark(one, where), self.mark(other, where)))
        self.freedom -= 3
        self.tight -= 3

    def spring(self, one: int, other: int) -> None:
        """A spring between points that are apart."""
        ends = [self.mark(k, self.between(k, k)) for k in (one, other)]
        stiffness, length = self.random.uniform(20.0, 100.0), self.random.uniform(0.1, 0.6)
        self.components.append(Spring(f"spring {len(self.components)}", *ends, float(stiffness), float(length)))

    def hinge_spring(self, one: int, other: int) -> None:
        """A torsion spring between two bodies that rotate."""
        bodies = [GROUND if k < 0 else self.bodies[k].name for k in (one, other)]
        stiffness, angle = self.random.uniform(0.5, 3.0), self.random.uniform(-1.0, 1.0)
        self.components.append(
            TorsionSpring(f"spring {len(self.components)}", *bodies, stiffness=float(stiffness), free_angle=float(angle))
        )

    def build(self, gravity: float) -> Mechanism:
        """The mechanism."""
        return Mechanism(
            bodies=tuple(replace(body, points=points) for body, points in zip(self.bodies, self.points, strict=True)),
            joints=tuple(self.joints),
            guides=tuple(self.guides),
            welds=tuple(self.welds),
            components=tuple(self.components),
            ground=tuple(self.ground.items()),
            gravity=gravity,
        )


@st.composite
def mechanisms(
    draw: st.DrawFn,
    *,
    floating: bool = False,
    clearances: tuple[Clearance, ...] = BOUNCING,
    everywhere: bool = False,
    turning_only: bool = False,
) -> Mechanism:
    """Two to five bodies with every kind of joint with at least one degree of freedom.

    `floating`: nothing is tied to the ground, and there is no gravity; `everywhere`: every joint has clearance.
    """
    draft = Draft(np.random.default_rng(draw(st.integers(0, 2**32 - 1), label="seed")))
    pick = st.sampled_from(clearances)

    def a_clearance() -> Clearance | None:
        return draw(pick, label="clearance") if everywhere or draw(st.integers(0, 3), label="has clearance") == 0 else None

    draft.add_body(rotates=True)
    if not floating:
        support = draw(st.sampled_from(["pin", "guide", "spring", "clearance joint"]), label="support")
        if support == "pin":
            draft.pin(0, -1)
        elif support == "guide":
            draft.guide(0, -1)
        elif support == "spring":
            draft.spring(0, -1)
        else:
            draft.pin(0, -1, clearance=draw(pick, label="clearance"))
    for _ in range(draw(st.integers(1, 4), label="more bodies")):
        rotates = turning_only or draw(st.integers(0, 4), label="rotates") > 0
        number = draft.add_body(rotates=rotates)
        parent = draw(st.integers(0, number - 1), label="parent")
        kinds = (
            ["pin", "pin", "common pin", "spring"] if everywhere else ["pin", "pin", "common pin", "guide", "weld", "spring"]
        )
        kind = draw(st.sampled_from(kinds), label="kind")
        if kind == "guide" and draft.rotates(parent):
            draft.guide(number, parent)
        elif kind == "weld" and rotates and draft.rotates(parent):
            draft.weld(number, parent)
        elif kind == "common pin" and draft.pins and rotates:
            other, where = draw(st.sampled_from(draft.pins), label="pin")
            draft.pin(number, other, clearance=a_clearance(), place=where)
        elif kind == "spring" or not (rotates or draft.rotates(parent)):
            draft.spring(number, parent)
        else:
            draft.pin(number, parent, clearance=a_clearance())
    turning = [number for number in range(len(draft.bodies)) if draft.rotates(number)]
    tied = {frozenset((weld.start[0], weld.end[0])) for weld in draft.welds}
    for _ in range(draw(st.integers(0, 2), label="loops")):
        if len(turning) < 2:
            break
        one, other = draw(st.permutations(turning), label="loop")[:2]
        clearance = a_clearance()
        # the start is that of the tight mechanism, which has to be able to move
        if draft.tight < (6 if floating else 3):
            continue
        if clearance is None and (tied or joined(draft, one, other)):
            continue
        if clearance is not None and welded(tied, draft.bodies[one].name, draft.bodies[other].name):
            continue
        draft.pin(one, other, clearance=clearance)
    for _ in range(draw(st.integers(0, 2), label="springs")):
        one = draw(st.sampled_from(turning), label="spring on")
        other = draw(st.sampled_from(turning if floating else [-1, *turning]), label="spring to")
        if one == other:
            continue
        if draw(st.booleans(), label="hinge spring"):
            draft.hinge_spring(one, other)
        else:
            draft.spring(one, other)
    return draft.build(0.0 if floating or draw(st.booleans(), label="weightless") else 9.81)


def welded(tied: set[frozenset[str]], one: str, other: str) -> bool:
    """Whether welds make one rigid body of two."""
    group = {one}
    for _ in tied:
        group |= {name for pair in tied if pair & group for name in pair}
    return other in group


def joined(draft: Draft, one: int, other: int) -> bool:
    """Whether an ideal joint already holds two bodies together: a second one would make them one rigid body."""
    pair = {draft.bodies[one].name, draft.bodies[other].name}
    held = [set(joint.bodies) for joint in draft.joints if joint.clearance is None]
    return pair in [*held, *({guide.follower[0], guide.body} for guide in draft.guides)]
