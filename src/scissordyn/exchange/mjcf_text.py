"""Write the ideal mechanism in MJCF for MuJoCo: a tree of hinges and slides, whose loops are closed by connections.

Couplings become equalities of joints, or of tendons along joints or between two points. Coordinate drives become motors on such
tendons.
"""

from __future__ import annotations

import cmath
import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.exchange.xml_element import number_text
from scissordyn.model.addition import without_backlash
from scissordyn.model.body import Body
from scissordyn.model.commanded import rigid
from scissordyn.model.coupling import Coordinate, CoordinateDrive, Coupling, Distance, RelativeAngle
from scissordyn.model.joint import Guide, Revolute, Weld
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.bending import bends
from scissordyn.run.simulate import simulate

TIME_STEP = 1e-4  # [s] step size of MuJoCo that exported models contain
STIFF_SOLVER: dict[str, Any] = {"solref": f"{2 * TIME_STEP:g} 1", "solimp": "0.9999 0.9999 0.001"}
"""Solver parameters that make MuJoCo's soft constraints as stiff as the time step permits."""


HINGE_ATTRIBUTES = {"type": "hinge", "axis": "0 0 1"}  # Attributes of MJCF hinges about z

Edge: TypeAlias = Guide | Revolute | Weld


class Model(NamedTuple):
    """Mechanism in MJCF."""

    text: str
    notes: tuple[str, ...]  # Parts that are left out


@dataclass
class _Placed:
    """Body at the start, its parent in the tree, and the joints between both; positions are complex numbers."""

    body: Body
    origin: complex
    angle: float
    velocity: complex  # Velocity of the origin
    rate: float
    parent: str = GROUND
    by: Edge | None = None
    hinge: str = ""
    slides: list[str] = field(default_factory=list)  # Names of slides; two for a freely moving body

    def arm(self, point: str) -> complex:
        """Return the vector from the origin to a point."""
        return cmath.rect(1.0, self.angle) * complex(*self.body.points[point])


def mjcf(mechanism: Mechanism) -> Model:
    """Return the mechanism with ideal joints in MJCF, as assembled at its start."""
    ideal, backlashes = without_backlash(rigid(mechanism.ideal()))
    for kind, parts in (("rod", ideal.rods), ("latch", ideal.latches)):
        if parts:
            raise InputError(f"MJCF cannot represent {kind} '{parts[0].name}'", "joints, guides, welds and couplings")
    notes = [f"{type(part).__name__} '{part.name}': left out" for part in ideal.components]
    notes += [
        f"the prescribed angle of '{drive.body}': replaced by a motor; its speed at the start is kept" for drive in ideal.drives
    ]
    notes += [f"the motion of drive '{drive.name}': replaced by a motor" for drive in ideal.coordinate_drives]
    notes += [f"the backlash of coupling '{name}': left out" for name in backlashes]
    notes += ["bars that bend are rigid"] if bends(mechanism) else []
    notes += ["joints with clearance are ideal"] if mechanism.clearance_joints else []
    root = _Writer(ideal).root
    ET.indent(root)
    return Model(ET.tostring(root, encoding="unicode") + "\n", tuple(notes))


