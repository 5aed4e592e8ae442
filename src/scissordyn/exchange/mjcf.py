"""Read planar mechanisms from MJCF, URDF and SDF with MuJoCo.

A model is accepted if all hinges have parallel axes and all slides are perpendicular to them. Unused parts are reported.
"""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from scissordyn.components.angle_stop import AngleStop
from scissordyn.components.clutch import Clutch
from scissordyn.components.place import GROUND
from scissordyn.components.torsion_spring import TorsionSpring
from scissordyn.components.travel_stop import TravelStop
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import Imported, plain_name, with_printable_notes
from scissordyn.exchange.loop_joint import LoopJoint, site_name
from scissordyn.exchange.mjcf_frame import compile_model
from scissordyn.exchange.mjcf_motor import MotorReader
from scissordyn.exchange.mjcf_plane import TILT_MAX
from scissordyn.exchange.robot_xml import Source, remove_unused
from scissordyn.exchange.xml_element import EXAMPLE, VALUE_MAX
from scissordyn.lookup import library
from scissordyn.model.body import Body
from scissordyn.model.coupling import Coordinate, Coupling, FurtherInput, RelativeAngle, Slide
from scissordyn.model.joint import Guide, Revolute, Weld
from scissordyn.model.mechanism import Mechanism
from scissordyn.tolerance import ASSEMBLY_TOL
from scissordyn.units import checked


@checked
def read_mjcf(text: str, *, folder: str | Path | None = None) -> Imported:
    """Return the planar mechanism of a model in MJCF, URDF or SDF at its start.

    Parameters
    ----------
    text : str
        XML of the model. Loops of a URDF are closed by `<loop_joint>` elements and by SDF joints in `<gazebo>`.
    folder : path, optional
        Folder of the files that a model in MJCF includes. Without a folder, or outside it, an include is an error. Mesh files
        whose mass counts are always an error.

    Returns
    -------
    Imported
        Bodies, joints and connections have the names of the model. The plane is perpendicular to the hinges: its x and y are
        x and y for hinges about z, x and z for hinges about y, y and z for hinges about x. Notes refer to lines of the text.

    Raises
    ------
    InputError
        If the model cannot be read, or is not planar.
    """
    mujoco = library("mujoco", "exchange", "MJCF")
    source = remove_unused(text, None if folder is None else Path(folder))
    warn = mujoco.get_mju_user_warning()
    # by default MuJoCo writes its warnings into a file of the current folder
    mujoco.set_mju_user_warning(lambda message: source.notes.append(f"MuJoCo warns: {message}"))
    try:
        model = compile_model(mujoco, source)
        data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
    except InputError:
        raise
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(
            f"MuJoCo cannot read the model: {str(error)[:500]}", "MJCF, URDF or SDF without further files", EXAMPLE
        ) from None
    finally:
        mujoco.set_mju_user_warning(warn)
    for numbers in (model.body_mass, model.body_inertia, data.xpos, data.xipos, data.xmat, data.cvel):
        if not np.all(np.isfinite(numbers)):
            raise InputError("the model has masses or positions that are not finite", "finite numbers", EXAMPLE)
    return _Reader(mujoco, model, data, source).read_mechanism()


