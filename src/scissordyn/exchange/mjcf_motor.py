"""Read actuators of a MuJoCo model on hinges and slides, and motors that a URDF names, as torques, forces and servos.

Source: MuJoCo's documentation, "Actuation model". The force of an actuator is affine in its input, length and speed.
The length is gear times the position of the joint, and gear times the force acts on the joint.
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
    """Slide at the start: a displacement `d` of the point changes its coordinate by `measure @ d`."""

    joint: int
    ends: tuple[int, int]  # Body and parent
    place: np.ndarray
    along: np.ndarray
    measure: np.ndarray
    position: float  # Coordinate [m]
    has_hinge: bool


class Drive(NamedTuple):
    """Force of an actuator on its joint: constant - stiffness q - damping q', within bounds."""

    name: str
    input: float
    constant: float
    stiffness: float
    damping: float
    bounds: tuple[float, float]


class MotorReader(ModelFrames):
    """Reader of the actuators of a MuJoCo model."""

    components: list[Any]
    fixed_angle: set[int]

    def _motors(self) -> None:
        """Add the actuators of the model, and the motors of a URDF."""
        for k in range(self.model.nu):
            name = plain_name(self.model.actuator(k).name or f"actuator {k + 1}", [part.name for part in self.components])
            j = int(self.model.actuator_trnid[k, 0])
            if reason := self._unread_motor(k, j):
                self.notes.append(f"actuator '{name}': left out; {reason}")
            elif j in self.hinged:
                self._motor_of_hinge(j, self._drive(k, j, name))
            else:
                self._motor_of_slide(self._line(j), self._drive(k, j, name))
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
            most = f", at most {self.model.jnt_actfrcrange[j, 1]:g} N m" if self.model.jnt_actfrclimited[j] else ""
            said = f"torque '{torques[motor.joint]}' is 0 N m; a URDF has no gains"
            self.notes.append(f"{motor.shown}: {said}{most}{motor.facts}")

    def _ends(self, j: int) -> tuple[str, str]:
        index = int(self.model.jnt_bodyid[j])
        return self.names[index], self.names[self._parent(index)]

    def _unread_motor(self, k: int, j: int) -> str:
        """Return the reason why an actuator is left out; empty if it is read."""
        model, trn, gain, bias, dyn = (
            self.model,
            *(getattr(self.mujoco, f"mjt{kind}") for kind in ("Trn", "Gain", "Bias", "Dyn")),
        )
        read = {
            "it does not act on a joint": ("trntype", (trn.mjTRN_JOINT, trn.mjTRN_JOINTINPARENT)),
            "its gain is not affine": ("gaintype", (gain.mjGAIN_FIXED, gain.mjGAIN_AFFINE)),
            "its bias is not affine": ("biastype", (bias.mjBIAS_NONE, bias.mjBIAS_AFFINE)),
            "its input is integrated over time": ("dyntype", (dyn.mjDYN_NONE, dyn.mjDYN_FILTER, dyn.mjDYN_FILTEREXACT)),
        }
        if self._disabled("ACTUATION") or int(model.opt.disableactuator) >> int(model.actuator_group[k]) & 1:
            return "the model disables it"
        for reason, (name, kinds) in read.items():
            if int(getattr(model, f"actuator_{name}")[k]) not in map(int, kinds):
                return reason
        if j not in self.hinged and j not in self.sliding:
            return "its joint is not a hinge or a slide"
        drive = self._drive(k, j, "")
        if min(drive.stiffness, drive.damping) < 0.0:
            return "its force grows with the position or the speed"
        if j in self.sliding and self._parent(int(model.jnt_bodyid[j])) and self._line(j).has_hinge:
            return "it pushes a turning body along a moving one"
        return ""

    def _drive(self, k: int, j: int, name: str) -> Drive:
        """Return the force of an actuator on its joint, with the input at the start."""
        model, gear = self.model, float(self.model.actuator_gear[k, 0])
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
            if np.sum(model.actuator_trnid[:, 0] == j) > 1 and name:
                self.notes.append(f"actuator '{name}': the force range of its joint limits each actuator there, not their sum")
        if name and model.actuator_dyntype[k] != int(self.mujoco.mjtDyn.mjDYN_NONE):
            self.notes.append(f"actuator '{name}': the filter of its input is left out")
        return Drive(name, value, gear * constant, 0.0 - gear * gear * by_length, 0.0 - gear * gear * by_speed, (low, high))

    def _motor_of_hinge(self, j: int, drive: Drive) -> None:
        """Add a constant torque, or a servo about the angle or speed at which its torque is zero."""
        sense, (body, base), (low, high) = self._sense(j), self._ends(j), drive.bounds
        what = f"actuator '{drive.name}': its input is held at {drive.input:g}"
        if not (drive.stiffness or drive.damping):
            torque = sense * min(max(drive.constant, low), high) + 0.0  # no -0
            self.components.append(Torque(drive.name, body, torque, base))
            self.notes.append(f"{what}, so its torque is {torque:g} N m")
            return
        limit = max(-low, high)
        if -low != high:
            self.notes.append(f"actuator '{drive.name}': its limits {low:g} and {high:g} N m are {limit:g} N m in both senses")
        reference: Any = ConstantSpeed(sense * drive.constant / drive.damping) if drive.damping else None
        gains = f"{drive.damping:g} N m s/rad"
        if drive.stiffness:
            index = int(self.model.jnt_bodyid[j])
            turn = drive.constant / drive.stiffness - float(self.data.joint(j).qpos[0])
            reference = Polynomial((self._angle(index) - self._angle(self._parent(index)) + sense * turn,))
            gains = f"{drive.stiffness:g} N m/rad and {gains}"
        controller = PID(drive.stiffness, drive.damping, limit=limit if limit < math.inf else None)
        self.components.append(Actuator(drive.name, body, controller, base, reference))
        self.notes.append(f"{what}; it is a servo of {gains}")

    def _motor_of_slide(self, line: SlideLine, drive: Drive) -> None:
        """Add a bushing about the position at which the force is zero, or a constant force."""
        what = f"actuator '{drive.name}': its input is held at {drive.input:g}"
        if drive.stiffness or drive.damping:
            rest = drive.constant / drive.stiffness if drive.stiffness else line.position
            self._add_bushing(drive.name, line, drive.stiffness, drive.damping, rest)
            what += f"; it is a bushing of {drive.stiffness:g} N/m and {drive.damping:g} N s/m"
            if any(map(math.isfinite, drive.bounds)):
                self.notes.append(f"actuator '{drive.name}': its force limits are left out")
        if not drive.stiffness:
            force = min(max(drive.constant, drive.bounds[0]), drive.bounds[1])
            self._add_force(drive.name, line, force)
            what += f", so its force is {force:g} N"
        self.notes.append(what)

    def _add_force(self, name: str, line: SlideLine, force: float) -> None:
        """Add a force along a slide, and its reaction on a body that carries the slide."""
        for index, sign in zip(line.ends, (1.0, -1.0), strict=True):
            if not index:
                continue
            follows = line.ends[1] != 0
            x, y = sign * force * line.measure
            turn = -self._angle(index) if follows else 0.0
            turned = math.cos(turn) * x - math.sin(turn) * y, math.sin(turn) * x + math.cos(turn) * y
            label = plain_name(name if sign > 0.0 else f"reaction of {name}", [part.name for part in self.components])
            self.components.append(Force(label, self._at(index, line.place, name), turned, follows=follows))

    def _line(self, j: int) -> SlideLine:
        """Return the line of a slide at the start."""
        index = int(self.model.jnt_bodyid[j])
        hinges, others = ([i for i in self._joints_of(index) if i in kind and i != j] for kind in (self.hinged, self.sliding))
        joint, along = self.model.joint(j), self.data.xaxis[j]
        measure = np.array(self._flat(along))
        if others:
            # motion along one slide does not change the coordinate of the other
            x, y = self._flat(self.data.xaxis[others[0]])
            measure = np.array([-y, x]) / float(np.array([-y, x]) @ measure)
        q = float(self.data.joint(j).qpos[0])
        # the anchor of a hinge does not move when the body turns; the anchor of a slide moves with the joint
        moved = self.data.xanchor[j] + (q - float(joint.qpos0[0])) * along
        place = self.data.xanchor[hinges[0]] if hinges else moved
        if index in self.fixed_angle:  # a body that does not turn is held at its mass centre; all its points move alike
            place = self.data.xipos[index]
        return SlideLine(j, (index, self._parent(index)), place, along, measure, q, bool(hinges))

    def _add_bushing(self, name: str, line: SlideLine, stiffness: float, damping: float, rest: float) -> None:
        """Add stiffness and damping along a slide, with zero force at the coordinate `rest`."""
        index, parent = line.ends
        size, direction = float(np.hypot(*line.measure)), math.atan2(line.measure[1], line.measure[0])
        turned = direction - self._angle(parent)
        cos, sin = size * math.cos(turned), size * math.sin(turned)
        point = plain_name(self._joint_name(line.joint), ())
        ends = self._at(parent, line.place + (rest - line.position) * line.along, f"rest of {name}")
        part = {"x": cos**2, "y": sin**2, "xy": cos * sin}
        numbers: dict[str, Any] = {f"stiffness_{axis}": stiffness * share for axis, share in part.items()}
        numbers |= {f"damping_{axis}": damping * share for axis, share in part.items()}
        self.components.append(Bushing(name, ends, self._at(index, line.place, point), **numbers))