class _Writer:
    """Generator of the MJCF model, part by part in the order of the file."""

    def __init__(self, ideal: Mechanism) -> None:
        self.ideal, self.placed = ideal, place_bodies(ideal)
        loops = _build_tree(ideal, self.placed)
        self.root = ET.Element("mujoco", model="mechanism")
        self.add("compiler", angle="radian", inertiafromgeom="false")
        down = cmath.rect(ideal.gravity, ideal.gravity_direction)
        self.add("option", timestep=f"{TIME_STEP:g}", gravity=_vector(down), integrator="RK4")
        self.elements = {GROUND: self.add("worldbody")}
        self.speeds: list[float] = []
        self._add_bodies(GROUND)
        self.equality = self.add("equality")
        for loop in loops:
            self._close(loop)
        self.motors = self.add("actuator")
        for drive in ideal.drives:
            if hinge := self.placed[drive.body].hinge:
                ET.SubElement(self.motors, "motor", name=f"motor of {drive.body}", joint=hinge)
        self.tendons = ET.Element("tendon")
        for coupling in ideal.couplings:
            self._couple(coupling)
        for coordinate_drive in ideal.coordinate_drives:
            weights = self._weights(coordinate_drive.coordinate, f"drive '{coordinate_drive.name}'")
            tendon = self._tendon(coordinate_drive, "coordinate", weights)
            ET.SubElement(self.motors, "motor", name=coordinate_drive.name, tendon=tendon)
        if len(self.tendons):
            self.root.append(self.tendons)
        ET.SubElement(self.add("keyframe"), "key", name="start", qvel=number_text(*self.speeds))

    def add(self, tag: str, **attributes: Any) -> ET.Element:
        return ET.SubElement(self.root, tag, **attributes)

    def _add_bodies(self, parent: str) -> None:
        """Add the bodies attached to a parent with their joints, and recursively the bodies attached to these."""
        above = self.placed.get(parent)
        origin, turn = (above.origin, above.angle) if above else (0j, 0.0)
        for name, here in self.placed.items():
            if here.parent != parent:
                continue
            body, angle = here.body, here.angle - turn
            place = cmath.rect(1.0, -turn) * (here.origin - origin)
            quaternion = number_text(math.cos(0.5 * angle), 0, 0, math.sin(0.5 * angle))
            element = ET.SubElement(self.elements[parent], "body", name=name, pos=_vector(place), quat=quaternion)
            self.elements[name] = element
            inertia = body.mass * (1e-3 * max(body.extent, 1e-2)) ** 2 if body.inertia is None else body.inertia
            moments, centre = number_text(0.6 * inertia, 0.6 * inertia, inertia), _vector(complex(*body.centre))
            ET.SubElement(element, "inertial", pos=centre, mass=number_text(body.mass), diaginertia=moments)
            for joint, speed in _joints(here, above):
                ET.SubElement(element, "joint", **joint)
                self.speeds.append(speed)
                if joint["type"] == "hinge":
                    here.hinge = joint["name"]
                else:
                    here.slides.append(joint["name"])
            self._add_bodies(name)

    def _close(self, loop: Revolute | Weld) -> None:
        """Add a connection or weld that closes a loop between two bodies of the tree."""
        ends = (loop.journal, loop.bearing) if isinstance(loop, Revolute) else (loop.start, loop.end)
        (body, point), (other, _) = ends if ends[0][0] != GROUND else ends[::-1]
        revolute = isinstance(loop, Revolute)
        pair: dict[str, Any] = {"anchor": _vector(complex(*self.placed[body].body.points[point]))} if revolute else {}
        pair |= {"body1": body} | ({} if other == GROUND else {"body2": other}) | STIFF_SOLVER
        ET.SubElement(self.equality, "connect" if revolute else "weld", name=loop.name, **pair)

    def _couple(self, part: Coupling) -> None:
        if part.further:
            raise InputError(f"coupling '{part.name}' has further inputs, which the export to MJCF leaves out", "one input")
        ends = [self._weights(coordinate, f"coupling '{part.name}'") for coordinate in (part.output, part.input)]
        single = [next(iter(end.items())) for end in ends if end and len(end) == 1]
        if len(single) == 2:
            kind, ((first, weight), (second, other)) = "joint", single
            factor = part.ratio * other / weight
        else:
            kind, factor = "tendon", part.ratio
            first, second = (self._tendon(part, side, end) for side, end in zip(("output", "input"), ends, strict=True))
        pair: dict[str, Any] = {f"{kind}1": first, f"{kind}2": second, "polycoef": f"0 {factor!r} 0 0 0"}
        ET.SubElement(self.equality, kind, name=part.name, **pair, **STIFF_SOLVER)

    def _weights(self, coordinate: Coordinate, what: str) -> dict[str, float] | None:
        """Return a weight for each joint so that their weighted sum is a coordinate plus a constant; None for a distance."""
        least_weight = 1e-12  # smaller weights are round-off of a slide perpendicular to the coordinate
        if isinstance(coordinate, Distance):
            return None
        if isinstance(coordinate, RelativeAngle):
            weights: Counter[str] = Counter()
            for body, sign in zip(coordinate.bodies, (1, -1), strict=True):
                while body != GROUND:
                    weights[self.placed[body].hinge] += sign
                    body = self.placed[body].parent
            return {joint: float(weight) for joint, weight in weights.items() if weight and joint}
        body, point = coordinate.point
        here = self.placed[body]
        guide = here.by if isinstance(here.by, Guide) else None
        if here.parent == coordinate.base and here.slides:
            leads = point == guide.follower[1] if guide else here.body.points[point] == (0.0, 0.0)
            if leads or not here.hinge:
                turned = coordinate.direction - (guide.direction if guide else 0.0)
                pairs = zip(here.slides, (math.cos(turned), math.sin(turned)), strict=False)
                return {joint: weight for joint, weight in pairs if abs(weight) > least_weight}
        raise InputError(
            f"{what}: MJCF cannot represent the slide of '{body}.{point}'",
            "a slide along the guide of its body; for a turning body, a slide of the guided point",
        )

    def _tendon(self, part: Coupling | CoordinateDrive, side: str, weights: Mapping[str, float] | None) -> str:
        """Add an MJCF tendon whose length is a coordinate plus a constant; return the name of the tendon."""
        name, coordinate = f"{part.name} {side}", getattr(part, side)
        tendon = ET.SubElement(self.tendons, "spatial" if weights is None else "fixed", name=name)
        for joint, weight in (weights or {}).items():
            ET.SubElement(tendon, "joint", joint=joint, coef=repr(weight))
        for end in ("start", "end") if weights is None else ():
            body, point = getattr(coordinate, end)
            x, y = dict(self.ideal.ground)[point] if body == GROUND else self.placed[body].body.points[point]
            ET.SubElement(self.elements[body], "site", name=f"{name} {end}", pos=f"{x!r} {y!r} 0")
            ET.SubElement(tendon, "site", site=f"{name} {end}")
        return name


