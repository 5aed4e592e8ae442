"""MJCF and URDF, read by MuJoCo: the planar mechanisms among them.

A mechanism is understood if all hinges have parallel axes and all slides are at right angles to these. What the import does
not use is named.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections import Counter
from typing import Any

import numpy as np

from scissordyn.components.angle_stop import AngleStop
from scissordyn.components.bushing import Bushing
from scissordyn.components.clutch import Clutch
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.torsion_spring import TorsionSpring
from scissordyn.components.travel_stop import TravelStop
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import Imported, plain_name
from scissordyn.lookup import library
from scissordyn.model.body import Body
from scissordyn.model.coupling import Coordinate, Coupling, RelativeAngle, Slide
from scissordyn.model.joint import Guide, Revolute, Weld
from scissordyn.model.mechanism import Mechanism

PARALLEL = 1e-9  # Axes are parallel, and gravity is in the plane, within this sine

SAMPLE = "scissordyn import model.xml -o case.toml"

FURTHER_FILES = re.compile(r"<\s*include\b|\bfile(name)?\s*=")  # What would make MuJoCo read other files

LEFT_OUT = {
    "nu": "actuators",
    "ntendon": "tendons",
    "nexclude": "contact exclusions",
    "npair": "contact pairs",
    "nsensor": "sensors",
    "nflex": "flexible bodies",
    "nplugin": "plugins",
}
"""Counts of a model and what they count that is left out."""

PLACE = "name pos quat euler axisangle xyaxes zaxis class"

MUJOCO = {
    "mujoco": "model",
    "compiler": "*",
    "default": "*",
    "option": "gravity",
    "worldbody": "",
    "body": f"{PLACE} childclass",
    "frame": f"{PLACE} childclass",
    "inertial": "*",
    "joint": "name type axis pos ref range limited class damping stiffness springref frictionloss armature "
    "joint1 joint2 polycoef active",
    "freejoint": "name",
    "geom": f"{PLACE} type size fromto mass density contype conaffinity mesh",
    "site": "name pos class",
    "equality": "",
    "connect": "name class active body1 body2 anchor site1 site2",
    "weld": "name class active body1 body2 anchor relpose site1 site2",
    "keyframe": "",
    "key": "name qpos qvel",
}
"""Attributes that the import uses, or names itself, of each element of MJCF; "*" are all, with the elements inside."""

URDF = {
    "robot": "name",
    "link": "name",
    "inertial": "*",
    "joint": "name type",
    "parent": "*",
    "child": "*",
    "origin": "xyz rpy",
    "axis": "*",
    "limit": "lower upper",
    "mimic": "joint multiplier offset",
    "dynamics": "*",
    "collision": "*",
    "mujoco": "*",
}
"""The same of URDF."""


def read_mjcf(text: str) -> Imported:
    """The planar mechanism of a model in MJCF, or in URDF, at its start.

    Parameters
    ----------
    text : str
        XML without further files; MuJoCo reads both. A URDF is a tree: of mechanisms only chains without loops are in it.

    Returns
    -------
    Imported
        Bodies, joints and connections have the names of the model. The plane is at right angles to the hinges: its x and y are
        x and y for hinges about z, x and z for hinges about y, y and z for hinges about x.

    Raises
    ------
    InputError
        If it cannot be read, or is not planar.
    """
    mujoco = library("mujoco", "exchange", "MJCF")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise InputError(f"no model of MuJoCo: {error}", "MJCF or URDF without further files", SAMPLE) from None
    notes = _unused(root)
    text = ET.tostring(_without_pictures(root), encoding="unicode")
    if FURTHER_FILES.search(text):
        raise InputError(
            "a model of MuJoCo that names further files (meshes, includes)", "a model in one text, with masses", SAMPLE
        )
    try:
        model = mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"no model of MuJoCo: {error}", "MJCF or URDF without further files", SAMPLE) from None
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
        notes.append(f"start: positions and velocities of keyframe '{model.key(0).name or 0}', the first of {model.nkey}")
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    return _Reader(mujoco, model, data, notes).imported()


class _Reader:
    """A model at its start, and the parts made of it so far."""

    def __init__(self, mujoco: Any, model: Any, data: Any, notes: list[str]) -> None:
        self.mujoco, self.model, self.data, self.notes = mujoco, model, data, notes
        # those without mass and joints are points of the body that they are fixed to
        self.host = [0]
        for index in range(1, model.nbody):
            fixed = not model.body_jntnum[index] and not model.body_mass[index] > 0.0
            self.host.append(self.host[int(model.body_parentid[index])] if fixed else index)
        self.bodies = [index for index in range(1, model.nbody) if self.host[index] == index]
        self.hinged, self.sliding = (
            [j for j in range(model.njnt) if model.jnt_type[j] == kind]
            for kind in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
        )
        self.basis = self._plane()
        self.names = [GROUND]
        for index in range(1, model.nbody):
            self.names.append(plain_name(model.body(index).name or f"body {index}", self.names))
        self.points: dict[str, dict[str, Point]] = {name: {} for name in self.names}
        self.components: list[Any] = []
        self.joints: list[Revolute] = []
        self.guides: list[Guide] = []
        self.welds: list[Weld] = []
        self.couplings: list[Coupling] = []

    def imported(self) -> Imported:
        for index in self.bodies:
            self._attach(index)
        for k in range(self.model.nsite):
            name = self.model.site(k).name or f"site {k}"
            self._at(int(self.model.site_bodyid[k]), self.data.site_xpos[k], name)
        for k in range(self.model.neq):
            self._equality(k)
        for count, what in LEFT_OUT.items():
            number = int(getattr(self.model, count, 0))
            self.notes += [f"{number} {what}: left out"] if number else []
        touching = int(np.sum((self.model.geom_contype != 0) | (self.model.geom_conaffinity != 0)))
        if touching:
            self.notes.append(f"{touching} geoms that may touch: only their masses are kept, bodies do not collide here")
        bodies = tuple(self._body(index) for index in self.bodies)
        if not bodies:
            raise InputError("a model of MuJoCo without bodies", "one body or more", SAMPLE)
        gravity, direction = self._gravity()
        mechanism = Mechanism(
            bodies=bodies,
            joints=tuple(self.joints),
            guides=tuple(self.guides),
            welds=tuple(self.welds),
            couplings=tuple(self.couplings),
            components=tuple(self.components),
            ground=tuple(self.points[GROUND].items()),
            gravity=gravity,
            gravity_direction=direction,
            input_body=bodies[0].name,
        )
        return Imported(mechanism, tuple(self.notes))

    def _plane(self) -> np.ndarray:
        """Unit vectors of x and y of the plane, and of its normal, as rows."""
        hinges, slides = ([self.data.xaxis[j] for j in joints] for joints in (self.hinged, self.sliding))
        balls = int(np.sum(self.model.jnt_type == self.mujoco.mjtJoint.mjJNT_BALL))
        if balls:
            raise InputError(f"a model with {balls} ball joints", "hinges and slides, in one plane", SAMPLE)
        if not hinges:
            raise InputError("a model without hinges", "a planar mechanism with hinges", SAMPLE)
        normal = max((abs(axis) for axis in hinges), key=lambda axis: float(axis.max()))
        main = int(np.argmax(normal))
        normal = np.eye(3)[main] * (-1.0 if main == 1 else 1.0)
        if any(np.linalg.norm(np.cross(axis, normal)) > PARALLEL for axis in hinges):
            raise InputError("a model whose hinges are not all parallel to x, y or z", "a planar mechanism", SAMPLE)
        if any(abs(axis @ normal) > PARALLEL for axis in slides):
            raise InputError("a model with a slide out of the plane of its hinges", "a planar mechanism", SAMPLE)
        return np.array([*np.delete(np.eye(3), main, axis=0), normal])

    def _gravity(self) -> tuple[float, float]:
        """Size and direction of its part in the plane."""
        gravity = self._flat(self.model.opt.gravity)
        size, across = math.hypot(*gravity), float(np.linalg.norm(self.model.opt.gravity))
        if across - size > PARALLEL * across:
            self.notes.append(f"gravity of {across:g} m/s^2: only its part in the plane, {size:g} m/s^2, is kept")
        if self.model.opt.disableflags & self.mujoco.mjtDisableBit.mjDSBL_GRAVITY or not size > 0.0:
            return 0.0, -math.pi / 2
        return size, math.atan2(gravity[1], gravity[0])

    def _flat(self, vector: Any) -> Point:
        x, y, _ = self.basis @ np.asarray(vector, float)
        return float(x), float(y)

    def _angle(self, index: int) -> float:
        """Direction of a body's x axis in the plane; of its y axis where x is the normal."""
        if index == 0:
            return 0.0
        axes = self.data.xmat[index].reshape(3, 3)
        normal = abs(axes.T @ self.basis[2])
        x, y = self._flat(axes[:, 1 if int(np.argmax(normal)) == 0 else 0])
        return math.atan2(y, x)

    def _local(self, index: int, place: Any) -> Point:
        """A place in space, in the plane and in the frame of a body."""
        x, y = self._flat(np.asarray(place) - self.data.xpos[index])
        cos, sin = math.cos(self._angle(index)), math.sin(self._angle(index))
        return cos * x + sin * y, cos * y - sin * x

    def _at(self, index: int, place: Any, name: str) -> BodyPoint:
        """A point of a body at a place in space."""
        index = self.host[index]
        local, points = self._local(index, place), self.points[self.names[index]]
        for named, other in points.items():
            if math.dist(local, other) <= 1e-12:
                return self.names[index], named
        point = plain_name(name, points)
        points[point] = local
        return self.names[index], point

    def _joints_of(self, index: int) -> range:
        first = int(self.model.body_jntadr[index])
        return range(first, first + int(self.model.body_jntnum[index]))

    def _parent(self, index: int) -> int:
        return self.host[int(self.model.body_parentid[index])]

    def _attach(self, index: int) -> None:
        """The joints of a body with its parent."""
        model, data, parent, joints = self.model, self.data, self._parent(index), self._joints_of(index)
        hinges, slides = ([j for j in joints if j in kind] for kind in (self.hinged, self.sliding))
        body = self.names[index]
        name = plain_name(next((model.joint(j).name for j in joints), "") or f"joint of {body}", ())
        if len(hinges) > 1 or len(slides) > 2:
            raise InputError(f"body '{body}' with {len(hinges)} hinges and {len(slides)} slides", "one hinge", SAMPLE)
        if joints and not hinges and not slides:
            self.notes.append(f"body '{body}' moves freely: here in the plane")
            return
        if not joints:
            place = data.xpos[index]
            self.welds.append(Weld(name, self._at(index, place, "origin"), self._at(parent, place, name)))
        elif not slides:
            place = data.xanchor[hinges[0]]
            self.joints.append(Revolute(name, self._at(index, place, name), self._at(parent, place, name)))
        elif len(slides) == 1:
            place = data.xanchor[hinges[0] if hinges else slides[0]]
            x, y = self._flat(data.xaxis[slides[0]])
            direction, through = math.atan2(y, x) - self._angle(parent), self._local(parent, place)
            follower = self._at(index, place, name)
            self.guides.append(Guide(name, follower, through, direction, self.names[parent], aligned=not hinges))
        elif not hinges:
            self.notes.append(f"body '{body}' slides in two directions: here it also rotates")
        for j in joints:
            joint = model.joint(j)
            (self._hinge if j in hinges else self._slide)(j, index, parent, joint.name or f"joint {j}")
            if joint.armature[0]:
                self.notes.append(f"rotor inertia of joint '{joint.name or f'joint {j}'}': left out")

    def _hinge(self, j: int, index: int, parent: int, name: str) -> None:
        """Spring, damping, friction and limits of a hinge, as parts of the mechanism."""
        joint, ends, label = self.model.joint(j), (self.names[index], self.names[parent]), plain_name(name, ())
        sense, start = self._sense(j), self._angle(index) - self._angle(parent)
        q = float(self.data.joint(j).qpos[0])

        def angle(value: float) -> float:
            return start + sense * (value - q)

        stiffness, damping = _coefficients(joint)
        if stiffness or damping:
            rest = angle(float(joint.qpos_spring[0]))
            spring = TorsionSpring(f"spring of {label}", *ends, stiffness=stiffness, free_angle=rest, damping=damping)
            self.components.append(spring)
        if friction := float(joint.frictionloss[0]):
            self.components.append(Clutch(f"dry friction of {label}", ends[0], friction, ends[1]))
            self.notes.append(
                f"dry friction of joint '{name}': a clutch of {friction:g} N m that slips, with linings that yield"
            )
        for side, limit in self._limits(joint, name, q, "rad", "an angle_stop"):
            self.components.append(AngleStop(f"{side} limit of {label}", ends[0], angle(limit), ends[1]))

    def _slide(self, j: int, index: int, parent: int, name: str) -> None:
        """Spring and damping of a slide as a bushing along its line, limits on the ground as end stops."""
        joint, along, label = self.model.joint(j), self.data.xaxis[j], plain_name(name, ())
        x, y = self._flat(along)
        q, rest = float(self.data.joint(j).qpos[0]), float(joint.qpos_spring[0])
        place = self.data.xanchor[j] + (q - float(joint.qpos0[0])) * along  # MuJoCo's anchor is that before the joint moves
        stiffness, damping = _coefficients(joint)
        if stiffness or damping:
            turned = math.atan2(y, x) - self._angle(parent)
            cos, sin = math.cos(turned), math.sin(turned)
            ends = self._at(parent, place + (rest - q) * along, f"rest of {label}"), self._at(index, place, label)
            part = {"x": cos**2, "y": sin**2, "xy": cos * sin}
            numbers: dict[str, Any] = {f"stiffness_{axis}": stiffness * share for axis, share in part.items()}
            numbers |= {f"damping_{axis}": damping * share for axis, share in part.items()}
            self.components.append(Bushing(f"spring of {label}", *ends, **numbers))
        if parent:
            self.notes += [f"limits of joint '{name}': left out"] if joint.limited[0] else []
        else:
            reached = float(self.basis[0] @ place) * x + float(self.basis[1] @ place) * y
            for side, limit in reversed(self._limits(joint, name, q, "m", "a travel_stop")):
                sign = 1.0 if side == "upper" else -1.0
                point, direction = self._at(index, place, label), math.atan2(sign * y, sign * x)
                self.components.append(TravelStop(f"{side} limit of {label}", point, direction, sign * (reached + limit - q)))
        if joint.frictionloss[0]:
            self.notes.append(f"dry friction of joint '{name}': left out")

    def _limits(self, joint: Any, name: str, q: float, unit: str, stop: str) -> list[tuple[str, float]]:
        """The limits of a joint that become end stops."""
        if not joint.limited[0]:
            return []
        low, high = joint.range.tolist()
        if not low < q < high:
            self.notes.append(f"limits of joint '{name}': left out; it starts at {q:g} {unit}, they are {low:g} and {high:g}")
            return []
        self.notes.append(f"limits of joint '{name}': end stops of the stiffness and restitution that {stop} has")
        return [("lower", low), ("upper", high)]

    def _sense(self, j: int) -> float:
        """Whether a hinge turns as angles in the plane do, or against them."""
        return math.copysign(1.0, float(self.data.xaxis[j] @ self.basis[2]))

    def _equality(self, k: int) -> None:
        model, kinds, equality = self.model, self.mujoco.mjtEq, self.model.equality(k)
        name = plain_name(equality.name or f"connection {k + 1}", ())
        kind, a, b = (int(part[0]) for part in (equality.type, equality.obj1id, equality.obj2id))
        if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD, kinds.mjEQ_JOINT) or not equality.active0[0]:
            self.notes.append(f"equality '{name}': left out; it is inactive, or none of two joints, a connection or a weld")
            return
        if kind == kinds.mjEQ_JOINT:
            self._couple(equality, a, b)
            return
        if model.eq_objtype[k] == self.mujoco.mjtObj.mjOBJ_SITE:
            places = self.data.site_xpos[a], self.data.site_xpos[b]
            a, b = int(model.site_bodyid[a]), int(model.site_bodyid[b])
        else:
            # data of a connection: anchors in both bodies; of a weld: in the second one, then in the first one
            first, second = equality.data[:3], equality.data[3:6]
            if kind == kinds.mjEQ_WELD:
                first, second = second, first
            places = self._place(a, first), self._place(b, second)
        if np.linalg.norm(self.basis[:2] @ (places[0] - places[1])) > 1e-6:
            self.notes.append(f"connection '{name}' is open by {np.linalg.norm(places[0] - places[1]):.3g} m at the start")
        points = self._at(a, places[0], name), self._at(b, places[1], name)
        if points[0][0] == GROUND:
            points = points[1], points[0]
        if kind == kinds.mjEQ_CONNECT:
            self.joints.append(Revolute(name, *points))
        else:
            self.welds.append(Weld(name, *points))

    def _couple(self, equality: Any, output: int, driver: int) -> None:
        """The equality q1 - q1_0 = c0 + c1 (q2 - q2_0) + ... of two joints, where q_0 is that of the model."""
        constant, factor, *further = equality.data[:5].tolist()
        parts: tuple[Any, ...] = (*self.joints, *self.guides, *self.welds, *self.couplings)
        label = equality.name or f"coupling of {self.model.joint(output).name or equality.id + 1}"
        name = plain_name(label, [part.name for part in parts])
        pair = [self._coordinate(j) for j in (output, driver) if j >= 0]
        reason = (
            "its polynomial is not linear"
            if any(further)
            else "it holds a single joint"
            if len(pair) < 2 or factor == 0.0
            else "a slide of a body that slides in two directions"
            if None in pair
            else ""
        )
        if reason:
            self.notes.append(f"equality '{name}': left out; {reason}")
            return
        (first, sense1, here1), (second, sense2, here2) = (entry for entry in pair if entry)
        q1, q2 = (float((self.data.joint(j).qpos - self.model.joint(j).qpos0)[0]) for j in (output, driver))
        gap = constant + factor * q2 - q1
        if abs(gap) > 1e-9:
            self.notes.append(f"equality '{name}' is open by {gap:.3g} {first.unit} at the start")
        ratio = sense1 * factor * sense2
        self.couplings.append(Coupling(name, first, second, ratio, here1 + sense1 * gap - ratio * here2))

    def _coordinate(self, j: int) -> tuple[Coordinate, float, float] | None:
        """The coordinate of a hinge or of the only slide of a body, its sense, and its value at the start."""
        index = int(self.model.jnt_bodyid[j])
        parent = self._parent(index)
        name, base = self.names[index], self.names[parent]
        if j in self.hinged:
            return RelativeAngle(name, base), self._sense(j), self._angle(index) - self._angle(parent)
        if len(set(self._joints_of(index)).intersection(self.sliding)) > 1:
            return None
        guide = next(guide for guide in self.guides if guide.follower[0] == name)
        through = guide.through  # where the follower is at the start
        here = math.cos(guide.direction) * through[0] + math.sin(guide.direction) * through[1]
        return Slide(guide.follower, guide.direction, base), 1.0, here

    def _place(self, index: int, local: Any) -> np.ndarray:
        return np.asarray(self.data.xpos[index] + self.data.xmat[index].reshape(3, 3) @ np.asarray(local))

    def _body(self, index: int) -> Body:
        mass, name = float(self.model.body_mass[index]), self.names[index]
        along = self.data.ximat[index].reshape(3, 3).T @ self.basis[2]
        inertia = float(along**2 @ self.model.body_inertia[index])
        if not mass > 0.0 or not inertia > 0.0:
            what = f"body '{name}' of the model without mass or inertia"
            raise InputError(what, "an <inertial>, or geoms with a mass", SAMPLE)
        twist = np.zeros(6)
        self.mujoco.mj_objectVelocity(self.model, self.data, self.mujoco.mjtObj.mjOBJ_XBODY, index, twist, 0)
        return Body(
            name,
            mass,
            inertia,
            points=self.points[name] or {"origin": (0.0, 0.0)},
            centre=self._local(index, self.data.xipos[index]),
            position=self._flat(self.data.xpos[index]),
            angle=self._angle(index),
            velocity=self._flat(twist[3:]),
            angular_velocity=float(self.basis[2] @ twist[:3]),
        )


