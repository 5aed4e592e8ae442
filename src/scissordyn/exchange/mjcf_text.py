"""The ideal mechanism in MJCF, for MuJoCo: a tree of hinges and slides, whose loops are closed by connections."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from scissordyn.component.place import GROUND, Point
from scissordyn.errors import InputError
from scissordyn.exchange.mjcf_coupling import Couplings, Tree
from scissordyn.model.backlash import closed
from scissordyn.model.body import Body
from scissordyn.model.connection import Weld
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.simulate import simulate

TIMESTEP = 1e-4
STIFF: dict[str, Any] = {"solref": f"{2 * TIMESTEP:g} 1", "solimp": "0.9999 0.9999 0.001"}
"""MuJoCo's constraints are soft; so they are as stiff as its time step allows."""

SHORT = 1e-6  # Time of the run whose start is taken [s]


class Model(NamedTuple):
    """A mechanism in MJCF."""

    text: str
    notes: tuple[str, ...]  # What is not in it


@dataclass
class _Placed:
    """A body at the start: its frame, its velocities, and what it is attached by."""

    body: Body
    origin: Point
    angle: float
    velocity: Point
    rate: float
    parent: str = ""
    by: Revolute | Guide | Weld | None = None

    def at(self, local: Point) -> Point:
        """A place of its frame in the plane."""
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        return self.origin[0] + cos * local[0] - sin * local[1], self.origin[1] + sin * local[0] + cos * local[1]


def mjcf(mechanism: Mechanism) -> Model:
    """The mechanism with ideal joints, as it is assembled at its start."""
    ideal, backlashes = closed(mechanism.ideal())
    refused: tuple[Any, ...] = (*ideal.rods, *ideal.latches)
    if refused:
        raise InputError(f"'{refused[0].name}' in MJCF", "joints, guides, welds and couplings; no rods and latches")
    placed = _placed(ideal)
    loops = _spanned(ideal, placed)
    notes = [f"{type(part).__name__} '{part.name}': left out" for part in ideal.components]
    notes += [
        f"the prescribed angle of '{drive.body}': a motor in its place; its speed at the start is kept"
        for drive in ideal.drives
    ]
    notes += [f"the motion of drive '{drive.name}': a motor in its place" for drive in ideal.coordinate_drives]
    notes += [f"the backlash of coupling '{name}': left out" for name in backlashes]
    notes += ["joints with clearance are ideal"] if mechanism.clearance_joints else []
    root = ET.Element("mujoco", model="mechanism")
    down = ideal.gravity * math.cos(ideal.gravity_direction), ideal.gravity * math.sin(ideal.gravity_direction)
    ET.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    ET.SubElement(root, "option", timestep=f"{TIMESTEP:g}", gravity=_numbers(*down, 0.0), integrator="RK4")
    world = ET.SubElement(root, "worldbody")
    speeds: list[float] = []
    led = {name: part.by for name, part in placed.items() if isinstance(part.by, Guide)}
    tree, bodies = Tree({name: part.parent for name, part in placed.items()}, led), {GROUND: world}
    for name in [name for name, part in placed.items() if part.parent == GROUND]:
        _add(world, name, placed, speeds, tree, bodies)
    equality = ET.SubElement(root, "equality")
    for loop in loops:
        _close(equality, loop, placed)
    motors = ET.SubElement(root, "actuator")
    for drive in ideal.drives:
        if drive.body in tree.hinges:
            ET.SubElement(motors, "motor", name=f"motor of {drive.body}", joint=tree.hinges[drive.body])
    Couplings(ideal, tree, bodies, root).add(equality, motors, STIFF)
    ET.SubElement(ET.SubElement(root, "keyframe"), "key", name="start", qvel=_numbers(*speeds))
    ET.indent(root)
    return Model(ET.tostring(root, encoding="unicode") + "\n", tuple(notes))


def _placed(ideal: Mechanism) -> dict[str, _Placed]:
    """The bodies at the start of a run."""
    run = simulate(ideal, until=SHORT, samples=2).isel(time=0)
    bodies = {}
    for body in ideal.bodies:
        motion = run.sel(body=body.name)
        angle = float(motion["angle"]) if body.rotates else body.placed_angle
        rate = float(motion["angular_velocity"]) if body.rotates else 0.0
        cos, sin = math.cos(angle), math.sin(angle)
        arm = cos * body.centre[0] - sin * body.centre[1], sin * body.centre[0] + cos * body.centre[1]
        x, y = (float(value) for value in motion["position"].values)
        vx, vy = (float(value) for value in motion["velocity"].values)
        bodies[body.name] = _Placed(body, (x - arm[0], y - arm[1]), angle, (vx + rate * arm[1], vy - rate * arm[0]), rate)
    return bodies


