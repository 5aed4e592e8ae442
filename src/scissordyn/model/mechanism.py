"""Mechanism: bodies, joints, guides, drives and gravity."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

from scissordyn.components.actuator import Actuator
from scissordyn.components.latch import Latch
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.rod import Rod
from scissordyn.components.time_function import ConstantSpeed, OverTime, TimeFunction
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError
from scissordyn.model.body import Track
from scissordyn.model.check import check_parts
from scissordyn.model.clearance import Clearance, GuideClearance
from scissordyn.model.coupling import CoordinateDrive, Drive
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.parameter_path import changed, matching
from scissordyn.model.parts import Parts
from scissordyn.units import Meaning, Quantity, check_quantities, checked, documented

MOVED_PARTS = ("components", "rods", Rod), ("components", "latches", Latch), ("drives", "coordinate_drives", CoordinateDrive)
"""Parts that `Mechanism` moves to another field: field, new field, and class of the part.

In their first field they would have no effect.
"""


@documented
@dataclass(frozen=True)
class Mechanism(Parts):
    """Description of a planar mechanism. It is frozen; every change returns a new one.

    A `CoordinateDrive` among the drives is moved to `coordinate_drives`; rods and latches among the components are moved to
    `rods` and `latches`.
    """

    def __post_init__(self) -> None:
        for source, field, kind in MOVED_PARTS:
            listed = getattr(self, source)
            if moved := tuple(part for part in listed if isinstance(part, kind)) if isinstance(listed, tuple | list) else ():
                object.__setattr__(self, field, (*getattr(self, field), *moved))
                object.__setattr__(self, source, tuple(part for part in listed if not isinstance(part, kind)))
        check_quantities(self)
        if not self.bodies:
            raise InputError("the mechanism has no bodies", "at least one body")
        check_parts(self)

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in Mechanism.__dataclass_fields__}  # without cached properties

    @cached_property
    def _ideal(self) -> Mechanism:
        if not self.clearance_joints and len(self.ideal_guides) == len(self.guides):
            return self
        closed = {name: tuple(map(_without_clearance, getattr(self, name))) for name in ("joints", "guides")}
        return self.with_parts({**closed, "_closed": True}, check=False)

    @documented
    @checked
    def with_clearance(
        self,
        joints: Annotated[str | Iterable[str], Meaning("names or patterns of joints, or of guides")],
        clearance: Annotated[Clearance | GuideClearance, Meaning("the clearance", "Clearance(5e-4)")],
    ) -> Mechanism:
        """Return the mechanism with a clearance at one or several joints or guides.

        Joints are given by name, by a group ("all", "pivots" inside the units of an array, "ends" between units), or by a
        pattern such as ``"unit 3/*"``. With a `GuideClearance` the names are those of guides.
        """
        if isinstance(clearance, GuideClearance):
            guided = matching("guide", joints, [guide.name for guide in self.guides])
            return self._with_guides(dataclasses.replace(self.guide(n), clearance=clearance, aligned=True) for n in guided)
        names = matching("joint", joints, [joint.name for joint in self.joints])
        return self._with_joints(dataclasses.replace(self.joint(name), clearance=clearance) for name in names)

    @checked
    def ideal(self, *joints: str) -> Mechanism:
        """Return the mechanism with ideal joints and guides: the named ones, or all."""
        if not joints:
            return self._ideal
        guides = {guide.name for guide in self.guides}
        named = {name if name in guides else self.joint(name).name for name in joints}
        closed = {
            kind: tuple(_without_clearance(part) if part.name in named else part for part in getattr(self, kind))
            for kind in ("joints", "guides")
        }
        return self.with_parts({**closed, "_closed": True})

    @documented
    @checked
    def driven(
        self,
        motion: Annotated[TimeFunction | None, Meaning("the prescribed angle", "speed=rpm(150)")] = None,
        *,
        speed: Annotated[float | None, Quantity("rad/s", help="short for `ConstantSpeed`")] = None,
        body: Annotated[str, Meaning("driven body; by default the mechanism's input body")] = "",
    ) -> Mechanism:
        """Return the mechanism with a drive of a body, which replaces any drive of that body."""
        if (motion is None) == (speed is None):
            raise InputError("driven() needs either motion or speed", "one of them", "driven(speed=rpm(150))")
        chosen, others = self._undriven("driven", body)
        drive = Drive(chosen, ConstantSpeed(speed) if motion is None else motion)  # type: ignore[arg-type]
        return self.with_parts({"drives": (*others, drive)})

    @documented
    @checked
    def controlled(
        self,
        controller: Annotated[Controller, Meaning("a controller", "PID(100.0)")],
        *,
        reference: Annotated[TimeFunction | None, Meaning("the reference angle", "speed=rpm(150)")] = None,
        speed: Annotated[float | None, Quantity("rad/s", help="short for `ConstantSpeed`")] = None,
        body: Annotated[str, Meaning("controlled body; by default the mechanism's input body")] = "",
        feed_forward: Annotated[TimeFunction | None, OverTime("N m", "a torque over time, for controllers with it")] = None,
        sensor: Annotated[str | BodyPoint | None, Meaning("joint whose eccentricity is measured, or measured point")] = None,
        inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, help="inertia of the rotor")] = 0.0,
        start_on_reference: Annotated[bool, Meaning("whether the body starts at angle and speed of the reference")] = True,
        base: Annotated[str, Meaning("body that bears the torque and is the base of the angle")] = GROUND,
        name: Annotated[str, Meaning('name of the actuator; by default "actuator of BODY"')] = "",
    ) -> Mechanism:
        """Return the mechanism with a controlled torque on a body, which replaces any drive of that body.

        The torques of several actuators on one body add up. The default reference is the motion of the body's drive, or its
        initial angle. Only the first actuator of a body, against the ground, starts on its reference.
        """
        chosen, others = self._undriven("controlled", body)
        if reference is not None and speed is not None:
            raise InputError(
                "controlled() has both reference and speed", "one of them", "controlled(PID(100.0), speed=rpm(150))"
            )
        reference = ConstantSpeed(speed) if speed is not None else reference
        if reference is None:
            reference = next((drive.motion for drive in self.drives if drive.body == chosen), None)
        label, number = name or f"actuator of {chosen}", 1
        while not name and any(component.name == label for component in self.components):
            number += 1
            label = f"actuator {number} of {chosen}"
        first = not any(isinstance(component, Actuator) and component.body == chosen for component in self.components)
        sensed = None if sensor is None else self.joint_or_point(sensor)
        if isinstance(sensed, Revolute):
            ends: tuple[Any, Any] = sensed.journal, sensed.bearing
            ends = (ends[1], ends[0]) if ends[0][0] == GROUND else ends
        else:
            ends = sensed, None
        actuator: Any = Actuator(
            label,
            chosen,
            controller,
            base,
            reference=reference,
            feed_forward=feed_forward,
            sensor=ends[0],
            sensor_origin=ends[1],
            inertia=inertia,
            start_on_reference=start_on_reference and first and reference is not None and base == GROUND,
        )
        return dataclasses.replace(self, drives=others, components=(*self.components, actuator))

    def _undriven(self, method: str, body: str) -> tuple[str, tuple[Drive, ...]]:
        """Return the body that a method acts on, and the drives of other bodies."""
        chosen = body or self.input_body
        if not chosen:
            raise InputError(f"{method}(): no body is given and the mechanism has no input body", f"{method}(..., body=NAME)")
        return chosen, tuple(other for other in self.drives if other.body != chosen)

    @documented
    @checked
    def track(
        self,
        name: str,
        body: str,
        point: Annotated[str | Point, Meaning("point of the body, or a position in its frame [m]")],
        tolerance: Annotated[float | None, Meaning("deviation within which the point has settled [m]")] = None,
    ) -> Mechanism:
        """Return the mechanism with one more tracked point; its motion and deviation from the commanded path are recorded."""
        return dataclasses.replace(self, tracks=(*self.tracks, Track(name, body, point, tolerance)))

    @documented
    @checked
    def replace(
        self,
        parameter: Annotated[str, Meaning("parameter path: a field of the mechanism, or a part and its field")],
        value: Annotated[Any, Meaning("new value, in SI units")],
    ) -> Mechanism:
        """Return the mechanism with one value changed.

        Examples of parameters are "gravity", "components", "A.clearance", "A.damping.restitution", "drive.speed",
        "body.slider.mass", "servo.controller.limit", "joint.all.friction" (`model.parameter_path`).
        """
        return changed(self, parameter, value)

    def _with_joints(self, changed: Iterable[Revolute]) -> Mechanism:
        new = {joint.name: joint for joint in changed}
        return self.with_parts({"joints": tuple(new.get(joint.name, joint) for joint in self.joints)})

    def _with_guides(self, changed: Iterable[Guide]) -> Mechanism:
        new = {guide.name: guide for guide in changed}
        return dataclasses.replace(self, guides=tuple(new.get(guide.name, guide) for guide in self.guides))


def _without_clearance(part: Any) -> Any:
    """Return a joint or guide without clearance."""
    return dataclasses.replace(part, clearance=None) if part.clearance is not None else part
