"""Convert the actuators of a MuJoCo model on hinges and slides, and the motors of a URDF, to torques, forces and servos.

Source: MuJoCo's documentation, "Actuation model". The force of an actuator is affine in its input, length and speed.
The length is gear times the position of the joint, and gear times the force acts on the joint. On a fixed tendon, the gear of
each joint is that of the actuator times the coefficient of the joint.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.components.bushing import Bushing
from scissordyn.components.force import Force
from scissordyn.components.time_function import ConstantSpeed, Polynomial
from scissordyn.components.torque import Torque
from scissordyn.control.tracking.pid import PID
from scissordyn.exchange.drawing import plain_name
from scissordyn.exchange.mjcf_frame import ModelFrames


class SlideLine(NamedTuple):
    """Line of a slide joint at the start: a displacement d of `point` in the plane changes the coordinate by gradient @ d."""

    joint: int  # Index of the joint
    ends: tuple[int, int]  # Indices of the sliding body and its parent
    point: np.ndarray  # Point of the body on the line, in space [m]
    axis: np.ndarray  # Unit vector of the line, in space
    gradient: np.ndarray  # Derivative of the joint's coordinate by the position of `point` in the plane
    coordinate: float  # Coordinate of the joint at the start [m]
    has_hinge: bool  # True if the body also has a hinge


class ActuatorForce(NamedTuple):
    """Force or torque of an actuator at coordinate q of its joint: constant - stiffness q - damping q', within bounds."""

    name: str
    input: float  # Input of the actuator at the start
    constant: float  # [N m or N]
    stiffness: float  # [N m/rad or N/m]
    damping: float  # [N m s/rad or N s/m]
    bounds: tuple[float, float]  # Smallest and largest force [N m or N]


