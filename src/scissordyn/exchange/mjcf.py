"""MJCF and URDF, read by MuJoCo: the planar mechanisms among them.

A mechanism is understood if all hinges have parallel axes and all slides are at right angles to these. What the import does
not use is named.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from scissordyn.component.angle_stop import AngleStop
from scissordyn.component.bushing import Bushing
from scissordyn.component.clutch import Clutch
from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.component.torsion_spring import TorsionSpring
from scissordyn.component.travel_stop import TravelStop
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import Imported, plain_name
from scissordyn.exchange.unused import unused, without_pictures
from scissordyn.extra import library
from scissordyn.model.body import Body
from scissordyn.model.connection import Weld
from scissordyn.model.coupling import Coordinate, Coupling, RelativeAngle, Slide
from scissordyn.model.joint import Guide, Revolute
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
    notes = unused(root)
    text = ET.tostring(without_pictures(root), encoding="unicode")
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
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, 0) or "0"
        notes.append(f"start: positions and velocities of keyframe '{name}', the first of {model.nkey}")
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    return _Reader(mujoco, model, data, notes).imported()


class _Reader:
    """A model at its start, and the parts made of it so far."""

    def __init__(self, mujoco: Any, model: Any, data: Any, notes: list[str]) -> None:
        self.mujoco, self.model, self.data, self.notes = mujoco, model, data, notes
        self.host = self._hosts()
        self.components: list[Any] = []
        self.basis = self._plane()
        self.names = self._names()
        self.points: dict[str, dict[str, Point]] = {name: {} for name in self.names}
        self.joints: list[Revolute] = []
        self.guides: list[Guide] = []
        self.welds: list[Weld] = []
        self.couplings: list[Coupling] = []
        self.turning = [False] * model.nbody

    def imported(self) -> Imported:
        for index in self._bodies():
            self._attach(index)
        for site in range(self.model.nsite):
            self._at(
                int(self.model.site_bodyid[site]), self.data.site_xpos[site], self._name("mjOBJ_SITE", site) or f"site {site}"
            )
        for index in range(self.model.neq):
            self._equality(index)
        self._left_out()
        bodies = tuple(self._body(index) for index in self._bodies())
        if not bodies:
            raise InputError("a model of MuJoCo without bodies", "one body or more", SAMPLE)
        gravity = self._flat(self.model.opt.gravity)
        size, across = math.hypot(*gravity), float(np.linalg.norm(self.model.opt.gravity))
        if across - size > PARALLEL * across:
            self.notes.append(f"gravity of {across:g} m/s^2: only its part in the plane, {size:g} m/s^2, is kept")
        if not self.model.opt.disableflags & self.mujoco.mjtDisableBit.mjDSBL_GRAVITY and size > 0.0:
            direction = math.atan2(gravity[1], gravity[0])
        else:
            size, direction = 0.0, -math.pi / 2
        ground = tuple(self.points[GROUND].items())
        mechanism = Mechanism(
            bodies=bodies,
            joints=tuple(self.joints),
            guides=tuple(self.guides),
            welds=tuple(self.welds),
            couplings=tuple(self.couplings),
            components=tuple(self.components),
            ground=ground,
            gravity=size,
            gravity_direction=direction,
            input_body=bodies[0].name,
        )
        return Imported(mechanism, tuple(self.notes))

    def _hosts(self) -> list[int]:
        """The body that each is part of: those without mass and joints are points of the body that they are fixed to."""
        host = [0]
        for index in range(1, self.model.nbody):
            fixed = not self.model.body_jntnum[index] and not self.model.body_mass[index] > 0.0
            host.append(host[int(self.model.body_parentid[index])] if fixed else index)
        return host

    def _bodies(self) -> list[int]:
        return [index for index in range(1, self.model.nbody) if self.host[index] == index]

    def _plane(self) -> np.ndarray:
        """Unit vectors of x and y of the plane, and of its normal, as rows."""
        kinds = self.mujoco.mjtJoint
        hinges = [self.data.xaxis[j] for j in range(self.model.njnt) if self.model.jnt_type[j] == kinds.mjJNT_HINGE]
        slides = [self.data.xaxis[j] for j in range(self.model.njnt) if self.model.jnt_type[j] == kinds.mjJNT_SLIDE]
        balls = int(np.sum(self.model.jnt_type == kinds.mjJNT_BALL))
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
        rows = {0: ([0, 1, 0], [0, 0, 1]), 1: ([1, 0, 0], [0, 0, 1]), 2: ([1, 0, 0], [0, 1, 0])}[main]
        return np.array([*rows, normal], float)

    def _flat(self, vector: Any) -> Point:
        x, y, _ = self.basis @ np.asarray(vector, float)
        return float(x), float(y)

    def _names(self) -> list[str]:
        names = [GROUND]
        for index in range(1, self.model.nbody):
            names.append(plain_name(self._name("mjOBJ_BODY", index) or f"body {index}", names))
        return names

    def _name(self, kind: str, index: int) -> str:
        return self.mujoco.mj_id2name(self.model, getattr(self.mujoco.mjtObj, kind), index) or ""

    def _angle(self, index: int) -> float:
        """Direction of a body's x axis in the plane; of its y axis where x is the normal."""
        if index == 0:
            return 0.0
        axes = self.data.xmat[index].reshape(3, 3)
        normal = abs(axes.T @ self.basis[2])
        along = axes[:, 1] if int(np.argmax(normal)) == 0 else axes[:, 0]
        x, y = self._flat(along)
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

    def _attach(self, index: int) -> None:
        """The joints of a body with its parent."""
        model, parent, kinds = self.model, self.host[int(self.model.body_parentid[index])], self.mujoco.mjtJoint
        first, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
        joints_of_body = list(range(first, first + count)) if count else []
        hinges = [j for j in joints_of_body if model.jnt_type[j] == kinds.mjJNT_HINGE]
        slides = [j for j in joints_of_body if model.jnt_type[j] == kinds.mjJNT_SLIDE]
        name = plain_name(
            next((self._name("mjOBJ_JOINT", j) for j in joints_of_body), "") or f"joint of {self.names[index]}", ()
        )
        if len(hinges) > 1 or len(slides) > 2:
            raise InputError(
                f"body '{self.names[index]}' with {len(hinges)} hinges and {len(slides)} slides", "one hinge", SAMPLE
            )
        if joints_of_body and model.jnt_type[joints_of_body[0]] == kinds.mjJNT_FREE:
            self.notes.append(f"body '{self.names[index]}' moves freely: here in the plane")
            return
        if not joints_of_body:
            place = self.data.xpos[index]
            self.welds.append(Weld(name, self._at(index, place, "origin"), self._at(parent, place, name)))
        elif not slides:
            place = self.data.xanchor[hinges[0]]
            self.joints.append(Revolute(name, self._at(index, place, name), self._at(parent, place, name)))
        elif len(slides) == 1:
            place = self.data.xanchor[hinges[0] if hinges else slides[0]]
            x, y = self._flat(self.data.xaxis[slides[0]])
            direction = math.atan2(y, x) - self._angle(parent)
            through = self._local(parent, place)
            follower = self._at(index, place, name)
            self.guides.append(Guide(name, follower, through, direction, self.names[parent], aligned=not hinges))
        elif not hinges:
            self.notes.append(f"body '{self.names[index]}' slides in two directions: here it also rotates")
        for j in joints_of_body:
            self._joint_left_out(j, taken=self._hinge(j, index, parent) if j in hinges else self._slide(j, index, parent))

    def _hinge(self, j: int, index: int, parent: int) -> bool:
        """Spring, damping and limits of a hinge, as parts of the mechanism."""
        model, name = self.model, self._name("mjOBJ_JOINT", j) or f"joint {j}"
        sense = math.copysign(1.0, float(self.data.xaxis[j] @ self.basis[2]))
        address = int(model.jnt_qposadr[j])
        placed, base = self._angle(index), self._angle(parent)
        q = float(self.data.qpos[address])

        def angle(value: float) -> float:
            return placed - base + sense * (value - q)

        ends = self.names[index], self.names[parent]
        stiffness = float(np.ravel(model.jnt_stiffness[j])[0])
        damping = float(np.ravel(model.dof_damping[int(model.jnt_dofadr[j])])[0])
        if stiffness or damping:
            rest = angle(float(model.qpos_spring[address]))
            self.components.append(
                TorsionSpring(f"spring of {plain_name(name, ())}", *ends, stiffness=stiffness, free_angle=rest, damping=damping)
            )
        friction = float(model.dof_frictionloss[int(model.jnt_dofadr[j])])
        if friction:
            self.components.append(Clutch(f"dry friction of {plain_name(name, ())}", ends[0], friction, ends[1]))
            self.notes.append(
                f"dry friction of joint '{name}': a clutch of {friction:g} N m that slips, with linings that yield"
            )
        if model.jnt_limited[j]:
            low, high = model.jnt_range[j].tolist()
            if not low < q < high:
                self.notes.append(f"limits of joint '{name}': left out; it starts at {q:g} rad, they are {low:g} and {high:g}")
                return True
            for label, limit in (("lower", low), ("upper", high)):
                stop = AngleStop(f"{label} limit of {plain_name(name, ())}", ends[0], angle(limit), ends[1])
                self.components.append(stop)
            self.notes.append(f"limits of joint '{name}': end stops of the stiffness and restitution that an angle_stop has")
        return True

    def _slide(self, j: int, index: int, parent: int) -> bool:
        """Spring and damping of a slide as a bushing along its line, limits on the ground as end stops."""
        model, name = self.model, plain_name(self._name("mjOBJ_JOINT", j) or f"joint {j}", ())
        along, slot = self.data.xaxis[j], int(model.jnt_qposadr[j])
        x, y = self._flat(along)
        q, rest = float(self.data.qpos[slot]), float(model.qpos_spring[slot])
        place = self.data.xanchor[j] + (q - float(model.qpos0[slot])) * along  # MuJoCo's anchor is that before the joint moves
        stiffness = float(np.ravel(model.jnt_stiffness[j])[0])
        damping = float(np.ravel(model.dof_damping[int(model.jnt_dofadr[j])])[0])
        if stiffness or damping:
            turned = math.atan2(y, x) - self._angle(parent)
            cos, sin = math.cos(turned), math.sin(turned)
            ends = self._at(parent, place + (rest - q) * along, f"rest of {name}"), self._at(index, place, name)
            part = {"x": cos**2, "y": sin**2, "xy": cos * sin}
            numbers: dict[str, Any] = {f"stiffness_{axis}": stiffness * share for axis, share in part.items()}
            numbers |= {f"damping_{axis}": damping * share for axis, share in part.items()}
            self.components.append(Bushing(f"spring of {name}", *ends, **numbers))
        if not model.jnt_limited[j] or parent:
            return False
        low, high = model.jnt_range[j].tolist()
        if not low < q < high:
            self.notes.append(f"limits of joint '{name}': left out; it starts at {q:g} m, they are {low:g} and {high:g}")
            return True
        point = self._at(index, place, name)
        reached = float(self.basis[0] @ place) * x + float(self.basis[1] @ place) * y
        for label, direction, limit in (
            ("upper", math.atan2(y, x), reached + high - q),
            ("lower", math.atan2(-y, -x), q - low - reached),
        ):
            self.components.append(TravelStop(f"{label} limit of {name}", point, direction, limit))
        self.notes.append(f"limits of joint '{name}': end stops of the stiffness and restitution that a travel_stop has")
        return True

    def _joint_left_out(self, j: int, *, taken: bool) -> None:
        model, name = self.model, self._name("mjOBJ_JOINT", j) or f"joint {j}"
        dof = int(model.jnt_dofadr[j])
        hinge = model.jnt_type[j] == self.mujoco.mjtJoint.mjJNT_HINGE
        reasons = {
            "limits": not taken and bool(model.jnt_limited[j]),
            "dry friction": not hinge and float(model.dof_frictionloss[dof]) != 0.0,
            "rotor inertia": float(model.dof_armature[dof]) != 0.0,
        }
        self.notes += [f"{what} of joint '{name}': left out" for what, there in reasons.items() if there]

    def _equality(self, index: int) -> None:
        model, kinds = self.model, self.mujoco.mjtEq
        name = plain_name(self._name("mjOBJ_EQUALITY", index) or f"connection {index + 1}", ())
        kind = kinds(int(model.eq_type[index]))
        if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD, kinds.mjEQ_JOINT) or not model.eq_active0[index]:
            self.notes.append(f"equality '{name}': left out; it is inactive, or none of two joints, a connection or a weld")
            return
        a, b = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
        if kind == kinds.mjEQ_JOINT:
            self._couple(index, a, b)
            return
        if model.eq_objtype[index] == self.mujoco.mjtObj.mjOBJ_SITE:
            places = self.data.site_xpos[a], self.data.site_xpos[b]
            a, b = int(model.site_bodyid[a]), int(model.site_bodyid[b])
        else:
            # data of a connection: anchors in both bodies; of a weld: in the second one, then in the first one
            first, second = model.eq_data[index][:3], model.eq_data[index][3:6]
            if kind == kinds.mjEQ_WELD:
                first, second = second, first
            places = self._place(a, first), self._place(b, second)
        if np.linalg.norm(self.basis[:2] @ (places[0] - places[1])) > 1e-6:
            self.notes.append(f"connection '{name}' is open by {np.linalg.norm(places[0] - places[1]):.3g} m at the start")
        points = self._at(a, places[0], name), self._at(b, places[1], name)
        if points[0][0] == GROUND:
            points = points[1], points[0]
        self.joints += [Revolute(name, *points)] if kind == kinds.mjEQ_CONNECT else []
        self.welds += [Weld(name, *points)] if kind == kinds.mjEQ_WELD else []

    def _couple(self, index: int, output: int, driver: int) -> None:
        """The equality q1 - q1_0 = c0 + c1 (q2 - q2_0) + ... of two joints, where q_0 is that of the model."""
        model = self.model
        constant, factor, *further = model.eq_data[index][:5].tolist()
        label = self._name("mjOBJ_EQUALITY", index) or f"coupling of {self._name('mjOBJ_JOINT', output) or index + 1}"
        parts: tuple[Any, ...] = (*self.joints, *self.guides, *self.welds, *self.couplings)
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
        q1, q2 = (float((self.data.qpos - model.qpos0)[model.jnt_qposadr[j]]) for j in (output, driver))
        gap = constant + factor * q2 - q1
        if abs(gap) > 1e-9:
            self.notes.append(f"equality '{name}' is open by {gap:.3g} {first.unit} at the start")
        ratio = sense1 * factor * sense2
        self.couplings.append(Coupling(name, first, second, ratio, here1 + sense1 * gap - ratio * here2))

    def _coordinate(self, j: int) -> tuple[Coordinate, float, float] | None:
        """The coordinate of a hinge or of the only slide of a body, its sense, and its value at the start."""
        model, kinds = self.model, self.mujoco.mjtJoint
        index = int(model.jnt_bodyid[j])
        parent, first = self.host[int(model.body_parentid[index])], int(model.body_jntadr[index])
        joints = range(first, first + int(model.body_jntnum[index]))
        base, axis = self.names[parent], self.data.xaxis[j]
        if model.jnt_type[j] == kinds.mjJNT_HINGE:
            sense = math.copysign(1.0, float(axis @ self.basis[2]))
            return RelativeAngle(self.names[index], base), sense, self._angle(index) - self._angle(parent)
        if sum(model.jnt_type[k] == kinds.mjJNT_SLIDE for k in joints) > 1:
            return None
        guide = next(guide for guide in self.guides if guide.follower[0] == self.names[index])
        through = guide.through  # where the follower is at the start
        here = math.cos(guide.direction) * through[0] + math.sin(guide.direction) * through[1]
        return Slide(guide.follower, guide.direction, base), 1.0, here

    def _place(self, index: int, local: Any) -> np.ndarray:
        return np.asarray(self.data.xpos[index] + self.data.xmat[index].reshape(3, 3) @ np.asarray(local))

    def _body(self, index: int) -> Body:
        mass = float(self.model.body_mass[index])
        axes = self.data.ximat[index].reshape(3, 3)
        along = axes.T @ self.basis[2]
        inertia = float(along**2 @ self.model.body_inertia[index])
        name = self.names[index]
        if not mass > 0.0 or not inertia > 0.0:
            raise InputError(
                f"body '{name}' of the model without mass or inertia", "an <inertial>, or geoms with a mass", SAMPLE
            )
        points, twist = self.points[name], np.zeros(6)
        self.mujoco.mj_objectVelocity(self.model, self.data, self.mujoco.mjtObj.mjOBJ_XBODY, index, twist, 0)
        return Body(
            name,
            mass,
            inertia,
            points=points or {"origin": (0.0, 0.0)},
            centre=self._local(index, self.data.xipos[index]),
            position=self._flat(self.data.xpos[index]),
            angle=self._angle(index),
            velocity=self._flat(twist[3:]),
            angular_velocity=float(self.basis[2] @ twist[:3]),
        )

    def _left_out(self) -> None:
        for count, what in LEFT_OUT.items():
            number = int(getattr(self.model, count, 0))
            self.notes += [f"{number} {what}: left out"] if number else []
        touching = int(np.sum((self.model.geom_contype != 0) | (self.model.geom_conaffinity != 0)))
        if touching:
            self.notes.append(f"{touching} geoms that may touch: only their masses are kept, bodies do not collide here")