def _coefficients(joint: Any) -> tuple[float, float]:
    """Stiffness and damping of a joint; those of polynomials are the linear ones."""
    stiffness, damping = (float(np.ravel(part)[0]) for part in (joint.stiffness, joint.damping))
    return stiffness, damping


def _unused(root: ET.Element) -> list[str]:
    """A line for each element, and for each attribute of the elements that are used, that the import does not use."""
    table = URDF if root.tag == "robot" else MUJOCO
    elements: dict[str, list[str]] = {}
    attributes: Counter[tuple[str, str]] = Counter()

    def visit(element: ET.Element) -> None:
        taken = table.get(element.tag)
        if taken is None:
            elements.setdefault(element.tag, []).append(element.get("name", ""))
            return
        if taken == "*":
            return
        attributes.update((element.tag, key) for key in element.attrib if key not in taken.split())
        for child in element:
            visit(child)

    visit(root)
    lines = []
    for tag, names in elements.items():
        titles = ", ".join(f"'{name}'" for name in names if name)
        lines.append(f"{len(names)} <{tag}> left out{': ' + titles if titles else ''}")
    lines += [f"attribute '{key}' of {count} <{tag}>: left out" for (tag, key), count in attributes.items()]
    return lines


def _without_pictures(root: ET.Element) -> ET.Element:
    """The model without shapes from files that are only looked at: visuals of URDF, meshes of bodies whose inertia is given."""
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *(link.findall("collision") if link.find("inertial/mass") is not None else [])]:
            link.remove(shape)
    for body in root.iter("body"):
        if body.find("inertial") is not None:
            for geom in [geom for geom in body.findall("geom") if geom.get("mesh")]:
                body.remove(geom)
    if root.tag == "mujoco" and not any(geom.get("mesh") or geom.get("hfield") for geom in root.iter("geom")):
        for asset in root.findall("asset"):
            for shape in [element for element in asset if element.tag in ("mesh", "texture", "material")]:
                asset.remove(shape)
        for geom in root.iter("geom"):
            geom.attrib.pop("material", None)
    return root
