"""Mechanism: bodies, joints, guides, drives and gravity."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, TypeVar

from scissordyn.annotation import body_point, shown
from scissordyn.components.actuator import Actuator
from scissordyn.components.declaration import Component
from scissordyn.components.latch import Latch
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.rod import Rod
from scissordyn.components.time_function import ConstantSpeed, OverTime, TimeFunction
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.body import Body, Track
from scissordyn.model.check import check_parts
from scissordyn.model.clearance import Clearance, ContactPoint, GuideClearance, Lubrication
from scissordyn.model.coupling import CoordinateDrive, Coupling, Drive
from scissordyn.model.joint import Guide, Revolute, Weld
from scissordyn.model.parameter_path import changed, matching
from scissordyn.tolerance import ROUND_OFF_TOL
from scissordyn.units import Meaning, Quantity, check_quantities, checked, counted, documented

Gravity = Annotated[float, Quantity("m/s^2", minimum=0.0, help="gravitational acceleration")]
GravityDirection = Annotated[float, Quantity("rad", help="direction of gravity; -pi/2 is along -y")]

MOVED_PARTS = ("components", "rods", Rod), ("components", "latches", Latch), ("drives", "coordinate_drives", CoordinateDrive)
"""Parts that a mechanism moves from one field to another, as the field, the new field and the class of the part.