def _spanned(ideal: Mechanism, placed: dict[str, _Placed]) -> list[Revolute | Weld]:
    """Attach each body to another one or to the ground, by guides first; returns the joints that close loops."""
    edges: list[tuple[str, str, Revolute | Guide | Weld]] = [(g.body, g.follower[0], g) for g in ideal.guides]
    edges += [(joint.bearing[0], joint.journal[0], joint) for joint in ideal.joints]
    edges += [(weld.start[0], weld.end[0], weld) for weld in ideal.welds]
    used: set[int] = set()
    grown = True
    while grown:
        grown = False
        for k, (first, second, edge) in enumerate(edges):
            for parent, child in ((first, second), (second, first)):
                if child == GROUND or placed[child].by is not None or k in used:
                    continue
                if parent != GROUND and placed[parent].by is None:
                    continue
                if isinstance(edge, Guide) and child != edge.follower[0]:
                    continue
                if not placed[child].body.rotates and not isinstance(edge, Guide):
                    continue
                placed[child].parent, placed[child].by = parent, edge
                used.add(k)
                grown = True
                break
            if grown:
                break
    loops: list[Revolute | Weld] = []
    for k, (_, _, edge) in enumerate(edges):
        if k not in used:
            if isinstance(edge, Guide):
                raise InputError(f"guide '{edge.name}' closes a loop, which MJCF cannot say", "guides that lead a body each")
            loops.append(edge)
    for body in placed.values():
        body.parent = body.parent or GROUND
    return loops


def _add(
    above: ET.Element, name: str, placed: dict[str, _Placed], speeds: list[float], tree: Tree, bodies: dict[str, ET.Element]
) -> None:
    """Add a body with its joints, and those that are attached to it."""
    body = placed[name]
    parent = placed.get(body.parent)
    base, turn = (parent.origin, parent.angle) if parent else ((0.0, 0.0), 0.0)
    x, y = body.origin[0] - base[0], body.origin[1] - base[1]
    cos, sin = math.cos(turn), math.sin(turn)
    local, angle = (cos * x + sin * y, cos * y - sin * x), body.angle - turn
    element = ET.SubElement(
        above, "body", name=name, pos=_numbers(*local, 0.0), quat=_numbers(math.cos(0.5 * angle), 0, 0, math.sin(0.5 * angle))
    )
    bodies[name] = element
    inertia = body.body.inertia if body.body.inertia is not None else body.body.mass * (1e-3 * max(body.body.extent, 1e-2)) ** 2
    ET.SubElement(
        element,
        "inertial",
        pos=_numbers(*body.body.centre, 0.0),
        mass=_numbers(body.body.mass),
        diaginertia=_numbers(0.6 * inertia, 0.6 * inertia, inertia),
    )
    for tag, speed in _joints(body, parent):
        ET.SubElement(element, "joint", **tag)
        speeds.append(speed)
        if tag["type"] == "hinge":
            tree.hinges[name] = tag["name"]
        else:
            tree.slides.setdefault(name, []).append(tag["name"])
    for child in [child for child, other in placed.items() if other.parent == name]:
        _add(element, child, placed, speeds, tree, bodies)


def _joints(each: _Placed, parent: _Placed | None) -> Iterator[tuple[dict[str, Any], float]]:
    """Joints of a body with its parent, and their speeds at the start."""
    by, name = each.by, each.body.name
    above = parent.rate if parent else 0.0
    hinge = {"type": "hinge", "axis": "0 0 1"}
    if isinstance(by, Revolute):
        point = by.journal[1] if by.journal[0] == name else by.bearing[1]
        yield {"name": by.name, "pos": _numbers(*each.body.points[point], 0.0), **hinge}, each.rate - above
    elif isinstance(by, Guide):
        direction = by.direction + (parent.angle if parent else 0.0)
        along = direction - each.angle
        place = each.at(each.body.points[by.follower[1]])
        arm = place[0] - each.origin[0], place[1] - each.origin[1]
        vx, vy = each.velocity[0] - each.rate * arm[1], each.velocity[1] + each.rate * arm[0]
        if parent:
            reach = place[0] - parent.origin[0], place[1] - parent.origin[1]
            vx, vy = vx - parent.velocity[0] + parent.rate * reach[1], vy - parent.velocity[1] - parent.rate * reach[0]
        axis = _numbers(math.cos(along), math.sin(along), 0.0)
        yield {"name": by.name, "type": "slide", "axis": axis}, math.cos(direction) * vx + math.sin(direction) * vy
        if each.body.rotates and not by.aligned:
            yield (
                {"name": f"{by.name} pin", "pos": _numbers(*each.body.points[by.follower[1]], 0.0), **hinge},
                each.rate - above,
            )
    elif by is None:
        cos, sin = math.cos(each.angle), math.sin(each.angle)
        yield {"name": f"{name} x", "type": "slide", "axis": _numbers(cos, -sin, 0.0)}, each.velocity[0]
        yield {"name": f"{name} y", "type": "slide", "axis": _numbers(sin, cos, 0.0)}, each.velocity[1]
        if each.body.rotates:
            yield {"name": f"{name} turn", **hinge}, each.rate


def _close(equality: ET.Element, loop: Revolute | Weld, placed: dict[str, _Placed]) -> None:
    """A connection, or a weld, of two bodies that are both in the tree."""
    ends = (loop.journal, loop.bearing) if isinstance(loop, Revolute) else (loop.start, loop.end)
    (body, point), (other, _) = ends if ends[0][0] != GROUND else ends[::-1]
    pair: dict[str, Any] = {"body1": body} | ({} if other == GROUND else {"body2": other}) | STIFF
    if isinstance(loop, Weld):
        ET.SubElement(equality, "weld", name=loop.name, **pair)
    else:
        ET.SubElement(equality, "connect", name=loop.name, anchor=_numbers(*placed[body].body.points[point], 0.0), **pair)


def _numbers(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)
