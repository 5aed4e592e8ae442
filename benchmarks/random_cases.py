"""Random valid mechanisms of any size, with every law, component, drive and controller.

Bodies are placed so that every joint is closed at the start. Lengths span four decades and masses six. Forces, speeds and the
length of a run follow from both and from gravity.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import scissordyn as sd
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION, MATERIALS
from scissordyn.model.joint import Weld

__all__ = ["Case", "random_case"]

LENGTHS = 1e-3, 10.0  # Sizes of the bodies [m]
MASSES = 1e-3, 1e3  # Masses of the bodies [kg]

GRAVITY = 9.81

DRAWN = {name: law for name, law in FRICTION.items() if name != "maxwell-slip"}
"""Friction laws that are drawn; another law would change all random cases, which are kept for comparison."""


@dataclass(frozen=True)
class Case:
    """Random mechanism and its run.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        End of the run [s].
    start : str
        Option `start` of `simulate`.
    contents : tuple of str
        Laws, components and drives of the mechanism.
    """

    mechanism: sd.Mechanism
    until: float
    start: str
    contents: tuple[str, ...]


@dataclass
class Draft:
    """Mechanism under construction, with its scales of length [m], mass [kg] and time [s]."""

    random: np.random.Generator
    length: float
    mass: float
    bodies: list[sd.Body] = field(default_factory=list)
    points: list[dict[str, Point]] = field(default_factory=list)
    ground: dict[str, Point] = field(default_factory=dict)
    joints: list[sd.Revolute] = field(default_factory=list)
    guides: list[sd.Guide] = field(default_factory=list)
    welds: list[Weld] = field(default_factory=list)
    components: list[Any] = field(default_factory=list)
    contents: list[str] = field(default_factory=list)
    freedom: int = 0
    rigid: list[int] = field(default_factory=list)

    @property
    def time(self) -> float:
        """Return the time in which a body falls by its size [s]."""
        return math.sqrt(self.length / GRAVITY)

    @property
    def force(self) -> float:
        """Return the weight of a body [N]."""
        return self.mass * GRAVITY

    def between(self, low: float, high: float) -> float:
        """Return a uniform random number."""
        return float(self.random.uniform(low, high))

    def decades(self, low: float, high: float) -> float:
        """Return a random number whose logarithm is uniform."""
        return float(np.exp(self.random.uniform(math.log(low), math.log(high))))

    def choice(self, options: Any) -> Any:
        """Return one of several options."""
        return options[int(self.random.integers(len(options)))]

    def happens(self, probability: float) -> bool:
        """Return True with the given probability."""
        return bool(self.random.random() < probability)

    def add_body(self, near: Point, *, turning: bool = False) -> int:
        """Add a body about its size away from a point; it rotates if it is the first or `turning`."""
        number, rotates = len(self.bodies), self.happens(0.85) or turning or not self.bodies
        mass, size = self.mass * self.decades(0.2, 5.0), self.length
        x, y = (near + self.random.uniform(-0.6, 0.6, 2) * size).tolist()
        self.bodies.append(
            sd.Body(
                name=f"body {number}",
                mass=mass,
                inertia=mass * size**2 * self.between(0.02, 0.2) if rotates else None,
                centre=tuple((self.random.uniform(-0.2, 0.2, 2) * size * rotates).tolist()),
                position=(x, y),
                angle=self.between(-3.0, 3.0),
                velocity=tuple((self.random.uniform(-0.5, 0.5, 2) * size / self.time).tolist()),
                angular_velocity=self.between(-1.0, 1.0) / self.time if rotates else 0.0,
            )
        )
        self.points.append({})
        self.rigid.append(number)
        self.freedom += 3 if rotates else 2
        return number

    def rotates(self, number: int) -> bool:
        """Return whether a body rotates; the ground, -1, does not."""
        return number >= 0 and self.bodies[number].rotates

    def welded(self, one: int, other: int) -> bool:
        """Return whether two bodies cannot move relative to each other; none is welded to the ground."""
        return other >= 0 and self.rigid[one] == self.rigid[other]

    def name(self, number: int) -> str:
        """Return the name of a body or of the ground."""
        return GROUND if number < 0 else self.bodies[number].name

    def local(self, number: int, place: Point) -> Point:
        """Return a global point in a body's frame."""
        body = self.bodies[number]
        x, y = place[0] - body.position[0], place[1] - body.position[1]
        cos, sin = math.cos(body.angle), math.sin(body.angle)
        return cos * x + sin * y, cos * y - sin * x

    def mark(self, number: int, place: Point) -> BodyPoint:
        """Add a point to a body or to the ground."""
        points = self.ground if number < 0 else self.points[number]
        name = f"p{len(points)}"
        points[name] = place if number < 0 else self.local(number, place)
        return self.name(number), name

    def middle(self, one: int, other: int) -> Point:
        """Return a point between two bodies; a body that does not rotate can only be held at its mass centre."""
        for number in (one, other):
            if number >= 0 and not self.rotates(number):
                return self.bodies[number].position
        origins = [np.zeros(2) if k < 0 else np.array(self.bodies[k].position) for k in (one, other)]
        x, y = (0.5 * (origins[0] + origins[1]) + self.random.uniform(-0.3, 0.3, 2) * self.length).tolist()
        return x, y

    def own(self, number: int) -> BodyPoint:
        """Add a point somewhere on a body."""
        return self.mark(number, self.middle(number, number))

    def new_name(self, kind: str) -> str:
        """Return a name that no other part of this kind has, and record the kind."""
        self.contents.append(kind)
        return f"{kind} {len(self.contents)}"

    # joints

    def clearance(self, *, plane: bool = False) -> Any:
        """Return a clearance with any laws that accept its geometry."""
        radius = self.length * self.decades(0.01, 0.1)
        size = radius * self.decades(1e-4, 0.05)
        while True:
            laws = {
                kind: self.law(table) for kind, table in (("stiffness", ELASTIC), ("damping", DAMPING), ("friction", DRAWN))
            }
            if self.happens(0.4):
                laws["friction"] = sd.NoFriction()
            material = self.choice(list(MATERIALS.values()))
            try:
                if plane:
                    block = {"length": self.length * self.between(0.2, 0.4), "width": self.length * self.between(0.1, 0.3)}
                    made: Any = sd.GuideClearance(
                        size, **block, corner_radius=0.02 * self.length, thickness=radius, material=material, **laws
                    )
                else:
                    made = sd.Clearance(size, journal_radius=radius, bearing_length=radius, material=material, **laws)
                for law in laws.values():
                    law.parameters(made.surfaces)
            except sd.InputError:  # the law is for another geometry
                continue
            self.contents += [f"{kind} {law.name}" for kind, law in laws.items()]
            return made

    def law(self, table: Any) -> Any:
        """Return a law whose parameters suit the scale of the mechanism."""
        made = self.choice(list(table.values()))
        scaled = {
            "kinetic": self.between(0.01, 0.3),
            "restitution": self.between(0.3, 1.0),
            "coefficient": 0.0,
            "mass": self.mass,
        }
        stiffness = self.force / self.length * self.decades(1e4, 1e6)
        scaled["coefficient"] = math.sqrt(stiffness * self.mass) * self.between(0.0, 0.3)
        if made.name == "power":
            scaled["coefficient"] = stiffness / math.sqrt(0.01 * self.length)
        if made.name in ("linear", "anagnostopoulos"):
            scaled["stiffness"] = stiffness
        fields = {each.name for each in dataclasses.fields(made)}
        return made(**{name: value for name, value in scaled.items() if name in fields})

    def connect(self, one: int, other: int, kind: str) -> None:
        """Connect two bodies, or a body and the ground."""
        if kind == "weld" and not (self.rotates(one) and self.rotates(other)):
            kind = "pin"
        if kind in ("guide", "clearance guide") and not (other < 0 or self.rotates(other)):
            kind = "pin"
        turning = self.rotates(one) or other < 0 or self.rotates(other)
        if kind in ("pin", "clearance joint", "bushing") and not turning:
            kind = "spring"  # the mass centres do not coincide
        if kind == "weld":
            self.rigid = [self.rigid[other] if group == self.rigid[one] else group for group in self.rigid]
        match kind:
            case "pin" | "clearance joint":
                place, label = self.middle(one, other), self.new_name(kind)
                play = self.clearance() if kind == "clearance joint" else None
                self.joints.append(sd.Revolute(label, self.mark(one, place), self.mark(other, place), play))
                self.freedom -= 2
            case "guide" | "clearance guide":
                self.add_guide(one, other, kind)
            case "weld":
                place, label = self.middle(one, other), self.new_name(kind)
                self.welds.append(Weld(label, self.mark(one, place), self.mark(other, place)))
                self.freedom -= 3
            case "bushing":
                self.add("bushing", one, other)
            case _:
                self.add("spring", one, other)

    def add_guide(self, one: int, other: int, kind: str) -> None:
        """Add a straight guide of a body on another body or on the ground."""
        place, label = self.middle(one, other), self.new_name(kind)
        follower = self.mark(one, place)
        body = dataclasses.replace(self.bodies[one], points=self.points[one])
        exact = body.place(follower[1])
        through = exact if other < 0 else self.local(other, exact)
        play = self.clearance(plane=True) if kind == "clearance guide" and self.rotates(one) and other < 0 else None
        aligned = play is not None
        self.guides.append(
            sd.Guide(label, follower, through, self.between(-3.0, 3.0), self.name(other), clearance=play, aligned=aligned)
        )
        self.freedom -= 2 if aligned else 1

    # components

    def add(self, kind: str, one: int, other: int) -> None:
        """Add a component between two bodies, or between a body and the ground."""
        F, L, T = self.force, self.length, self.time
        label, k = self.new_name(kind), F / L * self.decades(1.0, 1e3)
        d = math.sqrt(k * self.mass) * self.between(0.0, 0.5) * self.happens(0.5)
        turn = F * L * self.decades(0.1, 30.0)
        brake = turn * T * self.between(0.0, 0.3) * self.happens(0.5)
        between = self.angle(one) - self.angle(other)
        body, base = self.name(one), self.name(other)

        def ends() -> tuple[BodyPoint, BodyPoint]:
            return self.own(one), self.own(other)

        def distance(pair: tuple[BodyPoint, BodyPoint]) -> float:
            return math.dist(*(self.place(end) for end in pair))

        made: dict[str, Callable[[], Any]] = {
            "spring": lambda: sd.Spring(label, *ends(), k, L * self.between(0.0, 1.0), d),
            "torsion spring": lambda: sd.TorsionSpring(label, body, base, turn, between + self.between(-1.0, 1.0), brake),
            "tape spring": lambda: self.tape(label, body, base, between, turn),
            "constant force spring": lambda: sd.ConstantForceSpring(label, *ends(), F * self.decades(0.1, 10.0), 0.2 * L, d),
            "bushing": lambda: self.bushing(label, one, other, k, turn),
            "force": lambda: sd.Force(
                label,
                self.own(one),
                tuple((self.random.uniform(-3.0, 3.0, 2) * F).tolist()),
                follows=self.happens(0.5) and self.rotates(one),
                time_function=self.factor() if self.happens(0.5) else None,
            ),
            "torque": lambda: sd.Torque(label, body, turn * self.choice((-0.1, 0.1)), base),
            "motor": lambda: sd.Motor(
                label, body, 0.3 * turn, self.decades(0.3, 10.0) / T, base, None, 0.05 * self.mass * L**2
            ),
            "angle stop": lambda: sd.AngleStop(
                label,
                body,
                between + self.choice((-1.0, 1.0)) * self.between(0.1, 1.5),
                base,
                1e3 * turn,
                1.5,
                self.between(0.3, 1.0),
            ),
            "travel stop": lambda: self.travel_stop(label, one),
            "latch": lambda: sd.Latch(label, body, between + self.choice((-1.0, 1.0)) * self.between(0.1, 1.5), base),
        }
        if kind == "cable":
            pair = ends()
            self.components.append(sd.Cable(label, *pair, k * 30.0, distance(pair) * self.between(0.9, 1.3), d))
        elif kind == "rod":
            self.components.append(sd.Rod(label, *ends()))
            self.freedom -= 1
        else:
            self.components.append(made[kind]())

    def angle(self, number: int) -> float:
        """Return the direction of a body or of the ground."""
        return 0.0 if number < 0 else self.bodies[number].angle

    def place(self, point: BodyPoint) -> Point:
        """Return the start position of a point."""
        if point[0] == GROUND:
            return self.ground[point[1]]
        number = [body.name for body in self.bodies].index(point[0])
        return dataclasses.replace(self.bodies[number], points=self.points[number]).place(point[1])

    def tape(self, label: str, body: str, base: str, between: float, turn: float) -> Any:
        """Return a tape spring that folds within half a radian."""
        peak = turn * self.between(0.1, 0.4)
        return sd.TapeSpring(
            label, body, base, turn, peak, 0.2 * peak, 0.5 * peak, 0.1 * peak, between + self.between(-0.3, 0.3)
        )

    def bushing(self, label: str, one: int, other: int, stiffness: float, turn: float) -> Any:
        """Return a bushing without force at the start."""
        place = self.middle(one, other)
        turning = self.rotates(one) and (other < 0 or self.rotates(other))
        across = stiffness * self.between(0.3, 1.0)
        return sd.Bushing(
            label,
            self.mark(one, place),
            self.mark(other, place),
            stiffness_x=stiffness,
            stiffness_y=across,
            stiffness_xy=0.2 * across,
            torsional_stiffness=turn if turning else 0.0,
            damping_x=0.1 * math.sqrt(stiffness * self.mass),
        )

    def travel_stop(self, label: str, one: int) -> Any:
        """Return a wall at some distance from a point."""
        point, direction = self.own(one), self.between(-3.0, 3.0)
        x, y = self.place(point)
        limit = x * math.cos(direction) + y * math.sin(direction) + self.length * self.between(0.02, 0.3)
        stiffness = 1e4 * self.force / self.length**1.5
        return sd.TravelStop(label, point, direction, limit, stiffness, restitution=self.between(0.3, 1.0))

    def factor(self) -> Any:
        """Return a factor over time."""
        T = self.time
        return self.choice(
            (
                sd.Harmonic(0.0, 1.0, self.decades(1.0, 20.0) / T),
                sd.Cycloidal(0.0, 1.0, T),
                sd.Trapezoidal(0.0, 1.0, 2.0 * T),
                sd.Polynomial((1.0, -0.5 / T)),
            )
        )

    def motion(self, start: float) -> Any:
        """Return a prescribed angle that begins at `start`."""
        T, turn = self.time, self.between(-1.5, 1.5)
        return self.choice(
            (
                sd.ConstantSpeed(turn / T),
                sd.Harmonic(start, turn, self.decades(0.5, 5.0) / T),
                sd.Cycloidal(start, start + turn, T * self.between(0.5, 2.0)),
                sd.Trapezoidal(start, start + turn, T * self.between(0.5, 2.0)),
                sd.Polynomial((start, turn / T, 0.2 / T**2)),
            )
        )

    def controller(self, stiffness: float) -> tuple[Any, dict[str, Any]]:
        """Return a controller and the options it needs besides a reference."""
        T = self.time
        gains = stiffness, 0.2 * stiffness * T * self.between(0.1, 1.0), stiffness / T * self.between(0.0, 1.0)
        match int(self.random.integers(4)):
            case 0:
                return sd.PID(*gains, limit=5.0 * stiffness if self.happens(0.5) else None), {}
            case 1:
                return sd.FeedForward(*gains), {"feed_forward": sd.Harmonic(0.0, 0.1 * stiffness, 3.0 / T)}
            case 2:
                return sd.Pyragas(0.2 * stiffness, T * self.between(0.1, 0.5)), {}
            case _:
                return sd.ExtendedDelayedFeedback(0.2 * stiffness, T * self.between(0.1, 0.5), 0.5), {}