def place_bodies(ideal: Mechanism) -> dict[str, _Placed]:
    """Return the positions and velocities of the bodies at the start of a run, by body name."""
    until = 1e-6  # duration of the run that computes the start [s]
    run = simulate(ideal, until=until, samples=2).isel(time=0)
    bodies = {}
    for body in ideal.bodies:
        motion = run.sel(body=body.name)
        angle = float(motion["angle"]) if body.rotates else body.placed_angle
        rate = float(motion["angular_velocity"]) if body.rotates else 0.0
        arm = cmath.rect(1.0, angle) * complex(*body.centre)
        centre, velocity = (complex(*motion[name].values) for name in ("position", "velocity"))
        bodies[body.name] = _Placed(body, centre - arm, angle, velocity - 1j * rate * arm, rate)
    return bodies


def _build_tree(ideal: Mechanism, placed: dict[str, _Placed]) -> list[Revolute | Weld]:
    """Attach each body to another body or the ground, preferably by guides; return the joints and welds that close loops."""
    edges: list[tuple[Edge, str, str]] = [(guide, guide.body, guide.follower[0]) for guide in ideal.guides]
    edges += [(joint, joint.bearing[0], joint.journal[0]) for joint in ideal.joints]
    edges += [(weld, weld.start[0], weld.end[0]) for weld in ideal.welds]
    while True:
        ways = ((k, *way) for k, (_, first, second) in enumerate(edges) for way in ((first, second), (second, first)))
        step = next((way for way in ways if _can_attach(edges[way[0]][0], *way[1:], placed)), None)
        if step is None:
            break
        k, parent, child = step
        placed[child].parent, placed[child].by = parent, edges.pop(k)[0]
    loops: list[Revolute | Weld] = []
    for edge, _, _ in edges:
        if isinstance(edge, Guide):
            raise InputError(f"guide '{edge.name}' closes a loop, which MJCF cannot represent", "one guide for each body")
        loops.append(edge)
    return loops


def _can_attach(edge: Edge, parent: str, child: str, placed: dict[str, _Placed]) -> bool:
    """Return True if a connection can attach a body to the tree: a guide attaches its follower, others a rotating body."""
    if child == GROUND or placed[child].by or not (parent == GROUND or placed[parent].by):
        return False
    return child == edge.follower[0] if isinstance(edge, Guide) else placed[child].body.rotates


def _joints(here: _Placed, parent: _Placed | None) -> Iterator[tuple[dict[str, Any], float]]:
    """Yield the attributes of the MJCF joints between a body and its parent, each with its speed at the start."""
    by, name = here.by, here.body.name
    turning = here.rate - (parent.rate if parent else 0.0)
    if isinstance(by, Revolute):
        point = by.journal[1] if by.journal[0] == name else by.bearing[1]
        yield {"name": by.name, "pos": _vector(complex(*here.body.points[point])), **HINGE_ATTRIBUTES}, turning
    elif isinstance(by, Guide):
        direction = by.direction + (parent.angle if parent else 0.0)
        arm = here.arm(by.follower[1])
        velocity = here.velocity + 1j * here.rate * arm
        if parent:
            velocity -= parent.velocity + 1j * parent.rate * (here.origin + arm - parent.origin)
        speed = (cmath.rect(1.0, -direction) * velocity).real
        yield {"name": by.name, "type": "slide", "axis": _vector(cmath.rect(1.0, direction - here.angle))}, speed
        if here.body.rotates and not by.aligned:
            yield (
                {"name": f"{by.name} pin", "pos": _vector(complex(*here.body.points[by.follower[1]])), **HINGE_ATTRIBUTES},
                turning,
            )
    elif by is None:
        for letter, axis, speed in (("x", 1.0, here.velocity.real), ("y", 1j, here.velocity.imag)):
            along = cmath.rect(1.0, -here.angle) * axis
            yield {"name": f"{name} {letter}", "type": "slide", "axis": _vector(along)}, speed
        if here.body.rotates:
            yield {"name": f"{name} turn", **HINGE_ATTRIBUTES}, here.rate


def _vector(place: complex) -> str:
    return number_text(place.real, place.imag, 0.0)