In their first field they would have no effect.
"""

Named = TypeVar("Named", Body, Revolute, Guide)


@documented
@dataclass(frozen=True)
class Mechanism:
    """Description of a planar mechanism. It is frozen; every change returns a new one.

    A `CoordinateDrive` among the drives is moved to `coordinate_drives`; rods and latches among the components are moved to
    `rods` and `latches`.
    """

    bodies: tuple[Body, ...]
    joints: tuple[Revolute, ...] = ()
    guides: tuple[Guide, ...] = ()
    drives: tuple[Drive, ...] = ()
    welds: tuple[Weld, ...] = ()
    components: tuple[Component, ...] = ()
    ground: Annotated[tuple[tuple[str, Point], ...], Meaning("named points of the fixed frame [m]")] = ()
    gravity: Gravity = 9.81
    gravity_direction: GravityDirection = -math.pi / 2
    input_body: Annotated[str, Meaning("the body that `driven` drives by default")] = ""
    output_body: Annotated[str, Meaning("the output body, such as the slider of an array")] = ""
    rods: tuple[Rod, ...] = ()
    latches: tuple[Latch, ...] = ()
    tracks: Annotated[tuple[Track, ...], Meaning("points whose motion is recorded")] = ()
    couplings: tuple[Coupling, ...] = ()
    coordinate_drives: tuple[CoordinateDrive, ...] = ()
    source: Annotated[str, Meaning("authors of the description, for `citations`; several are separated by semicolons")] = ""
    _closed: bool = dataclasses.field(default=False, kw_only=True, compare=False, repr=False)

    @property
    def clearances_closed(self) -> bool:
        """True if `ideal` closed clearances; couplings that become redundant thereby are not an error."""
        return self._closed

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

    def body(self, name: str) -> Body:
        """Return the body with a name."""
        body = self._bodies.get(name)
        return _named("body", name, self._bodies) if body is None else body

    def joint(self, name: str) -> Revolute:
        """Return the revolute joint with a name."""
        return _named("joint", name, self._joints)

    def guide(self, name: str) -> Guide:
        """Return the guide with a name."""
        return _named("guide", name, {guide.name: guide for guide in self.guides})

    @cached_property
    def _ideal(self) -> Mechanism:
        if not self.clearance_joints and len(self.ideal_guides) == len(self.guides):
            return self
        closed = {name: tuple(map(_without_clearance, getattr(self, name))) for name in ("joints", "guides")}
        return self.with_parts({**closed, "_closed": True}, check=False)

    def __str__(self) -> str:
        counts = {
            "body": len(self.bodies),
            "ideal joint": len(self.ideal_joints),
            "clearance joint": len(self.clearance_joints),
            "guide": len(self.guides),
            "drive": len(self.drives) + len(self.coordinate_drives),
            "component": len(self.components) + len(self.rods),
        }
        parts = [counted(count, kind) for kind, count in counts.items() if count]
        return f"Mechanism of {', '.join(parts)}"

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:  # IPython and Jupyter show this
        printer.text(str(self))

    @cached_property
    def _bodies(self) -> dict[str, Body]:
        return {body.name: body for body in self.bodies}

    @cached_property
    def _joints(self) -> dict[str, Revolute]:
        return {joint.name: joint for joint in self.joints}

    def place(self, reference: BodyPoint) -> Point:
        """Return the position of a point of a body or of the ground at the start [m]."""
        body, point = body_point(reference) if isinstance(reference, str) else reference
        return dict(self.ground)[point] if body == GROUND else self.body(body).place(point)

    def joint_or_point(self, named: str | BodyPoint) -> Revolute | BodyPoint:
        """Return the revolute joint with a name, or the point given as "BODY.POINT" or as a pair."""
        if not isinstance(named, str):
            return named
        if "." in named and named not in self._joints:
            return body_point(named)
        try:
            return self.joint(named)
        except InputError as error:
            raise InputError(error.what, f'{error.expected}, or a point as "BODY.POINT"', error.example) from None

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the revolute joints, then of the guides, then of the contact points of clearance guides."""
        return tuple(part.name for parts in (self.joints, self.guides, self.contact_points) for part in parts)

    @cached_property
    def contact_points(self) -> tuple[ContactPoint, ...]:
        """Contact points of the clearance guides, in order."""
        points: list[ContactPoint] = []
        for guide in self.guides:
            if guide.clearance is None:
                continue
            follower = self.body(guide.follower[0])
            base = 0.0 if guide.body == GROUND else self.body(guide.body).placed_angle
            points += guide.contact_points(follower, base + guide.direction - follower.placed_angle)
        return tuple(points)

    @property
    def output_guide(self) -> Guide | None:
        """First guide on the ground that leads the output body; None if there is none."""
        guides = (guide for guide in self.guides if guide.follower[0] == self.output_body and guide.body == GROUND)
        return next(guides, None)

    @cached_property
    def ideal_guides(self) -> tuple[Guide, ...]:
        """Guides without clearance, in order."""
        return tuple(guide for guide in self.guides if guide.clearance is None)

    @cached_property
    def size(self) -> float:
        """Size of the mechanism: largest distance of points of a body, or of bodies and ground points [m]."""
        points = [list(body.points.values()) for body in self.bodies]
        spans = [math.dist(a, b) for places in points for a in places for b in places]
        if max(spans, default=0.0) <= ROUND_OFF_TOL * max((math.hypot(*a) for places in points for a in places), default=0.0):
            places = [body.placed_position for body in self.bodies] + [place for _, place in self.ground]
            spans = [math.dist(places[0], place) for place in places]
        return max(spans) or 1.0

    @cached_property
    def contacts(self) -> tuple[Revolute | ContactPoint, ...]:
        """Possible contacts: the clearance joints, then the contact points of the clearance guides."""
        return (*self.clearance_joints, *self.contact_points)

    def contact_groups(self, names: Iterable[str]) -> dict[str, list[str]]:
        """Return names of contacts by the clearance joint or guide that they belong to; a guide has several contact points."""
        guides = {point.name: point.guide for point in self.contact_points}
        groups: dict[str, list[str]] = {}
        for name in names:
            groups.setdefault(guides.get(name, name), []).append(name)
        return groups

    @property
    def lubricated(self) -> tuple[tuple[Revolute, Clearance, Lubrication], ...]:
        """Joints with an oil film, in order, each with its clearance and its oil."""
        pairs = ((joint, joint.clearance) for joint in self.clearance_joints)
        return tuple((joint, gap, gap.lubrication) for joint, gap in pairs if gap is not None and gap.lubrication is not None)

    @property
    def exerting(self) -> tuple[Component, ...]:
        """Parts that exert forces, except contacts: the components, then the films of lubricated joints."""
        films: list[Any] = [
            oil.film(joint.name, joint.bearing, joint.journal, gap.surfaces) for joint, gap, oil in self.lubricated
        ]
        return (*self.components, *films)

    @cached_property
    def clearance_joints(self) -> tuple[Revolute, ...]:
        """Joints with clearance, in order."""
        return tuple(joint for joint in self.joints if joint.clearance is not None)

    @cached_property
    def ideal_joints(self) -> tuple[Revolute, ...]:
        """Joints without clearance, in order."""
        return tuple(joint for joint in self.joints if joint.clearance is None)

    @property
    def coupling_parts(self) -> tuple[Coupling | CoordinateDrive, ...]:
        """Couplings, then drives of coordinates."""
        return (*self.couplings, *self.coordinate_drives)

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

    def with_parts(self, parts: Mapping[str, Any], *, check: bool = True) -> Mechanism:
        """Return the mechanism with other parts.

        Parameters
        ----------
        parts : mapping of str to tuple
            New parts by field.
        check : bool
            Whether to check parts and names. It can be False if names and connected bodies are unchanged.
        """
        if check:
            return dataclasses.replace(self, **parts)
        changed_mechanism = copy.copy(self)
        changed_mechanism.__dict__.update(parts)
        return changed_mechanism

    def _with_joints(self, changed: Iterable[Revolute]) -> Mechanism:
        new = {joint.name: joint for joint in changed}
        return self.with_parts({"joints": tuple(new.get(joint.name, joint) for joint in self.joints)})

    def _with_guides(self, changed: Iterable[Guide]) -> Mechanism:
        new = {guide.name: guide for guide in changed}
        return dataclasses.replace(self, guides=tuple(new.get(guide.name, guide) for guide in self.guides))


def _without_clearance(part: Any) -> Any:
    """Return a joint or guide without clearance."""
    return dataclasses.replace(part, clearance=None) if part.clearance is not None else part


def _named(what: str, name: str, parts: Mapping[str, Named]) -> Named:
    """Return a named part; raise `InputError` if it does not exist."""
    if not isinstance(name, str) or name not in parts:
        raise InputError(f"unknown {what} {shown(name)}{did_you_mean(name, parts)}", "one of " + (", ".join(parts) or "none"))
    return parts[name]