def random_case(seed: int) -> Case:
    """Return the random mechanism of a seed.

    Parameters
    ----------
    seed : int

    Returns
    -------
    Case
    """
    random = np.random.default_rng([20, seed])
    draft = Draft(random, 1.0, 1.0)
    draft.length, draft.mass = draft.decades(*LENGTHS), draft.decades(*MASSES)
    _tree(draft)
    _extras(draft)
    mechanism = sd.Mechanism(
        bodies=tuple(dataclasses.replace(body, points=points) for body, points in zip(draft.bodies, draft.points, strict=True)),
        joints=tuple(draft.joints),
        guides=tuple(draft.guides),
        welds=tuple(draft.welds),
        components=tuple(draft.components),
        ground=tuple(draft.ground.items()),
        gravity=GRAVITY * draft.happens(0.7),
        gravity_direction=draft.between(-3.0, 3.0),
        input_body="body 0",
    )
    mechanism = _moved(draft, mechanism)
    start = "concentric"
    if mechanism.contacts and not mechanism.guides and draft.happens(0.15):
        start = "in-contact"
    return Case(mechanism, draft.time * draft.between(0.2, 1.5), start, tuple(draft.contents))


def _tree(draft: Draft) -> None:
    """Add bodies that hang on the ground and on each other."""
    first = draft.add_body((0.0, 0.0))
    kinds = ["pin", "pin", "clearance joint", "guide", "clearance guide", "spring", "bushing"]
    draft.connect(first, -1, draft.choice(kinds))
    kinds = ["pin", "pin", "clearance joint", "clearance joint", "guide", "weld", "spring", "bushing"]
    for _ in range(int(draft.random.integers(0, 4))):
        parent = int(draft.random.integers(len(draft.bodies)))
        number = draft.add_body(draft.bodies[parent].position)
        draft.connect(number, parent, draft.choice(kinds))