class MotorReader(ModelFrames):
    """Reader of the actuators of a MuJoCo model."""

    components: list[Any]  # Components of the mechanism, to which actuators are added
    fixed_angle: set[int]  # Indices of bodies that slide in two directions without a hinge

    def _add_motors(self) -> None:
        """Add the actuators of the model, and the motors of a URDF, to the components."""
        for k in range(self.model.nu):
            name = plain_name(self.model.actuator(k).name or f"actuator {k + 1}", [part.name for part in self.components])
            gears = self._gears(k)
            if reason := self._reason_left_out(k, list(gears)):
                self.notes.append(f"actuator '{name}': left out; {reason}")
                continue
            for j in gears:
                if len(gears) > 1:
                    label = plain_name(f"{name} on {self._joint_name(j)}", [part.name for part in self.components])
                else:
                    label = name
                force = self._actuator_force(k, j, label)
                if j in self.hinged:
                    self._add_hinge_motor(j, force)
                else:
                    self._add_slide_motor(self._slide_line(j), force)
        hinges, torques = {self._joint_name(j): j for j in self.hinged}, dict[str, str]()
        for motor in self.motors:
            if motor.joint not in hinges:
                self.notes.append(f"{motor.shown}: left out, because its joint '{motor.joint}' is not a hinge of the model")
                continue
            j = hinges[motor.joint]
            if motor.joint not in torques:  # several elements may describe one motor
                name = plain_name(f"motor of {motor.joint}", [part.name for part in self.components])
                torques[motor.joint] = name
                self.components.append(Torque(name, self._ends(j)[0], 0.0, self._ends(j)[1]))
            limit = f", at most {self.model.jnt_actfrcrange[j, 1]:g} N m" if self.model.jnt_actfrclimited[j] else ""
            torque = f"torque '{torques[motor.joint]}' is 0 N m; a URDF has no gains"
            self.notes.append(f"{motor.shown}: {torque}{limit}{motor.facts}")

    def _ends(self, j: int) -> tuple[str, str]:
        """Return the names of the body and the parent that joint j connects."""
        index = int(self.model.jnt_bodyid[j])
        return self.names[index], self.names[self._parent(index)]

    def _gears(self, k: int) -> dict[int, float]:
        """Return the gear of actuator k by joint; on a tendon each joint has its coefficient as a factor."""
        target, gear = int(self.model.actuator_trnid[k, 0]), float(self.model.actuator_gear[k, 0])
        if self.model.actuator_trntype[k] != int(self.mujoco.mjtTrn.mjTRN_TENDON):
            return {target: gear}
        return {j: gear * coefficient for j, coefficient in self._tendon_joints(target).items()}

    def _reason_left_out(self, k: int, joints: list[int]) -> str:
        """Return the reason why actuator k on these joints is left out; empty if it is read."""
        model, trn, gain, bias, dyn = (
            self.model,
            *(getattr(self.mujoco, f"mjt{kind}") for kind in ("Trn", "Gain", "Bias", "Dyn")),
        )
        read = {
            "it does not act on a joint": ("trntype", (trn.mjTRN_JOINT, trn.mjTRN_JOINTINPARENT, trn.mjTRN_TENDON)),
            "its gain is not affine": ("gaintype", (gain.mjGAIN_FIXED, gain.mjGAIN_AFFINE)),
            "its bias is not affine": ("biastype", (bias.mjBIAS_NONE, bias.mjBIAS_AFFINE)),
            "its input is integrated over time": ("dyntype", (dyn.mjDYN_NONE, dyn.mjDYN_FILTER, dyn.mjDYN_FILTEREXACT)),
        }
        if self._disabled("ACTUATION") or int(model.opt.disableactuator) >> int(model.actuator_group[k]) & 1:
            return "the model disables it"
        for reason, (name, kinds) in read.items():
            if int(getattr(model, f"actuator_{name}")[k]) not in map(int, kinds):
                return reason
        for j in joints:
            if j not in self.hinged and j not in self.sliding:
                return "its joint is not a hinge or a slide"
            actuator = self._actuator_force(k, j, "")
            if min(actuator.stiffness, actuator.damping) < 0.0:
                return "its force grows with the position or the speed"
            if len(joints) > 1 and (actuator.stiffness or actuator.damping):
                return "its force depends on the length or speed of a tendon of several joints"
            if j in self.sliding and self._parent(int(model.jnt_bodyid[j])) and self._slide_line(j).has_hinge:
                return "it pushes a turning body along a moving one"
        return ""

    def _actuator_force(self, k: int, j: int, name: str) -> ActuatorForce:
        """Return the force of actuator k on joint j, with the actuator's input at the start."""
        model, gear = self.model, self._gears(k)[j]
        value = float(self.data.ctrl[int(getattr(model, "actuator_ctrladr", range(model.nu))[k])])
        if model.actuator_ctrllimited[k] and not self._disabled("CLAMPCTRL"):
            value = min(max(value, float(model.actuator_ctrlrange[k, 0])), float(model.actuator_ctrlrange[k, 1]))
        factors = np.array(model.actuator_gainprm[k, :3])
        if model.actuator_gaintype[k] == int(self.mujoco.mjtGain.mjGAIN_FIXED):
            factors[1:] = 0.0
        bias = model.actuator_biasprm[k, :3] * (model.actuator_biastype[k] != 0)
        constant, by_length, by_speed = (factors * value + bias).tolist()
        low, high = -math.inf, math.inf
        if model.actuator_forcelimited[k]:
            low, high = sorted((gear * model.actuator_forcerange[k]).tolist())
        if model.jnt_actfrclimited[j]:
            low, high = max(low, float(model.jnt_actfrcrange[j, 0])), min(high, float(model.jnt_actfrcrange[j, 1]))
            if name and sum(j in self._gears(other) for other in range(model.nu)) > 1:
                self.notes.append(f"actuator '{name}': the force range of its joint limits each actuator there, not their sum")
        if name and model.actuator_dyntype[k] != int(self.mujoco.mjtDyn.mjDYN_NONE):
            self.notes.append(f"actuator '{name}': the filter of its input is left out")
        return ActuatorForce(
            name, value, gear * constant, 0.0 - gear * gear * by_length, 0.0 - gear * gear * by_speed, (low, high)
        )

    def _add_hinge_motor(self, j: int, actuator: ActuatorForce) -> None:
        """Add a constant torque, or a servo whose reference is the angle or speed of zero actuator torque."""
        sense, (body, base), (low, high) = self._sense(j), self._ends(j), actuator.bounds
        what = f"actuator '{actuator.name}': its input is held at {actuator.input:g}"
        if not (actuator.stiffness or actuator.damping):
            torque = sense * min(max(actuator.constant, low), high) + 0.0  # no -0
            self.components.append(Torque(actuator.name, body, torque, base))
            self.notes.append(f"{what}, so its torque is {torque:g} N m")
            return
        limit = max(-low, high)
        if -low != high:
            self.notes.append(
                f"actuator '{actuator.name}': its limits {low:g} and {high:g} N m are {limit:g} N m in both senses"
            )
        reference: Any = ConstantSpeed(sense * actuator.constant / actuator.damping) if actuator.damping else None
        gains = f"{actuator.damping:g} N m s/rad"
        if actuator.stiffness:
            index = int(self.model.jnt_bodyid[j])
            turn = actuator.constant / actuator.stiffness - float(self.data.joint(j).qpos[0])
            reference = Polynomial((self._angle(index) - self._angle(self._parent(index)) + sense * turn,))
            gains = f"{actuator.stiffness:g} N m/rad and {gains}"
        controller = PID(actuator.stiffness, actuator.damping, limit=limit if limit < math.inf else None)
        self.components.append(Actuator(actuator.name, body, controller, base, reference))
        self.notes.append(f"{what}; it is a servo of {gains}")

    def _add_slide_motor(self, line: SlideLine, actuator: ActuatorForce) -> None:
        """Add a bushing, relaxed where the actuator's force is zero; without stiffness, also a constant force."""
        what = f"actuator '{actuator.name}': its input is held at {actuator.input:g}"
        if actuator.stiffness or actuator.damping:
            rest = actuator.constant / actuator.stiffness if actuator.stiffness else line.coordinate
            self._add_bushing(actuator.name, line, actuator.stiffness, actuator.damping, rest)
            what += f"; it is a bushing of {actuator.stiffness:g} N/m and {actuator.damping:g} N s/m"
            if any(map(math.isfinite, actuator.bounds)):
                self.notes.append(f"actuator '{actuator.name}': its force limits are left out")
        if not actuator.stiffness:
            force = min(max(actuator.constant, actuator.bounds[0]), actuator.bounds[1])
            self._add_force(actuator.name, line, force)
            what += f", so its force is {force:g} N"
        self.notes.append(what)

    def _add_force(self, name: str, line: SlideLine, force: float) -> None:
        """Add a force along a slide, and its reaction on a body that carries the slide."""
        for index, sign in zip(line.ends, (1.0, -1.0), strict=True):
            if not index:
                continue
            follows = line.ends[1] != 0
            x, y = sign * force * line.gradient
            turn = -self._angle(index) if follows else 0.0
            turned = math.cos(turn) * x - math.sin(turn) * y, math.sin(turn) * x + math.cos(turn) * y
            label = plain_name(name if sign > 0.0 else f"reaction of {name}", [part.name for part in self.components])
            self.components.append(Force(label, self._at(index, line.point, name), turned, follows=follows))

    def _slide_line(self, j: int) -> SlideLine:
        """Return the line of slide joint j at the start."""
        index = int(self.model.jnt_bodyid[j])
        hinges, others = ([i for i in self._joints_of(index) if i in kind and i != j] for kind in (self.hinged, self.sliding))
        joint, axis = self.model.joint(j), self.data.xaxis[j]
        gradient = np.array(self._flat(axis))
        if others:
            # motion along one slide does not change the coordinate of the other
            x, y = self._flat(self.data.xaxis[others[0]])
            gradient = np.array([-y, x]) / float(np.array([-y, x]) @ gradient)
        q = float(self.data.joint(j).qpos[0])
        # the anchor of a hinge does not move when the body turns; the anchor of a slide moves with the joint
        moved = self.data.xanchor[j] + (q - float(joint.qpos0[0])) * axis
        point = self.data.xanchor[hinges[0]] if hinges else moved
        if index in self.fixed_angle:  # a body that does not turn is held at its mass centre; all its points move alike
            point = self.data.xipos[index]
        return SlideLine(j, (index, self._parent(index)), point, axis, gradient, q, bool(hinges))

    def _add_bushing(self, name: str, line: SlideLine, stiffness: float, damping: float, rest: float) -> None:
        """Add stiffness and damping along a slide, with zero spring force at the coordinate `rest` [m]."""
        index, parent = line.ends
        size, direction = float(np.hypot(*line.gradient)), math.atan2(line.gradient[1], line.gradient[0])
        turned = direction - self._angle(parent)
        cos, sin = size * math.cos(turned), size * math.sin(turned)
        point = plain_name(self._joint_name(line.joint), ())
        ends = self._at(parent, line.point + (rest - line.coordinate) * line.axis, f"rest of {name}")
        part = {"x": cos**2, "y": sin**2, "xy": cos * sin}
        numbers: dict[str, Any] = {f"stiffness_{axis}": stiffness * share for axis, share in part.items()}
        numbers |= {f"damping_{axis}": damping * share for axis, share in part.items()}
        self.components.append(Bushing(name, ends, self._at(index, line.point, point), **numbers))