class _Reader(MotorReader):
    """Converter of a MuJoCo model at its start to the parts of a mechanism."""

    def __init__(self, mujoco: Any, model: Any, data: Any, source: Source) -> None:
        super().__init__(mujoco, model, data, source)
        self.fixed_angle: set[int] = set()  # Bodies that slide in two directions without a hinge
        self.rotors: dict[int, float] = {}  # Rotor inertia of bodies on the ground [kg m^2]
        self.components: list[Any] = []
        self.joints: list[Revolute] = []
        self.guides: list[Guide] = []
        self.welds: list[Weld] = []
        self.couplings: list[Coupling] = []

    def read_mechanism(self) -> Imported:
        for index in self.bodies:
            self._attach(index)
        for number, loop in enumerate(self.loops):
            self._close(number, loop)
        for k in range(0 if self.loops else self.model.nsite):  # a model with loop joints has only their sites
            name = self.model.site(k).name or f"site {k}"
            self._at(int(self.model.site_bodyid[k]), self.data.site_xpos[k], name)
        for k in range(self.model.neq):
            self._equality(k)
        self._add_motors()
        for t in np.flatnonzero(self.model.tendon_limited):
            self.notes.append(f"limits of tendon '{self.model.tendon(t).name or t + 1}': left out")
        touching = int(np.sum((self.model.geom_contype != 0) | (self.model.geom_conaffinity != 0)))
        if touching:
            self.notes.append(f"{touching} geoms with contact: only their masses are kept, because bodies do not collide here")
        bodies = tuple(self._body(index) for index in self.bodies)
        if not bodies:
            raise InputError("the model has no bodies", "one body or more", EXAMPLE)
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
        return with_printable_notes(mechanism, self.notes)

    def _gravity(self) -> tuple[float, float]:
        """Return the magnitude [m/s^2] and direction [rad] of gravity in the plane."""
        gravity = self._flat(self.model.opt.gravity)
        size, across = math.hypot(*gravity), float(np.linalg.norm(self.model.opt.gravity))
        if self._disabled("GRAVITY") or not size > ASSEMBLY_TOL * across:
            if across > size == 0.0:
                self.notes.append(f"gravity of {across:g} m/s^2: left out, because it is perpendicular to the plane")
            return 0.0, -math.pi / 2
        if abs(float(self.basis[2] @ self.model.opt.gravity)) > TILT_MAX * across:
            self.notes.append(f"gravity of {across:g} m/s^2: only its part in the plane, {size:g} m/s^2, is kept")
        return size, math.atan2(gravity[1], gravity[0])

    def _attach(self, index: int) -> None:
        """Add the joints between a body and its parent, with their springs, dampers, friction and limits."""
        model, data, parent, joints = self.model, self.data, self._parent(index), self._joints_of(index)
        hinges, slides = ([j for j in joints if j in kind] for kind in (self.hinged, self.sliding))
        body = self.names[index]
        name = plain_name(next((model.joint(j).name for j in joints), "") or f"joint of {body}", ())
        if len(hinges) > 1 or len(slides) > 2:
            raise InputError(
                f"body '{body}' has {len(hinges)} hinges and {len(slides)} slides", "at most one hinge and two slides", EXAMPLE
            )
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
        self._check_slides(index, hinges, slides)
        for j in hinges:
            joint, start = model.joint(j), (float(self.data.joint(j).qpos[0]), self._sense(j))
            self._hinge(joint, self._joint_name(j), start, (index, parent))
        for j in slides:
            self._slide(j, index, parent)
        for j in (j for j in joints if model.joint(j).armature[0]):
            self._rotor(j, index, parent)

    def _rotor(self, j: int, index: int, parent: int) -> None:
        """Add the rotor inertia of a hinge on the ground to its body; report any other rotor inertia as left out."""
        what, value = f"rotor inertia of joint '{self._joint_name(j)}'", float(self.model.joint(j).armature[0])
        if j in self.hinged and not parent:
            self.rotors[index] = value
            self.notes.append(f"{what}: {value:g} kg m^2 is added to the inertia of body '{self.names[index]}'")
        else:
            reason = "its base moves" if j in self.hinged else "it resists a slide"
            self.notes.append(f"{what}: left out, because {reason}")

    def _check_slides(self, index: int, hinges: list[int], slides: list[int]) -> None:
        """Raise `InputError` for a slide that turns with its own body, and for two slides without a hinge on a moving body."""
        turned = [j for j in slides if hinges and j > hinges[0]]
        for j in turned:
            joint = self.model.joint(j)
            if len(slides) == 1 or any(map(any, _coefficients(joint))) or joint.limited[0] or joint.frictionloss[0]:
                raise InputError(
                    f"body '{self.names[index]}': slide '{self._joint_name(j)}' behind hinge '{self._joint_name(hinges[0])}' "
                    "turns with the body",
                    "the slide before the hinge, or a body for each",
                    EXAMPLE,
                )
        if len(slides) == 2 and not hinges:
            if self._parent(index):
                what = f"body '{self.names[index]}' slides in two directions on body '{self.names[self._parent(index)]}'"
                raise InputError(what, "a body of its own for each of the two slides", EXAMPLE)
            self.fixed_angle.add(index)

    def _hinge(self, joint: Any, name: str, begin: tuple[float, float], pair: tuple[int, int]) -> None:
        """Add the spring, damping, friction and limits of a hinge.

        `begin` holds its angle at the start and its sense in the plane, `pair` its body and the base.
        """
        (q, sense), (index, parent) = begin, pair
        ends, label = (self.names[index], self.names[parent]), plain_name(name, ())
        start = self._angle(index) - self._angle(parent)

        def angle(value: float) -> float:
            return start + sense * (value - q)

        stiffness, damping = self._spring(joint, name, "rad")
        if stiffness or damping:
            rest = angle(float(joint.qpos_spring[0]))
            spring = TorsionSpring(f"spring of {label}", *ends, stiffness=stiffness, free_angle=rest, damping=damping)
            self.components.append(spring)
        if friction := self._friction(joint, name):
            self.components.append(Clutch(f"dry friction of {label}", ends[0], friction, ends[1]))
            self.notes.append(
                f"dry friction of joint '{name}': a clutch with a capacity of {friction:g} N m, which yields before it slips"
            )
        for side, limit in self._limits(joint, name, q, "rad", "an angle_stop"):
            self.components.append(AngleStop(f"{side} limit of {label}", ends[0], angle(limit), ends[1]))

    def _slide(self, j: int, index: int, parent: int) -> None:
        """Add the spring and damping of a slide as a bushing; add its limits as end stops if it slides on the ground."""
        joint, name, line = self.model.joint(j), self._joint_name(j), self._slide_line(j)
        label, size = plain_name(name, ()), float(np.hypot(*line.gradient))
        stiffness, damping = self._spring(joint, name, "m")
        if stiffness or damping:
            self._add_bushing(f"spring of {label}", line, stiffness, damping, float(joint.qpos_spring[0]))
        if parent:
            self.notes += [f"limits of joint '{name}': left out"] if joint.limited[0] else []
        else:
            reached = float(line.gradient @ self._flat(line.point))
            for side, limit in reversed(self._limits(joint, name, line.coordinate, "m", "a travel_stop")):
                sign = 1.0 if side == "upper" else -1.0
                point = self._at(index, line.point, label)
                towards = math.atan2(sign * line.gradient[1], sign * line.gradient[0])
                stop = sign * (reached + limit - line.coordinate) / size
                self.components.append(TravelStop(f"{side} limit of {label}", point, towards, stop))
        if self._friction(joint, name):
            self.notes.append(f"dry friction of joint '{name}': left out")

    def _spring(self, joint: Any, name: str, unit: str) -> tuple[float, float]:
        """Return stiffness and damping of a joint, or 0 if a flag disables them; of a polynomial only the linear part."""
        coefficients, torque = [], "N m" if unit == "rad" else "N"
        parts = (("stiffness", "spring", "SPRING", unit), ("damping", "damper", "DAMPER", f"{unit}/s"))
        for (what, flag, kind, per), (value, *further) in zip(parts, _coefficients(joint), strict=True):
            if any((value, *further)) and self._disabled(kind, "PASSIVE"):
                self.notes.append(f"{what} of joint '{name}': left out, as <flag {flag}='disable'> says")
                value, further = 0.0, []
            if any(further):
                terms = ", ".join(f"{number:g}" for number in further)
                self.notes.append(
                    f"{what} of joint '{name}': its linear part, {value:g} {torque} per {per}, is kept; the coefficients "
                    f"{terms} of higher powers are left out"
                )
            coefficients.append(value)
        return coefficients[0], coefficients[1]

    def _friction(self, joint: Any, name: str) -> float:
        """Return the dry friction of a joint [N m or N], or 0 if a flag disables it."""
        friction = float(joint.frictionloss[0])
        if friction and self._disabled("FRICTIONLOSS", "CONSTRAINT"):
            self.notes.append(f"dry friction of joint '{name}': left out, as <flag frictionloss='disable'> says")
            return 0.0
        return friction

    def _limits(self, joint: Any, name: str, q: float, unit: str, stop: str) -> list[tuple[str, float]]:
        """Return name and position of the end stops of a joint; a limit at the start position is moved slightly outwards."""
        if not joint.limited[0]:
            return []
        if self._disabled("LIMIT", "CONSTRAINT"):
            self.notes.append(f"limits of joint '{name}': left out, as <flag limit='disable'> says")
            return []
        low, high = joint.range.tolist()
        stops = []
        for side, limit, beyond in (("lower", low, low - q), ("upper", high, q - high)):
            if abs(limit) >= VALUE_MAX:
                continue
            if beyond > (TILT_MAX if unit == "rad" else ASSEMBLY_TOL):
                self.notes.append(f"{side} limit of joint '{name}': left out; it is {limit:g} {unit}, the start {q:g} {unit}")
                continue
            if beyond > ASSEMBLY_TOL:
                self.notes.append(
                    f"{side} limit of joint '{name}': its end stop is at the start, {beyond:.2g} {unit} beyond it"
                )
            stops.append((side, min(limit, q - ASSEMBLY_TOL) if side == "lower" else max(limit, q + ASSEMBLY_TOL)))
        if stops:
            self.notes.append(f"limits of joint '{name}': end stops of the stiffness and restitution that {stop} has")
        return stops

    def _equality(self, k: int) -> None:
        model, kinds, equality = self.model, self.mujoco.mjtEq, self.model.equality(k)
        name = plain_name(equality.name or f"connection {k + 1}", ())
        kind, a, b = (int(part[0]) for part in (equality.type, equality.obj1id, equality.obj2id))
        read = kinds.mjEQ_CONNECT, kinds.mjEQ_WELD, kinds.mjEQ_JOINT, kinds.mjEQ_TENDON
        if kind not in read or not equality.active0[0]:
            what = "it is inactive, or not a connection, a weld or an equality of joints or tendons"
            self.notes.append(f"equality '{name}': left out; {what}")
            return
        if self._disabled("EQUALITY", "CONSTRAINT"):
            self.notes.append(f"equality '{name}': left out, as <flag equality='disable'> says")
            return
        if kind in (kinds.mjEQ_JOINT, kinds.mjEQ_TENDON):
            output, driver = (
                {} if part < 0 else {part: 1.0} if kind == kinds.mjEQ_JOINT else self._tendon_joints(part) for part in (a, b)
            )
            self._couple(equality, output, driver)
            return
        if model.eq_objtype[k] == self.mujoco.mjtObj.mjOBJ_SITE:
            places = self.data.site_xpos[a], self.data.site_xpos[b]
            a, b = int(model.site_bodyid[a]), int(model.site_bodyid[b])
        else:
            # the data of a connection has anchors in the first and second body, that of a weld in the second and first body
            first, second = equality.data[:3], equality.data[3:6]
            if kind == kinds.mjEQ_WELD:
                first, second = second, first
            places = self._place(a, first), self._place(b, second)
        self._connect(name, (a, b), places, None if kind == kinds.mjEQ_CONNECT else self._weld_frames(k))

    def _connect(self, name: str, ends: tuple[int, int], places: Any, weld_frames: Any) -> None:
        """Add the pin of two bodies, or their weld if its orientations are given; report how far it is open at the start."""
        if math.hypot(*self._flat(places[0] - places[1])) > 1e-6:
            self.notes.append(f"connection '{name}' is open by {math.hypot(*(places[0] - places[1])):.3g} m at the start")
        points = self._at(ends[0], places[0], name), self._at(ends[1], places[1], name)
        if points[0][0] == GROUND:
            points = points[1], points[0]
        if weld_frames is None:
            self.joints.append(Revolute(name, *points))
            return
        first, second = weld_frames
        x, y = self._flat(second @ first.T @ self.basis[0])
        if abs(turned := math.atan2(y, x)) > 1e-6:
            self.notes.append(f"weld '{name}' is open by {math.degrees(turned):.3g} deg at the start: that angle is kept")
        self.welds.append(Weld(name, *points))

    def _close(self, number: int, loop: LoopJoint) -> None:
        """Add the pin, guide or weld of a joint that closes a loop."""
        marks = [self.data.site(site_name(number, k)) for k in range(4)]
        ends = [self.host[int(self.model.site(site_name(number, k)).bodyid[0])] for k in range(2)]
        if ends[0] == ends[1]:
            raise InputError(
                f"{loop.shown} joins '{loop.links[0]}' and '{loop.links[1]}', which are one rigid body",
                "a joint between two links that move relative to each other",
                EXAMPLE,
            )
        parts: tuple[Any, ...] = (*self.joints, *self.guides, *self.welds)
        name = plain_name(loop.name, [part.name for part in parts])
        places = marks[2].xpos.copy(), marks[3].xpos.copy()
        if loop.kind != "slide":
            frames = [mark.xmat.reshape(3, 3) for mark in marks[2:]] if loop.kind == "weld" else None
            self._connect(name, (ends[0], ends[1]), places, frames)
            if loop.kind == "pin" and loop.attributes and loop.axis is not None:
                self._loop_hinge(name, number, loop, (ends[0], ends[1]))
            return
        assert loop.axis is not None
        follower, carrier = ends if ends[0] else ends[::-1]
        along = self.data.site(site_name(number, 4)).xmat.reshape(3, 3) @ np.array(loop.axis)
        x, y = self._flat(along)
        direction, through = math.atan2(y, x) - self._angle(carrier), self._local(carrier, places[0])
        point = self._at(follower, places[0], name)
        self.guides.append(Guide(name, point, through, direction, self.names[carrier], aligned=True))

    def _loop_hinge(self, name: str, number: int, loop: LoopJoint, ends: tuple[int, int]) -> None:
        """Add the spring, damping, friction and limits of a pin that closes a loop; its angle at the start is 0."""
        part = {key: np.array(text.split(), float) for key, text in loop.attributes.items()}
        zero = np.zeros(1)
        joint = SimpleNamespace(
            stiffness=part.get("stiffness", zero),
            damping=part.get("damping", zero),
            frictionloss=part.get("frictionloss", zero),
            qpos_spring=part.get("springref", zero),
            limited=["range" in part],
            range=part.get("range"),
        )
        axis = self.data.site(site_name(number, 4)).xmat.reshape(3, 3) @ np.array(loop.axis)
        sense = math.copysign(1.0, float(axis @ self.basis[2]))
        if ends[0]:
            self._hinge(joint, name, (0.0, sense), ends)
        else:  # a component acts on a body; the ground is its base
            self._hinge(joint, name, (0.0, -sense), ends[::-1])

    def _weld_frames(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the orientation that a weld prescribes for its second body, and the orientation of that body at the start."""
        a, b = int(self.model.eq_obj1id[k]), int(self.model.eq_obj2id[k])
        if self.model.eq_objtype[k] == self.mujoco.mjtObj.mjOBJ_SITE:
            first, second = (self.data.site_xmat[site].reshape(3, 3) for site in (a, b))
        else:
            pose = np.zeros(9)
            self.mujoco.mju_quat2Mat(pose, self.model.eq_data[k][6:10])
            first, second = self.data.xmat[a].reshape(3, 3) @ pose.reshape(3, 3), self.data.xmat[b].reshape(3, 3)
        return first, second

    def _couple(self, equality: Any, output: dict[int, float], driver: dict[int, float]) -> None:
        """Add the coupling l1 - l1_0 = c0 + c1 (l2 - l2_0) of two joints or tendons, or of one tendon without l2.

        Each length l is a weighted sum of joint positions, and l_0 its value at the model's reference position. Both sides map
        joints to weights.
        """
        constant, factor, *further = equality.data[:5].tolist()
        weights = output | {j: output.get(j, 0.0) - factor * weight for j, weight in driver.items()}
        weights = {j: weight for j, weight in weights.items() if weight}
        entries = [self._coordinate(j) for j in weights]
        parts: tuple[Any, ...] = (*self.joints, *self.guides, *self.welds, *self.couplings)
        label = equality.name or f"coupling of {self.model.joint(next(iter(output))).name or equality.id + 1}"
        name = plain_name(label, [part.name for part in parts])
        reason = (
            "its polynomial is not linear"
            if driver and any(further)
            else "it relates fewer than two joints"
            if len(weights) < 2
            else "a slide of a body that slides in two directions"
            if None in entries
            else ""
        )
        if reason:
            self.notes.append(f"equality '{name}': left out; {reason}")
            return
        moved = sum(weight * float((self.data.joint(j).qpos - self.model.joint(j).qpos0)[0]) for j, weight in weights.items())
        (first, sense, here), *others = (entry for entry in entries if entry)
        scale, *factors = weights.values()
        gap = (constant - moved) / scale
        if abs(gap) > 1e-9:
            self.notes.append(f"equality '{name}' is open by {gap:.3g} {first.unit} at the start")
        offset, inputs = here + sense * gap, []
        for weight, (coordinate, sign, value) in zip(factors, others, strict=True):
            ratio = -sense * weight * sign / scale
            offset -= ratio * value
            inputs.append(FurtherInput(coordinate, ratio))
        second, *more = inputs
        self.couplings.append(Coupling(name, first, second.coordinate, second.ratio, offset, further=tuple(more)))

    def _coordinate(self, j: int) -> tuple[Coordinate, float, float] | None:
        """Return the coordinate of a joint, its sign and its value at the start; None for one of two slides of a body."""
        index = int(self.model.jnt_bodyid[j])
        parent = self._parent(index)
        name, base = self.names[index], self.names[parent]
        if j in self.hinged:
            return RelativeAngle(name, base), self._sense(j), self._angle(index) - self._angle(parent)
        if len(set(self._joints_of(index)).intersection(self.sliding)) > 1:
            return None
        guide = next(guide for guide in self.guides if guide.follower[0] == name)
        through = guide.through  # the position of the follower at the start
        here = math.cos(guide.direction) * through[0] + math.sin(guide.direction) * through[1]
        return Slide(guide.follower, guide.direction, base), 1.0, here

    def _body(self, index: int) -> Body:
        """Return a body at the start; a body with two slides and no hinge does not rotate."""
        mass, name, turns = float(self.model.body_mass[index]), self.names[index], index not in self.fixed_angle
        along = self.data.ximat[index].reshape(3, 3).T @ self.basis[2]
        inertia = float(along**2 @ self.model.body_inertia[index])
        if turns and not (mass > 0.0 and inertia > 0.0):
            what = f"body '{name}' of the model has no mass or no inertia"
            raise InputError(what, "an <inertial>, or geoms with a mass", EXAMPLE)
        twist = self._twist(index)
        return Body(
            name,
            mass,
            inertia + self.rotors.get(index, 0.0) if turns else None,
            points=self.points[name] or {"origin": (0.0, 0.0)},
            centre=self._local(index, self.data.xipos[index]),
            position=self._flat(self.data.xpos[index]),
            angle=self._angle(index),
            velocity=self._flat(twist[3:]),
            angular_velocity=float(self.basis[2] @ twist[:3]) if turns else None,
        )


def _coefficients(joint: Any) -> tuple[list[float], list[float]]:
    """Return the coefficients of a joint's stiffness and damping polynomials; old MuJoCo versions have only linear terms."""
    parts = ([getattr(joint, name, []) for name in (what, f"{what}poly")] for what in ("stiffness", "damping"))
    stiffness, damping = ([float(value) for part in pair for value in np.ravel(part)] for pair in parts)
    return stiffness, damping
