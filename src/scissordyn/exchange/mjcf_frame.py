"""Compile a model with MuJoCo, and read positions and names of its bodies in the plane."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np

from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import plain_name
from scissordyn.exchange.loop_joint import add_loop_sites, site_name
from scissordyn.exchange.mjcf_plane import TILT_MAX, plane_of
from scissordyn.exchange.robot_xml import Source
from scissordyn.exchange.xml_element import EXAMPLE


def compile_model(mujoco: Any, source: Source) -> Any:
    """Compile a text with MuJoCo and return the model, with sites at the joints that close loops."""
    if not source.loops:
        return mujoco.MjModel.from_xml_string(source.text)
    spec = mujoco.MjSpec.from_string(source.text)
    add_loop_sites(spec, source.loops)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always", UserWarning)
        model = spec.compile()
    source.notes.extend(f"MuJoCo warns: {' '.join(str(warning.message).split())}" for warning in warned)
    return model


class ModelFrames:
    """MuJoCo model at its start: positions, angles and names of its bodies in the plane of the mechanism."""

    def __init__(self, mujoco: Any, model: Any, data: Any, source: Source) -> None:
        self.mujoco, self.model, self.data, self.notes = mujoco, model, data, source.notes
        self.loops, self.motors = source.loops, source.motors
        if source.key_count:
            name = model.key(0).name or 0
            self.notes.append(f"start: positions and velocities of keyframe '{name}', the first of {source.key_count}")
        if not source.gives_gravity:
            self.notes.append("gravity: a URDF has none; that of MuJoCo is assumed, 9.81 m/s^2 along -z")
        # a body without mass and joints becomes points of the body to which it is fixed
        self.host = [0]
        for index in range(1, model.nbody):
            fixed = not model.body_jntnum[index] and not model.body_mass[index] > 0.0
            self.host.append(self.host[int(model.body_parentid[index])] if fixed else index)
        self.bodies = [index for index in range(1, model.nbody) if self.host[index] == index]
        self.hinged, self.sliding = (
            [j for j in range(model.njnt) if model.jnt_type[j] == kind]
            for kind in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
        )
        if balls := int(np.sum(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL)):
            raise InputError(f"the model has {balls} ball joints", "hinges and slides, in one plane", EXAMPLE)
        hinges, slides = ([(self._joint_name(j), data.xaxis[j]) for j in joints] for joints in (self.hinged, self.sliding))
        for number, loop in enumerate(self.loops):
            if loop.axis is not None and loop.kind != "weld":
                axis = data.site(site_name(number, 4)).xmat.reshape(3, 3) @ np.array(loop.axis)
                (hinges if loop.kind == "pin" else slides).append((loop.name, axis / np.linalg.norm(axis)))
        self.basis = plane_of(hinges, slides, model.opt.gravity, self.notes)
        self.names = [GROUND]
        for index in range(1, model.nbody):
            self.names.append(plain_name(model.body(index).name or f"body {index}", self.names))
        self.points: dict[str, dict[str, Point]] = {name: {} for name in self.names}

    def _joint_name(self, j: int) -> str:
        return self.model.joint(j).name or f"joint {j}"

    def _disabled(self, *kinds: str) -> bool:
        """Return True if a <flag> of the model disables a kind of force; kinds unknown to this MuJoCo version are ignored."""
        bits = [getattr(self.mujoco.mjtDisableBit, f"mjDSBL_{kind}", 0) for kind in kinds]
        return any(self.model.opt.disableflags & int(bit) for bit in bits)

    def _sense(self, j: int) -> float:
        """Return 1.0 if a hinge turns counter-clockwise in the plane, otherwise -1.0."""
        return math.copysign(1.0, float(self.data.xaxis[j] @ self.basis[2]))

    def _flat(self, vector: Any) -> Point:
        x, y, _ = self.basis @ np.asarray(vector, float)
        return float(x), float(y)

    def _angle(self, index: int) -> float:
        """Return the angle of a body in the plane [rad]: of its x axis, or of its y axis if x is normal to the plane."""
        if index == 0:
            return 0.0
        axes = self.data.xmat[index].reshape(3, 3)
        normal = abs(axes.T @ self.basis[2])
        x, y = self._flat(axes[:, 1 if int(np.argmax(normal)) == 0 else 0])
        return math.atan2(y, x)

    def _local(self, index: int, place: Any) -> Point:
        """Return the coordinates of a point in space in the frame of a body, projected to the plane [m]."""
        x, y = self._flat(np.asarray(place) - self.data.xpos[index])
        cos, sin = math.cos(self._angle(index)), math.sin(self._angle(index))
        return cos * x + sin * y, cos * y - sin * x

    def _at(self, index: int, place: Any, name: str) -> BodyPoint:
        """Return the point of a body at a position in space; add a point with this name if there is none."""
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

    def _tendon_joints(self, tendon: int) -> dict[int, float]:
        """Return the coefficients of a fixed tendon by joint; they multiply the joint positions in its length."""
        first = int(self.model.tendon_adr[tendon])
        part = slice(first, first + int(self.model.tendon_num[tendon]))
        return dict(zip(self.model.wrap_objid[part].tolist(), self.model.wrap_prm[part].tolist(), strict=True))

    def _parent(self, index: int) -> int:
        return self.host[int(self.model.body_parentid[index])]

    def _place(self, index: int, local: Any) -> np.ndarray:
        return np.asarray(self.data.xpos[index] + self.data.xmat[index].reshape(3, 3) @ np.asarray(local))

    def _twist(self, index: int) -> np.ndarray:
        """Return the angular velocity of a body and the velocity of its origin; add a note if they are not in the plane."""
        twist = np.zeros(6)
        self.mujoco.mj_objectVelocity(self.model, self.data, self.mujoco.mjtObj.mjOBJ_XBODY, index, twist, 0)
        normal = self.basis[2]
        out = abs(float(normal @ twist[3:])) + float(np.linalg.norm(np.cross(normal, twist[:3])))
        if out > TILT_MAX * float(np.linalg.norm(twist)):
            self.notes.append(f"body '{self.names[index]}': its velocity out of the plane at the start is left out")
        return twist