def _extras(draft: Draft) -> None:
    """Add loops and components."""
    turning = [k for k in range(len(draft.bodies)) if draft.rotates(k)]
    kinds = [
        "spring", "torsion spring", "tape spring", "constant force spring", "cable", "bushing", "force", "torque", "motor",
        "angle stop", "travel stop", "rod", "latch", "clearance joint",
    ]  # fmt: skip
    on_hinge = {"torsion spring", "tape spring", "torque", "motor", "angle stop", "latch"}
    for _ in range(int(draft.random.integers(0, 4))):
        one, other = (int(each) for each in draft.random.permutation([-1, *turning])[:2])
        one, other = (other, one) if one < 0 else (one, other)
        kind = draft.choice(kinds)
        if kind in ("rod", "latch", "clearance joint") and (draft.freedom < 4 or draft.welded(one, other)):
            continue
        if kind == "clearance joint":
            draft.connect(one, other, kind)
        elif kind in on_hinge or other < 0 or draft.happens(0.8):
            draft.add(kind, one, other)
        if kind == "latch":
            draft.freedom -= 1


def _moved(draft: Draft, mechanism: sd.Mechanism) -> sd.Mechanism:
    """Return the mechanism, sometimes with a drive or a controller of its first body."""
    held = any(guide.aligned and guide.follower[0] == "body 0" for guide in draft.guides)
    if held or draft.happens(0.5) or draft.freedom < 2:
        return mechanism
    angle = draft.bodies[0].angle
    if draft.happens(0.5):
        motion = draft.motion(angle)
        draft.contents.append(f"drive {type(motion).__name__}")
        return mechanism.driven(motion)
    controller, more = draft.controller(draft.force * draft.length * draft.decades(0.3, 30.0))
    draft.contents.append(f"controller {controller.name}")
    return mechanism.controlled(controller, reference=draft.motion(angle), **more)
